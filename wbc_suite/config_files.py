"""Read TOML files into frozen pydantic models, with errors that name file and key."""

import json
import re
import tomllib
import types
import typing
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, ValidationError
from pydantic_core import CoreSchema, core_schema

from wbc_suite.errors import (
    ConfigError,
    WbcError,
    did_you_mean,
    join_first,
    shortened,
)
from wbc_suite.files import read_text

MAX_DEPTH = 30  # parts of a dotted key
SHOWN = 8  # faults in a message

_PART = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')"""
_DOTTED = rf"{_PART}(?:[ \t]*\.[ \t]*{_PART})*"
_DEEP_KEY = re.compile(rf"(?<![\w-]){_PART}(?:[ \t]*\.[ \t]*{_PART}){{{MAX_DEPTH}}}")
_TABLE = re.compile(rf"\s*(\[\[?)\s*({_DOTTED})\s*\]\]?\s*(?:#.*)?$")
_VALUE = re.compile(rf"\s*({_DOTTED})\s*=")

M = TypeVar("M", bound=BaseModel)


def _whole(value: Any) -> Any:
    if isinstance(value, str | bool | np.bool_):
        raise ValueError("must be a whole number")
    return value


def _truth(value: Any) -> Any:
    if not isinstance(value, bool | np.bool_):
        raise ValueError("must be true or false")
    return bool(value)


_CHECKED = {"int": _whole, "bool": _truth}


def _unconverted(schema: Any) -> Any:
    """Return a part of a schema whose numbers take neither texts nor booleans."""
    match schema:
        case {"type": "float"}:
            return schema | {"strict": True}  # takes whole numbers, and NumPy's
        case {"type": "int" | "bool" as kind}:
            return core_schema.no_info_before_validator_function(_CHECKED[kind], schema)
        case dict():
            return {key: _unconverted(value) for key, value in schema.items()}
        case list():
            return [_unconverted(item) for item in schema]
        case _:
            return schema


class FrozenModel(BaseModel):
    """Base of models that are read from a file; a text is no number, and true not 1."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, populate_by_name=True
    )

    @classmethod
    def __get_pydantic_core_schema__(
        cls, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Return the schema in which nothing is converted to a number."""
        return _unconverted(handler(source))


def read_toml(path: Path) -> dict[str, Any]:
    """Parse one TOML file; raises ConfigError."""
    return parse_toml(read_text(path), source=str(path))


def parse_toml(text: str, *, source: str) -> dict[str, Any]:
    """Parse TOML text; raises ConfigError."""
    if _DEEP_KEY.search(text):  # which costs tomllib a time that is quadratic
        raise ConfigError(f"{source}: a key has more than {MAX_DEPTH} parts.")
    try:
        return tomllib.loads(text)
    except RecursionError as error:
        raise ConfigError(f"{source}: the values are nested too deeply.") from error
    except ValueError as error:  # not TOML, or a number with thousands of digits
        raise ConfigError(f"{source}: not a readable TOML file: {error}") from error


def read_json(path: Path) -> dict[str, Any]:
    """Parse one JSON file that holds an object; raises ConfigError."""
    return parse_json(read_text(path), source=str(path), parse_constant=_no_constant)


def parse_json(
    text: str, *, source: str, error: type[WbcError] = ConfigError, **options: Any
) -> dict[str, Any]:
    """Parse an object of JSON, with options of `json.loads`; raises an `error`."""
    try:
        found = json.loads(text, **options)
    except (ValueError, RecursionError) as cause:
        raise error(f"{source}: not readable JSON: {cause}") from cause
    if not isinstance(found, dict):
        kind = type(found).__name__
        raise error(f"{source}: holds {kind}, not an object {{...}}.")
    return found


def _no_constant(text: str) -> float:
    raise ValueError(f"{text} is not JSON")


