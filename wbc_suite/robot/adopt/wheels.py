"""Find the wheels of an imported robot by their geometry, and let its base drive.

A wheel is round about the axis of a hinge without limits, which is level, and touches
the lowest plane; nothing moves on it but its rollers. It is driven, or belongs to a
caster. Words of names only decide what geometry leaves open.
"""

from collections.abc import (
    Callable,
    Collection,
    Iterable,
    Iterator,
    Mapping,
    Sequence,
)
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from wbc_suite.robot.adopt.name_words import words_of
from wbc_suite.robot.elements import Joint, Link, Wheel, rigid_bodies
from wbc_suite.robot.poses import pose_at, pose_fields, se3_of
from wbc_suite.robot.shape_geometry import hull_spheres
from wbc_suite.robot.shapes import Cylinder, Hull, Shape
from wbc_suite.robot.wheel_drive import PARALLEL, placed, rigid_spheres
from wbc_suite.typing import Matrix, Vector

ROUND = 0.9
"""Least ratio of the extents of a wheel across its axis: 0.87 of a hexagon, 0.92 of an
octagon."""
LEVEL = 0.25  # greatest vertical component of a level axis: 14 degrees
UPRIGHT = 0.85  # least vertical component of the axis of a swivel
ON_FLOOR = 0.01, 0.2
"""Greatest height of a wheel over the lowest plane: m, and part of its radius. Casters
in files hang up to 8 mm low or high."""
LEAST_RADIUS = 0.005  # m
WIDEST = 4.0  # greatest width of a wheel in radii; a longer one is a drum
TRAIL = 0.15  # least distance of a caster's wheel behind its swivel, in radii
ROLLERS = 4  # fewer links that turn on one are no rollers
SLANTED = (
    0.35  # rad; rollers of mecanum wheels are turned by more, mostly by 45 degrees
)
SIDEWAYS = {"mecanum", "mechanum", "swedish", "omni", "omnidirectional"}
"""Words for four parallel wheels that drive sideways, so they are mecanum wheels."""
CASTERS = {"caster", "castor", "casters", "castors", "idler", "rotacastor"}

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


class _Wheel(NamedTuple):
    """A wheel at `ready`, in the axes of the first link; `chain` leads to it."""

    link: Link
    axis: Vector
    centre: Vector
    radius: float
    width: float
    chain: tuple[Link, ...]
    roller: float | None = None

    @property
    def joint(self) -> Joint:
        assert self.link.joint is not None
        return self.link.joint

    @property
    def bottom(self) -> float:
        level = 1.0 - self.axis[2] ** 2
        return float(self.centre[2] - self.radius * np.sqrt(level))

    @property
    def ahead(self) -> Vector:
        """Where it rolls, a unit vector (2,)."""
        ahead = np.cross(self.axis, (0.0, 0.0, 1.0))[:2]
        return ahead / np.linalg.norm(ahead)


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
    return _Search(links, ready, root, take, driven, name, meshes or {}).base()


