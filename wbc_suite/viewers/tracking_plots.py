"""Plots of the last seconds: distances to targets, step time and period."""

import time
from collections import deque
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from wbc_suite.typing import Matrix, Vector
from wbc_suite.viewers.scene_setup import (
    Colour,
    add_plot,
    css,
    plot_series,
)
from wbc_suite.viewers.session_state import SessionInfo, Snapshot

if TYPE_CHECKING:
    import viser

SECONDS = 10.0  # that are plotted
POINTS = 150  # of a curve, at most
ROWS = 300  # more than SECONDS at the rate of the page's updates
LEAST_TOP = 10.0  # mm and ms, of an axis: it does not show the noise at rest
STEP_CURVES = {"step": "#4a6fa5", "period": "#9aa5b1"}
IDLE = (
    "<div style='padding:.3em .8em;opacity:.7;font-size:.88em'>"
    "The distance to the target is plotted once a limb is moved.</div>"
)


class TrackingPlots:
    """Two plots in the present folder; a limb appears once its target was moved."""

    def __init__(
        self, gui: "viser.GuiApi", info: SessionInfo, colours: Mapping[str, Colour]
    ) -> None:
        self._rows: deque[list[float]] = deque(maxlen=ROWS)
        self._last_tick, self._epoch, self._moved = -1, 0, [False] * len(info.limbs)
        curves = {limb.title: css(colours[name]) for name, limb in info.limbs.items()}
        self._errors: Plot | None = None
        if curves:
            self._idle = gui.add_html(IDLE)
            self._errors = Plot(gui, "Distance to target [mm]", curves, visible=False)
        self._steps = Plot(gui, "Step time (blue) and period [ms]", STEP_CURVES)

    def record(self, snapshot: Snapshot) -> None:
        """Append the errors, step time and period of a tick."""
        if snapshot.tick == self._last_tick:
            return
        if snapshot.epoch != self._epoch:
            self._rows.clear()
        self._last_tick, self._epoch = snapshot.tick, snapshot.epoch
        limbs = snapshot.limbs.values()
        errors = [limb.position_error for limb in limbs]
        steps = snapshot.step_time, snapshot.step_period
        self._rows.append([time.monotonic(), *steps, *errors])
        self._moved = [limb.moved for limb in limbs]

    def update(self) -> None:
        """Send the curves of the last seconds."""
        if len(self._rows) < 2:
            return
        rows = np.array(self._rows, dtype=np.float64)
        ago = rows[:, 0] - rows[-1, 0]
        rows, ago = rows[ago > -SECONDS], ago[ago > -SECONDS]
        step = max(1, len(rows) // POINTS)
        rows, ago = rows[::-step][::-1], ago[::-step][::-1]
        self._steps.update(ago, 1e3 * rows[:, 1:3], [True, True])
        if self._errors is not None:
            self._errors.update(ago, 1e3 * rows[:, 3:], self._moved)
            self._idle.visible = not any(self._moved)


class Plot:
    """A plot of some of its curves over the time in s, from zero to a round number."""

    def __init__(
        self,
        gui: "viser.GuiApi",
        title: str,
        curves: Mapping[str, str],
        *,
        visible: bool = True,
    ) -> None:
        self._curves, self._shown, self._top = curves, [visible] * len(curves), 0.0
        options = {"height": 130, "padding": (10, 24, 0, 0), "visible": visible}
        self._handle = add_plot(gui, title, curves, **options)

    def update(self, ago: Vector, values: Matrix, shown: list[bool]) -> None:
        """Send values, shape (times, curves), over times, s, shape (times,).

        A browser makes a plot anew when its curves or its axis change, so both are
        only sent when they do.
        """
        self._handle.visible = any(shown)
        if shown != self._shown:
            self._shown = shown
            self._handle.series = plot_series(self._curves, shown)
        if not any(shown):
            return
        top = round_up(max(LEAST_TOP, float(values[:, shown].max())))
        if top != self._top:
            self._top = top
            self._handle.scales = {"x": {"time": False}, "y": {"range": (0.0, top)}}
        self._handle.data = tuple(np.vstack([ago, values.T]))


def round_up(value: float) -> float:
    """Return the least 1, 2 or 5 times a power of ten that is not below a value > 0."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(k * power for k in (1.0, 2.0, 5.0, 10.0) if k * power >= value))
