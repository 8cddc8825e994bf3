"""A joint trajectory of several profiles that may change while it is followed."""

import bisect
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
import ruckig

from wbc_suite.planning.time_parameterisation import State
from wbc_suite.typing import Vector


@dataclass(frozen=True, slots=True)
class Segment:
    """A part of a profile, from `begin` to `end`; backwards where `end` is earlier."""

    profile: ruckig.Trajectory
    begin: float  # s, time of the profile
    end: float  # s, time of the profile

    @classmethod
    def whole(cls, profile: ruckig.Trajectory) -> "Segment":
        """Return all of a profile."""
        return cls(profile, 0.0, profile.duration)

    @property
    def duration(self) -> float:
        """Duration, s."""
        return abs(self.end - self.begin)

    @property
    def reversed(self) -> "Segment":
        """The segment that leads back the same way."""
        return Segment(self.profile, self.end, self.begin)

    def state(self, time: float) -> State:
        """Return positions and velocities after a time, bounded to the segment."""
        sign = 1.0 if self.end >= self.begin else -1.0
        x, v, _ = self.profile.at_time(self._time(time))
        return np.array(x), sign * np.array(v)

    def between(self, first: float, last: float) -> "Segment":
        """Return the part between two times of the segment, bounded to it."""
        return Segment(self.profile, self._time(first), self._time(last))

    def _time(self, time: float) -> float:
        """Return the profile's time after a time of the segment, bounded to it."""
        time = min(max(time, 0.0), self.duration)
        return self.begin + (time if self.end >= self.begin else -time)

    def check_times(self, spacing: float) -> list[float]:
        """Return times inside the segment, at most a spacing apart, s."""
        count = max(1, int(np.ceil(self.duration / spacing)))
        return [self.duration * k / count for k in range(1, count)]

    def check_positions(
        self, spacing: float, *, begin: float = 0.0
    ) -> Iterator[Vector]:
        """Yield positions (nv,) from a time on, at most a spacing (s) apart.

        Coarse steps are first: collisions are found early.
        """
        times = self.check_times(spacing)
        stride = 1 << len(times).bit_length()
        while stride := stride // 2:
            for time in times[stride - 1 :: 2 * stride]:
                if time >= begin:
                    yield self.state(time)[0]


class Trajectory:
    """Segments one after the other, at least one; each begins where the last ends.

    Attributes:
        segments: A new tuple whenever the trajectory changes.
    """

    def __init__(self, segments: Iterable[Segment]) -> None:
        self._set(segments)

    @property
    def duration(self) -> float:
        """Duration, s."""
        return self._ends[-1]

    @property
    def end(self) -> Vector:
        """Final positions, shape (nv,)."""
        return self.state(self.duration)[0]

    def state(self, time: float) -> State:
        """Return positions and velocities at a time; the last ones afterwards."""
        k = min(bisect.bisect_left(self._ends, time), len(self._ends) - 1)
        return self.segments[k].state(time - self._start(k))

    def extend(self, segments: Iterable[Segment]) -> None:
        """Append segments."""
        self._set([*self.segments, *segments])

    def replace(self, first: float, segment: Segment, last: float) -> None:
        """Put a segment in place of all that is between two times."""
        before = [
            part.between(0.0, first - self._start(k))
            for k, part in enumerate(self.segments)
            if first > self._start(k)
        ]
        after = [
            part.between(last - self._start(k), part.duration)
            for k, part in enumerate(self.segments)
            if last < self._ends[k]
        ]
        self._set([*before, segment, *after])

    def _start(self, k: int) -> float:
        return self._ends[k - 1] if k else 0.0

    def _set(self, segments: Iterable[Segment]) -> None:
        self.segments = tuple(segments)
        durations = [segment.duration for segment in self.segments]
        self._ends: list[float] = np.cumsum(durations).tolist()


@dataclass(frozen=True, slots=True)
class TimedState:
    """A configuration and a velocity at a time, s."""

    time: float
    q: Vector
    v: Vector


class Motion:
    """A trajectory in the tangent space of a configuration, and how far it is followed.

    Positions of the trajectory, shape (nv,), are counted from the origin, a
    configuration, shape (nq,). The clock is the time on the trajectory, s.
    """

    def __init__(
        self, model: pin.Model, origin: Vector, trajectory: Trajectory
    ) -> None:
        self._model, self.origin, self.trajectory = model, origin, trajectory
        self.clock = 0.0

    def configuration(self, time: float | None = None) -> Vector:
        """Return the configuration at a time, or else at the clock."""
        time = self.clock if time is None else time
        return self.configuration_of(self.trajectory.state(time)[0])

    def configuration_of(self, x: Vector) -> Vector:
        """Return the configuration of a position of the trajectory."""
        return pin.integrate(self._model, self.origin, x)

    def position_of(self, q: Vector) -> Vector:
        """Return the position on the trajectory's axes of a configuration."""
        return pin.difference(self._model, self.origin, q)

    @property
    def goal(self) -> Vector:
        """The final configuration."""
        return self.configuration_of(self.trajectory.end)

    @property
    def remaining(self) -> float:
        """Time left, s."""
        return max(0.0, self.trajectory.duration - self.clock)
