"""A robot at a posture: poses by Pinocchio, contacts by MuJoCo."""

from collections.abc import Mapping
from functools import cached_property

import mujoco
import pinocchio as pin

from wbc_suite.robot.description import RobotDescription
from wbc_suite.typing import Vector

Bodies = frozenset[str]
"""Names of two links; of one where it touches itself."""


class PosedRobot:
    """A robot whose joints are moved to see where its frames are and what touches.

    Attributes:
        q: Its posture, shape (nq,), at first `ready`; `update` follows writing to it.
        places: Index in q of each joint, in the robot's order.
        model: Pinocchio's model.
        data: Pinocchio's data with the poses of frames.
    """

    def __init__(self, robot: RobotDescription) -> None:
        self.robot, self.model = robot, robot.to_pinocchio()
        self.data, self.q = self.model.createData(), pin.neutral(self.model)
        index = [self.model.getJointId(name) for name in robot.joint_names]
        self.places = [self.model.joints[j].idx_q for j in index]
        self.move(robot.keyframes.get("ready", {}))

    def move(self, values: Mapping[str, float]) -> None:
        """Move joints by name, rad or m; all others to 0, and followers along."""
        posture = self.robot.posture(values)
        self.q[self.places] = [posture[name] for name in self.robot.joint_names]
        self.update()

    def update(self) -> None:
        """Compute the poses of frames at `q`."""
        pin.framesForwardKinematics(self.model, self.data, self.q)

    def pose(self, frame: str) -> pin.SE3:
        """Return the pose of a frame or link in the world."""
        return self.data.oMf[self.model.getFrameId(frame)]

    @cached_property
    def compiled(self) -> mujoco.MjModel:
        """MuJoCo's model."""
        return self.robot.to_mjspec().compile()

    @cached_property
    def _physics(self) -> tuple[mujoco.MjData, list[int], dict[int, str]]:
        """Return MuJoCo's data, places of joints in qpos, and links by body."""
        m, robot = self.compiled, self.robot
        addresses = [m.joint(name).qposadr[0] for name in robot.joint_names]
        links = {m.body(link.name).id: link.name for link in robot.links}
        return mujoco.MjData(m), addresses, links

    def contacts(self, values: Vector, *distances: float) -> list[set[Bodies]]:
        """Return the links that are nearer than each of some distances, m.

        The values of the joints, rad or m, are in the robot's order.
        """
        m, (data, addresses, links) = self.compiled, self._physics
        data.qpos[addresses] = values
        mujoco.mj_kinematics(m, data)
        mujoco.mj_comPos(m, data)
        mujoco.mj_collision(m, data)
        found: list[set[Bodies]] = []
        for distance in distances:
            near = data.contact.geom[data.contact.dist < distance]
            pairs = m.geom_bodyid[near].reshape(-1, 2).tolist()
            found.append({frozenset((links[a], links[b])) for a, b in pairs})
        return found
