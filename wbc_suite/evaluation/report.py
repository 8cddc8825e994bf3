"""The report of an evaluation: one HTML page with all that it shows."""

import datetime
import html
import platform
from collections.abc import Iterable, Mapping, Sequence
from importlib import resources
from importlib.metadata import version
from string import Template
from typing import Any

from wbc_suite.evaluation.results import Results
from wbc_suite.evaluation.rollouts import Case
from wbc_suite.evaluation.statistics import Interval, Summary

PACKAGES = ("wbc-suite", "mujoco", "numpy", "scipy")
COLOURS = ("#2f6fab", "#c8553d", "#3f8f5b", "#8a5fa8", "#b08a1e", "#3a9aa3")
"""Of the cases, in turn, in all plots."""
CASES = ("case", "0 to 100 %", "success", "Wilson 95 %", "exact 95 %", "episodes")
CASES += ("return, IQM", "its 95 %", "steps", "physics errors")
PAIRS = ("policy", "beside", "verdict", "difference", "95 %", "only this", "only that")
PAIRS += ("p", "P(return larger)", "95 %")


def report_page(results: Results, command: str) -> str:
    """Return the page; `command` is what the evaluation was started with."""
    template = Template(
        resources.files("wbc_suite.evaluation").joinpath("report.html").read_text()
    )
    return template.substitute(
        summary=_overall(results),
        command=html.escape(command),
        about=html.escape(_about(results)),
        cases=_table(
            CASES, (_case(k, *each) for k, each in enumerate(results.summaries.items()))
        ),
        steps=_steps_plot(results.episodes),
        comparisons=_comparisons(results),
        failures=_failures(results),
    )


def _overall(results: Results) -> str:
    figures = results.figures()
    if not figures["episodes"]:
        return "No episode was played."
    low, high = figures["intervals"]["stratified"]
    return (
        f"<b>{figures['success_rate']:.1%}</b> of {figures['episodes']} episodes "
        f"succeeded ({_percent(figures['intervals']['wilson'])} by Wilson, "
        f"{_percent(figures['intervals']['exact'])} exact, {low:.1%} to {high:.1%} by "
        "a stratified bootstrap)."
    )


def _about(results: Results) -> str:
    now = datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M UTC")
    packages = ", ".join(f"{name} {version(name)}" for name in PACKAGES)
    system = f"{platform.system()} {platform.machine()}"
    return (
        f"{now}. {packages}, Python {platform.python_version()}, {system}. "
        f"{results.seconds:.1f} s of wall time."
    )


def _case(number: int, case: Case, s: Summary) -> list[str]:
    """Return the row of a case; a bar shows its rate in the interval of Wilson."""
    (low, high), colour = s.wilson, _colour(number)
    iqm, interval = f"{s.iqm_return:.3g}", s.iqm_return_interval
    return [
        f'<i class="key" style="background:{colour}"></i>{html.escape(case.title)}',
        f'<div class="rate"><i style="left:{low:.2%};width:{high - low:.2%};'
        f'background:{colour}"></i><b style="left:{s.success_rate:.2%}"></b></div>',
        f"{s.success_rate:.1%}",
        _percent(s.wilson),
        _percent(s.exact),
        str(s.episodes),
        iqm,
        f"{interval[0]:.3g} to {interval[1]:.3g}",
        f"{s.mean_steps:.0f}",
        str(s.physics_errors),
    ]


def _steps_plot(episodes: Mapping[Case, Sequence[Mapping[str, Any]]]) -> str:
    """Return the share of each case's episodes that succeeded by a number of steps.

    In SVG, of width and height 100.
    """
    solved = [
        sorted(int(e["steps"]) for e in each if e["succeeded"])
        for each in episodes.values()
    ]
    last = max((steps[-1] for steps in solved if steps), default=1)
    curves = ""
    for k, (case, steps) in enumerate(zip(episodes, solved, strict=True)):
        stairs = "".join(
            f"H{100 * step / last:.2f}V{100 - 100 * rank / len(episodes[case]):.2f}"
            for rank, step in enumerate(steps, 1)
        )
        curves += f'<path stroke="{_colour(k)}" d="M0 100{stairs}H100">'
        curves += f"<title>{html.escape(case.title)}</title></path>"
    return (
        '<div class="steps"><p><span>100 %</span><span>50 %</span><span>0 %</span></p>'
        '<svg viewBox="0 0 100 100" preserveAspectRatio="none" role="img" '
        'aria-label="Share of episodes that succeeded by a step">'
        f'<path class="grid" d="M0 0H100M0 50H100M0 100H100"></path>{curves}</svg>'
        f"<p></p><p><span>0</span><span>{last} steps</span></p></div>"
    )


def _colour(case: int) -> str:
    return COLOURS[case % len(COLOURS)]


def _comparisons(results: Results) -> str:
    if not results.comparisons:
        return ""
    rows = [
        [
            html.escape(second),
            html.escape(first),
            found.verdict,
            f"{found.difference:+.1%}",
            _percent(found.interval, sign=True),
            str(found.only_second),
            str(found.only_first),
            f"{found.p_value:.2g}",
            f"{found.improvement:.2f}",
            f"{found.improvement_interval[0]:.2f} to "
            f"{found.improvement_interval[1]:.2f}",
        ]
        for (first, second), found in results.comparisons.items()
    ]
    alarms = max(found.false_alarms for found in results.comparisons.values())
    return (
        "<h2>Comparison on the same scenes</h2>"
        + _table(PAIRS, rows)
        + "<p>McNemar's exact test on the scenes that one policy solves and the other "
        f"does not. Two equal policies are called better or worse in at most "
        f"{alarms:.0%} of comparisons.</p>"
    )


def _failures(results: Results) -> str:
    reasons = {
        case.title: [_reason(e) for e in episodes if not e["succeeded"]]
        for case, episodes in results.episodes.items()
    }
    rows = [
        [html.escape(title), html.escape(reason), str(found.count(reason))]
        for title, found in reasons.items()
        for reason in dict.fromkeys(found)
    ]
    if not rows:
        return "<p>None.</p>"
    films = "".join(
        f'<figure><img alt="" src="{film.data_url}"><figcaption>'
        f"{html.escape(case.title)}<br>seed {film.seed}, {film.steps} steps"
        "</figcaption></figure>"
        for case, mine in results.films.items()
        for film in mine
    )
    return _table(("case", "reason", "episodes"), rows) + (
        f'<div class="films">{films}</div>'
    )


def _reason(episode: Mapping[str, Any]) -> str:
    """Return why an episode was no success."""
    if error := episode.get("error"):
        return f"{error['kind']}: {error['text']}"
    return str(episode["physics_error"] or episode["failure"] or "not solved in time")


def _percent(interval: Interval, *, sign: bool = False) -> str:
    form = "+.1%" if sign else ".1%"
    return " to ".join(format(bound, form) for bound in interval)


def _table(head: Iterable[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table of cells in HTML."""
    cells = "".join(f"<th>{name}</th>" for name in head)
    lines = "".join(
        "<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows
    )
    return f'<div class="wide"><table><tr>{cells}</tr>{lines}</table></div>'
