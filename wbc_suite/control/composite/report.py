"""What a whole-body controller says about its goals, and why one is not reached."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from wbc_suite.control.composite.backend import IkStep
from wbc_suite.control.composite.config import ControlledFrame, WholeBodyIKConfig
from wbc_suite.control.composite.hindrance import Touch
from wbc_suite.kinematics import Configuration
from wbc_suite.typing import Vector

__all__ = ["Body", "FrameReport", "IkReport", "WallTime"]

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
        speed: Speed of the fastest joint, rad/s or m/s.
        touches: Tells what the robot presses on.
        lagging: Tells which joint is farthest from its command.
    """

    commanded: Vector
    goals: Sequence[pin.SE3]
    speed: float
    touches: Callable[[], Sequence[Touch]]
    lagging: Callable[[], str]


@dataclass(frozen=True, kw_only=True, slots=True)
class FrameReport:
    """One controlled frame.

    Attributes:
        reached: Whether both errors are below the tolerance.
        position_error: m.
        orientation_error: rad.
        reasons: Why it is not reached, in words; hardest first.
    """

    reached: bool
    position_error: float
    orientation_error: float
    reasons: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return asdict(self) | {"reasons": list(self.reasons)}


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
        names = configuration.velocity_names()
        self._support = [
            {names[i] for i in _support(configuration, frame)}
            for frame in config.frames
        ]

    def frames(
        self,
        q: Vector,
        goals: Sequence[pin.SE3],
        answer: IkStep,
        body: "Body",
    ) -> dict[str, FrameReport]:
        """Return one report per controlled frame.

        Args:
            q: Measured configuration.
            goals: Goals in the world.
            answer: The last solve.
            body: How the robot follows.
        """
        errors, reached = self._compare(q, goals)
        whys: list[Sequence[str]] = [()] * len(goals)
        if not all(reached):
            whys = self._reasons(reached, answer, body)
        return {
            frame.name: FrameReport(
                reached=reached[k],
                position_error=errors[k][0],
                orientation_error=errors[k][1],
                reasons=() if reached[k] else tuple(dict.fromkeys(whys[k])),
            )
            for k, frame in enumerate(self._config.frames)
        }

    def _compare(
        self, q: Vector, goals: Sequence[pin.SE3]
    ) -> tuple[list[tuple[float, float]], list[bool]]:
        """Return each frame's distances, and whether they are within tolerance."""
        self._configuration.update(q)
        errors = [
            self._error(frame, goal)
            for frame, goal in zip(self._config.frames, goals, strict=True)
        ]
        linear, angular = self._config.tolerance
        return errors, [p <= linear and r <= angular for p, r in errors]

    def _error(self, frame: ControlledFrame, goal: pin.SE3) -> tuple[float, float]:
        """Return distances that count for the frame's kind, m and rad."""
        if frame.frame is None:
            offset = goal.translation - self._configuration.com
            return float(np.linalg.norm(offset)), 0.0
        pose = self._configuration.frame_pose(frame.frame)
        offset = goal.translation - pose.translation
        turn = pin.log3(pose.rotation.T @ goal.rotation)
        if frame.kind == "base":
            offset, turn = offset[:2], turn[2:]
        linear = 0.0 if frame.kind == "orientation" else float(np.linalg.norm(offset))
        angular = 0.0 if frame.kind == "position" else float(np.linalg.norm(turn))
        return linear, angular

    def _reasons(
        self, reached: Sequence[bool], answer: IkStep, body: "Body"
    ) -> list[Sequence[str]]:
        """Return why each frame is not reached.

        Where the commanded robot is at its goal, what counts is why the body is not;
        else the solver's reasons, or some of our own where it has none.
        """
        _, commanded = self._compare(body.commanded, body.goals)
        known = answer.explain() if answer.explain is not None else {}
        standing = float(np.abs(answer.v).max(initial=0.0)) < STANDING
        whys: list[Sequence[str]] = []
        for k, frame in enumerate(self._config.frames):
            why = known.get(frame.name) or ()
            if commanded[k]:
                why = self._held_back(k, body) if standing else ()
            elif frame.name not in known:
                why = self._from_limits(k, reached, answer)
            if not why and standing and not commanded[k]:
                why = ["out of reach"]
            whys.append(why or ["moving"])
        return whys

    def _held_back(self, k: int, body: "Body") -> Sequence[str]:
        """Return what the frame's limb presses on, or else the joint that lags."""
        if body.speed > RATTLING:
            return ()
        touching = [
            str(touch)
            for touch in body.touches()
            if self._support[k] & self._names(touch.link)
        ]
        standing = body.speed < STANDING_BODY
        return touching or ([body.lagging()] if standing else ())

    def _names(self, frame: str) -> set[str]:
        names = self._configuration.velocity_names()
        return {names[i] for i in self._configuration.support(frame)}

    def _from_limits(
        self, k: int, reached: Sequence[bool], answer: IkStep
    ) -> list[str]:
        """Return the limits on the frame's joints, or else rivals."""
        support = self._support[k]
        limits = [
            words for joint, words in answer.limits if joint is None or joint in support
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
