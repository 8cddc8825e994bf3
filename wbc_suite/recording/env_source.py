"""The description of an environment in a dataset, and the environment made from it."""

import json
import platform
import re
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, NoReturn

from wbc_suite import __version__
from wbc_suite.benchmark import BENCHMARKS
from wbc_suite.config_files import parse_json
from wbc_suite.control import load_composite_controller_config
from wbc_suite.envs import RobotEnv
from wbc_suite.envs.config import EnvConfig
from wbc_suite.errors import DatasetError, WbcError, shortened
from wbc_suite.recording.dataset import Dataset
from wbc_suite.recording.episode import Fact

PACKAGE = "wbc_suite"
GYM_TYPE = 2  # type of Gymnasium environments in robomimic's `env_args`
PACKAGES = ("mujoco", "pin", "numpy", "gymnasium", "h5py", "daqp")
MAX_TEXT = 1_000_000  # characters of env_args
SHOWN_KEYS = 5  # of those that differ
_SHOWN = {"render_mode", "render_camera", "render_size", "render_preset", "skin"}
"""Arguments of rendering, which do not change an episode."""
_PATH = re.compile(r"[/\\:]|\.(toml|json|xml|urdf|py)\Z", re.IGNORECASE)
_NAMES = ("robots", "arena", "controller_configs", "gripper_types", "base_types")
_NAMES += ("placement_initializer",)
_SIZES = ("camera_heights", "camera_widths")
MAX_PIXELS = 2048  # of a camera's side, unless the dataset is trusted


@dataclass(frozen=True, kw_only=True, slots=True)
class EnvSource:
    """Name and arguments of an environment.

    `arguments` are plain data; `missing` names those that are not, such as a user's
    sampler. `package` is `wbc_suite`, or another one.
    """

    benchmark: str
    arguments: Mapping[str, Any]
    package: str = PACKAGE
    missing: tuple[str, ...] = ()

    @classmethod
    def of(cls, env: Any) -> "EnvSource":
        """Describe an environment; raise DatasetError if it is not of this package."""
        inner = env.unwrapped
        if not isinstance(inner, RobotEnv):
            raise DatasetError(
                f"Only wbc_suite environments are recorded, not {inner}."
            )
        benchmark, given = inner.made_of
        kept = {k: v for k, v in given.items() if k not in _SHOWN}
        plain = {k: v for k, v in kept.items() if _is_plain(v)}
        missing = sorted(set(kept) - set(plain))
        if not isinstance(benchmark, str | Path):
            missing.append("benchmark")
            benchmark = inner.benchmark.name
        name = _lasting_name(str(benchmark))
        return cls(benchmark=name, arguments=plain, missing=tuple(missing))

    @classmethod
    def parse(cls, env_args: str | None) -> "EnvSource":
        """Parse `env_args` of a dataset; raise DatasetError if they are none."""
        if not env_args:
            raise DatasetError("The dataset does not name its environment.")
        fields = _parse_json(env_args)
        if "env_name" not in fields:
            raise DatasetError("`env_args` does not name an environment.")
        name, arguments = fields["env_name"], fields.get("env_kwargs", {})
        if not isinstance(name, str) or not isinstance(arguments, dict):
            raise DatasetError("`env_args`: env_name or env_kwargs has a wrong type.")
        return cls(
            benchmark=name,
            arguments=arguments,
            package=str(fields.get("package", "elsewhere")),
            missing=tuple(map(str, fields.get("missing") or ())),
        )

    @property
    def text(self) -> str:
        """The description in the form of robomimic's `env_args`."""
        fields = {
            "env_name": self.benchmark,
            "env_version": __version__,
            "type": GYM_TYPE,
            "env_kwargs": dict(self.arguments),
            "package": self.package,
        }
        if self.missing:
            fields["missing"] = list(self.missing)
        return json.dumps(fields, sort_keys=True, default=_plain)

    def build(self, *, trust_files: bool = False, **changes: Any) -> RobotEnv:
        """Make the environment for replay; rendering arguments are left out.

        With `trust_files`, names may be paths of files and modules here. `changes`
        replace given arguments.

        Raises:
            DatasetError: If it cannot be made from the description.
        """
        lost = set(self.missing) - set(changes)
        if lost:
            raise DatasetError(
                f"The dataset does not contain {', '.join(sorted(lost))}: make the "
                "environment yourself, and replay in it."
            )
        taken = set(EnvConfig.model_fields) - _SHOWN
        known = {k: v for k, v in self.arguments.items() if k in taken}
        if not trust_files:
            _refuse_paths([self.benchmark, *(known.get(k) for k in _NAMES)])
            if known.get("arena") is not None:
                _refuse_path(known["arena"])  # it has no name but its file
            _refuse_sizes([known.get(k) for k in _SIZES if k not in changes])
        try:
            return RobotEnv(self.benchmark, **{**known, **changes})
        except WbcError as error:
            raise DatasetError(
                f"The environment {self.benchmark} with {known!s:.200} "
                f"cannot be made here: {error}"
            ) from error