@dataclass
class _Search:
    links: Sequence[Link]
    ready: dict[str, float]
    root: dict[str, Any]
    take: Callable[[str, str], str]
    driven: Collection[str]
    name: str
    meshes: Mapping[str, str]

    def __post_init__(self) -> None:
        links = self.links
        self._poses = placed(links, self.ready)
        self._rigid = rigid_bodies(links)
        self._moving = {x.name: x for x in links if x.joint is not None}
        self._above = {
            name: self._rigid[str(link.parent)] for name, link in self._moving.items()
        }
        self._solid = rigid_spheres(links, "collision")
        self._drawn = rigid_spheres(links, "visual")

    def base(self) -> WheeledBase | None:
        """Return what the robot drives on."""
        touching = self._touching()
        wheels = self._without_casters(touching)
        legged = [w for w in wheels if self._is_leg(w, wheels)]
        if legged:
            if len(legged) < len(wheels) or not self._is_lowest(wheels):
                return None
        elif not all(self._is_carriage(w) for w in wheels):
            return None
        if len(wheels) < 2 or not _spread(wheels, touching):
            return None
        wheels = self._with_rollers(wheels)
        if wheels is None:
            return None
        casters = [
            w for w in touching if w.link.name not in {x.link.name for x in wheels}
        ]
        return self._described(wheels, casters, legged=bool(legged))

    def _axis(self, link: Link) -> Vector:
        assert link.joint is not None
        return self._poses[link.name].rotation @ np.asarray(link.joint.axis)

    def _chain(self, link: Link) -> tuple[Link, ...]:
        """Return the moving links above one, the outermost first."""
        found: list[Link] = []
        name = self._above[link.name]
        while name in self._moving:
            found.append(self._moving[name])
            name = self._above[name]
        return tuple(found)

    def _below(self, name: str) -> list[Link]:
        return [self._moving[n] for n, own in self._above.items() if own == name]

    def _spheres(self, name: str, source: dict[str, Matrix]) -> Matrix:
        """Return the spheres of a rigid body in the axes of the first link."""
        spheres, pose = source[name].copy(), self._poses[name]
        spheres[:, :3] = spheres[:, :3] @ pose.rotation.T + pose.translation
        return spheres

    def _round(self) -> Iterator[_Wheel]:
        """Yield what is round about a level axis without limits."""
        for link in self._moving.values():
            joint, axis = link.joint, self._axis(link)
            below = self._below(link.name)
            if not _is_endless(joint) or abs(axis[2]) > LEVEL:
                continue
            above = self._moving.get(self._above[link.name])
            if above is not None and _is_endless(above.joint) and not self._up(above):
                continue  # a roller of a wheel
            ends = all(_is_endless(x.joint) and not self._below(x.name) for x in below)
            if below and not (len(below) >= ROLLERS and ends):
                continue
            for source in (self._solid, self._drawn):
                names = [link.name, *(x.name for x in below)]
                spheres = np.concatenate([self._spheres(n, source) for n in names])
                if (found := self._profile(link, axis, spheres)) is not None:
                    yield found._replace(roller=self._roller(found, below))
                    break

    def _profile(self, link: Link, axis: Vector, spheres: Matrix) -> _Wheel | None:
        """Return a wheel of the shape of spheres, or None if they are not round."""
        if not len(spheres):
            return None
        origin = self._poses[link.name].translation
        first = np.cross(axis, (0.0, 0.0, 1.0))
        first /= np.linalg.norm(first)
        angles = np.linspace(0.0, 2.0 * np.pi, 36, endpoint=False)
        second = np.cross(axis, first)
        rays = np.outer(np.cos(angles), first) + np.outer(np.sin(angles), second)
        away = spheres[:, :3] - origin
        reach = (away @ rays.T + spheres[:, 3:]).max(axis=0)
        along = away @ axis
        low, high = (along - spheres[:, 3]).min(), (along + spheres[:, 3]).max()
        radius, width = float(reach.max()), float(high - low)
        if radius < LEAST_RADIUS or reach.min() < ROUND * radius:
            return None
        if width > WIDEST * radius:
            return None
        centre = origin + axis * (low + high) / 2.0
        return _Wheel(link, axis, centre, radius, width, self._chain(link))

    def _roller(self, wheel: _Wheel, rollers: list[Link]) -> float | None:
        """Return the angle of the lowest roller from where the wheel rolls, rad."""
        if not rollers:
            return None
        lowest = min(rollers, key=lambda x: self._poses[x.name].translation[2])
        along, ahead = self._axis(lowest)[:2], wheel.ahead
        angle = np.arctan2(ahead[0] * along[1] - ahead[1] * along[0], ahead @ along)
        return float((angle + np.pi / 2.0) % np.pi - np.pi / 2.0)

    def _touching(self) -> list[_Wheel]:
        """Return the wheels on the lowest plane of the trunk and all wheels."""
        found = list(self._round())
        if not found:
            return []
        root = self._spheres(self.links[0].name, self._solid)
        bottoms = [w.bottom for w in found]
        if len(root):
            bottoms.append(float((root[:, 2] - root[:, 3]).min()))
        floor = min(bottoms)
        return [
            w for w in found if w.bottom < floor + ON_FLOOR[0] + ON_FLOOR[1] * w.radius
        ]

    def _is_lowest(self, wheels: Sequence[_Wheel]) -> bool:
        """Whether nothing of the robot is lower than its wheels."""
        bodies = [self._spheres(name, self._solid) for name in self._solid]
        spheres = np.concatenate(bodies)
        lowest = float((spheres[:, 2] - spheres[:, 3]).min())
        return min(w.bottom for w in wheels) < lowest + ON_FLOOR[0]

    def _swivels(self, wheel: _Wheel) -> list[Link]:
        return [x for x in wheel.chain if self._up(x) and _hinge(x)]

    def _up(self, link: Link) -> bool:
        return bool(abs(self._axis(link)[2]) > UPRIGHT)

    def _without_casters(self, found: list[_Wheel]) -> list[_Wheel]:
        """Return the wheels that drive: not the wheels of casters, and no followers."""
        motors = {w.link.name for w in found if self._has_motor(w.joint)}
        wheels = [w for w in found if w.joint.mimic is None]
        tests: list[Callable[[_Wheel], bool]] = [
            lambda w: not motors or w.link.name in motors,
            lambda w: not self._trails(w),
            lambda w: not CASTERS.intersection(self._words(w)),
        ]
        for is_driven in tests:
            kept = list(filter(is_driven, wheels))
            wheels = kept if len(kept) > 1 else wheels
        return wheels

    def _has_motor(self, joint: Joint) -> bool:
        return not joint.passive and bool(joint.effort or joint.name in self.driven)

    def _trails(self, wheel: _Wheel) -> bool:
        """Whether a wheel stands behind its swivel, as that of a caster."""
        for swivel in self._swivels(wheel)[:1]:
            away = (wheel.centre - self._poses[swivel.name].translation)[:2]
            return bool(abs(away @ wheel.ahead) > TRAIL * wheel.radius)
        return False

    def _words(self, wheel: _Wheel) -> set[str]:
        links = (wheel.link, *self._swivels(wheel))
        names = [n for x in links for n in (x.name, x.joint.name if x.joint else "")]
        return {word for name in names for word in words_of(name)}

    def _is_leg(self, wheel: _Wheel, wheels: Sequence[_Wheel]) -> bool:
        """Whether two joints or more, beside a swivel, move this wheel and no other."""
        others = {x.name for w in wheels if w is not wheel for x in w.chain}
        swivels = {x.name for x in self._swivels(wheel)}
        own = [x for x in wheel.chain if x.name not in others | swivels]
        return len(own) > 1

    def _is_carriage(self, wheel: _Wheel) -> bool:
        """Whether a wheel hangs on the root by a swivel and a suspension at most."""
        swivels = len(self._swivels(wheel))
        return swivels < 2 and len(wheel.chain) - swivels < 3

    def _with_rollers(self, wheels: list[_Wheel]) -> list[_Wheel] | None:
        """Return the wheels with the rollers that their arrangement or names give.

        None if such wheels cannot drive.
        """
        if any(self._swivels(w) for w in wheels):
            fixed = [w.ahead for w in wheels if not self._swivels(w)]
            everywhere = all(
                _is_endless(x.joint) for w in wheels for x in self._swivels(w)
            )
            return wheels if _parallel(fixed) and (fixed or everywhere) else None
        if not _parallel([w.ahead for w in wheels]):
            if len(wheels) < 3:
                return None
            return [w._replace(roller=w.roller or 0.0) for w in wheels]
        words = {word for w in wheels for word in self._words(w)}
        files = (self.meshes.get(w.link.name, "") for w in wheels)
        words |= {word for text in (self.name, *files) for word in words_of(text)}
        if len(wheels) == 4 and SIDEWAYS & words and wheels[0].roller is None:
            middle = np.mean([w.centre for w in wheels], axis=0)
            return [w._replace(roller=_slant(w, middle)) for w in wheels]
        if any(w.roller is not None and abs(w.roller) < SLANTED for w in wheels):
            return [w._replace(roller=None) for w in wheels]
        return wheels

    def _described(
        self, wheels: list[_Wheel], casters: list[_Wheel], *, legged: bool
    ) -> WheeledBase:
        swivels = {w.link.name: self._swivels(w)[:1] for w in wheels}
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
        loose |= {x.name for w in (*wheels, *casters) for x in self._below(w.link.name)}
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

    def _cleared(self, link: Link, wheels: Sequence[_Wheel]) -> tuple[Shape, ...]:
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

    def _sprung(self, link: Link, wheels: Sequence[_Wheel]) -> Joint:
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
        self, wheels: Sequence[_Wheel], steered: dict[str, Link]
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
        self, links: list[Link], wheels: Sequence[_Wheel]
    ) -> tuple[list[Link], dict[str, Any]]:
        """Return links below one that turns on the spot, and the planar root."""
        steered = [w for w in wheels if self._swivels(w)]
        axle = [w for w in wheels if not self._swivels(w)] or list(wheels)
        middle = np.mean([w.centre for w in axle], axis=0)
        middle[2] = min(w.bottom for w in wheels)
        ahead = np.array([1.0, 0.0])
        if _parallel([w.ahead for w in axle]):
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


