"""The building blocks of a robot description: links, joints, frames and the rest.

These models mirror the tables of a component's TOML file one to one; the reference of
the format is `docs/robots.md`. SI units, radians, quaternions w x y z. A link's frame
sits at its joint.
"""

import math
from typing import Annotated, Literal, TypeAlias

from pydantic import (
    AfterValidator,
    Field,
    PositiveInt,
    field_validator,
    model_validator,
)

from wbc_suite.robot.shapes import ROUNDING, Posed, Real, Shape, Vector3
from wbc_suite.tomlfile import FrozenModel

__all__ = [
    "Actuator",
    "Camera",
    "Connect",
    "Contacts",
    "Frame",
    "Joint",
    "Link",
    "Mimic",
    "Mount",
    "Name",
    "Root",
    "Sensor",
    "Synergy",
]

Name: TypeAlias = Annotated[
    str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=80)
]
Range: TypeAlias = tuple[Real, Real]
Positive: TypeAlias = Annotated[float, Field(gt=0.0, le=1e9)]
NotNegative: TypeAlias = Annotated[float, Field(ge=0.0, le=1e9)]
Command: TypeAlias = Annotated[float, Field(ge=-1.0, le=1.0)]
Moment: TypeAlias = Annotated[float, Field(ge=-1e6, le=1e6)]


def _rising(limits: Range) -> Range:
    if not limits[0] < limits[1]:
        raise ValueError(f"the lower end {limits[0]} must be below {limits[1]}")
    return limits


Limits: TypeAlias = Annotated[Range, AfterValidator(_rising)]


class Mimic(FrozenModel):
    """A joint that follows another: `q = ratio * q_joint + offset`.

    Attributes:
        joint: The joint that leads.
        ratio: How far this one turns (or slides) for each unit of the leader.
        offset: Where it stands when the leader is at zero.
        closed: Whether a `[[connect]]` holds the joint in MuJoCo. The relation is then
            written for engines without loops, and MuJoCo gets no second constraint.
    """

    joint: Name
    ratio: Real = 1.0
    offset: Real = 0.0
    closed: bool = False


class Joint(FrozenModel):
    """One degree of freedom between a link and its parent.

    Attributes:
        name: Unique name.
        type: `hinge` (radians) or `slide` (metres).
        axis: Axis in the link's frame; normalised on reading.
        range: Position limits; absent for a joint that turns without end.
        velocity: Largest speed, rad/s or m/s.
        acceleration: Largest acceleration, rad/s^2 or m/s^2; optional.
        effort: Largest torque or force, N m or N; a joint without has no motor.
        armature: Rotor inertia seen at the joint, kg m^2 or kg.
        damping: Viscous friction, N m s/rad or N s/m (MuJoCo only).
        frictionloss: Dry friction, N m or N (MuJoCo only).
        mimic: The joint that this one follows.
        passive: A joint without a motor that belongs to no group, such as a caster.
    """

    name: Name
    type: Literal["hinge", "slide"] = "hinge"
    axis: Vector3 = (0.0, 0.0, 1.0)
    range: Limits | None = None
    velocity: Positive | None = None
    acceleration: Positive | None = None
    effort: Positive | None = None
    armature: NotNegative = 0.0
    damping: NotNegative = 0.0
    frictionloss: NotNegative = 0.0
    mimic: Mimic | None = None
    passive: bool = False

    @field_validator("axis")
    @classmethod
    def _normalise_axis(cls, axis: Vector3) -> Vector3:
        norm = math.hypot(*axis)
        if abs(norm - 1.0) > 1e-3:
            raise ValueError(f"an axis must have length 1, this has {norm:.6g}")
        if abs(norm - 1.0) < ROUNDING:
            return axis
        x, y, z = (component / norm for component in axis)
        return (x, y, z)


