"""Controlled frames, their kinds, and where to register one's own.

A kind defines which components of a pose a slice of the action commands. The classes
below are registered like one's own: by `register_frame_kind`.
"""

from collections.abc import Sequence
from typing import Annotated, ClassVar, TypeVar

import numpy as np
import pinocchio as pin
from pydantic import (
    AfterValidator,
    Field,
    NonNegativeFloat,
    PositiveFloat,
    model_validator,
)

from wbc_suite.config_files import FrozenModel
from wbc_suite.control.action import FULL_TURN, ActionPart, Axis, SliceKind, Unit
from wbc_suite.control.part.part_settings import InputFrame, InputType, check_axes
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.qp import ComTask, FrameTask
from wbc_suite.registry import Registry
from wbc_suite.robot.elements import Name
from wbc_suite.typing import Matrix, Vector

MAX_POSITION = 10.0
"""Bound of absolute positions, m: no robot here reaches farther."""

NO_SPEED_LIMIT = 1e3
"""m/s and rad/s; the speeds of targets are bounded elsewhere."""

AXES = (Axis.X, Axis.Y, Axis.Z, Axis.RX, Axis.RY, Axis.RZ)
"""Components of a pose's error: position, and rotation vector, rad."""

GoalTask = FrameTask | ComTask
"""QP tasks of the kinds here."""

Kind = TypeVar("Kind", bound="FrameKind")


class FrameKind:
    """Commands some components of a frame's pose.

    Values of a slice are `x`, `y`, `z` (m), and either `rx`, `ry`, `rz` (a rotation
    vector, rad) or `yaw` (rad). Subclasses set the attributes, and override the methods
    whose meaning differs.

    Attributes:
        name: Name in controller files, `kind = "..."`.
        labels: Components that a slice commands, in order.
        slice_kind: How the action layout classifies the slice.
        needs_frame: Whether it is the kind of a frame or link of the robot.
    """

    name: ClassVar[str]
    labels: ClassVar[tuple[str, ...]]
    slice_kind: ClassVar[SliceKind] = SliceKind.POSE
    needs_frame: ClassVar[bool] = True

    @property
    def counted(self) -> tuple[bool, ...]:
        """Which components of the error (world position, own rotation) count, (6,)."""
        labels = ["rz" if label == "yaw" else label for label in self.labels]
        return tuple(axis in labels for axis in AXES)

    def action_part(
        self, frame: "ControlledFrame", config: "GoalsConfig"
    ) -> ActionPart:
        """Return the slice of a frame of this kind."""
        absolute = config.input_type == "absolute"
        far = MAX_POSITION if absolute else config.delta_position
        turn = FULL_TURN if absolute else config.delta_rotation
        linear = [label in AXES[:3] for label in self.labels]
        bounds = tuple(far if is_linear else turn for is_linear in linear)
        return ActionPart(
            name=frame.name,
            kind=self.slice_kind,
            labels=self.labels,
            units=tuple(Unit("m" if is_linear else "rad") for is_linear in linear),
            low=tuple(-bound for bound in bounds),
            high=bounds,
            wraps=absolute,
        )

    def values(self, pose: pin.SE3) -> Vector:
        """Return the absolute values that command a pose."""
        x, y, z = pose.translation
        rx, ry, rz = pin.log3(pose.rotation)
        yaw = np.arctan2(pose.rotation[1, 0], pose.rotation[0, 0])
        known = {"x": x, "y": y, "z": z, "rx": rx, "ry": ry, "rz": rz, "yaw": yaw}
        return np.array([known[label] for label in self.labels])

    def pose(self, values: Vector, now: pin.SE3) -> pin.SE3:
        """Return the pose that absolute values command.

        The present goal gives the components that are not commanded.
        """
        given = dict(zip(self.labels, values.tolist(), strict=True))
        xyz = now.translation.tolist()
        position = [given.get(label, xyz[k]) for k, label in enumerate("xyz")]
        rotates = any(label not in "xyz" for label in given)
        turned = pin.exp3(_rotation_vector(given)) if rotates else now.rotation.copy()
        return pin.SE3(turned, np.array(position))

    def moved(self, values: Vector, goal: pin.SE3, axes: Matrix) -> pin.SE3:
        """Return a goal moved by a delta slice, in the given axes, shape (3, 3)."""
        given = dict(zip(self.labels, values.tolist(), strict=True))
        step = np.array([given.get(label, 0.0) for label in "xyz"])
        rotation = pin.exp3(axes @ _rotation_vector(given)) @ goal.rotation
        return pin.SE3(rotation, goal.translation + axes @ step)

    def task(self, frame: "ControlledFrame") -> GoalTask:
        """Return the QP task of a frame of this kind."""
        assert frame.frame is not None
        position, orientation = self.costs(frame)
        return FrameTask(
            frame.frame,
            position_cost=position,
            orientation_cost=orientation,
            gain=frame.gain,
            level=frame.level,
            max_linear_speed=NO_SPEED_LIMIT,
            max_angular_speed=NO_SPEED_LIMIT,
            name=frame.name,
        )

    def costs(self, frame: "ControlledFrame") -> tuple[Vector, Vector]:
        """Return costs of position (world axes) and orientation (the frame's axes)."""
        counted = np.array(self.counted, dtype=float)
        return frame.position_cost * counted[:3], frame.orientation_cost * counted[3:]


def _rotation_vector(values: dict[str, float]) -> Vector:
    turn = [values.get(label, 0.0) for label in AXES[3:]]
    turn[2] += values.get("yaw", 0.0)
    return np.array(turn)


