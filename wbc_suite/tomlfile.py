"""Read TOML files into frozen pydantic models, with errors that teach.

Every file of the catalogue, and every file that a user brings, comes in through
`load_model`: one place for size limits, for did-you-mean and for the wording.
"""

import tomllib
import types
import typing
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from wbc_suite.errors import ConfigError, nearest_name

__all__ = [
    "FrozenModel",
    "load_model",
    "parse_model",
    "parse_toml",
    "read_text",
    "read_toml",
]

MAX_BYTES = 4_000_000
"""Largest file that is read; the largest of ours has about 60 kB."""

M = TypeVar("M", bound=BaseModel)


class FrozenModel(BaseModel):
    """Base of everything that is read from a file: frozen, no unknown keys."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        allow_inf_nan=False,
        populate_by_name=True,
        arbitrary_types_allowed=False,
    )


def read_toml(path: Path) -> dict[str, Any]:
    """Parse one TOML file.

    Raises:
        ConfigError: If the file is missing, too large, not UTF-8 or not TOML.
    """
    return parse_toml(read_text(path), source=str(path))


def read_text(path: Path) -> str:
    """Read one text file.

    Raises:
        ConfigError: If the file is missing, too large or not UTF-8.
    """
    try:
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise ConfigError(
                f"{path}: {size} bytes, more than the {MAX_BYTES} that a description "
                "may have. Is this the right file?"
            )
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror}).") from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: not a readable TOML file: {error}") from error


def parse_toml(text: str, *, source: str) -> dict[str, Any]:
    """Parse TOML text.

    Raises:
        ConfigError: If it is not TOML.
    """
    try:
        return tomllib.loads(text)
    except RecursionError as error:
        raise ConfigError(f"{source}: its values are nested too deep.") from error
    except ValueError as error:  # no TOML, or a number of thousands of digits
        raise ConfigError(f"{source}: not a readable TOML file: {error}") from error


def load_model(model: type[M], path: Path) -> M:
    """Read one TOML file into a model.

    Raises:
        ConfigError: Names file, key, value, the rule, and the nearest legal name.
    """
    return parse_model(model, read_toml(path), source=str(path))


def parse_model(
    model: type[M],
    data: object,
    *,
    source: str,
    error: type[ConfigError] = ConfigError,
) -> M:
    """Validate plain data against a model, with errors in our words."""
    try:
        return model.model_validate(data)
    except ValidationError as failure:
        lines = [_explain(model, item) for item in failure.errors()[:8]]
        more = failure.error_count() - len(lines)
        if more > 0:
            lines.append(f"... and {more} more")
        raise error(f"{source}: " + "; ".join(lines)) from failure


def _explain(model: type[BaseModel], item: Any) -> str:  # pydantic's ErrorDetails
    loc: tuple[int | str, ...] = item["loc"]
    key = _dotted(loc, model)
    if item["type"] == "extra_forbidden":
        known = _legal_keys(model, loc[:-1])
        close = nearest_name(str(loc[-1]), known)
        hint = f" Did you mean '{close}'?" if close else ""
        return f"unknown key '{key}'.{hint} Known: {', '.join(sorted(known))}"
    if item["type"] == "missing":
        return f"missing key '{key}'"
    value = _shorten(item["input"])
    message = str(item["msg"]).removeprefix("Value error, ")
    hint = ""
    if item["type"] in ("literal_error", "enum") and isinstance(item["input"], str):
        options = str(item["ctx"]["expected"]).replace("'", "").replace(" or ", ", ")
        close = nearest_name(item["input"], options.split(", "))
        hint = f" Did you mean '{close}'?" if close else ""
    where = f"key '{key}' = {value}: " if key else ""
    return f"{where}{message}.{hint}"


def _shorten(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."


def _dotted(loc: tuple[int | str, ...], model: type[BaseModel]) -> str:
    """Write a location as in TOML: `link[3].joint.range`; union tags are dropped."""
    text = ""
    options: list[type[BaseModel]] = [model]
    for part in loc:
        if isinstance(part, int):
            text += f"[{part}]"
            continue
        tagged = [m for m in options if part in _tags(m)]
        if tagged and len(options) > 1:
            options = tagged
            continue
        if not options and _is_type(part):  # which of `float | tuple` it was not
            continue
        text += f".{part}" if text else part
        options = _below(options, part)
    return text


def _legal_keys(model: type[BaseModel], loc: tuple[int | str, ...]) -> list[str]:
    """Return the keys that the table at `loc` may have."""
    options: list[type[BaseModel]] = [model]
    for part in loc:
        if isinstance(part, int):
            continue
        tagged = [m for m in options if part in _tags(m)]
        several = tagged and len(options) > 1
        options = tagged if several else _below(options, part)
    return [f.alias or n for m in options for n, f in m.model_fields.items()]


def _tags(model: type[BaseModel]) -> tuple[object, ...]:
    """Return the literals that select this model in a discriminated union."""
    for name, field in model.model_fields.items():
        if typing.get_origin(field.annotation) is typing.Literal:
            literals = typing.get_args(field.annotation)
            if len(literals) == 1 or name == "type":
                return literals
    return ()


def _is_type(part: str) -> bool:
    """Whether a part of a location is pydantic's name of a type, and no key."""
    return part.startswith(("constrained-", "tuple[", "literal[", "list[")) or part in (
        *("float", "int", "str", "bool", "none"),
    )


def _below(options: list[type[BaseModel]], part: str) -> list[type[BaseModel]]:
    """Return the models of a key's value; a name in a table of models changes none."""
    fields = {
        key for m in options for n, f in m.model_fields.items() for key in (n, f.alias)
    }
    if part not in fields:
        return options
    return [n for m in options for n in _field_models(m, part)]


def _field_models(model: type[BaseModel], key: str) -> list[type[BaseModel]]:
    """Return the models that the value of a key may be parsed into."""
    for name, field in model.model_fields.items():
        if key in (name, field.alias):
            return _models_in(field.annotation)
    return []


def _models_in(annotation: object) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and not isinstance(annotation, types.GenericAlias):
        return [annotation] if issubclass(annotation, BaseModel) else []
    return [m for a in typing.get_args(annotation) for m in _models_in(a)]
