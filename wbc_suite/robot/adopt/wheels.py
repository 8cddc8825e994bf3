"""Let a robot drive on its wheels: motors, tyres, suspensions and a planar root."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from wbc_suite.robot.adopt.wheel_search import (
    LEVEL,
    ON_FLOOR,
    Found,
    FoundWheel,
    WheelSearch,
    are_parallel,
)
from wbc_suite.robot.elements import Joint, Link, Wheel, rigid_bodies
from wbc_suite.robot.poses import pose_at, pose_fields, se3_of
from wbc_suite.robot.shape_geometry import hull_spheres
from wbc_suite.robot.shapes import Cylinder, Hull, Shape
from wbc_suite.robot.wheel_drive import placed
from wbc_suite.typing import Matrix

GRIP = 1.0
"""Friction of tyres, MuJoCo's default: a motor that makes a wheel slip is strong."""
GRAVITY = 9.81  # m/s^2
LOAD = 2.0  # greatest load of a wheel over an equal part of the weight
SPEED_ERROR = 0.02  # m/s; of a wheel whose servo exerts the moment that makes it slip
STEERING_ERROR = 0.1  # rad; at which a steering servo exerts its effort
STEERING_RATE = 10.0  # 1/s; with which its error decays
STEERING_RESERVE = 3.0  # of its effort over the moment that turns the wheel on the spot
SAG = 0.01  # m; by which a suspension without a spring yields under the weight
CLEAR = 0.4  # least height of the hull of a chassis over the floor, in radii of wheels
CHASSIS = 3.0  # least extent of such a hull, in radii of wheels
SLIDING = (0.05, 0.005, 0.0001)
"""Friction of a caster that is a ball or a block without joints: of its bearings."""
CENTRED = 1e-3  # m; greatest distance of the first link from the middle of the drive
PACE = (1.5, 2.0)
"""Greatest speeds of a base, m/s and rad/s: a brisk walk. Motors may give less."""
PLANAR_GRIP = 0.6
"""Force of a planar root over its weight, as in `robots/tiago.toml`."""


@dataclass(frozen=True, kw_only=True, slots=True)
class WheeledBase:
    """What is found about a robot on wheels.

    Attributes:
        links: Its links; wheels have motors, casters are passive, and the first link is
            on the floor in the middle of the drive, with x ahead.
        wheels: The driven wheels.
        actuators: Fields of the actuators of wheels and of their steering.
        kinds: Kind of limb of the links that wheels move or hang on, by name.
        root: Fields of the planar root; None of a robot with wheels on legs.
    """

    links: tuple[Link, ...]
    wheels: tuple[Wheel, ...]
    actuators: tuple[dict[str, Any], ...]
    kinds: dict[str, str]
    root: dict[str, Any] | None

    @property
    def joints(self) -> tuple[str, ...]:
        """Joints of wheels and of their steering."""
        own = [name for w in self.wheels for name in (w.joint, w.steering) if name]
        return tuple(dict.fromkeys(own))

    def fields(self, actuators: Iterable[dict[str, Any]]) -> dict[str, Any]:
        """Return wheels and all actuators, with those of other joints in the file."""
        kept = [x for x in actuators if x["joint"] not in self.joints]
        return {"wheels": self.wheels, "actuators": [*kept, *self.actuators]}


def find_wheels(
    links: Sequence[Link],
    ready: dict[str, float],
    *,
    root: dict[str, Any],
    take: Callable[[str, str], str],
    driven: Collection[str] = (),
    name: str = "",
    meshes: Mapping[str, str] | None = None,
) -> WheeledBase | None:
    """Return the wheels that a robot drives on, or None.

    Args:
        links: Links in depth-first order.
        ready: Values of joints, rad or m.
        root: Fields of the root in the file.
        take: Returns a free name near the given one, for a kind of element.
        driven: Joints with an actuator that is not a motor with an effort.
        name: Name of the robot.
        meshes: Names of the files of meshes, by link.
    """
    found = WheelSearch(links, ready, driven, name, meshes or {}).find()
    return None if found is None else _Base(links, ready, root, take, found).described()