def load_model(model: type[M], path: Path) -> M:
    """Read one TOML file into a model; raises ConfigError as `parse_model` does."""
    return parse_model(model, read_toml(path), source=str(path))


def parse_model(
    model: type[M],
    data: object,
    *,
    source: str,
    within: str = "",
    error: type[ConfigError] = ConfigError,
) -> M:
    """Validate plain data against a model.

    Raises:
        ConfigError: Or another `error`. Names the source (a file or an item), key,
            value and rule of the first faults; `within` is the key of the data in it.
    """
    try:
        return model.model_validate(data)
    except ValidationError as failure:
        text, found = _text(source), failure.errors()
        faults = [_explain(model, item, within, text) for item in found[:SHOWN]]
        faults[:-1] = [fault.removesuffix(".") for fault in faults[:-1]]
        faults += [""] * (len(found) - len(faults))
        shown = join_first(faults, limit=SHOWN, separator="; ")
        raise error(f"{source}: {shown}") from failure


def _text(source: str) -> str:
    """Return the content of a TOML file; nothing if the source is none."""
    path = Path(source)
    return read_text(path) if path.suffix == ".toml" and path.is_file() else ""


def _lines(text: str) -> dict[str, int]:
    """Return where keys stand in a TOML file, by keys as `_resolve` writes them."""
    table, counts, lines = "", dict[str, int](), dict[str, int]()
    for number, line in enumerate(text.splitlines(), 1):
        if header := _TABLE.match(line):
            table = ""
            *parents, last = _parts(header[2])
            for part in parents:
                table += f".{part}" if table else part
                table += f"[{counts[table] - 1}]" if table in counts else ""
            table += f".{last}" if table else last
            if header[1] == "[[":
                counts[table] = counts.get(table, 0) + 1
                table += f"[{counts[table] - 1}]"
            lines.setdefault(table, number)
        elif value := _VALUE.match(line):
            key = ".".join(filter(None, (table, *_parts(value[1]))))
            lines.setdefault(key, number)
    return lines


def located(key: str, source: str) -> str:
    """Return `key 'a.b' (line 3)`, the line of a key in a TOML file, if it is one."""
    return f"key '{key}'{_line(key, _lines(_text(source)))}"


_NAMED = re.compile(r"""\bname\s*=\s*["']([\w.-]+)["']""")
_QUOTED = re.compile(r"(group |keyframe |)'([\w.-]+)'")


def _with_lines(message: str, text: str) -> str:
    """Add the line of each item, keyframe and group that a message quotes by name."""
    named = dict[str, int]()
    for number, line in enumerate(text.splitlines(), 1):
        for name in _NAMED.findall(line):
            named.setdefault(name, number)
    for key, number in _lines(text).items():
        table, _, name = key.partition(".")
        if table in ("keyframe", "groups"):
            named[f"{table.removesuffix('s')} {name}"] = number

    def located(found: re.Match[str]) -> str:
        number = named.pop(found[1] + found[2], None)
        return found[0] + (f" (line {number})" if number else "")

    return _QUOTED.sub(located, message)


def _parts(key: str) -> list[str]:
    return [part.strip("\"'") for part in re.findall(_PART, key)]


def _line(key: str, lines: dict[str, int]) -> str:
    """Return " (line 3)" for a key, or for the nearest one that holds it."""
    while key and key not in lines:
        key = key[: max(key.rfind("."), key.rfind("["), 0)]
    return f" (line {lines[key]})" if key else ""


_RULES = {
    "float_type": "must be a number",
    "int_type": "must be a whole number",
    "int_from_float": "must be a whole number",
    "int_parsing_size": "must be a smaller number",
    "finite_number": "must be a finite number",
    "string_type": "must be a text",
    "tuple_type": "must be a list",
    "list_type": "must be a list",
    "dict_type": "must be a table",
    "model_type": "must be a table",
    "model_attributes_type": "must be a table",
    "path_type": "must be the path of a file",
    "string_pattern_mismatch": "must have the form {pattern}",
    "string_too_short": "must have {min_length} characters or more",
    "string_too_long": "must have {max_length} characters or less",
    "too_short": "must have {min_length} items or more, not {actual_length}",
    "too_long": "must have {max_length} items or less, not {actual_length}",
}
"""What is allowed, by pydantic's types of errors."""


