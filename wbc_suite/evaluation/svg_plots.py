"""Plots of success rates as SVG, for a page that needs nothing from elsewhere."""

import html
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from wbc_suite.evaluation.statistics import Interval

WIDTH, LEFT, RIGHT, ROW, TOP = 860, 300, 70, 26, 8  # pixels
CURVES, AXIS = 260, 34  # height of the plot of curves, and of an axis, pixels
COLOURS = ("#2f6fab", "#c8553d", "#3f8f5b", "#8a5fa8", "#b08a1e", "#3a9aa3")


def rates_plot(rows: Sequence[tuple[str, float, Interval]]) -> str:
    """Return a plot of rates: a name, the rate and its interval, a row each."""
    height = TOP + ROW * len(rows) + AXIS
    lines = [_axis(height - AXIS)]
    for k, (name, rate, (low, high)) in enumerate(rows):
        y, colour = TOP + ROW * (k + 0.5), COLOURS[k % len(COLOURS)]
        lines += [
            f'<text x="{LEFT - 12}" y="{y + 4}" text-anchor="end">{_short(name)}'
            "</text>",
            f'<line x1="{_x(low):.1f}" x2="{_x(high):.1f}" y1="{y}" y2="{y}" '
            f'stroke="{colour}" stroke-width="3" stroke-linecap="round"/>',
            f'<circle cx="{_x(rate):.1f}" cy="{y}" r="5" fill="{colour}"/>',
            f'<text x="{WIDTH - RIGHT + 12}" y="{y + 4}">{rate:.1%}</text>',
        ]
    return _svg(height, lines, "Success rates with 95 % Wilson intervals")


def steps_plot(curves: Mapping[str, tuple[Sequence[int], int]]) -> str:
    """Return a plot of the share of episodes that succeeded by a number of steps.

    Each curve is the steps of the episodes that succeeded, and the number of all.
    """
    last = max((max(steps, default=1) for steps, _ in curves.values()), default=1)
    wide, high = WIDTH - 60 - RIGHT, CURVES - TOP
    lines = []
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        y = TOP + high * (1.0 - share)
        lines += [
            f'<line class="grid" x1="60" x2="{60 + wide}" y1="{y}" y2="{y}"/>',
            f'<text x="50" y="{y + 4}" text-anchor="end">{share:.0%}</text>',
        ]
    for at in np.linspace(0, last, 6).round().astype(int).tolist():
        x = 60 + wide * at / last
        lines.append(
            f'<text x="{x:.1f}" y="{CURVES + 18}" text-anchor="middle">{at}</text>'
        )
    for k, (name, (steps, total)) in enumerate(curves.items()):
        points = [(60.0, TOP + high)]
        for rank, step in enumerate(sorted(steps)):
            x = 60 + wide * step / last
            points += [(x, points[-1][1]), (x, TOP + high * (1 - (rank + 1) / total))]
        points.append((60.0 + wide, points[-1][1]))
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        colour = COLOURS[k % len(COLOURS)]
        lines.append(
            f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="2">'
            f"<title>{html.escape(name)}</title></polyline>"
        )
    return _svg(CURVES + AXIS, lines, "Share of episodes that succeeded by a step")


def legend(names: Iterable[str]) -> str:
    """Return the names in the colours of the curves."""
    items = (
        f'<span><i style="background:{COLOURS[k % len(COLOURS)]}"></i>'
        f"{html.escape(name)}</span>"
        for k, name in enumerate(names)
    )
    return f'<p class="legend">{"".join(items)}</p>'


def _x(share: float) -> float:
    return LEFT + (WIDTH - LEFT - RIGHT) * share


def _axis(bottom: float) -> str:
    lines = []
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        x = f"{_x(share):.1f}"
        lines += [
            f'<line class="grid" x1="{x}" x2="{x}" y1="{TOP}" y2="{bottom}"/>',
            f'<text x="{x}" y="{bottom + 20}" text-anchor="middle">{share:.0%}</text>',
        ]
    return "".join(lines)


def _short(name: str, limit: int = 42) -> str:
    return html.escape(name if len(name) <= limit else name[: limit - 1] + "…")


def _svg(height: float, lines: Iterable[str], title: str) -> str:
    return (
        f'<svg viewBox="0 0 {WIDTH} {height}" role="img" aria-label="{title}">'
        f"{''.join(lines)}</svg>"
    )