def _lasting_name(benchmark: str) -> str:
    """Return a benchmark's name as registered, and a file's with its folder."""
    if benchmark.endswith(".toml"):
        return str(Path(benchmark).resolve())
    return BENCHMARKS.spelled(benchmark) if benchmark in BENCHMARKS else benchmark


def differences(one: str, other: str) -> str:
    """Return which keys of two `env_args` differ, with both values, in words."""
    first, second = (_flat(_parse_json(text or "{}")) for text in (one, other))
    found = [
        f"{key} is {first.get(key, 'absent')} and {second.get(key, 'absent')}"
        for key in sorted(first.keys() | second.keys())
        if first.get(key, "absent") != second.get(key, "absent")
    ]
    return "; ".join(found[:SHOWN_KEYS])


def _flat(value: Any, path: str = "") -> dict[str, str]:
    """Return the values of nested dictionaries by their keys, shortened."""
    if not isinstance(value, dict):
        return {path or "env_args": shortened(json.dumps(value), 60)}
    found: dict[str, str] = {}
    for key, inner in value.items():
        outer = "" if key == "env_kwargs" else f"{path}.{key}" if path else str(key)
        found |= _flat(inner, outer)
    return found


def header_of(env: Any) -> dict[str, Fact]:
    """Return the attributes of `data`, common to all episodes of an environment."""
    inner = env.unwrapped
    versions = {"wbc-suite": __version__, "python": platform.python_version()}
    versions |= {"system": platform.system()} | {p: _version(p) for p in PACKAGES}
    source = EnvSource.of(env)
    controllers = [
        load_composite_controller_config(given, robot)
        for given, robot in zip(inner.config.controller_list, inner.robots, strict=True)
    ]
    space = inner.action_space
    layout = [
        {"name": s.name, "kind": str(s.kind), "labels": list(s.labels)}
        for s in inner.action_layout.slices
    ]
    return {
        "env_args": source.text,
        "env": inner.benchmark.name,
        "control_freq": float(inner.config.control_freq),
        "repository_version": __version__,
        "versions": json.dumps(versions),
        "controller_config": json.dumps(controllers, default=_plain),
        "action_layout": json.dumps(layout),
        "action_bounds": json.dumps([space.low, space.high], default=_plain),
    }


def rebuild(dataset: Dataset, *, trust_files: bool = False, **changes: Any) -> RobotEnv:
    """Make the environment that a dataset is of; see `EnvSource.build`."""
    header = dataset.header
    env_args = header.get("env_args")
    if env_args is None and "env" in header:  # robosuite's raw files
        arguments = _parse_json(str(header.get("env_info", "{}")))
        env_args = json.dumps({"env_name": header["env"], "env_kwargs": arguments})
    source = EnvSource.parse(None if env_args is None else str(env_args))
    return source.build(trust_files=trust_files, **changes)


def _parse_json(text: str) -> dict[str, Any]:
    source = "The description of its environment"
    return parse_json(text[:MAX_TEXT], source=source, error=DatasetError)


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "unknown"


def _is_plain(value: Any) -> bool:
    try:
        json.dumps(value, default=_plain)
    except TypeError:
        return False
    return True


def _plain(value: Any) -> Any:
    """Convert paths, arrays and NumPy numbers for JSON."""
    if hasattr(value, "__fspath__"):
        return str(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(type(value).__name__)


def _refuse_paths(values: list[Any]) -> None:
    """Refuse arguments that would make the package read files, or import modules."""
    waiting = list(values)
    while waiting:
        value = waiting.pop()
        if isinstance(value, dict):
            waiting += value.values()
        elif isinstance(value, list):
            waiting += value
        elif isinstance(value, str) and _PATH.search(value):
            _refuse_path(value)


def _refuse_path(value: Any) -> NoReturn:
    raise DatasetError(
        "The description of the environment names a file or a module, "
        f"'{value!s:.80}'. If you trust it, use --trust-files."
    )


def _refuse_sizes(values: list[Any]) -> None:
    """Refuse pictures that fill the memory."""
    for value in values:
        sides = value if isinstance(value, list) else [value]
        if len(sides) > 100 or any(
            isinstance(side, int | float) and side > MAX_PIXELS for side in sides
        ):
            raise DatasetError(
                f"The description asks for pictures of {value!s:.60} pixels; at most "
                f"{MAX_PIXELS} are taken. If you trust it, use --trust-files."
            )
