"""Find the wheels of an imported robot by their geometry.

A wheel is round about the axis of a hinge without limits, which is level, and touches
the lowest plane; nothing moves on it but its rollers. It is driven, or belongs to a
caster. Words of names only decide what geometry leaves open.
"""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wbc_suite.robot.adopt.name_words import words_of
from wbc_suite.robot.elements import Joint, Link, rigid_bodies
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


class FoundWheel(NamedTuple):
    """A wheel at `ready`, in the axes of the first link.

    Attributes:
        link: Its link.
        axis: Where it turns, a unit vector (3,).
        centre: Its middle, m.
        radius: m.
        width: m.
        chain: The moving links above it, the outermost first.
        swivels: Those of them that turn about a vertical axis.
        rollers: The links that turn on it.
        roller: Angle of the lowest roller from where the wheel rolls, rad.
    """

    link: Link
    axis: Vector
    centre: Vector
    radius: float
    width: float
    chain: tuple[Link, ...]
    swivels: tuple[Link, ...]
    rollers: tuple[Link, ...]
    roller: float | None = None

    @property
    def joint(self) -> Joint:
        """Its hinge."""
        assert self.link.joint is not None
        return self.link.joint

    @property
    def bottom(self) -> float:
        """Height of its lowest point, m."""
        level = 1.0 - self.axis[2] ** 2
        return float(self.centre[2] - self.radius * np.sqrt(level))

    @property
    def ahead(self) -> Vector:
        """Where it rolls, a unit vector (2,)."""
        ahead = np.cross(self.axis, (0.0, 0.0, 1.0))[:2]
        return ahead / np.linalg.norm(ahead)


class Found(NamedTuple):
    """The wheels of a robot.

    Attributes:
        wheels: Those that drive.
        casters: Those of casters.
        legged: Whether legs carry the wheels that drive.
    """

    wheels: list[FoundWheel]
    casters: list[FoundWheel]
    legged: bool


@dataclass
class WheelSearch:
    """Finds what a robot drives on.

    Args:
        links: Links in depth-first order.
        ready: Values of joints, rad or m.
        driven: Joints with an actuator that is not a motor with an effort.
        name: Name of the robot.
        meshes: Names of the files of meshes, by link.
    """

    links: Sequence[Link]
    ready: dict[str, float]
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

    def find(self) -> Found | None:
        """Return the wheels that drive and those of casters, or None."""
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
        return Found(wheels, casters, bool(legged))

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

    def _round(self) -> Iterator[FoundWheel]:
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

    def _profile(self, link: Link, axis: Vector, spheres: Matrix) -> FoundWheel | None:
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
        chain = self._chain(link)
        swivels = tuple(x for x in chain if self._up(x) and _hinge(x))
        rollers = tuple(self._below(link.name))
        return FoundWheel(link, axis, centre, radius, width, chain, swivels, rollers)

    def _roller(self, wheel: FoundWheel, rollers: list[Link]) -> float | None:
        """Return the angle of the lowest roller from where the wheel rolls, rad."""
        if not rollers:
            return None
        lowest = min(rollers, key=lambda x: self._poses[x.name].translation[2])
        along, ahead = self._axis(lowest)[:2], wheel.ahead
        angle = np.arctan2(ahead[0] * along[1] - ahead[1] * along[0], ahead @ along)
        return float((angle + np.pi / 2.0) % np.pi - np.pi / 2.0)

    def _touching(self) -> list[FoundWheel]:
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

    def _is_lowest(self, wheels: Sequence[FoundWheel]) -> bool:
        """Whether nothing of the robot is lower than its wheels."""
        bodies = [self._spheres(name, self._solid) for name in self._solid]
        spheres = np.concatenate(bodies)
        lowest = float((spheres[:, 2] - spheres[:, 3]).min())
        return min(w.bottom for w in wheels) < lowest + ON_FLOOR[0]

    def _up(self, link: Link) -> bool:
        return bool(abs(self._axis(link)[2]) > UPRIGHT)

    def _without_casters(self, found: list[FoundWheel]) -> list[FoundWheel]:
        """Return the wheels that drive: not the wheels of casters, and no followers."""
        motors = {w.link.name for w in found if self._has_motor(w.joint)}
        wheels = [w for w in found if w.joint.mimic is None]
        tests: list[Callable[[FoundWheel], bool]] = [
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

    def _trails(self, wheel: FoundWheel) -> bool:
        """Whether a wheel stands behind its swivel, as that of a caster."""
        for swivel in wheel.swivels[:1]:
            away = (wheel.centre - self._poses[swivel.name].translation)[:2]
            return bool(abs(away @ wheel.ahead) > TRAIL * wheel.radius)
        return False

    def _words(self, wheel: FoundWheel) -> set[str]:
        links = (wheel.link, *wheel.swivels)
        names = [n for x in links for n in (x.name, x.joint.name if x.joint else "")]
        return {word for name in names for word in words_of(name)}

    def _is_leg(self, wheel: FoundWheel, wheels: Sequence[FoundWheel]) -> bool:
        """Whether two joints or more, beside a swivel, move this wheel and no other."""
        others = {x.name for w in wheels if w is not wheel for x in w.chain}
        swivels = {x.name for x in wheel.swivels}
        own = [x for x in wheel.chain if x.name not in others | swivels]
        return len(own) > 1

    def _is_carriage(self, wheel: FoundWheel) -> bool:
        """Whether a wheel hangs on the root by a swivel and a suspension at most."""
        swivels = len(wheel.swivels)
        return swivels < 2 and len(wheel.chain) - swivels < 3

    def _with_rollers(self, wheels: list[FoundWheel]) -> list[FoundWheel] | None:
        """Return the wheels with the rollers that their arrangement or names give.

        None if such wheels cannot drive.
        """
        if any(w.swivels for w in wheels):
            fixed = [w.ahead for w in wheels if not w.swivels]
            everywhere = all(_is_endless(x.joint) for w in wheels for x in w.swivels)
            return wheels if are_parallel(fixed) and (fixed or everywhere) else None
        if not are_parallel([w.ahead for w in wheels]):
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


def _is_endless(joint: Joint | None) -> bool:
    return joint is not None and joint.type == "hinge" and joint.range is None


def _hinge(link: Link) -> bool:
    return link.joint is not None and link.joint.type == "hinge"


def are_parallel(directions: Sequence[Vector]) -> bool:
    """Whether unit vectors are parallel to the first, one way or the other."""
    return all(abs(float(x @ directions[0])) > PARALLEL for x in directions)


def _spread(wheels: Sequence[FoundWheel], touching: Sequence[FoundWheel]) -> bool:
    """Whether wheels do not stand one behind the other, as those of a bicycle do."""
    across = wheels[0].axis[:2]
    places = np.array([w.centre[:2] for w in touching])
    own = np.array([w.centre[:2] for w in wheels])
    least = max(w.radius for w in wheels) / 2.0
    apart = np.linalg.norm(own - own[0], axis=1).max()
    return bool(np.ptp(places @ across) > least and apart > least)


def _slant(wheel: FoundWheel, middle: Vector) -> float:
    """Return the angle of the rollers on the ground of a mecanum wheel, rad.

    Rollers on the ground form a diamond, as on all platforms that turn: those of the
    left front and the right rear wheel point inward.
    """
    away = (wheel.centre - middle)[:2]
    left = np.array([-wheel.ahead[1], wheel.ahead[0]])
    return float(-np.sign((away @ wheel.ahead) * (away @ left)) * np.pi / 4.0)
