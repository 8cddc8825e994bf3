"""What a whole-body controller says about its goals, and why one is not reached."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pinocchio as pin

from wbc_suite.control.composite.backend import Explanation, IkStep
from wbc_suite.control.composite.config import ControlledFrame, WholeBodyIKConfig
from wbc_suite.control.composite.frames import ControlledFrames
from wbc_suite.control.composite.hindrance import Touch
from wbc_suite.control.reasons import Once, Reasons
from wbc_suite.kinematics import Configuration
from wbc_suite.typing import Vector

__all__ = ["Body", "IkReport", "WallTime"]

STANDING = 1e-3
"""rad/s or m/s; a command slower than that stands."""

RATTLING = 0.1
"""rad/s or m/s; what a robot that presses on something may still move."""

STANDING_BODY = 0.02
"""rad/s or m/s; a robot slower than that stands."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Body:
    """How a robot follows its commands.

    Attributes:
        commanded: Commanded configuration.
        goals: Goals in the world of the commanded robot.
        speed: Tells the speed of the fastest joint now, rad/s or m/s.
        touches: Tells what the robot presses on now.
        lagging: Tells which joint is farthest from its command now.
    """

    commanded: Vector
    goals: Sequence[pin.SE3]
    speed: Callable[[], float]
    touches: Callable[[], Sequence[Touch]]
    lagging: Callable[[], str]


class WallTime(float):
    """A measured time, s, equal to any other.

    Same seed and actions give the same `info`; how long the machine took is no part of
    that.
    """

    def __eq__(self, other: object) -> bool:
        return isinstance(other, WallTime)

    def __hash__(self) -> int:
        return 0


class IkReport:
    """Compares measured frames with their goals.

    Args:
        config: Controlled frames and tolerances.
        configuration: Kinematics to use; it is moved.
    """

    def __init__(self, config: WholeBodyIKConfig, configuration: Configuration) -> None:
        self._config, self._configuration = config, configuration
        self._frames = ControlledFrames(config, configuration)
        names = configuration.velocity_names()
        self._support = [
            {names[i] for i in _support(configuration, frame)}
            for frame in config.frames
        ]

    def frames(
        self, q: Vector, goals: Sequence[pin.SE3], answer: IkStep, body: Body
    ) -> dict[str, dict[str, Any]]:
        """Return what `info["ik"]["frames"]` holds.

        Reasons are told later, of what was so now.

        Args:
            q: Measured configuration.
            goals: Goals in the world.
            answer: The last solve.
            body: How the robot follows.
        """
        errors, reached = self._compare(q, goals)
        tell: Callable[[], Sequence[Sequence[str]]] = tuple
        if not all(reached):
            tell = Once(self._reasons(reached, answer, body))
        return {
            frame.name: {
                "reached": there,
                "position_error": position,
                "orientation_error": angle,
                "reasons": [] if there else Reasons(partial(_pick, tell, k)),
            }
            for k, (frame, there, (position, angle)) in enumerate(
                zip(self._config.frames, reached, errors, strict=True)
            )
        }

    def _compare(
        self, q: Vector, goals: Sequence[pin.SE3]
    ) -> tuple[list[list[float]], list[bool]]:
        """Return each frame's distances, and whether they are within tolerance."""
        self._configuration.update(q)
        errors = self._frames.measure(goals).tolist()
        linear, angular = self._config.tolerance
        return errors, [p <= linear and r <= angular for p, r in errors]

    def _reasons(
        self, reached: Sequence[bool], answer: IkStep, body: Body
    ) -> Callable[[], Sequence[Sequence[str]]]:
        """Return what tells why each frame is not reached, now or later.

        Where the commanded robot is at its goal, what counts is why the body is not;
        else the solver's reasons, or some of our own where it has none.
        """
        there = Once(partial(self._compare, body.commanded, body.goals))
        standing = float(np.abs(answer.v).max(initial=0.0)) < STANDING
        explain = answer.record() if answer.record is not None else dict
        held_back: Sequence[Sequence[str]] = [()] * len(reached)
        if standing and any(there()[1]):
            held_back = self._held_back(body)
        return partial(self._tell, reached, there, standing, held_back, explain, answer)

    def _tell(
        self,
        reached: Sequence[bool],
        there: Callable[[], tuple[object, Sequence[bool]]],
        standing: bool,
        held_back: Sequence[Sequence[str]],
        explain: Explanation,
        answer: IkStep,
    ) -> Sequence[Sequence[str]]:
        known, whys = explain(), list[Sequence[str]]()
        _, commanded = there()
        for k, frame in enumerate(self._config.frames):
            why = known.get(frame.name) or ()
            if commanded[k]:
                why = held_back[k]
            elif frame.name not in known:
                why = self._from_limits(k, reached, answer)
            if not why and standing and not commanded[k]:
                why = ["out of reach"]
            whys.append(why or ["moving"])
        return whys

    def _held_back(self, body: Body) -> Sequence[Sequence[str]]:
        """Return what each frame's limb presses on, or else the joint that lags."""
        speed = body.speed()
        if speed > RATTLING:
            return [()] * len(self._support)
        touches = [(self._names(touch.link), str(touch)) for touch in body.touches()]
        lagging = [body.lagging()] if speed < STANDING_BODY else []
        return [
            [words for names, words in touches if support & names] or lagging
            for support in self._support
        ]

    def _names(self, frame: str) -> set[str]:
        names = self._configuration.velocity_names()
        return {names[i] for i in self._configuration.support(frame)}

    def _from_limits(
        self, k: int, reached: Sequence[bool], answer: IkStep
    ) -> list[str]:
        """Return the limits on the frame's joints, or else rivals."""
        support = self._support[k]
        limits = [
            words
            for joint, words in answer.limits()
            if joint is None or joint in support
        ]
        return limits or [
            f"conflict: {other.name}"
            for i, other in enumerate(self._config.frames)
            if i != k
            and not reached[i]
            and other.level <= self._config.frames[k].level
            and support & self._support[i]
        ]


def _support(configuration: Configuration, frame: ControlledFrame) -> Sequence[int]:
    if frame.frame is None:
        return range(configuration.nv)
    return [int(i) for i in configuration.support(frame.frame)]


def _pick(tell: Callable[[], Sequence[Sequence[str]]], k: int) -> list[str]:
    """Return the k-th words, each once."""
    return list(dict.fromkeys(tell()[k]))
