"""Where episodes come from: an environment as text, and back."""

import json
import platform
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from wbc_suite import __version__
from wbc_suite.control import load_composite_controller_config
from wbc_suite.envs import RobotEnv
from wbc_suite.envs.config import EnvConfig
from wbc_suite.errors import DatasetError, WbcError
from wbc_suite.recording.dataset import Dataset
from wbc_suite.recording.episode import Fact

__all__ = ["EnvSource", "header_of", "rebuild"]

GYM_TYPE = 2
"""What robomimic's `env_args` calls environments that Gymnasium makes."""
PACKAGES = ("mujoco", "pin", "numpy", "gymnasium", "h5py", "daqp")
MAX_TEXT = 1_000_000  # characters of env_args
_SHOWN = {"render_mode", "render_camera", "render_size", "render_preset", "skin"}
"""Arguments that change what is shown, and not what happens."""
_NAMES = ("robots", "controller_configs", "gripper_types", "base_types")


@dataclass(frozen=True, kw_only=True, slots=True)
class EnvSource:
    """What an environment is made of.

    Attributes:
        benchmark: Its name.
        arguments: Plain data.
        package: Who made it: `wbc_suite`, or another for files from elsewhere.
        missing: Arguments that text cannot tell, such as a sampler of one's own.
    """

    benchmark: str
    arguments: Mapping[str, Any]
    package: str = "wbc_suite"
    missing: tuple[str, ...] = ()

    @classmethod
    def of(cls, env: Any) -> "EnvSource":
        """Describe an environment.

        Raises:
            DatasetError: If it is none of ours.
        """
        inner = env.unwrapped
        if not isinstance(inner, RobotEnv):
            raise DatasetError(f"Only environments of ours are recorded, not {inner}.")
        benchmark, given = inner.made_of
        kept = {k: v for k, v in given.items() if k not in _SHOWN}
        plain = {k: v for k, v in kept.items() if _is_plain(v)}
        missing = sorted(set(kept) - set(plain))
        if not isinstance(benchmark, str):
            missing.append("benchmark")
        name = inner.benchmark.name
        return cls(benchmark=name, arguments=plain, missing=tuple(missing))

    @classmethod
    def parse(cls, env_args: str | None) -> "EnvSource":
        """Read the text of a dataset.

        Raises:
            DatasetError: If it is missing or is no description of an environment.
        """
        if not env_args:
            raise DatasetError("The dataset does not say what environment it is of.")
        told = _parse_json(env_args)
        if not isinstance(told, dict) or "env_name" not in told:
            raise DatasetError("`env_args` does not name an environment.")
        name, arguments = told["env_name"], told.get("env_kwargs", {})
        if not isinstance(name, str) or not isinstance(arguments, dict):
            raise DatasetError("`env_args` has no name, or no arguments by name.")
        return cls(
            benchmark=name,
            arguments=arguments,
            package=str(told.get("package", "elsewhere")),
            missing=tuple(map(str, told.get("missing") or ())),
        )

    @property
    def text(self) -> str:
        """The description as robomimic's `env_args` has it."""
        told = {
            "env_name": self.benchmark,
            "env_version": __version__,
            "type": GYM_TYPE,
            "env_kwargs": dict(self.arguments),
            "package": self.package,
        }
        if self.missing:
            told["missing"] = list(self.missing)
        return json.dumps(told, sort_keys=True, default=_plain)

    def build(self, *, trust_files: bool = False, **changes: Any) -> RobotEnv:
        """Make the environment again, for playing; nothing is shown unless asked for.

        Args:
            trust_files: Whether names in the dataset may be paths of files here.
            changes: Arguments to make it with instead.

        Raises:
            DatasetError: If it cannot be made from what the dataset says.
        """
        lost = set(self.missing) - set(changes)
        if lost:
            raise DatasetError(
                f"The dataset cannot tell {', '.join(sorted(lost))}: make the "
                "environment yourself and replay in that."
            )
        known = {k: v for k, v in self.arguments.items() if k in EnvConfig.model_fields}
        known = {k: v for k, v in known.items() if k not in _SHOWN}
        if not trust_files:
            _refuse_paths([self.benchmark, *(known.get(k) for k in _NAMES)])
        try:
            return RobotEnv(self.benchmark, **{**known, **changes})
        except WbcError as error:
            raise DatasetError(
                f"The dataset is of {self.benchmark} with {dict(known)!s:.200}, which "
                f"cannot be made here: {error}"
            ) from error


def header_of(env: Any) -> dict[str, Fact]:
    """Return what all episodes of an environment have in common, for `data`."""
    inner = env.unwrapped
    versions = {name: _version(name) for name in PACKAGES}
    versions |= {
        "wbc-suite": __version__,
        "python": platform.python_version(),
        "system": platform.system(),
    }
    source = EnvSource.of(env)
    controllers = [
        load_composite_controller_config(given, robot)
        for given, robot in zip(inner.config.controller_list, inner.robots, strict=True)
    ]
    layout = [
        {"name": s.name, "kind": str(s.kind), "labels": list(s.labels)}
        for s in inner.action_layout.slices
    ]
    return {
        "env_args": source.text,
        "env": source.benchmark,
        "control_freq": float(inner.config.control_freq),
        "repository_version": __version__,
        "versions": json.dumps(versions),
        "controller_config": json.dumps(controllers, default=_plain),
        "action_layout": json.dumps(layout),
        "action_bounds": json.dumps(
            [inner.action_space.low.tolist(), inner.action_space.high.tolist()]
        ),
    }


def rebuild(dataset: Dataset, *, trust_files: bool = False, **changes: Any) -> RobotEnv:
    """Make the environment that a dataset is of; see `EnvSource.build`."""
    header = dataset.header
    told = header.get("env_args")
    if told is None and "env" in header:  # robosuite's raw files
        known = _parse_json(str(header.get("env_info", "{}")))
        told = json.dumps({"env_name": header["env"], "env_kwargs": known})
    source = EnvSource.parse(None if told is None else str(told))
    return source.build(trust_files=trust_files, **changes)


def _parse_json(text: str) -> Any:
    try:
        return json.loads(text[:MAX_TEXT])
    except (ValueError, RecursionError) as error:
        raise DatasetError(f"What it is of is not understood: {error}.") from error


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
    """Say what JSON has no word for; paths, arrays and numbers of NumPy."""
    if hasattr(value, "__fspath__"):
        return str(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(type(value).__name__)


def _refuse_paths(values: list[Any]) -> None:
    """Stop before a dataset makes us read files that it names."""
    for value in values:
        if isinstance(value, dict):
            _refuse_paths(list(value.values()))
        elif isinstance(value, list):
            _refuse_paths(value)
        elif isinstance(value, str) and _looks_like_path(value):
            raise DatasetError(
                f"The dataset names a file, '{value[:80]}'. If you trust it, say "
                "--trust-files."
            )


def _looks_like_path(text: str) -> bool:
    ends = (".toml", ".json", ".xml", ".urdf", ".py")
    return "/" in text or "\\" in text or text.lower().endswith(ends)
