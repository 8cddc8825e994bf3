"""The report shows what was found, in one file that loads nothing."""

import re
from html.parser import HTMLParser

import pytest

from wbc_suite.evaluation import Case
from wbc_suite.evaluation.report import report_page
from wbc_suite.evaluation.results import Film, collect
from wbc_suite.executors import Outcome, WorkItem


def episode(seed, *, succeeded, steps):
    return {
        "seed": seed,
        "success": succeeded,
        "succeeded": succeeded,
        "return": float(succeeded),
        "max_reward": float(succeeded),
        "steps": steps,
        "seconds": 0.1,
        "physics_error": None,
        "failure": None if succeeded else "It <fell>.",
    }


@pytest.fixture
def results():
    found = {"good": [True] * 9 + [False], "bad": [False] * 10}
    items, outcomes = {}, []
    for policy, successes in found.items():
        case = Case(benchmark="Lift", robots=("Panda",), policy=policy)
        items[case] = [WorkItem(name=policy, payload={})]
        lines = [episode(k, succeeded=s, steps=20 + k) for k, s in enumerate(successes)]
        outcomes.append(Outcome(name=policy, result={"episodes": lines}))
    return collect(items, outcomes, seconds=2.0)


class Tags(HTMLParser):
    """Checks that tags close, and keeps addresses."""

    VOID = ("meta", "img", "br", "link")

    def __init__(self):
        super().__init__()
        self.open, self.addresses = [], []

    def handle_starttag(self, tag, attrs):
        self.addresses += [v for k, v in attrs if k in ("src", "href")]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        assert tag in self.VOID

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_figures_are_of_all_cases_and_of_each(results):
    figures = results.figures()
    assert (figures["episodes"], figures["successes"]) == (20, 9)
    assert figures["success_rate"] == pytest.approx(0.45)
    assert figures["intervals"]["wilson"][0] < 0.45 < figures["intervals"]["exact"][1]
    low, high = figures["intervals"]["stratified"]
    assert 0.3 < low < 0.45 <= high <= 0.5  # the second case never succeeds
    assert [case["successes"] for case in figures["cases"]] == [9, 0]
    (pair,) = figures["comparisons"]
    assert (pair["first"], pair["second"], pair["verdict"]) == ("good", "bad", "worse")


def test_nothing_played_is_told():
    figures = collect({}, [Outcome(name="a", error="it broke")], seconds=0.0).figures()
    assert (figures["episodes"], figures["failed_items"]) == (0, 1)
    assert "success_rate" not in figures


def test_the_page_is_whole_and_loads_nothing(results, tmp_path):
    film = tmp_path / "a.webp"
    film.write_bytes(b"RIFF")
    case = next(iter(results.summaries))
    results.films[case] = [Film(seed=9, path=film, steps=29)]
    page = report_page(results, "wbc-suite evaluate <Lift>")
    tags = Tags()
    tags.feed(page)
    assert tags.open == []
    assert tags.addresses == ["data:image/webp;base64,UklGRg=="]
    assert "http" not in re.sub(r"http-equiv", "", page)
    assert "evaluate &lt;Lift&gt;" in page
    assert "It &lt;fell&gt;." in page
    assert "90.0%" in page
    assert "seed 9, 29 steps" in page


def test_a_rate_is_drawn_inside_its_interval(results):
    page = report_page(results, "")
    bars = re.findall(r"left:([\d.]+)%;width:([\d.]+)%.*?left:([\d.]+)%", page)
    for (low, width, rate), summary in zip(
        bars, results.summaries.values(), strict=True
    ):
        ends = float(low), float(low) + float(width)
        assert ends == pytest.approx([100 * x for x in summary.wilson], abs=0.01)
        assert float(rate) == pytest.approx(100 * summary.success_rate)
        assert ends[0] <= float(rate) <= ends[1]


def test_a_curve_climbs_by_the_share_of_its_episodes(results):
    curves = re.findall(r'<path stroke=.*? d="([^"]+)"', report_page(results, ""))
    heights = [float(y) for y in re.findall(r"V([\d.]+)", curves[0])]
    assert heights == pytest.approx([90, 80, 70, 60, 50, 40, 30, 20, 10])
    steps = [float(x) for x in re.findall(r"H([\d.]+)V", curves[0])]
    assert steps == pytest.approx([100 * n / 28 for n in range(20, 29)], abs=0.01)
    assert curves[1] == "M0 100H100"  # never