def _explain(model: type[BaseModel], item: Any, within: str, text: str) -> str:
    """Return one of pydantic's `ErrorDetails` as a sentence with the nearest name."""
    loc: tuple[int | str, ...] = item["loc"]
    kind, given, context = item["type"], item["input"], item.get("ctx", {})
    own, _ = _resolve(loc, model)
    key = ".".join(filter(None, (within, own)))
    if kind.startswith("union_tag"):  # the key that says which table it is
        key += "." + str(context["discriminator"]).strip("'")
        given = context.get("tag")
    line = _line(key, _lines(text))
    if kind == "extra_forbidden":
        _, tables = _resolve(loc[:-1], model)
        known = [f.alias or n for m in tables for n, f in m.model_fields.items()]
        hint = did_you_mean(str(loc[-1]), known)
        return f"unknown key '{key}'{line}.{hint} Known: {', '.join(sorted(known))}"
    if kind in ("missing", "union_tag_not_found"):
        return f"missing key '{key}'{line}"
    message, hint = str(item["msg"]).removeprefix("Value error, "), ""
    message = message.replace("Input should be", "must be")
    expected = str(context.get("expected") or context.get("expected_tags", ""))
    if expected:
        message = f"must be {'one of ' * (kind == 'union_tag_invalid')}{expected}"
        options = expected.replace("'", "").replace(" or ", ", ").split(", ")
        hint = did_you_mean(given, options) if isinstance(given, str) else ""
    if kind in _RULES:
        message = _RULES[kind].format_map(context)
    message = message.removesuffix(".") + "." * (not message.endswith("?")) + hint
    if not key:
        return _with_lines(message, text)
    return f"key '{key}' = {shortened(repr(given))}{line}: {message}"


_TYPE_NAME = re.compile(
    r"(constrained-|function-|tuple\[|literal\[|list\[).*|float|int|str|bool|none"
)
"""Pydantic's names of types, which stand among the keys of a location."""


def _resolve(
    loc: tuple[int | str, ...], model: type[BaseModel]
) -> tuple[str, list[type[BaseModel]]]:
    """Return a location as in TOML, `link[3].joint.range`, and the models it may have.

    The tags that pydantic inserts for the members of a union are dropped.
    """
    text = ""
    models: list[type[BaseModel]] = [model]
    for part in loc:
        if isinstance(part, int):
            text += f"[{part}]"
            continue
        tagged = [m for m in models if part in _tags(m)]
        if tagged and len(models) > 1:
            models = tagged
        elif models or not _TYPE_NAME.fullmatch(part):
            text += f".{part}" if text else part
            models = _value_models(models, part)
    return text, models


def _tags(model: type[BaseModel]) -> tuple[object, ...]:
    """Return the literals that select this model in a discriminated union."""
    for name, field in model.model_fields.items():
        if typing.get_origin(field.annotation) is typing.Literal:
            literals = typing.get_args(field.annotation)
            if len(literals) == 1 or name == "type":
                return literals
    return ()


def _value_models(models: list[type[BaseModel]], key: str) -> list[type[BaseModel]]:
    """Return the models of a key's value; a key of a free table keeps the models."""
    fields = [
        field
        for model in models
        for name, field in model.model_fields.items()
        if key in (name, field.alias)
    ]
    if not fields:
        return models
    return [found for field in fields for found in _models_in(field.annotation)]


def _models_in(annotation: object) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and not isinstance(annotation, types.GenericAlias):
        return [annotation] if issubclass(annotation, BaseModel) else []
    return [m for a in typing.get_args(annotation) for m in _models_in(a)]
