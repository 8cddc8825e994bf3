"""Read the elements of a URDF file and check that they form one tree."""

import logging
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from wbc_suite.errors import ConfigError, DescriptionError, nearest_name
from wbc_suite.robot.xml_files import children, read_xml

__all__ = ["Branch", "UrdfTree", "read_tree"]

LOG = logging.getLogger(__name__)
MAX_LINKS = 500
"""As many links as our own format allows."""

Element = ElementTree.Element


@dataclass(frozen=True, kw_only=True, slots=True)
class Branch:
    """A link and the joint that it hangs on; the root has none."""

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


@dataclass(frozen=True, kw_only=True, slots=True)
class UrdfTree:
    """One URDF file: its element `<robot>`, and its branches in depth-first order."""

    robot: Element
    branches: tuple[Branch, ...]

    def below(self, name: str) -> list[Branch]:
        """Return the branches that hang on a link."""
        return [branch for branch in self.branches if branch.parent == name]


def read_tree(path: Path) -> UrdfTree:
    """Read a URDF file.

    Raises:
        ConfigError: If it is no URDF.
        DescriptionError: If its links and joints form no tree.
    """
    robot = read_xml(path)
    _check_root(robot, path)
    links = _by_name(robot, "link", path)
    joints = _by_name(robot, "joint", path)
    if not 1 <= len(links) <= MAX_LINKS:
        raise DescriptionError(
            f"{path}: {len(links)} links; a robot has between 1 and {MAX_LINKS}."
        )
    above: dict[str, tuple[str, Element]] = {}
    for name, joint in joints.items():
        parent = _end(joint, "parent", links, path)
        child = _end(joint, "child", links, path)
        if child in above:
            other = above[child][1].get("name")
            raise DescriptionError(
                f"{path}: link '{child}' hangs on two joints, '{other}' and '{name}'; "
                "a link has one parent."
            )
        above[child] = (parent, joint)
    return UrdfTree(robot=robot, branches=tuple(_ordered(links, above, path)))


def _check_root(robot: Element, path: Path) -> None:
    if any(element.tag.startswith("xacro:") for element in robot.iter()):
        raise ConfigError(
            f"{path}: this is a xacro file, a template of a URDF; expand it first "
            "('xacro FILE > robot.urdf')."
        )
    if robot.tag != "robot":
        hint = " It looks like MJCF: name it .xml." if robot.tag == "mujoco" else ""
        raise ConfigError(
            f"{path}: a URDF begins with <robot>, not <{robot.tag}>.{hint}"
        )


def _by_name(robot: Element, tag: str, path: Path) -> dict[str, Element]:
    found: dict[str, Element] = {}
    for element in children(robot, tag):
        name = element.get("name")
        if not name:
            raise DescriptionError(f"{path}: a <{tag}> has no name.")
        if name in found:
            raise DescriptionError(f"{path}: two {tag}s are called '{name}'.")
        found[name] = element
    return found


def _end(joint: Element, tag: str, links: dict[str, Element], path: Path) -> str:
    element = joint.find(tag)
    name = "" if element is None else element.get("link", "")
    if name not in links:
        close = nearest_name(name, links)
        hint = f" Did you mean '{close}'?" if close else ""
        raise DescriptionError(
            f"{path}: joint '{joint.get('name')}': its {tag} link '{name}' does not "
            f"exist.{hint}"
        )
    return name


def _ordered(
    links: dict[str, Element], above: dict[str, tuple[str, Element]], path: Path
) -> Iterator[Branch]:
    """Yield the links depth-first, children in the order of their joints."""
    below: dict[str, list[str]] = {}
    for child, (parent, _) in above.items():
        below.setdefault(parent, []).append(child)
    roots = [name for name in links if name not in above]
    if len(roots) > 1:
        shown = ", ".join(f"'{name}'" for name in roots[:6])
        raise DescriptionError(
            f"{path}: {len(roots)} links hang on nothing: {shown}. A robot has one "
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
    loop = [name for name in links if name not in seen]
    if loop:
        shown = ", ".join(f"'{name}'" for name in loop[:6])
        raise DescriptionError(
            f"{path}: the links {shown} hang on each other in a loop."
        )
