"""The controlled frames of a whole-body controller, and their targets."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from wbc_suite.compiling import as_argument
from wbc_suite.control.composite.frame_targets import (
    CENTRE_OF_MASS,
    FrameArrays,
    PostureArrays,
    measure_frames,
)
from wbc_suite.control.composite.whole_body_config import WholeBodyIKConfig
from wbc_suite.kinematics import Configuration
from wbc_suite.typing import Matrix, Vector


class ControlledFrames:
    """Owner of the arrays of controlled frames on one configuration.

    Args:
        config: Controlled frames.
        configuration: The robot; read.
        accelerations: Acceleration limits, shape (nv,).

    Attributes:
        arrays: Arrays of the frames.
        posture: Arrays of the preferred posture.
        argument: The argument of kernels that stands for `arrays`.
        posture_argument: That for `posture`.
    """

    def __init__(
        self,
        config: WholeBodyIKConfig,
        configuration: Configuration,
        accelerations: Vector | None = None,
    ) -> None:
        self._configuration = configuration
        self.arrays = _frame_arrays(config, configuration)
        braking = np.ones(configuration.nv) if accelerations is None else accelerations
        self.posture = PostureArrays(
            goal=configuration.q.copy(),
            target=configuration.q.copy(),
            max_speed=np.full(configuration.nv, config.posture.speed),
            braking=config.posture.braking * braking,
        )
        self.argument = as_argument(self.arrays)
        self.posture_argument = as_argument(self.posture)

    def pose(self, k: int) -> pin.SE3:
        """Return the present pose of a frame."""
        measure_frames(self._configuration.robot, self.argument)
        T = self.arrays.pose[k].reshape(3, 4)
        return pin.SE3(T[:, :3], T[:, 3])

    def goal(self, k: int) -> pin.SE3:
        """Return the goal of a frame."""
        T = self.arrays.goal[k].reshape(3, 4)
        return pin.SE3(T[:, :3], T[:, 3])

    def measure(self, goals: Sequence[pin.SE3]) -> Matrix:
        """Set the goals in the world, and return distances from them.

        Returns:
            Distances that count for each frame's kind, m and rad, shape (n, 2). A
            buffer.
        """
        for row, goal in zip(self.arrays.goal, goals, strict=True):
            row[:] = _row(goal)
        measure_frames(self._configuration.robot, self.argument)
        return self.arrays.distance


def _frame_arrays(
    config: WholeBodyIKConfig, configuration: Configuration
) -> FrameArrays:
    frames, n = config.frames, len(config.frames)
    joint = np.full(n, CENTRE_OF_MASS, dtype=np.int64)
    offset = np.tile(_row(pin.SE3.Identity()), (n, 1))
    for k, frame in enumerate(frames):
        if frame.frame is not None:
            found = configuration.model.frames[configuration.frame_id(frame.frame)]
            joint[k], offset[k] = found.parentJoint, _row(found.placement)
    return FrameArrays(
        joint=joint,
        offset=offset,
        counted=np.array([f.behaviour.counted for f in frames], dtype=float),
        gain=np.array([f.gain for f in frames]),
        max_speed=np.array([(f.max_linear_speed, f.max_angular_speed) for f in frames]),
        braking=np.array([(f.linear_braking, f.angular_braking) for f in frames]),
        level=np.array([f.level for f in frames], dtype=np.int64),
        tolerance=np.array(config.tolerance, dtype=float),
        pose=np.zeros((n, 12)),
        goal=np.zeros((n, 12)),
        target=np.zeros((n, 12)),
        error=np.zeros((n, 6)),
        distance=np.zeros((n, 2)),
    )


def _row(T: pin.SE3) -> Vector:
    """Return a pose as [R p] row by row, shape (12,)."""
    return T.homogeneous.ravel()[:12]
