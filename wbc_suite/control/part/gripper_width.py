"""How wide a parallel gripper is open, by its synergy."""

from collections.abc import Iterable

import mujoco
import numpy as np

from wbc_suite.control.state import RobotState
from wbc_suite.errors import ConfigError
from wbc_suite.robot.parts import Synergy
from wbc_suite.typing import Vector

__all__ = ["OpeningTable"]

SAMPLES = 41


class OpeningTable:
    """Width between two fingers against the synergy's command.

    The width is measured along the y axis of the grasp frame, from its origin to the
    fingers on both sides, by their collision shapes; linkages follow their drives by
    the ratios of the description. Between samples it is interpolated linearly.

    Args:
        synergy: What moves the fingers.
        grasp: Frame between them.
        state: The robot in the simulation; its state is left alone.

    Attributes:
        least: Width when closed, m.
        greatest: Width when open, m.

    Raises:
        ConfigError: If there are no two fingers opposite each other.
    """

    def __init__(self, synergy: Synergy, grasp: str, state: RobotState) -> None:
        self._state, self._grasp = state, state.prefix + grasp
        self._data = mujoco.MjData(state.model)
        self._commands = np.linspace(-1.0, 1.0, SAMPLES)
        self._moving = self._moving_shapes(_followers(synergy, state))
        sides = self._hits(synergy, -1.0)
        if None in [body for _, body in sides]:
            raise ConfigError(
                f"key 'input': gripper '{synergy.gripper}' has no two fingers opposite "
                f"each other at frame '{grasp}', so 'width' means nothing. Use "
                "'synergy'."
            )
        widths = []
        for command in self._commands:
            now = self._hits(synergy, float(command))
            # Fingers that overlap when closed would meet each other's inside.
            widths.append(
                sum(
                    distance
                    for (distance, body), (_, own) in zip(now, sides, strict=True)
                    if body == own
                )
            )
        self._widths: Vector = np.minimum.accumulate(widths)
        self.greatest, self.least = float(self._widths[0]), float(self._widths[-1])

    def command(self, width: float) -> float:
        """Return the synergy's command that opens the gripper so wide, m."""
        return float(np.interp(width, self._widths[::-1], self._commands[::-1]))

    def width(self, command: float) -> float:
        """Return the width, m, of a synergy's command."""
        return float(np.interp(command, self._commands, self._widths))

    def _hits(self, synergy: Synergy, command: float) -> list[tuple[float, int | None]]:
        """Return distance and body of what is met along y, and against it."""
        model, data = self._state.model, self._data
        for name, value in _joint_values(synergy, command, self._state).items():
            joint = model.joint(self._state.prefix + name)
            data.qpos[joint.qposadr[0]] = value
        mujoco.mj_kinematics(model, data)
        frame = data.site(self._grasp)
        y = frame.xmat.reshape(3, 3)[:, 1].copy()
        return [self._nearest(frame.xpos, sign * y) for sign in (1.0, -1.0)]

    def _nearest(self, start: Vector, direction: Vector) -> tuple[float, int | None]:
        model, data = self._state.model, self._data
        found: tuple[float, int | None] = (np.inf, None)
        for geom in self._moving:
            if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
                distance = mujoco.mj_rayMesh(model, data, geom, start, direction)
            else:
                distance = mujoco.mju_rayGeom(
                    data.geom_xpos[geom],
                    data.geom_xmat[geom],
                    model.geom_size[geom],
                    start,
                    direction,
                    int(model.geom_type[geom]),
                )
            if 0.0 <= distance < found[0]:
                found = distance, int(model.geom_bodyid[geom])
        return found

    def _moving_shapes(self, joints: Iterable[str]) -> list[int]:
        """Return the collision shapes that some joints move."""
        model, prefix = self._state.model, self._state.prefix
        bodies = {int(model.jnt_bodyid[model.joint(prefix + j).id]) for j in joints}
        for body in range(model.nbody):
            if int(model.body_parentid[body]) in bodies:
                bodies.add(body)
        return [
            geom
            for geom in range(model.ngeom)
            if int(model.geom_bodyid[geom]) in bodies and model.geom_contype[geom]
        ]


def _joint_values(
    synergy: Synergy, command: float, state: RobotState
) -> dict[str, float]:
    """Return positions of the synergy's joints and of those that follow them."""
    closed = 0.5 * (command + 1.0)
    values = {
        joint: (1.0 - closed) * value + closed * synergy.closed[joint]
        for joint, value in synergy.open.items()
    }
    followers = {j.name: j.mimic for j in state.robot.joints if j.mimic is not None}
    for name in _followers(synergy, state):  # a leader comes before its followers
        if name in followers:
            mimic = followers[name]
            values[name] = mimic.ratio * values[mimic.joint] + mimic.offset
    return values


def _followers(synergy: Synergy, state: RobotState) -> dict[str, None]:
    """Return the synergy's joints and all that follow them, leaders first."""
    found = dict.fromkeys(synergy.open)
    mimics = [(j.name, j.mimic.joint) for j in state.robot.joints if j.mimic]
    while True:
        more = [a for a, leader in mimics if leader in found and a not in found]
        if not more:
            return found
        found |= dict.fromkeys(more)
