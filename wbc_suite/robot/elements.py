"""The elements of a robot description: links, joints, frames and the others.

Each model is one table of a component's TOML file; `docs/robots.md` is the reference of
the format. SI units, radians, quaternions w x y z. A link's frame is at its joint.
"""

from collections.abc import Sequence
from functools import cached_property
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    PositiveInt,
    model_validator,
)

from wbc_suite.config_files import FrozenModel
from wbc_suite.robot.shapes import Axis, Posed, Quaternion, Real, Shape, Vector3

Name: TypeAlias = Annotated[
    str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=80)
]
Range: TypeAlias = tuple[Real, Real]
Positive: TypeAlias = Annotated[float, Field(gt=0.0, le=1e9)]
NotNegative: TypeAlias = Annotated[float, Field(ge=0.0, le=1e9)]
Command: TypeAlias = Annotated[float, Field(ge=-1.0, le=1.0)]
Moment: TypeAlias = Annotated[float, Field(ge=-1e6, le=1e6)]
Channel: TypeAlias = Annotated[float, Field(ge=0.0, le=1.0)]
Rgb: TypeAlias = tuple[Channel, Channel, Channel]


def _with_alpha(color: Any) -> Any:
    """Append alpha 1 to a colour of three channels."""
    match color:
        case [red, green, blue]:
            return (red, green, blue, 1.0)
        case _:
            return color


Rgba: TypeAlias = Annotated[
    tuple[Channel, Channel, Channel, Channel],
    BeforeValidator(
        _with_alpha,
        json_schema_input_type=Rgb | tuple[Channel, Channel, Channel, Channel],
    ),
]
"""Red green blue alpha from 0 to 1; files may leave out alpha."""


def _rising(limits: Range) -> Range:
    if not limits[0] < limits[1]:
        raise ValueError(f"the lower limit {limits[0]} must be below {limits[1]}")
    return limits


Limits: TypeAlias = Annotated[Range, AfterValidator(_rising)]


class Mimic(FrozenModel):
    """A joint that follows another: `q = ratio * q_joint + offset`.

    If it is `closed`, a `[[connect]]` enforces the relation in MuJoCo, which gets no
    second constraint; other engines use this relation.
    """

    joint: Name
    ratio: Real = 1.0
    offset: Real = 0.0
    closed: bool = False


class Joint(FrozenModel):
    """One degree of freedom between a link and its parent.

    Units are rad and N m for a hinge, m and N for a slide; limits may be absent.

    Attributes:
        axis: Axis in the link's frame; normalised on reading.
        effort: Largest torque or force; a joint without effort has no motor.
        armature: Rotor inertia seen at the joint, kg m^2 or kg.
        damping: Viscous friction (MuJoCo only).
        frictionloss: Dry friction (MuJoCo only).
        stiffness: Of a spring that acts towards `springref` (MuJoCo only).
        passive: A joint without motor that belongs to no group, such as a caster.
    """

    name: Name
    type: Literal["hinge", "slide"] = "hinge"
    axis: Axis = (0.0, 0.0, 1.0)
    range: Limits | None = None
    velocity: Positive | None = None
    acceleration: Positive | None = None
    effort: Positive | None = None
    armature: NotNegative = 0.0
    damping: NotNegative = 0.0
    frictionloss: NotNegative = 0.0
    stiffness: NotNegative = 0.0
    springref: Real = 0.0
    mimic: Mimic | None = None
    passive: bool = False

    @property
    def independent(self) -> bool:
        """Whether the joint follows no other and is not passive."""
        return self.mimic is None and not self.passive


