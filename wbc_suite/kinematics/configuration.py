"""A robot's configuration with its forward kinematics and Jacobians."""

from typing import Literal

import numpy as np
import pinocchio as pin

from wbc_suite.arguments import check_array
from wbc_suite.compiling import as_argument
from wbc_suite.errors import ConfigError, look_up
from wbc_suite.kinematics.forward import (
    JointKind,
    RobotArrays,
    compute_com,
    compute_joint_poses,
    pack_pose,
    robot_arrays,
)
from wbc_suite.typing import Indices, Matrix, Vector

Axes = Literal["local", "aligned", "world"]
"""Axes of a Jacobian: the frame's own, world axes at the frame, world at its origin."""

UNLIMITED = 1e6  # rad or m; joints with a greater limit have none

_REFERENCE = {
    "local": pin.ReferenceFrame.LOCAL,
    "aligned": pin.ReferenceFrame.LOCAL_WORLD_ALIGNED,
    "world": pin.ReferenceFrame.WORLD,
}
_ROOT_NAMES = ("root_x", "root_y", "root_yaw")


class Configuration:
    """Joint positions q with everything that follows from them.

    What follows from them is computed when it is first asked for. Twists are linear
    first, then angular. The Pinocchio model is shared, not copied.

    Attributes:
        q: Joint positions, shape (nq,), neutral by default; move them with `update`.
        arrays: What compiled kernels read and write.
        robot: The argument of kernels that stands for `arrays`.
        root_linear: Velocity indices that translate a free or planar root.
        root_angular: Velocity indices that turn a free or planar root.
    """

    def __init__(self, model: pin.Model, q: Vector | None = None) -> None:
        # A caller may pass a RobotDescription, which Pinocchio answers with a crash.
        if not isinstance(model, pin.Model):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise ConfigError(
                "Configuration needs a pinocchio.Model, such as robot.to_pinocchio(), "
                f"not {type(model).__name__}."
            )
        self.model = model
        self._data: pin.Data = model.createData()
        self.nq, self.nv = int(model.nq), int(model.nv)
        # The configurations of most robots are a vector space; others have quaternions
        # or joints that turn without end.
        self._is_vector_space = self.nq == self.nv
        self.arrays: RobotArrays = robot_arrays(model)
        self.robot = as_argument(self.arrays)
        self.q: Vector = self.arrays.q
        self._by_pinocchio = bool(
            (self.arrays.joints["kind"][1:] == JointKind.OTHER).any()
        )
        self.root_linear, self.root_angular = _root_indices(model)
        self._frame_ids = {f.name: i for i, f in enumerate(model.frames)}
        self._nframes = len(model.frames)
        self._joint_ids = {n: i for i, n in enumerate(model.names)}
        self.update(self.q if q is None else q)

    def update(self, q: Vector) -> None:
        """Move to q, shape (nq,), whose values are not checked.

        Raises:
            ConfigError: If the shape is wrong.
        """
        self.q[:] = self._checked("q", q, self.nq)
        self.refresh()

    def refresh(self) -> None:
        """Discard what was computed from q, after q itself was written to."""
        self.arrays.is_current.fill(0)
        if self._by_pinocchio:  # it has joints that the kernels do not know
            data, arrays = self.data, self.arrays
            for row, T in zip(arrays.pose, data.oMi, strict=True):
                row[:] = pack_pose(T)
            # Pinocchio gives a single column as a vector.
            arrays.jacobian[:] = data.J.reshape(6, self.nv).T
            arrays.is_current[0] = 1

    @property
    def data(self) -> pin.Data:
        """Pinocchio's data with `oMi` and `J` of the present q."""
        if not self.arrays.is_current[2]:
            pin.computeJointJacobians(self.model, self._data, self.q)
            self.arrays.is_current[2] = 1
        return self._data

    @property
    def joint_poses(self) -> Matrix:
        """Joint poses in the world, shape (njoints, 12), a view; see `pack_pose`."""
        compute_joint_poses(self.robot)
        return self.arrays.pose

    @property
    def joint_jacobians(self) -> Matrix:
        """Transposed joint Jacobians in `world` axes, shape (nv, 6), a view."""
        compute_joint_poses(self.robot)
        return self.arrays.jacobian

    def integrate(self, dq: Vector) -> Vector:
        """Return `q (+) dq`: the configuration reached by the tangent step dq (nv,)."""
        dq = self._checked("dq", dq, self.nv)
        if self._is_vector_space:
            return self.q + dq
        return pin.integrate(self.model, self.q, dq)

    def difference(self, q: Vector) -> Vector:
        """Return `q (-) self.q`, shape (nv,): the tangent step from here to q."""
        q = self._checked("q", q, self.nq)
        if self._is_vector_space:
            return q - self.q
        return pin.difference(self.model, self.q, q)

    def frame_id(self, name: str) -> int:
        """Return the index of a frame; raises UnknownNameError."""
        return look_up("frame", name, self._frame_ids)

    def joint_id(self, name: str) -> int:
        """Return the index of a joint; raises UnknownNameError."""
        return look_up("joint", name, self._joint_ids)

    def velocity_names(self) -> tuple[str, ...]:
        """Return one name for each velocity; "root[3]" for joints with several."""
        names: list[str] = []
        for name, joint in named_joints(self.model):
            many = [f"{name}[{k}]" for k in range(joint.nv)]
            names += [name] if joint.nv == 1 else many
        return tuple(names)

    def velocity_units(self) -> tuple[str, ...]:
        """Return the unit of each velocity's position: m or rad."""
        units = ["rad"] * self.nv
        linear = {JointKind.PRISMATIC.value: 1, JointKind.FREE.value: 3}
        joints = self.arrays.joints
        for kind, i in zip(joints["kind"], joints["v_start"], strict=True):
            count = linear.get(int(kind), 0)
            units[i : i + count] = ["m"] * count
        return tuple(units)

    def support(self, frame: str | int) -> Indices:
        """Return the velocity indices that move a frame, ascending, shape (n,)."""
        joint = self.model.frames[self._resolve(frame)].parentJoint
        return self.joint_support(joint)

    def joint_support(self, joint: int) -> Indices:
        """Return the velocity indices that move a joint, with its own, shape (n,)."""
        indices: list[int] = []
        for j in list(self.model.supports[joint])[1:]:  # without the universe
            first = int(self.model.joints[j].idx_v)
            indices += range(first, first + int(self.model.joints[j].nv))
        return np.array(indices, dtype=np.int64)

    def frame_pose(self, frame: str | int) -> pin.SE3:
        """Return the pose T_wf of a frame in the world, a copy."""
        k = self._resolve(frame)
        return pin.updateFramePlacement(self.model, self.data, k).copy()

    def frame_jacobian(self, frame: str | int, axes: Axes = "local") -> Matrix:
        """Return a frame's Jacobian, shape (6, nv): `J v` is its twist in the axes."""
        k = self._resolve(frame)
        reference, data = look_up("axes", axes, _REFERENCE), self.data
        pin.updateFramePlacement(self.model, data, k)
        J = pin.getFrameJacobian(self.model, data, k, reference)
        return J.reshape(6, self.nv)

    @property
    def com(self) -> Vector:
        """Centre of mass in the world, m, shape (3,). A view."""
        self._compute_com()
        return self.arrays.com

    @property
    def com_jacobian(self) -> Matrix:
        """Jacobian of the centre of mass, shape (3, nv). A view."""
        self._compute_com()
        return self.arrays.com_jacobian.T

    def _compute_com(self) -> None:
        if not self.arrays.is_current[1]:
            compute_joint_poses(self.robot)
            compute_com(self.robot)

    def _resolve(self, frame: str | int) -> int:
        """Return a frame's index; Pinocchio would read past its own memory."""
        if isinstance(frame, int) and 0 <= frame < self._nframes:
            return frame
        return self.frame_id(frame)  # type: ignore[arg-type]  # or raise

    def _checked(self, name: str, values: Vector, size: int) -> Vector:
        if type(values) is np.ndarray and values.shape == (size,):
            return values
        return check_array(f"{name} of model '{self.model.name}'", values, (size,))


