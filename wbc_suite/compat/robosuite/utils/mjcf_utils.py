"""Elements of MJCF text, as trees of `xml.etree.ElementTree`."""

import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from wbc_suite.robot.xml_files import read_xml
from wbc_suite.typing import Vector

RED, GREEN, BLUE, CYAN = [1, 0, 0, 1], [0, 1, 0, 1], [0, 0, 1, 1], [0, 1, 1, 1]
OBJECT_COLLISION_COLOR = [0.5, 0, 0, 1]
ENVIRONMENT_COLLISION_COLOR = [0.5, 0.5, 0, 1]
ROBOT_COLLISION_COLOR = [0, 0.5, 0, 1]
MOUNT_COLLISION_COLOR = [0.5, 0.5, 0, 1]
GRIPPER_COLLISION_COLOR = [0, 0, 0.5, 1]
IMAGE_CONVENTION_MAPPING = {"opengl": 1, "opencv": -1}

NAMED = (
    *("class", "childclass", "name", "objname", "material", "texture", "joint"),
    *("joint1", "joint2", "jointinparent", "geom", "geom1", "geom2", "mesh", "body"),
    *("body1", "body2", "site", "site1", "site2", "tendon", "hfield", "actuator"),
    "fixture",
)
"""Attributes whose values are names of elements."""

_COLORS = {"red": "0.75 0.2 0.18 1", "green": "0.25 0.6 0.3 1"} | {
    "blue": "0.2 0.35 0.7 1",
    "wood": "0.77 0.61 0.44 1",
    "metal": "0.6 0.62 0.65 1",
    "steel": "0.6 0.62 0.65 1",
    "brass": "0.72 0.6 0.3 1",
    "ceramic": "0.9 0.89 0.85 1",
    "plaster": "0.88 0.87 0.84 1",
    "dark": "0.35 0.25 0.18 1",
}

Element = ET.Element


class CustomMaterial:
    """A material by the name of one of robosuite's textures, drawn in a plain colour.

    A `texture` may also be a colour, or the path of a picture.
    """

    def __init__(
        self,
        texture: Any,
        tex_name: str,
        mat_name: str,
        tex_attrib: Mapping[str, Any] | None = None,
        mat_attrib: Mapping[str, Any] | None = None,
        shared: bool = False,
    ) -> None:
        self.name, self.shared = mat_name, shared
        self.mat_attrib = {"name": mat_name} | {
            k: convert_to_string(v) for k, v in (mat_attrib or {}).items()
        }
        self.tex_attrib: dict[str, str] | None = None
        if isinstance(texture, str) and Path(texture).is_file():
            self.tex_attrib = {"name": tex_name, "file": texture, "type": "2d"}
            self.tex_attrib |= {
                k: convert_to_string(v) for k, v in (tex_attrib or {}).items()
            }
            self.mat_attrib["texture"] = tex_name
        elif isinstance(texture, str):
            words = (c for k, c in _COLORS.items() if k in texture.lower())
            self.mat_attrib["rgba"] = next(words, "0.7 0.7 0.7 1")
        elif texture is not None:
            self.mat_attrib["rgba"] = array_to_string(texture)


def xml_path_completion(xml_path: str | Path, root: str | Path | None = None) -> str:
    """Return the path of an MJCF file; one that is not absolute is below `root`."""
    path = Path(xml_path)
    if path.is_absolute() or root is None:
        return str(path)
    return str(Path(root) / path)


def array_to_string(array: Iterable[Any]) -> str:
    """Return numbers as text."""
    return " ".join(str(x) for x in np.asarray(array).tolist())


def string_to_array(string: str) -> Vector:
    """Return the numbers of a text."""
    return np.array([float(x) for x in string.strip().split()])


def convert_to_string(inp: Any) -> str:
    """Return a value as the text of an attribute."""
    if isinstance(inp, str):
        return inp
    if isinstance(inp, bool):
        return str(inp).lower()
    return array_to_string(inp) if isinstance(inp, Iterable) else str(inp)


def new_element(tag: str, name: str | None, **kwargs: Any) -> Element:
    """Return an element; attributes that are None are left out."""
    given = kwargs if name is None else {"name": name, **kwargs}
    return Element(
        tag, {k: convert_to_string(v) for k, v in given.items() if v is not None}
    )


def new_joint(name: str, **kwargs: Any) -> Element:
    """Return a joint."""
    return new_element("joint", name, **kwargs)


def new_actuator(
    name: str, joint: str, act_type: str = "actuator", **kwargs: Any
) -> Element:
    """Return an actuator of a joint."""
    return new_element(act_type, name, joint=joint, **kwargs)


def new_site(
    name: str, rgba: Any = RED, pos: Any = (0, 0, 0), size: Any = (0.005,), **kw: Any
) -> Element:
    """Return a site."""
    return new_element("site", name, rgba=rgba, pos=pos, size=size, **kw)


