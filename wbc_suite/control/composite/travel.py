"""The way from where the robot is to a configuration, round what is there."""

import itertools
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from wbc_suite.control.composite.ramps import (
    Ramp,
    braking_ramp,
    fastest_ramp,
    line_ramp,
    reversed_ramp,
)
from wbc_suite.control.composite.retrace import paces_back
from wbc_suite.control.composite.trajectory import Trajectory, positions, times
from wbc_suite.control.composite.way import WayFinder
from wbc_suite.typing import Vector

__all__ = ["HELD_UP", "Passed", "Router", "Way"]

CHECKS = 1500  # configurations that the search for a way round may look at
SHORTCUTS = 600
ROOM = 0.015  # m; nearer to each other links are slowed, and a short way takes long
HELD_UP = 0.03  # s; with so much to make up, the robot looks for a shorter way
LEAD = 0.03  # s; how far ahead of the robot its way may still change
NEARER = 3e-3  # m; links that are too near at the start may come so much nearer
AHEAD = (0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0)  # s; where to rejoin a way
REJOINED = 0.5  # of the delay; what must not be lost
LEAP, LEAPS = 0.02, 60  # s, and how many; where a way is looked at for the robot
PUSH = 8.0  # of the accelerations on the way back: solved velocities have steps


@dataclass(frozen=True, slots=True)
class Passed:
    """A configuration and a velocity that the robot had at a time, s."""

    time: float
    q: Vector
    v: Vector


class Way:
    """A motion from where the robot is, and how far the robot has come.

    Args:
        model: The robot.
        origin: Configuration that positions of the motion are counted from.
        motion: What to follow.

    Attributes:
        clock: Time that the robot has spent on it, s.
    """

    def __init__(self, model: pin.Model, origin: Vector, motion: Trajectory) -> None:
        self._model, self.origin, self.motion = model, origin, motion
        self.clock = 0.0

    def configuration(self) -> Vector:
        """Return the configuration that belongs to the clock."""
        return self.place(self.motion.state(self.clock)[0])

    def place(self, x: Vector) -> Vector:
        """Return the configuration of a position."""
        return pin.integrate(self._model, self.origin, x)

    @property
    def left(self) -> float:
        """How long it still takes, s."""
        return max(0.0, self.motion.duration - self.clock)