class Link(Posed):
    """A rigid body; `pos` and `quat` place its frame in its parent's frame.

    Attributes:
        parent: Parent link; absent for the root of a component.
        mass: Mass in kg; a link with a joint needs one.
        com: Centre of mass in the link's frame, m.
        inertia: Inertia about the centre of mass in the link's axes, kg m^2, in the
            order xx yy zz xy xz yz.
        joint: Joint to the parent; absent for a fixed link.
        collision: Shapes to collide with (primitives and hulls).
        gravcomp: Part of the weight that MuJoCo cancels (MuJoCo only).
        accept: Plausibility rules (`com`, `inertia`) that this link may violate, each
            with the reason.
    """

    name: Name
    parent: Name | None = None
    mass: NotNegative = 0.0
    com: Vector3 = (0.0, 0.0, 0.0)
    inertia: tuple[Moment, Moment, Moment, Moment, Moment, Moment] = (0, 0, 0, 0, 0, 0)
    joint: Joint | None = None
    visual: tuple[Shape, ...] = ()
    collision: tuple[Shape, ...] = ()
    gravcomp: Real = 0.0
    accept: dict[Literal["com", "inertia"], str] = {}


class Frame(Posed):
    """A named pose on a link, for tasks, grasps and sensors."""

    name: Name
    link: Name
    role: Literal[
        "eef", "tcp", "foot", "head", "torso", "base", "tip", "imu", "wrist", "other"
    ] = "other"


class Mount(Posed):
    """A named pose on a link where another component can be mounted."""

    name: Name
    link: Name


class Camera(Posed):
    """A camera; it looks along -z with y up and a vertical field of view in degrees."""

    name: Name
    link: Name
    fovy: float = Field(default=45.0, gt=1.0, lt=175.0)
    resolution: tuple[PositiveInt, PositiveInt] = (640, 480)


class Actuator(FrozenModel):
    """An actuator that differs from the default of one torque motor per joint.

    A `motor` takes a torque, `position` a setpoint with gains kp and kd, `velocity` a
    speed with gain kd. The effort limit is the joint's own when absent.
    """

    joint: Name
    kind: Literal["motor", "position", "velocity"]
    kp: NotNegative = 0.0
    kd: NotNegative = 0.0
    effort: Positive | None = None


class Sensor(FrozenModel):
    """A sensor at a frame, read from MuJoCo under its own name."""

    name: Name
    kind: Literal["force", "torque", "gyro", "accelerometer", "touch"]
    frame: Name
    noise: NotNegative = 0.0


class Synergy(FrozenModel):
    """One gripper command that moves several joints from open to closed.

    In an assembly a gripper has the name of its part.

    Attributes:
        grasps: Commands (-1 open to 1 closed) before and after closing, by name of a
            grasp, such as `pinch`; -1 and 1 for other grasps. The frame of the same
            name, or else the `tcp`, gives the pose: the gripper approaches along z,
            fingers close along y and a bar lies along x.
        reason: Why the values are these, if they were inferred.
    """

    name: Name
    gripper: Name = "gripper"
    open: dict[Name, Real]
    closed: dict[Name, Real]
    grasps: dict[Name, tuple[Command, Command]] = {}
    reason: str = ""

    @model_validator(mode="after")
    def _same_joints(self) -> "Synergy":
        if set(self.open) != set(self.closed) or not self.open:
            raise ValueError("'open' and 'closed' must have the same joints")
        return self


class Connect(FrozenModel):
    """A ball joint between two links that closes a loop (MuJoCo only).

    With `quat`, the orientation of `other` in `link`, the two are welded, and `anchor`
    is the position of `other` in `link`.
    """

    link: Name
    other: Name
    anchor: Vector3
    quat: Quaternion | None = None


class TendonStep(FrozenModel):
    """A joint with its coefficient, or a frame that a tendon passes."""

    joint: Name | None = None
    coef: Real = 1.0
    frame: Name | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> "TendonStep":
        if (self.joint is None) == (self.frame is None):
            raise ValueError("give either 'joint' or 'frame'")
        return self


class Tendon(FrozenModel):
    """A weighted sum of joints, or a string through frames (MuJoCo only).

    Attributes:
        range: Smallest and largest length, m or rad.
        springlength: Lengths between which the spring has no force.
        held: Where given, the length is constant: this much more than at zero.
    """

    name: Name
    path: tuple[TendonStep, ...] = Field(min_length=1)
    range: Limits | None = None
    stiffness: NotNegative = 0.0
    damping: NotNegative = 0.0
    frictionloss: NotNegative = 0.0
    springlength: Range | None = None
    held: Real | None = None


