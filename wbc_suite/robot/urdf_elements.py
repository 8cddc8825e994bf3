"""Read the XML elements of a URDF file: the tree of links, numbers and poses."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin

from wbc_suite import logs
from wbc_suite.errors import ConfigError, DescriptionError, did_you_mean, join_first
from wbc_suite.robot.xacro_files import XACRO, expand_xacro
from wbc_suite.robot.xml_files import Element, at_line, parse_xml, read_xml
from wbc_suite.typing import Vector

LOG = logs.logger(__name__)

PREFIX = "xacro:"
MAX_LINKS = 500  # largest number of links, as in robot files


@dataclass(frozen=True, kw_only=True, slots=True)
class Branch:
    """A link and the joint to its parent; the root has no joint."""

    link: Element
    joint: Element | None
    parent: str | None

    @property
    def name(self) -> str:
        """The link's name in the file."""
        return self.link.get("name", "")

    @property
    def kind(self) -> str:
        """Type of the joint, `fixed` for the root."""
        return "fixed" if self.joint is None else self.joint.get("type", "")

    @property
    def where(self) -> str:
        """The joint, for error messages."""
        return "" if self.joint is None else place_of(self.joint)

    @property
    def pose(self) -> pin.SE3:
        """Pose of the link in its parent; the identity for the root."""
        if self.joint is None:
            return pin.SE3.Identity()
        return pose_of(self.joint, where=self.where)


def place_of(element: Element) -> str:
    """Return kind, name and line of an element, for messages."""
    return f"{element.tag} '{element.get('name')}'{at_line(element)}"


def read_tree(path: Path) -> tuple[Element, tuple[Branch, ...]]:
    """Return the element `<robot>` of a URDF file, and its branches depth-first.

    Raises:
        ConfigError: If it is not URDF.
        DescriptionError: If its links and joints do not form a tree.
    """
    if path.suffix.lower() == XACRO:
        robot = parse_xml(expand_xacro(path), source=str(path))
    else:
        robot = read_xml(path)
    _check_root(robot, path)
    links = _by_name(robot, "link", path)
    joints = _by_name(robot, "joint", path)
    if not 1 <= len(links) <= MAX_LINKS:
        raise DescriptionError(
            f"{path}: {len(links)} links; a robot has between 1 and {MAX_LINKS}."
        )
    if "world" in {x.get("link") for x in robot.findall("joint/parent")} - set(links):
        LOG.warning("%s: it has no link 'world', which is the world.", path)
        links["world"] = Element("link", name="world")
    above: dict[str, tuple[str, Element]] = {}
    for joint in joints.values():
        parent = _end(joint, "parent", links, path)
        child = _end(joint, "child", links, path)
        if child in above:
            raise DescriptionError(
                f"{path}: link '{child}' is the child of two joints, "
                f"{place_of(above[child][1])} and {place_of(joint)}; a link has one "
                "parent."
            )
        above[child] = (parent, joint)
    return robot, tuple(_depth_first(links, above, path))


def _check_root(robot: Element, path: Path) -> None:
    templates = {x.tag for x in robot.iter() if x.tag.startswith(PREFIX)}
    parts = [*robot.findall("link"), *robot.findall("joint")]
    inside = (x for part in parts for x in part.iter())
    if templates and (not parts or any(map(_is_template, inside))):
        raise ConfigError(
            f"{path}: this is a xacro file, a template of a URDF. Name it "
            f"{path.stem}.xacro, to expand it here, or expand it first: "
            f"xacro {path.name} > robot.urdf"
        )
    if templates:
        shown = join_first(sorted(templates))
        LOG.warning("%s: not expanded, and not read: %s.", path, shown)
    if robot.tag != "robot":
        hint = " It looks like MJCF: name it .xml." if robot.tag == "mujoco" else ""
        raise ConfigError(
            f"{path}: a URDF begins with <robot>, not <{robot.tag}>.{hint}"
        )


def _is_template(element: Element) -> bool:
    values = element.attrib.values()
    return element.tag.startswith(PREFIX) or any(
        re.search(r"\$[{(]", x) for x in values
    )


def _by_name(robot: Element, tag: str, path: Path) -> dict[str, Element]:
    found: dict[str, Element] = {}
    for element in robot.findall(tag):
        name = element.get("name")
        if not name:
            raise DescriptionError(f"{path}: a <{tag}>{at_line(element)} has no name.")
        if name in found:
            raise DescriptionError(
                f"{path}: two {tag}s are named '{name}':{at_line(found[name])} and"
                f"{at_line(element)}."
            )
        found[name] = element
    return found


def _end(joint: Element, tag: str, links: dict[str, Element], path: Path) -> str:
    element = joint.find(tag)
    name = "" if element is None else element.get("link", "")
    if name not in links:
        raise DescriptionError(
            f"{path}: {place_of(joint)}: its {tag} link '{name}' does not exist."
            f"{did_you_mean(name, links)}"
        )
    return name


def _depth_first(
    links: dict[str, Element], above: dict[str, tuple[str, Element]], path: Path
) -> Iterator[Branch]:
    """Yield the links depth-first, children in the order of their joints."""
    below: dict[str, list[str]] = {}
    for child, (parent, _) in above.items():
        below.setdefault(parent, []).append(child)
    roots = [name for name in links if name not in above]
    if len(roots) > 1:
        shown = join_first([f"'{name}'{at_line(links[name])}" for name in roots])
        raise DescriptionError(
            f"{path}: {len(roots)} links have no parent: {shown}. A robot has one "
            "root; join them by fixed joints."
        )
    seen: set[str] = set()
    stack = list(roots)
    while stack:
        name = stack.pop()
        seen.add(name)
        parent, joint = above.get(name, (None, None))
        yield Branch(link=links[name], joint=joint, parent=parent)
        stack.extend(reversed(below.get(name, [])))
    loop = [f"'{n}'{at_line(link)}" for n, link in links.items() if n not in seen]
    if loop:
        raise DescriptionError(f"{path}: the links {join_first(loop)} form a loop.")


def numbers(
    element: Element,
    key: str,
    count: int,
    *,
    where: str,
    default: Sequence[float] | None = None,
) -> Vector:
    """Read an attribute of finite numbers, shape (count,); raises DescriptionError."""
    text = element.get(key)
    if text is None:
        if default is None:
            raise DescriptionError(f"{where}: <{element.tag}> needs '{key}'.")
        return np.asarray(default, dtype=np.float64)
    try:
        values = np.array([float(word) for word in text.split()], dtype=np.float64)
    except ValueError:
        values = np.array([np.nan])
    if values.shape != (count,) or not np.isfinite(values).all():
        wanted = "a finite number" if count == 1 else f"{count} finite numbers"
        raise DescriptionError(
            f'{where}: <{element.tag} {key}="{text}"> must be {wanted}.'
        )
    return values


def number(
    element: Element, key: str, *, where: str, default: float | None = None
) -> float:
    """Read an attribute of one finite number; errors as in `numbers`."""
    fallback = None if default is None else (default,)
    return float(numbers(element, key, 1, where=where, default=fallback)[0])


def pose_of(element: Element, *, where: str) -> pin.SE3:
    """Read the `<origin>` of an element; the identity if it has none."""
    origin = element.find("origin")
    if origin is None:
        return pin.SE3.Identity()
    zero = (0.0, 0.0, 0.0)
    xyz = numbers(origin, "xyz", 3, where=where, default=zero)
    rpy = numbers(origin, "rpy", 3, where=where, default=zero)
    return pin.SE3(pin.rpy.rpyToMatrix(*rpy), xyz)
