"""Where robots stand when an episode begins."""

import numpy as np

from wbc_suite.control import RobotState
from wbc_suite.envs.config import NoiseConfig
from wbc_suite.typing import Indices, Vector

__all__ = ["StartPosture"]


class StartPosture:
    """Puts one robot at its keyframe `ready`, with noise on the arms' joints.

    Args:
        state: The robot in the simulation.
        noise: The noise, drawn anew each time; None for none.
    """

    def __init__(self, state: RobotState, noise: NoiseConfig | None) -> None:
        robot = state.robot
        posture = robot.keyframe("ready")
        self._qpos, self._noise = state.data.qpos, noise
        joints, _ = state.joint_addresses(tuple(posture))
        self._index, self._values = _root(state)
        self._index = np.concatenate([self._index, joints])
        self._values = np.concatenate([self._values, list(posture.values())])
        arms = [
            name
            for group, names in robot.groups.items()
            if group.endswith("arm")
            for name in names
        ]
        self._arms, _ = state.joint_addresses(tuple(arms))
        ranges = [robot.joint(name).range or (-np.inf, np.inf) for name in arms]
        self._low, self._high = np.array(ranges).reshape(-1, 2).T

    def write(self, rng: np.random.Generator | None = None) -> None:
        """Write the posture into the simulation; without `rng` there is no noise."""
        self._qpos[self._index] = self._values
        if self._noise is None or rng is None:
            return
        count = len(self._arms)
        gaussian = self._noise.type == "gaussian"
        draw = rng.normal(size=count) if gaussian else rng.uniform(-1.0, 1.0, count)
        moved = self._qpos[self._arms] + self._noise.magnitude * draw
        self._qpos[self._arms] = np.clip(moved, self._low, self._high)


def _root(state: RobotState) -> tuple[Indices, Vector]:
    """Return where the root's pose is in qpos, and what it is at the start."""
    root, model = state.robot.root, state.model
    if root.kind == "free":
        first = int(model.joint(f"{state.prefix}root").qposadr[0])
        return np.arange(first, first + 7, dtype=np.int64), np.array(
            [*root.pos, *root.quat]
        )
    index, _ = state.joint_addresses(
        state.robot.root_joint_names if root.kind == "planar" else ()
    )
    return index, np.zeros(len(index))