class Wheel(FrozenModel):
    """A wheel that drives the robot, see `robot.wheel_drive`.

    Attributes:
        joint: Hinge of the wheel, with an actuator of kind `velocity`.
        radius: m.
        roller: Angle about the vertical from the direction in which the wheel rolls to
            the axis of the roller on the ground, rad: 0 of an omnidirectional wheel,
            +-pi/4 of a mecanum wheel; none for a tyre.
        steering: Hinge that steers the wheel, if one does, with an actuator of kind
            `position`.
    """

    joint: Name
    radius: Positive
    roller: Real | None = None
    steering: Name | None = None


class Contacts(FrozenModel):
    """Pairs of links that never collide with each other."""

    exclude: tuple[tuple[Name, Name], ...] = ()


class Root(Posed):
    """Connection of the robot's first link to the world.

    Limits and damping are for moving and turning: m/s and rad/s, N and N m, N s/m and
    N m s/rad. A planar base that is not `holonomic` cannot move sideways.
    """

    kind: Literal["fixed", "planar", "free"] = "fixed"
    drive: Literal["holonomic", "differential"] = "holonomic"
    actuated: bool = True
    velocity: tuple[Positive, Positive] = (1.0, 1.5)
    effort: tuple[Positive, Positive] = (2000.0, 1000.0)
    damping: tuple[NotNegative, NotNegative] = (0.0, 0.0)

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The joints of a planar root (x, y, yaw); none for other kinds."""
        if self.kind != "planar":
            return ()
        return tuple(
            Joint(
                name=name,
                type="hinge" if k else "slide",
                axis=axis,
                velocity=self.velocity[k],
                effort=self.effort[k],
                damping=self.damping[k],
            )
            for name, axis, k in (
                ("root_x", (1.0, 0.0, 0.0), 0),
                ("root_y", (0.0, 1.0, 0.0), 0),
                ("root_yaw", (0.0, 0.0, 1.0), 1),
            )
        )


UrdfRoot: TypeAlias = Literal["none", "fixed", "planar", "floating"]
"""URDF joint between a link `world` and the first; `none` leaves both to the reader."""


class Elements(FrozenModel):
    """The elements of a component and of a robot; keys of tables are singular."""

    materials: dict[Name, Rgba] = {}
    links: tuple[Link, ...] = Field(alias="link")
    frames: tuple[Frame, ...] = Field(default=(), alias="frame")
    mounts: tuple[Mount, ...] = Field(default=(), alias="mount")
    cameras: tuple[Camera, ...] = Field(default=(), alias="camera")
    actuators: tuple[Actuator, ...] = Field(default=(), alias="actuator")
    sensors: tuple[Sensor, ...] = Field(default=(), alias="sensor")
    connects: tuple[Connect, ...] = Field(default=(), alias="connect")
    tendons: tuple[Tendon, ...] = Field(default=(), alias="tendon")
    wheels: tuple[Wheel, ...] = Field(default=(), alias="wheel")
    groups: dict[Name, tuple[Name, ...]] = {}
    keyframes: dict[Name, dict[Name, float]] = Field(default={}, alias="keyframe")
    contacts: Contacts = Contacts()
    root: Root = Root()

    @cached_property
    def joints(self) -> tuple[Joint, ...]:
        """All joints except the root's, in the order of both engines."""
        return tuple(link.joint for link in self.links if link.joint is not None)

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Names of `joints`."""
        return tuple(joint.name for joint in self.joints)


def rigid_bodies(links: Sequence[Link]) -> dict[str, str]:
    """Map each link to the moving (or first) link that it is rigidly fixed to."""
    owner: dict[str, str] = {}
    for link in links:
        fixed = link.joint is None and link.parent in owner
        owner[link.name] = owner[str(link.parent)] if fixed else link.name
    return owner
