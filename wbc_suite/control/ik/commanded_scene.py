"""The simulated scene, with a robot's joints where they are commanded."""

from typing import NamedTuple

import mujoco
import numpy as np

from wbc_suite.compiling import as_argument, compiled, struct
from wbc_suite.control.ground.mujoco_functions import addresses, mj_kinematics
from wbc_suite.control.state import RobotState
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.forward import JointKind
from wbc_suite.linear_algebra import copy_rows, copy_vector
from wbc_suite.typing import Indices, Matrix, Vector


@struct
class CommandedArrays(NamedTuple):
    """Two states of a scene; views.

    Attributes:
        model: Address of the model.
        data: Address of the state that is written.
        qpos: Its positions.
        measured: Positions in the simulation.
        q: The commanded configuration.
        joint: Places of n commanded joints in q, shape (n,).
        place: Their places in qpos.
    """

    model: int
    data: int
    qpos: Vector
    mocap_pos: Matrix
    mocap_quat: Matrix
    measured: Vector
    measured_mocap_pos: Matrix
    measured_mocap_quat: Matrix
    q: Vector
    joint: Indices
    place: Indices


class CommandedScene:
    """Poses of bodies for commanded joints; all else is as measured.

    So are fingers, which the reduced robot has not, and a free root. Joints that a load
    holds off their command are elsewhere in the simulation.

    Args:
        state: The robot in its scene.
        configuration: The commanded configuration.

    Attributes:
        model: The model of the simulation.
        data: The state; only its kinematics are computed.
        argument: The argument of kernels that stands for the scene.
    """

    def __init__(self, state: RobotState, configuration: Configuration) -> None:
        self.model, measured = state.model, state.data
        self.data = mujoco.MjData(state.model)
        model, data = self.model, self.data
        arrays, names = configuration.arrays, configuration.model.names
        kinds = JointKind.REVOLUTE, JointKind.PRISMATIC
        known = arrays.joints["kind"].tolist()
        joints = [k for k in range(1, len(names)) if known[k] in kinds]
        ids = [model.joint(state.prefix + names[k]).id for k in joints]
        self.argument = as_argument(
            CommandedArrays(
                *addresses(model, data),
                qpos=data.qpos,
                mocap_pos=data.mocap_pos,
                mocap_quat=data.mocap_quat,
                measured=measured.qpos,
                measured_mocap_pos=measured.mocap_pos,
                measured_mocap_quat=measured.mocap_quat,
                q=arrays.q,
                joint=arrays.joints["q_start"][joints].astype(np.int64),
                place=model.jnt_qposadr[ids].astype(np.int64),
            )
        )

    def place(self) -> None:
        """Do what `place_commanded` does."""
        place_commanded(self.argument)


def joint_bodies(state: RobotState, configuration: Configuration) -> Indices:
    """Return the simulator's body with each joint of the model; the world's is 0."""
    model, names = state.model, configuration.model.names
    joints = [model.joint(state.prefix + name).id for name in names[1:]]
    return np.array([0, *model.jnt_bodyid[joints]], dtype=np.int64)


@compiled
def place_commanded(scene: CommandedArrays) -> None:
    """Write the poses of all bodies and geoms."""
    copy_vector(scene.measured, scene.qpos)
    copy_rows(scene.measured_mocap_pos, scene.mocap_pos)
    copy_rows(scene.measured_mocap_quat, scene.mocap_quat)
    for k in range(scene.joint.shape[0]):
        scene.qpos[scene.place[k]] = scene.q[scene.joint[k]]
    mj_kinematics(scene.model, scene.data)