class Router:
    """Plans ways of bounded speed and acceleration from a state of motion.

    Args:
        model: The robot.
        room: Tells how much farther apart links are than they must be, m.
        speed: Greatest speeds, shape (nv,).
        rate: Accelerations, shape (nv,).
    """

    def __init__(
        self,
        model: pin.Model,
        room: Callable[[Vector], float],
        *,
        speed: Vector,
        rate: Vector,
    ) -> None:
        self._model, self._room = model, room
        self._speed, self._rate = speed, rate
        self._finder = WayFinder(model, speed, lambda q: room(q) > 0.0)
        self._is_plain = model.nq == model.nv  # all joints have one parameter

    def time(self, now: Passed, goal: Vector) -> float:
        """Return how long it takes to rest at a configuration, s."""
        ramp = self._ramp(now, goal)
        return np.inf if ramp is None else ramp.duration

    def direct(self, now: Passed, goal: Vector) -> Way | None:
        """Return the fastest way, or None where something is in the way."""
        ramp = self._ramp(now, goal)
        if ramp is None:
            return None
        way = self._way(now, ramp)
        return way if self._is_free(way, ramp) else None

    def stop(self, now: Passed) -> Way:
        """Return the way that stops soonest."""
        still = np.zeros_like(now.v)
        return self._way(now, braking_ramp((still, now.v), rate=self._rate))

    def shorten(self, way: Way) -> Iterator[None]:
        """Shorten a way under way; yield now and then."""
        return way.motion.shorten(
            SHORTCUTS,
            room=lambda x: self._room(way.place(x)),
            enough=ROOM,
            begin=lambda: way.clock + LEAD,
            rng=np.random.default_rng(0),
        )

    def rejoin(self, way: Way, now: Passed) -> None:
        """Cut short to a later part of the way where the robot has been held up.

        Args:
            way: It is changed.
            now: Where the robot is.
        """
        self._leap(way, now)
        delay = self.recovery(way, now)
        if delay < HELD_UP:
            return
        start = self._from(way, now.q), now.v
        best, least = None, REJOINED * delay
        for ahead in AHEAD:
            time = min(way.clock + ahead, way.motion.duration)
            end = way.motion.state(time)
            ramp = fastest_ramp(start, end, speed=self._speed, rate=self._rate)
            lost = np.inf if ramp is None else ramp.duration - (time - way.clock)
            if ramp is not None and lost < least and self._is_free(way, ramp):
                best, least = (ramp, time), lost
        if best is not None:
            way.motion.begin_with(*best)
            way.clock = 0.0

    def _leap(self, way: Way, now: Passed) -> None:
        """Go on from a later place on the way that the robot is nearer to.

        What was held up before it could turn round need not go out first.
        """
        x = self._from(way, now.q)
        clocks = way.clock + LEAP * np.arange(LEAPS)
        places = np.array([way.motion.state(clock)[0] for clock in clocks.tolist()])
        off = (np.abs(places - x) / self._speed).max(axis=1)
        nearest = int(off.argmin())
        if off[nearest] < REJOINED * off[0]:
            way.clock = min(float(clocks[nearest]), way.motion.duration)

    def late(self, way: Way, now: Passed) -> float:
        """Return how far the robot is from where it should be, s at full speed."""
        return float((self._behind(way, now) / self._speed).max())

    def recovery(self, way: Way, now: Passed) -> float:
        """Return how long the robot needs to get to where it should be, s.

        A joint of great speed and small acceleration is hardly late for a long time.
        """
        behind = self._behind(way, now)
        times = np.maximum(behind / self._speed, np.sqrt(behind / self._rate))
        return float(times.max())

    def back(
        self, now: Passed, goal: Vector, trail: Iterable[Passed]
    ) -> Generator[None, None, Way | None]:
        """Return a way that stops and leads back until it can turn to the goal.

        What the robot has passed was free, so that this needs no search.

        Args:
            now: Where the robot is.
            goal: Where to arrive.
            trail: Where it was, last first.
        """
        if not self._is_plain:
            return None
        way = self.stop(now)
        end, still = self._from(way, goal), np.zeros_like(way.origin)
        ramps = [reversed_ramp(way.motion.first), *self._along(way, [now, *trail])]
        exits = [(ramp.state(ramp.duration), ramp.duration) for ramp in ramps]
        off = np.array([np.abs(x - end) / self._speed for (x, _), _ in exits])
        times = np.cumsum([time for _, time in exits]) + off.max(axis=1)
        for k in times.argsort().tolist():
            yield None
            last = fastest_ramp(
                exits[k][0], (end, still), speed=self._speed, rate=self._rate
            )
            if last is not None and self._is_free(way, last):
                way.motion.extend([*ramps[: k + 1], last])
                return way
        return None

    def _along(self, way: Way, passed: Sequence[Passed]) -> Iterator[Ramp]:
        """Yield ramps from place to place, as fast as the robot came or faster."""
        x = [self._from(way, p.q) for p in passed]
        times = -np.array([p.time for p in passed])
        v = -np.array([p.v for p in passed])
        pace = paces_back(v, np.diff(times), speed=self._speed, rate=self._rate)
        places = list(zip(x, pace[:, None] * v, strict=True))
        least = 2.0 * np.diff(times) / (pace[1:] + pace[:-1])
        for (a, b), time in zip(itertools.pairwise(places), least, strict=True):
            ramp = fastest_ramp(
                a, b, speed=self._speed, rate=PUSH * self._rate, least=float(time)
            )
            if ramp is None:
                return
            yield ramp

    def round(self, way: Way, goal: Vector) -> Iterator[None]:
        """Continue a way that stops: on lines round what is there, or else straight."""
        rest = way.place(way.motion.end)
        corners = [rest, goal]
        if self._is_plain:
            for found in self._finder.find(rest, goal, CHECKS):
                corners = found or corners
                yield None
        places = [self._from(way, q) for q in corners]
        way.motion.extend(
            line_ramp(a, b, speed=self._speed, rate=self._rate)
            for a, b in itertools.pairwise(places)
        )

    def _ramp(self, now: Passed, goal: Vector) -> Ramp | None:
        still = np.zeros_like(now.v)
        end = pin.difference(self._model, now.q, goal)
        return fastest_ramp(
            (still, now.v), (end, still), speed=self._speed, rate=self._rate
        )

    def _way(self, now: Passed, ramp: Ramp) -> Way:
        motion = Trajectory(ramp, speed=self._speed, rate=self._rate)
        return Way(self._model, now.q, motion)

    def _is_free(self, way: Way, ramp: Ramp) -> bool:
        """Tell whether nothing is in the way, but for what is too near at the start."""
        begin, start = 0.0, self._room(way.place(ramp.start))
        if start < NEARER:
            least = min(0.0, start) - NEARER
            for begin in times(ramp):
                room = self._room(way.place(ramp.state(begin)[0]))
                if room < least:
                    return False
                if room > 0.0:
                    break
        found = positions(ramp, begin=begin)
        return all(self._room(way.place(x)) > 0.0 for x in found)

    def _behind(self, way: Way, now: Passed) -> Vector:
        return np.abs(pin.difference(self._model, now.q, way.configuration()))

    def _from(self, way: Way, q: Vector) -> Vector:
        return pin.difference(self._model, way.origin, q)