def named_joints(model: pin.Model) -> list[tuple[str, pin.JointModel]]:
    """Return names and joints without Pinocchio's joint 0, the universe."""
    return list(zip(model.names, model.joints, strict=True))[1:]


def _root_indices(model: pin.Model) -> tuple[Indices, Indices]:
    """Return the linear and the angular velocity indices of the root."""
    linear: list[int] = []
    angular: list[int] = []
    for name, joint in named_joints(model):
        if joint.nv == 6:
            linear += range(joint.idx_v, joint.idx_v + 3)
            angular += range(joint.idx_v + 3, joint.idx_v + 6)
        elif name in _ROOT_NAMES:
            (angular if name == "root_yaw" else linear).append(joint.idx_v)
    return np.array(linear, dtype=np.int64), np.array(angular, dtype=np.int64)


def random_configuration(
    model: pin.Model, q: Vector, rng: np.random.Generator
) -> Vector:
    """Return q, shape (nq,), with limited joints drawn uniformly from their ranges."""
    drawn = q.copy()
    for joint in list(model.joints)[1:]:
        low = model.lowerPositionLimit[joint.idx_q]
        high = model.upperPositionLimit[joint.idx_q]
        if joint.nq == 1 and low < high < UNLIMITED:
            drawn[joint.idx_q] = rng.uniform(low, high)
    return drawn
