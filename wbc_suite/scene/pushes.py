"""Pushes: forces on a body, each for a short while."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated

import mujoco
import numpy as np
from pydantic import Field, PositiveFloat, field_validator

from wbc_suite.config_files import FrozenModel
from wbc_suite.robot.shapes import Vector3

Newtons = Annotated[float, Field(ge=0.0, le=1e5)]


class PushConfig(FrozenModel):
    """Horizontal pushes from random directions, one after another.

    Attributes:
        force: Least and greatest force, N.
        interval: Least and greatest time from the start of one push to that of the
            next, and from the start of an episode to the first, s.
        duration: Duration of each, s.
        spread: Greatest angle of a push to a direction that is drawn for each episode,
            rad; at most pi, which is any direction.
    """

    force: tuple[Newtons, Newtons]
    interval: tuple[PositiveFloat, PositiveFloat]
    duration: PositiveFloat = 0.1
    spread: float = Field(default=math.pi, ge=0.0, le=math.pi)

    @field_validator("force", "interval")
    @classmethod
    def _least_first(cls, ends: tuple[float, float]) -> tuple[float, float]:
        if ends[0] > ends[1]:
            raise ValueError("the smallest value must come first")
        return ends


@dataclass(frozen=True, kw_only=True, slots=True)
class Push:
    """A force on a body at its centre of mass.

    Attributes:
        body: Index of the body.
        force: In world axes, N.
        start: Start, s from that of the episode.
        stop: End, likewise.
    """

    body: int
    force: Vector3
    start: float
    stop: float


def draw_pushes(
    config: PushConfig, rng: np.random.Generator, *, body: int, until: float
) -> tuple[Push, ...]:
    """Draw the pushes of an episode that end before `until`, s."""
    pushes: list[Push] = []
    middle = rng.uniform(-math.pi, math.pi)
    start = float(rng.uniform(*config.interval))
    while start + config.duration <= until:
        angle = middle + rng.uniform(-config.spread, config.spread)
        size = rng.uniform(*config.force)
        force = (size * math.cos(angle), size * math.sin(angle), 0.0)
        stop = start + config.duration
        pushes.append(Push(body=body, force=force, start=start, stop=stop))
        start += float(rng.uniform(*config.interval))
    return tuple(pushes)


class PushSchedule:
    """Writes the forces of pushes into a simulation, at the nearest physics steps.

    Args:
        pushes: The pushes of an episode.
        data: State of the simulation.
        timestep: Duration of a physics step, s.
    """

    def __init__(
        self, pushes: Sequence[Push], data: mujoco.MjData, timestep: float
    ) -> None:
        self._data = data
        self._pushes = [
            (push, round(push.start / timestep), round(push.stop / timestep))
            for push in pushes
        ]
        self._bodies = sorted({push.body for push in pushes})
        self._changes = sorted({k for _, *ends in self._pushes for k in ends})

    def spans(self, first: int, last: int) -> Iterator[int]:
        """Yield numbers of physics steps with constant forces, from first to last.

        The forces of each are written before it is yielded.
        """
        while first < last:
            if first in self._changes:
                self._write(first)
            stop = min([k for k in self._changes if first < k < last], default=last)
            yield stop - first
            first = stop

    def _write(self, step: int) -> None:
        forces = self._data.xfrc_applied
        forces[self._bodies, :3] = 0.0
        for push, start, stop in self._pushes:
            if start <= step < stop:
                forces[push.body, :3] += push.force
