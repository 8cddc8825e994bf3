"""Write a robot description as one component file (TOML)."""

import json
from collections.abc import Iterator
from typing import Any, Literal, TypeAlias, cast

from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import Elements
from wbc_suite.robot.robot_file import SOURCES, Component, Header

ONE_A_LINE = ("visual", "collision", "spheres", "sections", "exclude")
"""Lists that are written with one entry per line."""


def write_toml(robot: RobotDescription) -> str:
    """Write a robot as the text of one component file.

    An assembly is written as one robot. Values that equal a default are omitted.
    Numbers keep all digits, so reading the text gives an equal robot.
    """
    fields = as_component(robot).model_dump(by_alias=True, exclude_defaults=True)
    head = {key: fields.pop(key) for key in ("format", "component")}
    return toml_text(head | fields)


def as_component(
    robot: RobotDescription, kind: Literal["body", "gripper"] = "body"
) -> Component:
    """Return a robot as one component."""
    data: dict[str, Any] = {key: getattr(robot, key) for key in Elements.model_fields}
    data["synergies"] = tuple(s for own in robot.synergies.values() for s in own)
    return Component(
        format=1,
        component=Header(kind=kind, **{key: getattr(robot, key) for key in SOURCES}),
        **data,
    )


def toml_text(fields: "Table") -> str:
    """Write plain data as TOML: values, then one table for each dict or list of these.

    Entries that are None are left out.
    """
    given = {key: value for key, value in fields.items() if value is not None}
    tabular = {key: x for key, x in given.items() if x and _is_table(x)}
    plain = [f"{key} = {_inline(x)}" for key, x in given.items() if key not in tabular]
    tables = ["\n".join(plain)]
    for name, value in tabular.items():
        tables += _tables(name, value)
    return "\n\n".join(tables) + "\n"


def _is_table(value: Any) -> bool:
    rows = cast(list[Any], value if isinstance(value, list) else [value])
    return all(isinstance(row, dict) for row in rows)


Table: TypeAlias = dict[str, Any]  # a model as plain data


def _tables(name: str, value: Table | list[Table]) -> Iterator[str]:
    if not isinstance(value, dict):
        for item in value:
            yield _table(f"[[{name}]]", item)
    elif name == "keyframe":
        for key, item in value.items():
            yield _table(f"[{name}.{key}]", item)
    else:
        yield _table(f"[{name}]", value)


def _table(head: str, items: Table) -> str:
    rows = [head]
    for key, value in _sorted(items).items():
        text = _inline(value)
        if key in ONE_A_LINE:
            text = "[\n" + "".join(f"  {_inline(item)},\n" for item in value) + "]"
        rows.append(f"{key} = {text}")
    return "\n".join(rows)


def _sorted(items: Table) -> Table:
    """Return the table with its identifying keys first."""
    first = [key for key in ("name", "shape", "parent", "link") if key in items]
    return {key: items[key] for key in dict.fromkeys([*first, *items])}


def _inline(value: Any) -> str:
    match value:
        case str():
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        case bool():
            return str(value).lower()
        case dict():
            table = _sorted(cast(Table, value))
            pairs = [f"{key} = {_inline(item)}" for key, item in table.items()]
            return "{ " + ", ".join(pairs) + " }" if pairs else "{}"
        case list() | tuple():
            items = cast(list[Any], value)
            return "[" + ", ".join(_inline(item) for item in items) + "]"
        case _:
            return _number(float(value))


def _number(value: float) -> str:
    """Write integers without a point, other numbers with all digits."""
    whole = value.is_integer() and abs(value) < 1e15
    return str(int(value)) if whole else repr(value)
