"""What a whole-body controller says about its goals, and why one is not reached."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from wbc_suite.control.composite.backend import IkStep
from wbc_suite.control.composite.config import ControlledFrame, WholeBodyIKConfig
from wbc_suite.kinematics import Configuration
from wbc_suite.typing import Vector

__all__ = ["FrameReport", "IkReport", "WallTime"]


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
        self, q: Vector, goals: Sequence[pin.SE3], answer: IkStep
    ) -> dict[str, FrameReport]:
        """Return one report per controlled frame.

        Args:
            q: Measured configuration.
            goals: Goals in the world.
            answer: The last solve.
        """
        self._configuration.update(q)
        errors = [
            self._error(frame, goal)
            for frame, goal in zip(self._config.frames, goals, strict=True)
        ]
        linear, angular = self._config.tolerance
        reached = [p <= linear and r <= angular for p, r in errors]
        known: Mapping[str, Sequence[str]] = {}
        if answer.explain is not None and not all(reached):
            known = answer.explain()
        return {
            frame.name: FrameReport(
                reached=reached[k],
                position_error=errors[k][0],
                orientation_error=errors[k][1],
                reasons=()
                if reached[k]
                else self._reasons(k, reached, answer, known.get(frame.name)),
            )
            for k, frame in enumerate(self._config.frames)
        }

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
        self,
        k: int,
        reached: Sequence[bool],
        answer: IkStep,
        reasons: Sequence[str] | None,
    ) -> tuple[str, ...]:
        """Return reasons, if the solver has any, and some of our own if not."""
        if reasons is None:
            reasons = self._from_limits(k, reached, answer)
        if not reasons and float(np.abs(answer.v).max(initial=0.0)) < 1e-3:
            reasons = ["out of reach"]
        return tuple(dict.fromkeys(reasons)) or ("moving",)

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
