"""What controllers see of a robot in a simulation."""

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.errors import UnknownNameError
from wbc_suite.kinematics import Conversion
from wbc_suite.robot import RobotDescription
from wbc_suite.typing import Indices, Matrix, Vector


class RobotState:
    """One robot among everything a MuJoCo simulation holds.

    A live view: it owns no state, and reads MuJoCo's own arrays when asked. The prefix
    is the text before the robot's names in the scene, such as `robot0_`.

    Attributes:
        actuators: Names of the robot's actuators, without prefix; the order of tau.
        actuator_ids: Their indices in the scene.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        robot: RobotDescription,
        *,
        prefix: str = "",
    ) -> None:
        self.model, self.data, self.robot, self.prefix = model, data, robot, prefix
        self.conversion = Conversion(model, robot.to_pinocchio(), prefix=prefix)
        own = {prefix + j for j in (*robot.joint_names, *robot.root_joint_names)}
        named = [model.actuator(i).name for i in range(model.nu)]
        ids = [i for i, name in enumerate(named) if name in own]
        self.actuator_ids: Indices = np.array(ids, dtype=np.int64)
        self.actuators = tuple(named[i].removeprefix(prefix) for i in ids)
        self._mass_matrix: Matrix = np.zeros((model.nv, model.nv))

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self.data.time

    @property
    def q(self) -> Vector:
        """Joint positions in Pinocchio's order and conventions, shape (nq,)."""
        return self.conversion.q_to_pinocchio(self.data.qpos)

    @property
    def v(self) -> Vector:
        """Joint velocities in Pinocchio's conventions, shape (nv,)."""
        return self.conversion.v_to_pinocchio(self.data.qpos, self.data.qvel)

    @property
    def root_pose(self) -> pin.SE3:
        """Measured pose T_wr of the robot's first link."""
        body = self.data.body(self.prefix + self.robot.links[0].name)
        return pin.SE3(body.xmat.reshape(3, 3).copy(), body.xpos.copy())

    def mass_matrix(self) -> Matrix:
        """Return the joint-space inertia of the whole scene, (nv, nv). A buffer."""
        mujoco.mj_fullM(self.model, self.data, self._mass_matrix)
        return self._mass_matrix

    def joint_addresses(self, names: tuple[str, ...]) -> tuple[Indices, Indices]:
        """Return the places of one-parameter joints in qpos and in qvel.

        Raises:
            UnknownNameError: If the robot has no such joint.
        """
        known = {*self.robot.joint_names, *self.robot.root_joint_names}
        for name in names:
            if name not in known:
                raise UnknownNameError("joint", name, known)
        joints = [self.model.joint(self.prefix + name) for name in names]
        q = np.array([j.qposadr[0] for j in joints], dtype=np.int64)
        v = np.array([j.dofadr[0] for j in joints], dtype=np.int64)
        return q, v
