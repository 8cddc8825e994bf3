"""The drive of a robot on wheels: its kind, and wheel speeds for a twist of the base.

The base is the robot's first link, with x ahead and z up. A wheel at the contact point
p rolls along the unit vector f and grips along r. That is the axis of the roller on the
ground for an omnidirectional or mecanum wheel, and f for a tyre. Without slip

    v(p) . r = radius * speed * (f . r),    v(p) = (v_x - w p_y, v_y + w p_x),

and a tyre does not move along its axle. Where tyres have to scrub (skid steering) the
twist is the one with the least sum of squares of the slip: with equal loads and Coulomb
friction wheels at speeds +-u on a rectangle of length l and width b turn at the rate
`2 u / (b (1 + (l / b)^2))`. Source: Campion, Bastin, D'Andrea-Novel (1996), "Structural
Properties and Classification of Kinematic and Dynamic Models of Wheeled Mobile Robots",
IEEE Transactions on Robotics and Automation 12(1).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import Literal

import numpy as np
import pinocchio as pin

from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import Link, Wheel, rigid_bodies
from wbc_suite.robot.poses import joint_motion, poses_in_rigid_bodies, se3_of
from wbc_suite.robot.shape_geometry import hull_spheres
from wbc_suite.typing import Matrix, Vector

WHEELS = "wheels"
"""Group of the joints of wheels and of their steering."""
PARALLEL = 0.985  # least cosine between parallel axles: 10 degrees
STILL = 1e-3  # m/s; a steered wheel that moves more slowly keeps its direction
FAR = 1e3  # m; radius of a curve that counts as straight


class DriveKind(StrEnum):
    """How a robot on wheels drives."""

    DIFFERENTIAL = "differential"
    SKID = "skid steering"
    OMNI = "omnidirectional"
    MECANUM = "mecanum"
    CAR = "car-like"
    SWERVE = "swerve"

    @property
    def is_holonomic(self) -> bool:
        """Whether the base can move sideways."""
        return self in (DriveKind.OMNI, DriveKind.MECANUM, DriveKind.SWERVE)


def placed(
    links: Sequence[Link], values: dict[str, float] | None = None
) -> dict[str, pin.SE3]:
    """Return the poses of links in the first one; joints have values, rad or m, or 0.

    Followers move with their leaders.
    """
    given = values or {}
    poses: dict[str, pin.SE3] = {}
    for link in links:
        pose = poses[link.parent] * se3_of(link) if link.parent else pin.SE3.Identity()
        joint = link.joint
        if joint is not None:
            value = given.get(joint.name, 0.0)
            if joint.mimic is not None:
                leader = given.get(joint.mimic.joint, 0.0)
                value = joint.mimic.ratio * leader + joint.mimic.offset
            slide = joint.type == "slide"
            pose = pose * joint_motion(np.asarray(joint.axis), value, slide=slide)
        poses[link.name] = pose
    return poses


@dataclass(frozen=True, kw_only=True, slots=True)
class _Steering:
    """A hinge that steers: its name, place (2,), sense about z, value at `ready`."""

    joint: str
    place: Vector
    sense: float
    ready: float
    limits: tuple[float, float]


class WheelDrive:
    """The wheels of a robot in its posture `ready`, in the axes of its first link.

    Attributes:
        wheels: The wheels, n.
        places: Contact points x y, shape (n, 2), m.
        rolling: Directions in which the wheels roll at positive speed, shape (n, 2).
        steering: Names of the joints that steer.
    """

    def __init__(self, robot: RobotDescription) -> None:
        self.wheels: tuple[Wheel, ...] = robot.wheels
        ready = robot.keyframes.get("ready", {})
        poses = placed(robot.links, ready)
        links = {x.joint.name: x for x in robot.links if x.joint is not None}
        self.places: Matrix = np.zeros((len(self.wheels), 2))
        self.rolling: Matrix = np.zeros((len(self.wheels), 2))
        found: dict[str, _Steering] = {}
        bodies = rigid_spheres(robot.links, "collision")
        drawn = rigid_spheres(robot.links, "visual")
        for k, wheel in enumerate(self.wheels):
            link = links[wheel.joint]
            axis = poses[link.name].rotation @ np.asarray(link.joint.axis)  # pyright: ignore[reportOptionalMemberAccess]
            ahead = np.cross(axis, (0.0, 0.0, 1.0))[:2]
            self.rolling[k] = ahead / np.linalg.norm(ahead)
            own = bodies[link.name] if len(bodies[link.name]) else drawn[link.name]
            along = own[:, :3] @ link.joint.axis  # pyright: ignore[reportOptionalMemberAccess]
            middle = (along.min() + along.max()) / 2.0 if len(own) else 0.0
            self.places[k] = (poses[link.name].translation + middle * axis)[:2]
            if wheel.steering is not None:
                found[wheel.steering] = _steering(
                    links[wheel.steering], poses, ready.get(wheel.steering, 0.0)
                )
        self._steering = found
        self.steering: tuple[str, ...] = tuple(found)
        self._radii: Vector = np.array([wheel.radius for wheel in self.wheels])

    @cached_property
    def kind(self) -> DriveKind:
        """What the wheels' axles and rollers make of them."""
        if self.steering:
            is_car = any(wheel.steering is None for wheel in self.wheels)
            return DriveKind.CAR if is_car else DriveKind.SWERVE
        parallel = bool(np.all(np.abs(self.rolling @ self.rolling[0]) > PARALLEL))
        grips = np.linalg.matrix_rank(self._gripping_rows(self._gripping()), tol=1e-6)
        if any(wheel.roller is not None for wheel in self.wheels) and grips == 3:
            return DriveKind.MECANUM if parallel else DriveKind.OMNI
        along = self.places @ self.rolling[0]
        coaxial = np.ptp(along) < self._radii.min()
        return DriveKind.DIFFERENTIAL if coaxial else DriveKind.SKID

    @property
    def radius(self) -> float:
        """Mean radius of the wheels, m."""
        return float(self._radii.mean())

    @property
    def track(self) -> float:
        """Distance of the outermost wheels across the direction of driving, m.

        It is the diameter of the circle through the wheels where axles cross.
        """
        if self.kind is DriveKind.OMNI:
            away = self.places - self.places.mean(axis=0)
            return 2.0 * float(np.linalg.norm(away, axis=1).mean())
        return float(np.ptp(self.places[:, 1]))

    @property
    def wheelbase(self) -> float:
        """Distance of the outermost wheels along the direction of driving, m."""
        return float(np.ptp(self.places[:, 0]))

    def __str__(self) -> str:
        text = (
            f"{self.kind} on {len(self.wheels)} wheels of radius "
            f"{1e3 * self.radius:.0f} mm, track {1e3 * self.track:.0f} mm"
        )
        if self.wheelbase > self.radius and self.kind is not DriveKind.OMNI:
            text += f", wheelbase {1e3 * self.wheelbase:.0f} mm"
        if self.kind is DriveKind.CAR:
            text += f", curves of {self.turning_radius:.2f} m and more"
        return text

    def feasible(self, twist: Vector) -> Vector:
        """Return the nearest twist (3,) that the steering allows: x, y, turn.

        A car does not move sideways, and turns by what its speed and its greatest
        steering angle give.
        """
        twist = np.array(twist, dtype=np.float64)
        if self.kind is not DriveKind.CAR:
            return twist
        twist[1] = 0.0
        most = abs(twist[0]) / self.turning_radius
        twist[2] = np.clip(twist[2], -most, most)
        return twist

    @cached_property
    def turning_radius(self) -> float:
        """Radius of a car's tightest curve, of its first link, m; 0 of others."""
        if self.kind is not DriveKind.CAR:
            return 0.0
        radii: list[float] = [1.0 / FAR]
        for steering in self._steering.values():
            x, y = steering.place
            for limit in steering.limits:
                angle = np.clip(abs(limit - steering.ready), 0.0, np.pi / 2.0)
                radii.append(abs(x) / np.tan(angle) + abs(y) if angle > 0.0 else FAR)
        return float(max(radii))

    def steered(self, twist: Vector, now: Vector) -> Vector:
        """Return the steering joints' values (m,) for a twist (3,), rad.

        Wheels that would stand still keep the values of `now`. A wheel may roll
        backward, so that no joint turns by more than a quarter from `ready`.
        """
        wanted = np.array(now, dtype=np.float64)
        for k, (name, own) in enumerate(self._steering.items()):
            x, y = own.place
            move = np.array([twist[0] - twist[2] * y, twist[1] + twist[2] * x])
            if np.linalg.norm(move) < STILL:
                continue
            wheel = next(i for i, w in enumerate(self.wheels) if w.steering == name)
            ahead = self.rolling[wheel]
            angle = np.arctan2(ahead[0] * move[1] - ahead[1] * move[0], ahead @ move)
            angle = (angle + np.pi / 2.0) % np.pi - np.pi / 2.0
            wanted[k] = np.clip(own.ready + own.sense * angle, *own.limits)
        return wanted

    def speeds(self, twist: Vector, steering: Vector) -> Vector:
        """Return the wheels' speeds (n,), rad/s, for a twist of the base (3,).

        Args:
            twist: Forward and sideways, m/s; turn, rad/s.
            steering: Values of the steering joints, shape (m,), rad.
        """
        if not self.steering:
            return self._from_twist @ twist
        places, rolling = self.places.copy(), self.rolling.copy()
        for value, own in zip(steering, self._steering.values(), strict=True):
            angle = own.sense * (value - own.ready)
            c, s = np.cos(angle), np.sin(angle)
            turn = np.array([[c, -s], [s, c]])
            for i, wheel in enumerate(self.wheels):
                if wheel.steering == own.joint:
                    places[i] = own.place + turn @ (self.places[i] - own.place)
                    rolling[i] = turn @ self.rolling[i]
        v = twist[:2] + twist[2] * np.column_stack([-places[:, 1], places[:, 0]])
        return (v * rolling).sum(axis=1) / self._radii

    @cached_property
    def _from_twist(self) -> Matrix:
        """Speeds for a twist, (n, 3): those whose twist with least slip is nearest."""
        gripping = self._gripping()
        rows = self._gripping_rows(gripping)
        tyres = [k for k, wheel in enumerate(self.wheels) if wheel.roller is None]
        across = np.column_stack([-self.rolling[:, 1], self.rolling[:, 0]])
        slides = _rows(self.places, across)[tyres]
        to_twist = np.linalg.pinv(np.concatenate([rows, slides]), rcond=1e-9)
        to_twist = to_twist[:, : len(rows)]
        share = (self.rolling * gripping).sum(axis=1)
        inverse = np.linalg.pinv(to_twist, rcond=1e-9)
        return inverse / (self._radii * share)[:, None]

    def _gripping(self) -> Matrix:
        """Return the directions in which wheels grip, shape (n, 2)."""
        found = self.rolling.copy()
        for k, wheel in enumerate(self.wheels):
            c, s = np.cos(wheel.roller or 0.0), np.sin(wheel.roller or 0.0)
            found[k] = np.array([[c, -s], [s, c]]) @ self.rolling[k]
        return found

    def _gripping_rows(self, gripping: Matrix) -> Matrix:
        return _rows(self.places, gripping)