def _check(name: str, kind: FrameKind) -> None:
    known: Sequence[str] = (*AXES, "yaw")
    for label in kind.labels:
        if label not in known:
            raise ConfigError(f"{name}: {UnknownNameError('component', label, known)}")


FRAME_KINDS: Registry[FrameKind] = Registry("kind of controlled frame", check=_check)
"""Kinds of controlled frames by name."""


def register_frame_kind(kind: type[Kind], *, replace: bool = False) -> type[Kind]:
    """Register a class of `FrameKind` under its name; also as a decorator.

    Raises:
        ConfigError: If name or labels are missing, the name is taken, or a label is
            unknown.
    """
    if missing := [x for x in ("name", "labels") if not hasattr(kind, x)]:
        raise ConfigError(
            f"{kind.__name__}: a kind of controlled frame needs "
            f"{' and '.join(missing)}."
        )
    FRAME_KINDS.register(kind.name, kind(), replace=replace)
    return kind


def _registered(kind: str) -> str:
    try:
        return FRAME_KINDS.spelled(kind)
    except UnknownNameError as error:
        raise ValueError(str(error)) from error


class ControlledFrame(FrozenModel):
    """A frame that an action slice moves.

    Attributes:
        name: Name of the slice.
        frame: Frame or link of the robot; absent for the centre of mass.
        kind: A registered kind: `pose`, `position`, `orientation`, `com`, `base` (x, y
            and yaw), or one's own; see `frame_kinds`.
        position_cost: [cost]/m.
        orientation_cost: [cost]/rad.
        gain: Fraction of the error that one solve removes, (0, 1].
        level: Strict priority, 0 first.
        max_linear_speed: Greatest speed asked for, m/s.
        max_angular_speed: Greatest angular speed asked for, rad/s.
        linear_braking: Deceleration towards the goal, m/s^2.
        angular_braking: Deceleration towards the goal, rad/s^2.
        range: How far from its pose at reset the frame may be sent, m and rad; goals
            beyond are brought back to there. Keeps a standing robot on its feet.
    """

    name: Name
    frame: Name | None = None
    kind: Annotated[str, AfterValidator(_registered)] = "pose"
    position_cost: NonNegativeFloat = 1.0
    orientation_cost: NonNegativeFloat = 1.0
    gain: float = Field(default=0.5, gt=0.0, le=1.0)
    level: int = Field(default=0, ge=0, le=3)
    max_linear_speed: PositiveFloat = 2.0
    max_angular_speed: PositiveFloat = 6.0
    linear_braking: PositiveFloat = 4.0
    angular_braking: PositiveFloat = 12.0
    range: tuple[PositiveFloat, PositiveFloat] | None = None

    @model_validator(mode="after")
    def _frame_given(self) -> "ControlledFrame":
        if (self.frame is not None) != self.behaviour.needs_frame:
            rule = "is needed" if self.behaviour.needs_frame else "must be absent"
            raise ValueError(f"'frame' {rule} for kind '{self.kind}'")
        return self

    @property
    def behaviour(self) -> FrameKind:
        """What frames of the kind have in common."""
        return FRAME_KINDS[self.kind]


class GoalsConfig(FrozenModel):
    """Controlled frames, and how an action moves their goals.

    Attributes:
        frames: Controlled frames, in the order of the action.
        input_type: `absolute` targets, or `delta` steps from the last target.
        input_ref_frame: Axes of targets and steps: `world`, the robot's `base`, or the
            controlled frame's own (`eef`, deltas only).
        delta_position: Largest step of a delta action, m.
        delta_rotation: Largest step of a delta action, rad.
    """

    frames: tuple[ControlledFrame, ...] = Field(default=(), alias="frame")
    input_type: InputType = "absolute"
    input_ref_frame: InputFrame = "world"
    delta_position: PositiveFloat = 0.05
    delta_rotation: PositiveFloat = 0.5

    @model_validator(mode="after")
    def _consistent(self) -> "GoalsConfig":
        names = [frame.name for frame in self.frames]
        if len({*names}) != len(names):
            raise ValueError(f"controlled frames share a name: {names}")
        check_axes(self.input_type, self.input_ref_frame)
        return self


def set_target(task: GoalTask, row: Vector) -> None:
    """Set a pose in the world as the target of a kind's task: [R p], shape (12,)."""
    task.target_row.set(row if isinstance(task, FrameTask) else row[3::4])


@register_frame_kind
class Pose(FrameKind):
    """Position and orientation of a frame."""

    name = "pose"
    labels = AXES


@register_frame_kind
class Position(FrameKind):
    """Position of a frame; its orientation is free."""

    name = "position"
    labels = AXES[:3]
    slice_kind = SliceKind.POSITION


@register_frame_kind
class Orientation(FrameKind):
    """Orientation of a frame; its position is free."""

    name = "orientation"
    labels = AXES[3:]
    slice_kind = SliceKind.ORIENTATION


@register_frame_kind
class Base(FrameKind):
    """Place on the floor and heading of a frame."""

    name = "base"
    labels = (Axis.X, Axis.Y, Axis.YAW)
    slice_kind = SliceKind.BASE


@register_frame_kind
class CentreOfMass(FrameKind):
    """Position of the robot's centre of mass."""

    name = "com"
    labels = AXES[:3]
    slice_kind = SliceKind.POSITION
    needs_frame = False

    def task(self, frame: "ControlledFrame") -> GoalTask:
        """Return the QP task of the centre of mass."""
        return ComTask(
            frame.position_cost,
            gain=frame.gain,
            level=frame.level,
            max_speed=NO_SPEED_LIMIT,
            name=frame.name,
        )
