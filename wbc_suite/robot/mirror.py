"""`[mirror]`: generate the other side of a robot by reflection in a plane.

Let `S` be the reflection (for the plane xz: diag(1, -1, 1)). A link frame goes to
`S p`, `S R S`. Within a link, points go to `D p`, tensors to `D I D^T`, the axis of a
slide to `D a` and that of a hinge (pseudovector) to `-D a`. `D` is `S`, unless the file
defines the link of the other side: then `D = R_target^T S R_source`, both at zero joint
angles. If an axis is only negated, the axis is kept and the range is negated instead,
as in vendors' models. Definitions of the file override the reflection.
"""

import re
from typing import Any, Literal, TypeVar

import numpy as np
import pinocchio as pin

from wbc_suite.config_files import FrozenModel
from wbc_suite.errors import DescriptionError
from wbc_suite.robot.elements import Elements, Joint, Link, Name
from wbc_suite.robot.inertia import inertia_fields, inertia_matrix
from wbc_suite.robot.poses import HasPose, pose_fields, rotation_matrix
from wbc_suite.robot.shapes import Capsule, Cylinder, Hull, Loft, Shape
from wbc_suite.typing import Matrix, Vector

E = TypeVar("E", bound=Elements)

NAMED = ("frames", "mounts", "cameras", "sensors", "actuators", "connects")


class Mirror(FrozenModel):
    """The word in names (between underscores) of the defined side, and of the other.

    The plane of reflection is in the axes of the component's first link.
    """

    source: Name = "left"
    target: Name = "right"
    plane: Literal["xz", "yz", "xy"] = "xz"


def reflect(elements: E, mirror: Mirror, *, source: str) -> E:
    """Return elements with both sides; raises DescriptionError."""
    reflection = _Reflection(mirror, elements)
    if not any(reflection.matches(link.name) for link in elements.links):
        raise DescriptionError(
            f"{source}: key 'mirror.source' = '{mirror.source}': no link has this word "
            "in its name."
        )
    return elements.model_copy(update=reflection.changes())