def _is_endless(joint: Joint | None) -> bool:
    return joint is not None and joint.type == "hinge" and joint.range is None


def _hinge(link: Link) -> bool:
    return link.joint is not None and link.joint.type == "hinge"


def _is_primitive(links: Sequence[Link], rigid: Mapping[str, str], owner: str) -> bool:
    """Whether a rigid body collides with one round primitive."""
    solid = [s for link in links if rigid[link.name] == owner for s in link.collision]
    return [s.shape for s in solid] in (["cylinder"], ["sphere"], ["capsule"])


def _parallel(directions: Sequence[Vector]) -> bool:
    return all(abs(float(x @ directions[0])) > PARALLEL for x in directions)


def _spread(wheels: Sequence[_Wheel], touching: Sequence[_Wheel]) -> bool:
    """Whether wheels do not stand one behind the other, as those of a bicycle do."""
    across = wheels[0].axis[:2]
    places = np.array([w.centre[:2] for w in touching])
    own = np.array([w.centre[:2] for w in wheels])
    least = max(w.radius for w in wheels) / 2.0
    apart = np.linalg.norm(own - own[0], axis=1).max()
    return bool(np.ptp(places @ across) > least and apart > least)


def _slant(wheel: _Wheel, middle: Vector) -> float:
    """Return the angle of the rollers on the ground of a mecanum wheel, rad.

    Rollers on the ground form a diamond, as on all platforms that turn: those of the
    left front and the right rear wheel point inward.
    """
    away = (wheel.centre - middle)[:2]
    left = np.array([-wheel.ahead[1], wheel.ahead[0]])
    return float(-np.sign((away @ wheel.ahead) * (away @ left)) * np.pi / 4.0)


def _tyre(wheel: _Wheel, pose: pin.SE3) -> Cylinder:
    """Return the cylinder around a wheel, in its frame: hulls roll unevenly."""
    half = wheel.axis * wheel.width / 2.0
    ends = [pose.actInv(wheel.centre + side * half).tolist() for side in (-1.0, 1.0)]
    fields = {"shape": "cylinder", "from": ends[0], "to": ends[1]}
    return Cylinder.model_validate(fields | {"radius": wheel.radius})
