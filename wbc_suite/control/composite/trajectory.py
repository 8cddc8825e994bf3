"""A motion in joint space, and how to make it shorter while it is under way."""

import bisect
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from wbc_suite.control.composite.ramps import Ramp, fastest_ramp
from wbc_suite.typing import Vector

__all__ = ["Trajectory", "positions", "times"]

SPACING = 0.02  # s; between configurations that are checked
GAIN = 0.01  # s; less is no gain
NEARER = 0.1  # of the space that is enough; so much less does not hinder
CHECKS = 2  # configurations checked at once


@dataclass(frozen=True, slots=True)
class _Span:
    """A part of a ramp."""

    ramp: Ramp
    begin: float
    end: float

    def state(self, time: float) -> tuple[Vector, Vector]:
        return self.ramp.state(self.begin + time)


class Trajectory:
    """Ramps one after the other.

    Args:
        first: The first ramp.
        speed: Greatest speeds, shape (nv,).
        rate: Accelerations, shape (nv,).
    """

    def __init__(self, first: Ramp, *, speed: Vector, rate: Vector) -> None:
        self._speed, self._rate = speed, rate
        self._spans: list[_Span] = []
        self._ends: list[float] = []
        self._replace([_Span(first, 0.0, first.duration)])

    @property
    def duration(self) -> float:
        """How long it takes, s."""
        return self._ends[-1]

    @property
    def first(self) -> Ramp:
        """The ramp that it begins with."""
        return self._spans[0].ramp

    @property
    def end(self) -> Vector:
        """Where it ends."""
        return self.state(self.duration)[0]

    def state(self, time: float) -> tuple[Vector, Vector]:
        """Return positions and velocities at a time; the last ones when it is over."""
        k = min(bisect.bisect_left(self._ends, time), len(self._ends) - 1)
        span = self._spans[k]
        return span.state(min(time - self._start(k), span.end - span.begin))

    def extend(self, ramps: Iterable[Ramp]) -> None:
        """Go on with further ramps."""
        more = [_Span(ramp, 0.0, ramp.duration) for ramp in ramps]
        self._replace([*self._spans, *more])

    def begin_with(self, ramp: Ramp, time: float) -> None:
        """Put a ramp in place of all that comes before a time."""
        self._replace([_Span(ramp, 0.0, ramp.duration), *self._after(time)])

    def shorten(
        self,
        tries: int,
        *,
        room: Callable[[Vector], float],
        enough: float,
        begin: Callable[[], float],
        rng: np.random.Generator,
    ) -> Iterator[None]:
        """Replace parts by faster ones that are free, at random; yield now and then.

        Args:
            tries: How often to try.
            room: Tells how much space is left at a position, m; none is negative.
            enough: What must about be left, or as much as at the ends of the part, m.
            begin: Returns the time from which on the motion may still change.
            rng: Random numbers.
        """
        for _ in range(tries):
            least, spans = begin(), self._spans
            if len(spans) < 2 or self.duration - least < SPACING:
                return  # one ramp is the fastest there is
            cuts = np.sort(rng.uniform(least, self.duration, 2)).tolist()
            ramp = self._between(*cuts)
            if ramp is None or ramp.duration > cuts[1] - cuts[0] - GAIN:
                continue
            least_room = min(enough, *(room(self.state(t)[0]) for t in cuts))
            bound = max(0.0, least_room) - NEARER * enough
            for number, x in enumerate(positions(ramp)):
                if room(x) < bound:
                    break
                if number % CHECKS == 0:
                    yield
            else:
                if spans is self._spans and cuts[0] >= begin():
                    self._splice(cuts[0], ramp, cuts[1])
            yield

    def _between(self, first: float, last: float) -> Ramp | None:
        return fastest_ramp(
            self.state(first), self.state(last), speed=self._speed, rate=self._rate
        )

    def _splice(self, first: float, ramp: Ramp, last: float) -> None:
        middle = _Span(ramp, 0.0, ramp.duration)
        self._replace([*self._before(first), middle, *self._after(last)])

    def _before(self, time: float) -> Iterator[_Span]:
        for k, span in enumerate(self._spans):
            left = time - self._start(k)
            if left > 0.0:
                yield _Span(span.ramp, span.begin, min(span.end, span.begin + left))

    def _after(self, time: float) -> Iterator[_Span]:
        for k, span in enumerate(self._spans):
            if self._ends[k] > time:
                gone = max(0.0, time - self._start(k))
                yield _Span(span.ramp, span.begin + gone, span.end)

    def _start(self, k: int) -> float:
        return self._ends[k - 1] if k else 0.0

    def _replace(self, spans: list[_Span]) -> None:
        self._spans = spans
        self._ends = np.cumsum([s.end - s.begin for s in spans]).tolist()


def positions(ramp: Ramp, *, begin: float = 0.0) -> Iterator[Vector]:
    """Yield positions on a ramp, coarse steps first: what is blocked is soon told.

    Args:
        ramp: The ramp.
        begin: Time from which on to look, s.
    """
    found = times(ramp)
    stride = 1 << len(found).bit_length()
    while stride := stride // 2:
        for time in found[stride - 1 :: 2 * stride]:
            if time >= begin:
                yield ramp.state(time)[0]


def times(ramp: Ramp) -> list[float]:
    """Return when to look at a ramp, between its ends, s."""
    count = max(1, int(np.ceil(ramp.duration / SPACING)))
    return [ramp.duration * k / count for k in range(1, count)]
