"""Self-collision capsules of fingers, where the simulator has them."""

from typing import NamedTuple

import numpy as np

from wbc_suite.compiling import as_argument, compiled, struct
from wbc_suite.control.ik.commanded_scene import CommandedScene, joint_bodies
from wbc_suite.control.state import RobotState
from wbc_suite.kinematics import Configuration
from wbc_suite.qp import SelfCollisionLimit
from wbc_suite.qp.self_collision_rows import CAPSULE
from wbc_suite.typing import CompiledRecords, Indices, Matrix


@struct
class FingerArrays(NamedTuple):
    """n capsules on links that move in the simulator, and not in the reduced robot.

    Attributes:
        capsule: Place of each among the capsules of the limit, shape (n,).
        body: Body of its link.
        carrier: Body of the joint that moves it in the reduced robot.
        local: Ends of its segment in its link, m, shape (n, 6).
        capsules: `CAPSULE` records of all capsules; those of the limit.
        xpos: Positions of bodies of the commanded scene, m, shape (nbody, 3).
        xmat: Their orientations, shape (nbody, 9).
    """

    capsule: Indices
    body: Indices
    carrier: Indices
    local: Matrix
    capsules: CompiledRecords
    xpos: Matrix
    xmat: Matrix


class FingerCapsules:
    """Moves the capsules of a self-collision limit with measured fingers.

    The reduced robot has its fingers at `ready`; open or closed fingers reach
    elsewhere, and hands would hit the robot or hook into each other.

    Args:
        state: The robot in its scene.
        configuration: The commanded configuration.
        commanded: The scene with the commanded robot.
        limit: The limit; None without any.

    Attributes:
        argument: The argument of kernels that stands for the fingers.
    """

    def __init__(
        self,
        state: RobotState,
        configuration: Configuration,
        commanded: CommandedScene,
        limit: SelfCollisionLimit | None,
    ) -> None:
        capsules, placed = (), np.zeros(0, CAPSULE)
        if limit is not None:
            limit.bind(configuration)
            capsules, placed = limit.capsules, limit.placed
        joint = placed["joint"]
        model, data = state.model, commanded.data
        names = [state.prefix + capsule.link for capsule in capsules]
        body = np.array([model.body(name).id for name in names], dtype=np.int64)
        carrier = joint_bodies(state, configuration)[joint]
        rigid = model.body_weldid[body] == model.body_weldid[carrier]
        moved = np.flatnonzero((joint > 0) & ~rigid)
        local = [(*capsules[k].start, *capsules[k].end) for k in moved.tolist()]
        self._arrays = FingerArrays(
            capsule=moved,
            body=body[moved],
            carrier=carrier[moved],
            local=np.reshape(local, (len(moved), 6)),
            capsules=placed,
            xpos=data.xpos,
            xmat=data.xmat,
        )
        self.argument = as_argument(self._arrays)

    def place(self) -> None:
        """Do what `place_fingers` does."""
        place_fingers(self.argument)


@compiled
def place_fingers(fingers: FingerArrays) -> None:
    """Write the ends of the fingers' capsules; poses of bodies are current."""
    xpos, way = fingers.xpos, np.empty(3)
    for k in range(fingers.capsule.shape[0]):
        row, b, c = fingers.capsule[k], fingers.body[k], fingers.carrier[k]
        R_b, R_c = fingers.xmat[b], fingers.xmat[c]
        ends = fingers.capsules[row].ends
        for end in range(2):
            x = fingers.local[k, 3 * end : 3 * end + 3]
            for i in range(3):
                way[i] = xpos[b, i] - xpos[c, i]
                for j in range(3):
                    way[i] += R_b[3 * i + j] * x[j]
            for i in range(3):
                ends[end, i] = 0.0
                for j in range(3):
                    ends[end, i] += R_c[3 * j + i] * way[j]