def _rows(places: Matrix, along: Matrix) -> Matrix:
    """Return rows that give velocities of points along directions for a twist."""
    turning = places[:, 0] * along[:, 1] - places[:, 1] * along[:, 0]
    return np.column_stack([along, turning])


def rigid_spheres(
    links: Sequence[Link], key: Literal["collision", "visual"]
) -> dict[str, Matrix]:
    """Return spheres x y z radius (n, 4) whose hulls are the shapes of rigid bodies.

    They are those of the first link or a moving one, in its frame, and of what is fixed
    to it, by its name; see `shape_geometry.hull_spheres`.
    """
    owners, poses = rigid_bodies(links), poses_in_rigid_bodies(links)
    found: dict[str, list[Matrix]] = {name: [] for name in owners.values()}
    for link in links:
        for shape in getattr(link, key):
            spheres = hull_spheres(shape).copy()
            pose = poses[link.name] * se3_of(shape)
            spheres[:, :3] = spheres[:, :3] @ pose.rotation.T + pose.translation
            found[owners[link.name]].append(spheres)
    none = [np.zeros((0, 4))]
    return {name: np.concatenate(own or none) for name, own in found.items()}


def _steering(link: Link, poses: dict[str, pin.SE3], ready: float) -> _Steering:
    joint, pose = link.joint, poses[link.name]
    assert joint is not None
    axis = pose.rotation @ np.asarray(joint.axis)
    return _Steering(
        joint=joint.name,
        place=pose.translation[:2].copy(),
        sense=float(np.sign(axis[2])),
        ready=ready,
        limits=joint.range or (-np.inf, np.inf),
    )
