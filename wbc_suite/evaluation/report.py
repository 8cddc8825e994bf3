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
from wbc_suite.evaluation.svg_plots import legend, rates_plot, steps_plot

PACKAGES = ("wbc-suite", "mujoco", "numpy", "scipy")
CASES = ("case", "episodes", "success", "Wilson 95 %", "exact 95 %")
CASES += ("return, IQM", "its 95 %", "steps", "physics errors")
PAIRS = ("policy", "beside", "verdict", "difference", "95 %", "only this", "only that")
PAIRS += ("p", "P(return larger)", "95 %")


def report_page(results: Results, command: str) -> str:
    """Return the page; `command` is what the evaluation was started with."""
    template = Template(
        resources.files("wbc_suite.evaluation").joinpath("report.html").read_text()
    )
    titles = [case.title for case in results.summaries]
    rows = [(c.title, s.success_rate, s.wilson) for c, s in results.summaries.items()]
    curves = {
        case.title: ([int(e["steps"]) for e in es if e["succeeded"]], len(es))
        for case, es in results.episodes.items()
    }
    return template.substitute(
        summary=_overall(results),
        command=html.escape(command),
        about=html.escape(_about(results)),
        rates=rates_plot(rows),
        steps=legend(titles) + steps_plot(curves),
        cases=_table(CASES, (_case(c, s) for c, s in results.summaries.items())),
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


def _case(case: Case, s: Summary) -> list[str]:
    iqm, interval = f"{s.iqm_return:.3g}", s.iqm_return_interval
    return [
        case.title,
        str(s.episodes),
        f"{s.success_rate:.1%}",
        _percent(s.wilson),
        _percent(s.exact),
        iqm,
        f"{interval[0]:.3g} to {interval[1]:.3g}",
        f"{s.mean_steps:.0f}",
        str(s.physics_errors),
    ]


def _comparisons(results: Results) -> str:
    if not results.comparisons:
        return ""
    rows = [
        [
            second,
            first,
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
        [title, reason, str(found.count(reason))]
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
    cells = "".join(f"<th>{html.escape(name)}</th>" for name in head)
    lines = "".join(
        "<tr>" + "".join(f"<td>{html.escape(text)}</td>" for text in row) + "</tr>"
        for row in rows
    )
    return f'<div class="wide"><table><tr>{cells}</tr>{lines}</table></div>'