@dataclass
class _Base:
    links: Sequence[Link]
    ready: dict[str, float]
    root: dict[str, Any]
    take: Callable[[str, str], str]
    found: Found

    def __post_init__(self) -> None:
        self._poses = placed(self.links, self.ready)
        self._rigid = rigid_bodies(self.links)

    def described(self) -> WheeledBase:
        """Return the robot that drives."""
        wheels, casters, legged = self.found
        swivels = {w.link.name: w.swivels[:1] for w in wheels}
        steered = {x.name: x for own in swivels.values() for x in own}
        motors = self._motors(wheels, steered)
        elements = tuple(
            Wheel(
                joint=w.joint.name,
                radius=round(w.radius, 5),
                roller=w.roller,
                steering=next((x.joint.name for x in own if x.joint), None),
            )
            for w, own in zip(wheels, swivels.values(), strict=True)
        )
        kind = "leg" if legged else "base"
        hung = {x.name for w in wheels for x in w.chain} - steered.keys()
        loose = {x.name for w in casters for x in (*w.chain, w.link)} - hung
        loose |= {x.name for w in (*wheels, *casters) for x in w.rollers}
        turning = {w.link.name for w in wheels} | steered.keys()
        kinds = dict.fromkeys(loose, "base") | dict.fromkeys(hung | turning, kind)
        tyres = {w.link.name: w for w in (*wheels, *casters)}
        changed: list[Link] = []
        for link in self.links:
            update: dict[str, Any] = {}
            joint, owner = link.joint, self._rigid[link.name]
            if owner in tyres and not _is_primitive(self.links, self._rigid, owner):
                tyre = _tyre(tyres[owner], self._poses[owner])
                update["collision"] = (tyre,) if owner == link.name else ()
            if joint is not None and joint.name in motors:
                effort = joint.effort or motors[joint.name][0]
                lossless = {"effort": effort, "damping": 0.0, "frictionloss": 0.0}
                update["joint"] = joint.model_copy(update=lossless)
            elif joint is not None and link.name in loose:
                free = {"passive": True, "effort": None}
                update["joint"] = joint.model_copy(update=free)
            elif joint is not None and link.name in hung and not legged:
                update["joint"] = self._sprung(link, wheels)
            if owner == self.links[0].name and not legged:
                update["collision"] = self._cleared(link, wheels)
            changed.append(link.model_copy(update=update))
        root = None
        if not legged:
            changed, root = self._rooted(changed, wheels)
        return WheeledBase(
            links=tuple(changed),
            wheels=elements,
            actuators=tuple(x | {"joint": name} for name, (_, x) in motors.items()),
            kinds=kinds,
            root=root,
        )

    def _cleared(self, link: Link, wheels: Sequence[FoundWheel]) -> tuple[Shape, ...]:
        """Return the shapes of a chassis: hulls above the floor, and feet that slide.

        The hull of a mesh fills what is hollow between wheels. What else touches the
        floor is a caster without joints.
        """
        radius = min(w.radius for w in wheels)
        floor = min(w.bottom for w in wheels)
        shapes: list[Shape] = []
        for shape in link.collision:
            pose = self._poses[link.name] * se3_of(shape)
            spheres = hull_spheres(shape).copy()
            points = spheres[:, :3] @ pose.rotation.T + pose.translation
            bottom = float((points[:, 2] - spheres[:, 3]).min())
            wide = np.ptp(points[:, :2], axis=0).max() > CHASSIS * radius
            least = floor + CLEAR * radius
            if isinstance(shape, Hull) and wide and bottom < least:
                if points[:, 2].max() < least + radius / 2.0:
                    continue
                points[:, 2] = np.maximum(points[:, 2], least + spheres[:, 3])
                spheres[:, :3] = (points - pose.translation) @ pose.rotation
                update: dict[str, Any] = {"spheres": _rows(spheres)}
                shapes.append(shape.model_copy(update=update))
            elif bottom < floor + ON_FLOOR[0]:
                update = {"friction": SLIDING, "priority": 1}
                shapes.append(shape.model_copy(update=update))
            else:
                shapes.append(shape)
        return tuple(shapes)

    def _sprung(self, link: Link, wheels: Sequence[FoundWheel]) -> Joint:
        """Return a joint of a suspension as a damped spring, unless it has one."""
        assert link.joint is not None
        joint = link.joint.model_copy(update={"passive": True, "effort": None})
        if joint.stiffness:
            return joint
        carried = [w for w in wheels if link in w.chain]
        share = len(carried) * sum(x.mass for x in self.links) / len(wheels)
        arm = 1.0
        if joint.type == "hinge":
            away = [w.centre - self._poses[link.name].translation for w in carried]
            arm = max(float(np.linalg.norm(x[:2])) for x in away)
        stiffness = share * GRAVITY / SAG * arm**2
        damping = 2.0 * arm**2 * share * np.sqrt(GRAVITY / SAG)
        update = {
            "stiffness": float(f"{stiffness:.3g}"),
            "damping": float(f"{damping:.3g}"),
            "springref": self.ready.get(joint.name, 0.0),
        }
        return joint.model_copy(update=update)

    def _motors(
        self, wheels: Sequence[FoundWheel], steered: dict[str, Link]
    ) -> dict[str, tuple[float, dict[str, Any]]]:
        """Return effort and actuator of the joints of wheels and steering, by name.

        A wheel without an effort can spin on the spot under its part of the weight.
        """
        share = sum(link.mass for link in self.links) / len(wheels)
        found: dict[str, tuple[float, dict[str, Any]]] = {}
        for w in wheels:
            grip = GRIP * GRAVITY * share * w.radius
            effort, kd = w.joint.effort or LOAD * grip, grip * w.radius / SPEED_ERROR
            found[w.joint.name] = (
                float(f"{effort:.3g}"),
                {
                    "kind": "velocity",
                    "kd": float(f"{kd:.3g}"),
                },
            )
        scrub = STEERING_RESERVE * GRIP * GRAVITY * share * wheels[0].width / 2.0
        for link in steered.values():
            assert link.joint is not None
            effort = link.joint.effort or max(scrub, 1.0)
            kp = effort / STEERING_ERROR
            found[link.joint.name] = (
                float(f"{effort:.3g}"),
                {
                    "kind": "position",
                    "kp": float(f"{kp:.3g}"),
                    "kd": float(f"{kp / STEERING_RATE:.3g}"),
                },
            )
        return found

    def _rooted(
        self, links: list[Link], wheels: Sequence[FoundWheel]
    ) -> tuple[list[Link], dict[str, Any]]:
        """Return links below one that turns on the spot, and the planar root."""
        steered = [w for w in wheels if w.swivels]
        axle = [w for w in wheels if not w.swivels] or list(wheels)
        middle = np.mean([w.centre for w in axle], axis=0)
        middle[2] = min(w.bottom for w in wheels)
        ahead = np.array([1.0, 0.0])
        if are_parallel([w.ahead for w in axle]):
            ahead = axle[0].ahead
            front = np.array([1.0, 0.0] if abs(ahead[0]) > LEVEL else [0.0, 1.0])
            if steered and len(axle) < len(wheels):
                front = np.mean([w.centre for w in steered], axis=0)[:2] - middle[:2]
            ahead = ahead * np.sign(ahead @ front)
        up, x = np.array([0.0, 0.0, 1.0]), np.append(ahead, 0.0)
        pose = pin.SE3(np.column_stack([x, np.cross(up, x), up]), middle)
        away = max(float(np.linalg.norm((w.centre - middle)[:2])) for w in wheels)
        rates = [w.joint.velocity * w.radius for w in wheels if w.joint.velocity]
        speed = min([PACE[0], *rates])
        force = PLANAR_GRIP * GRAVITY * sum(link.mass for link in links)
        turns = any(w.roller is not None for w in wheels) or len(steered) == len(wheels)
        root = {
            "kind": "planar",
            "drive": "holonomic" if turns else "differential",
            "velocity": [round(speed, 3), round(min(PACE[1], speed / away), 3)],
            "effort": [round(force, 1), round(force * away, 1)],
        }
        own = pose_at(
            self.root.get("pos", (0, 0, 0)), self.root.get("quat", (1, 0, 0, 0))
        )
        aligned = np.allclose(pose.rotation, np.eye(3), atol=1e-3)
        if aligned and float(np.linalg.norm(middle[:2])) < CENTRED:
            return links, root | pose_fields(own)
        first = Link(name=self.take("drive", "link"))
        below = pose_fields(pose.inverse()) | {"parent": first.name}
        carried = links[0].model_copy(update=below)
        return [first, carried, *links[1:]], root | pose_fields(own * pose)


def _rows(spheres: Matrix) -> tuple[tuple[float, ...], ...]:
    return tuple((float(x), float(y), float(z), float(r)) for x, y, z, r in spheres)


def _is_primitive(links: Sequence[Link], rigid: Mapping[str, str], owner: str) -> bool:
    """Whether a rigid body collides with one round primitive."""
    solid = [s for link in links if rigid[link.name] == owner for s in link.collision]
    return [s.shape for s in solid] in (["cylinder"], ["sphere"], ["capsule"])


def _tyre(wheel: FoundWheel, pose: pin.SE3) -> Cylinder:
    """Return the cylinder around a wheel, in its frame: hulls roll unevenly."""
    half = wheel.axis * wheel.width / 2.0
    ends = [pose.actInv(wheel.centre + side * half).tolist() for side in (-1.0, 1.0)]
    fields = {"shape": "cylinder", "from": ends[0], "to": ends[1]}
    return Cylinder.model_validate(fields | {"radius": wheel.radius})