class Link(Posed):
    """A rigid body; `pos` and `quat` place its frame in its parent's frame.

    Attributes:
        name: Unique name.
        parent: Parent link; absent for the root of a component.
        mass: Mass in kg; a link with a joint needs one.
        com: Centre of mass in the link's frame, m.
        inertia: Inertia about the centre of mass in the link's axes, kg m^2, in the
            order xx yy zz xy xz yz.
        joint: Joint to the parent; absent for a fixed link.
        visual: Shapes to draw.
        collision: Shapes to collide with (primitives and hulls).
        accept: Plausibility rules (`com`, `inertia`) that this link may break, with
            the reason in words.
    """

    name: Name
    parent: Name | None = None
    mass: NotNegative = 0.0
    com: Vector3 = (0.0, 0.0, 0.0)
    inertia: tuple[Moment, Moment, Moment, Moment, Moment, Moment] = (0, 0, 0, 0, 0, 0)
    joint: Joint | None = None
    visual: tuple[Shape, ...] = ()
    collision: tuple[Shape, ...] = ()
    accept: dict[Literal["com", "inertia"], str] = {}


class Frame(Posed):
    """A named pose on a link: where tasks act, grippers grasp and sensors sit."""

    name: Name
    link: Name
    role: Literal[
        "eef", "tcp", "foot", "head", "torso", "base", "tip", "imu", "wrist", "other"
    ] = "other"


class Mount(Posed):
    """A named place on a link where another component can be mounted."""

    name: Name
    link: Name


class Camera(Posed):
    """A camera; it looks along its -z axis with y up, as in MuJoCo.

    Attributes:
        name: Unique name.
        link: Link that carries it.
        fovy: Vertical field of view, degrees (MuJoCo's own unit for it).
        resolution: Width and height in pixels.
    """

    name: Name
    link: Name
    fovy: float = Field(default=45.0, gt=1.0, lt=175.0)
    resolution: tuple[PositiveInt, PositiveInt] = (640, 480)


class Actuator(FrozenModel):
    """A motor that differs from the default, which is one torque motor per joint.

    Attributes:
        joint: Joint that it drives.
        kind: `motor` takes a torque, `position` a set point with gains kp and kd,
            `velocity` a speed with gain kd.
        kp: Stiffness, N m/rad or N/m.
        kd: Damping, N m s/rad or N s/m.
        effort: Largest effort; the joint's own when absent.
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
    """One command of a gripper that moves joints together from open to closed.

    Attributes:
        name: Unique name within the gripper.
        gripper: The gripper; only a component with several needs to say. In an assembly
            a gripper is called like its part.
        open: Joint values when open.
        closed: The same joints' values when closed.
        grasps: Commands (-1 open to 1 closed) before and after closing, by the name of
            a grasp, such as `pinch`; from -1 to 1 where a grasp is not named. A frame
            of that name tells where: z is the way of approach, fingers close along y
            and a bar is grasped along x. Without such a frame it is the `tcp`.
    """

    name: Name
    gripper: Name = "gripper"
    open: dict[Name, Real]
    closed: dict[Name, Real]
    grasps: dict[Name, tuple[Command, Command]] = {}

    @model_validator(mode="after")
    def _same_joints(self) -> "Synergy":
        if set(self.open) != set(self.closed) or not self.open:
            raise ValueError("'open' and 'closed' must give the same joints")
        return self


class Connect(FrozenModel):
    """Two links pinned together at a point, closing a loop (MuJoCo only)."""

    link: Name
    other: Name
    anchor: Vector3


class Contacts(FrozenModel):
    """Which pairs of links never collide with each other."""

    exclude: tuple[tuple[Name, Name], ...] = ()


class Root(Posed):
    """How the robot's first link stands in the world.

    Attributes:
        kind: `fixed`; `planar` (slides along x and y, turns about z); `free`.
        drive: Whether a planar base may move sideways (`holonomic`) or not
            (`differential`).
        actuated: Whether the planar joints have motors.
        velocity: Speed limits of a moving root, m/s and rad/s.
        effort: Force and torque limits of an actuated planar root, N and N m.
        damping: Viscous friction of planar joints, N s/m and N m s/rad.
    """

    kind: Literal["fixed", "planar", "free"] = "fixed"
    drive: Literal["holonomic", "differential"] = "holonomic"
    actuated: bool = True
    velocity: tuple[Positive, Positive] = (1.0, 1.5)
    effort: tuple[Positive, Positive] = (2000.0, 1000.0)
    damping: tuple[NotNegative, NotNegative] = (0.0, 0.0)