def new_geom(
    name: str,
    type: str,
    size: Any,
    pos: Any = (0, 0, 0),
    group: int = 0,
    **kwargs: Any,
) -> Element:
    """Return a geom; group 1 is visual."""
    return new_element(
        "geom", name, type=type, size=size, pos=pos, group=group, **kwargs
    )


def new_body(name: str, pos: Any = (0, 0, 0), **kwargs: Any) -> Element:
    """Return a body."""
    return new_element("body", name, pos=pos, **kwargs)


def new_inertial(pos: Any = (0, 0, 0), mass: Any = None, **kwargs: Any) -> Element:
    """Return an inertial element; the inertia is diagonal, small by default."""
    kwargs.setdefault("diaginertia", (1e-6, 1e-6, 1e-6))
    return new_element("inertial", None, pos=pos, mass=mass, **kwargs)


def set_alpha(node: Element, alpha: float = 0.1) -> None:
    """Write the opacity of all elements with a colour."""
    for child in node.iter():
        if "rgba" in child.attrib:
            child.set(
                "rgba", " ".join([*child.get("rgba", "").split()[:3], f"{alpha}"])
            )


def get_size(
    size: Any,
    size_max: Any,
    size_min: Any,
    default_max: Any,
    default_min: Any,
    rng: np.random.Generator | None = None,
) -> list[float]:
    """Return a size, or one drawn uniformly between two."""
    if size is not None:
        return [float(x) for x in size]
    high = default_max if size_max is None else size_max
    low = default_min if size_min is None else size_min
    rng = np.random.default_rng() if rng is None else rng
    return [float(rng.uniform(a, b)) for a, b in zip(low, high, strict=True)]


def add_to_dict(dic: dict[str, list[Any]], **kwargs: Any) -> None:
    """Append values to the lists of a dictionary."""
    for key, value in kwargs.items():
        dic.setdefault(key, []).append(value)


def add_prefix(
    root: Element, prefix: str, exclude: Callable[[str], bool] | None = None
) -> None:
    """Put a prefix before all names in a tree."""
    for element in root.iter():
        for key in NAMED:
            value = element.get(key)
            if not value or value == "world" or value.startswith(prefix):
                continue
            if exclude is None or not exclude(value):
                element.set(key, prefix + value)


def find_elements(
    root: Element,
    tags: str | Iterable[str],
    attribs: Mapping[str, str] | None = None,
    return_first: bool = True,
) -> Any:
    """Return the first element with a tag and attributes, or all; None for none."""
    wanted = {tags} if isinstance(tags, str) else set(tags)
    found = [
        element
        for element in root.iter()
        if element.tag in wanted
        and all(element.get(k) == v for k, v in (attribs or {}).items())
    ]
    if return_first:
        return found[0] if found else None
    return found or None


def find_elements_by_substring(
    root: Element,
    tags: str | Iterable[str],
    substrings: str | Iterable[str],
    attribs: Mapping[str, str] | None = None,
    return_first: bool = False,
) -> Any:
    """Return elements whose name has one of some texts in it; see `find_elements`."""
    texts = [substrings] if isinstance(substrings, str) else list(substrings)
    named = find_elements(root, tags, attribs, return_first=False) or []
    found = [e for e in named if any(text in e.get("name", "") for text in texts)]
    return (found[0] if found else None) if return_first else found or None


def recolor_collision_geoms(
    root: Element, rgba: Any, exclude: Callable[[Element], bool] | None = None
) -> None:
    """Give all geoms of group 0 a colour instead of their material."""
    for geom in root.iter("geom"):
        if geom.get("group", "0") == "0" and not (exclude and exclude(geom)):
            geom.set("rgba", array_to_string(rgba))
            geom.attrib.pop("material", None)


def find_parent(root: Element, child: Element) -> Element | None:
    """Return the element above another."""
    return next((e for e in root.iter() if child in list(e)), None)


def get_elements(root: Element, element_type: str) -> list[Element]:
    """Return all elements of a tag."""
    return list(root.iter(element_type))


def get_ids(sim: Any, elements: Any, element_type: str = "geom") -> Any:
    """Return the indices of elements by name."""
    find = getattr(sim.model, f"{element_type}_name2id")
    return find(elements) if isinstance(elements, str) else [find(e) for e in elements]


def save_sim_model(sim: Any, fname: str) -> None:
    """Write the scene of a simulation as an MJCF file."""
    Path(fname).write_text(sim.model.get_xml(), encoding="utf-8")


def parse_file(fname: str | Path) -> tuple[Element, Path]:
    """Return the root of an MJCF file with absolute paths, and its folder.

    Raises:
        ConfigError: If it cannot be read.
    """
    root, path = read_xml(Path(fname), only_utf8=True), Path(fname).resolve()
    compiler = root.find("compiler")
    dirs = {} if compiler is None else compiler.attrib
    for element in root.iter():
        file = element.get("file")
        if file is not None and not Path(file).is_absolute():
            key = {"mesh": "meshdir", "texture": "texturedir"}.get(element.tag, "")
            below = dirs.get(key) or dirs.get("assetdir") or "."
            element.set("file", str(path.parent / below / file))
    return root, path.parent