class _Reflection:
    """The reflection of the elements of one component."""

    def __init__(self, mirror: Mirror, elements: Elements) -> None:
        self._mirror = mirror
        self._word = re.compile(rf"(?<![^_]){re.escape(mirror.source)}(?![^_])")
        self._elements = elements
        missing = {"xz": 1, "yz": 0, "xy": 2}[mirror.plane]
        self._s = np.eye(3)
        self._s[missing, missing] = -1.0
        self._signs: dict[str, float] = {}
        self._world: dict[str, Matrix] = {}
        self._inside: dict[str, Matrix] = {}

    def changes(self) -> dict[str, Any]:
        """Return every field that has mirrored items, with these added."""
        c = self._elements
        links = self._links()
        return {
            "links": links,
            **{k: self._both_sides(getattr(c, k)) for k in NAMED},
            "groups": self._groups(c.groups),
            "keyframes": {k: self._values(v) for k, v in c.keyframes.items()},
            "contacts": c.contacts.model_copy(
                update={"exclude": self._pairs(c.contacts.exclude)}
            ),
        }

    def matches(self, name: str) -> bool:
        """Whether a name belongs to the defined side."""
        return self._word.search(name) is not None

    def name(self, name: str) -> str:
        """Return the name on the other side; names of neither side are unchanged."""
        return self._word.sub(self._mirror.target, name, count=1)

    def _links(self) -> tuple[Link, ...]:
        own = {link.name: link for link in self._elements.links}
        made: list[Link] = []
        for link in self._elements.links:
            self._turn(link)
            if not self.matches(link.name):
                self._set_d(link.name, link.name)
                continue
            given = own.get(self.name(link.name))
            if given is not None:
                own[given.name] = self._link(link, given)
            else:
                made.append(self._link(link, None))
        return (*own.values(), *made)

    def _turn(self, link: Link) -> None:
        """Store the orientation of a link at zero joint angles."""
        parent = self._world.get(link.parent or "", np.eye(3))
        self._world[link.name] = parent @ rotation_matrix(link)

    def _link(self, link: Link, given: Link | None) -> Link:
        update = self._moved(link, self._d(link.parent)) | {
            "name": self.name(link.name),
            "parent": self.name(link.parent) if link.parent else None,
        }
        hand = {k: getattr(given, k) for k in given.model_fields_set} if given else {}
        placed = link.model_copy(update=update | hand)
        self._turn(placed)
        d = self._set_d(link.name, placed.name)
        update |= {
            "com": _floats(d @ np.asarray(link.com)),
            "inertia": inertia_fields(0.0 + d @ inertia_matrix(link.inertia) @ d.T),
            "visual": tuple(self._shape(s, d) for s in link.visual),
            "collision": tuple(self._shape(s, d) for s in link.collision),
        }
        if link.joint is not None:
            update["joint"] = self._joint(link.joint, d, placed.joint if hand else None)
        return link.model_copy(update=update | hand)

    def _set_d(self, source: str, target: str) -> Matrix:
        """Store and return D between a link and its image, itself on the plane."""
        d = self._world[target].T @ self._s @ self._world[source]
        self._inside[source] = np.where(abs(d) < 1e-12, 0.0, d)
        return self._inside[source]

    def _d(self, link: str | None) -> Matrix:
        return self._inside.get(link or "", self._s)

    def _moved(self, posed: HasPose, d: Matrix) -> dict[str, Any]:
        """Return the pose `D p`, `D R S` of an item whose inside is reflected by S."""
        quat, pos = posed.quat, _floats(d @ np.asarray(posed.pos))
        if not np.array_equal(d, self._s):
            R = d @ rotation_matrix(posed) @ self._s
            return pose_fields(pin.SE3(R, np.array(pos)))
        axis = -np.diag(self._s)  # exact: a rotation's axis goes to -S a
        return {"pos": pos, "quat": (quat[0], *_floats(axis * np.asarray(quat[1:])))}

    def _joint(self, joint: Joint, d: Matrix, given: Joint | None) -> Joint:
        axis = np.asarray(joint.axis)
        reflected = d @ axis * (-1.0 if joint.type == "hinge" else 1.0)
        written = axis if given is None else np.asarray(given.axis)
        sign = -1.0 if np.allclose(reflected, -written, atol=1e-9) else 1.0
        self._signs[joint.name] = sign
        update: dict[str, Any] = {"name": self.name(joint.name)}
        if sign > 0:
            update["axis"] = _floats(reflected)
        elif joint.range is not None:
            update["range"] = (-joint.range[1], -joint.range[0])
        if joint.mimic is not None:
            leader = self._signs.get(joint.mimic.joint, 1.0)
            update["mimic"] = joint.mimic.model_copy(
                update={
                    "joint": self.name(joint.mimic.joint),
                    "ratio": joint.mimic.ratio * sign * leader,
                    "offset": joint.mimic.offset * sign,
                }
            )
        return joint.model_copy(update=update)

    def _shape(self, shape: Shape, d: Matrix) -> Shape:
        update = self._moved(shape, d)
        match shape:
            case Capsule(start=start, end=end) | Cylinder(start=start, end=end):
                update |= {"start": self._point(start), "end": self._point(end)}
            case Hull(spheres=spheres):
                update["spheres"] = tuple((*self._point(s[:3]), s[3]) for s in spheres)
            case Loft(axis=axis, sections=sections):
                update["sections"] = self._sections(axis, sections)
            case _:
                pass
        return shape.model_copy(update=update)

    def _point(self, point: tuple[float, ...]) -> tuple[float, ...]:
        return _floats(self._s @ np.asarray(point))

    def _sections(
        self, axis: str, sections: tuple[tuple[float, ...], ...]
    ) -> tuple[tuple[float, ...], ...]:
        k = "xyz".index(axis)
        u, v = (i for i in range(3) if i != k)
        along, side_u, side_v = (float(self._s[i, i]) for i in (k, u, v))
        rows = [
            (along * p, side_u * a + 0.0, side_v * b + 0.0, hu, hv)
            for p, a, b, hu, hv in sections
        ]
        return tuple(rows if along > 0 else rows[::-1])

    def _both_sides(self, items: tuple[Any, ...]) -> tuple[Any, ...]:
        """Return the items, and the images of those of the defined side."""
        known = {getattr(item, "name", None) for item in items} - {None}
        made: list[Any] = []
        for item in items:
            update: dict[str, Any] = {
                key: self.name(value)
                for key, value in item
                if isinstance(value, str) and self.matches(value)
            }
            if update and update.get("name") not in known:
                if hasattr(item, "quat"):
                    update |= self._moved(item, self._d(item.link))
                made.append(item.model_copy(update=update))
        return (*items, *made)

    def _groups(
        self, groups: dict[Name, tuple[Name, ...]]
    ) -> dict[Name, tuple[Name, ...]]:
        made: dict[Name, tuple[Name, ...]] = {}
        for group, joints in groups.items():
            mirrored = tuple(self.name(j) for j in joints if self.matches(j))
            name = self.name(group)
            if name != group and name not in groups:
                made[name] = mirrored
            elif name == group:  # one group for both sides, such as `legs`
                made[group] = (*joints, *(j for j in mirrored if j not in joints))
        return groups | made

    def _values(self, values: dict[Name, float]) -> dict[Name, float]:
        made = {
            self.name(joint): self._signs.get(joint, 1.0) * value
            for joint, value in values.items()
            if self.matches(joint)
        }
        return values | {k: v + 0.0 for k, v in made.items() if k not in values}

    def _pairs(
        self, pairs: tuple[tuple[Name, Name], ...]
    ) -> tuple[tuple[Name, Name], ...]:
        made = [(self.name(a), self.name(b)) for a, b in pairs]
        known = {frozenset(pair) for pair in pairs}
        return (*pairs, *(p for p in made if frozenset(p) not in known))


def _floats(vector: Vector) -> tuple[float, ...]:
    """Return plain floats without negative zeros."""
    return tuple((vector + 0.0).tolist())
