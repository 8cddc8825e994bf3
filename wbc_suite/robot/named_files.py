"""Names of robots in public collections, for the files that they stand for.

`menagerie:unitree_g1` is a model of MuJoCo Menagerie, in the folder `MENAGERIE_ROOT` or
by the package `mujoco-menagerie`; `menagerie:unitree_g1/g1_with_hands` another one of
its files. `robot_descriptions:g1_description` is one of the package of that name. Both
packages fetch what they lack from the network.
"""

import importlib
import importlib.util
import os
import pkgutil
from pathlib import Path
from typing import Any

from wbc_suite.errors import ConfigError, UnknownNameError, look_up

MENAGERIE, DESCRIPTIONS = "menagerie", "robot_descriptions"


def named_file(name: str) -> Path | None:
    """Return the file of a name in a collection; None for other names.

    Raises:
        UnknownNameError: If the collection has no such robot.
        ConfigError: If the collection is not installed, or cannot be fetched.
    """
    collection, colon, rest = name.partition(":")
    if not colon or collection not in (MENAGERIE, DESCRIPTIONS):
        return None
    if collection == DESCRIPTIONS:
        return _description(rest)
    robot, _, entry = rest.partition("/")
    if root := os.environ.get("MENAGERIE_ROOT"):
        return _in_folder(Path(root).expanduser(), robot, entry)
    package = _package("mujoco_menagerie", "mujoco-menagerie", ", or MENAGERIE_ROOT")
    if robot not in package.names():
        raise UnknownNameError("model of MuJoCo Menagerie", robot, package.names())
    model = package.get(robot)
    entries = {Path(e.file).stem: e.name for e in model.entry_points}
    entries |= {e.name: e.name for e in model.entry_points}
    wanted = look_up("file", entry, entries) if entry else model.default_model
    try:
        return Path(model.xml(wanted))
    except (package.MenagerieError, OSError) as error:
        raise ConfigError(f"menagerie:{rest}: it cannot be fetched: {error}") from error


def _in_folder(root: Path, robot: str, entry: str) -> Path:
    """Return a model of a checkout of Menagerie: by default that with no variant."""
    folder = root / robot
    if not robot or not folder.is_dir():
        known = [path.name for path in root.glob("*/") if any(path.glob("*.xml"))]
        raise UnknownNameError(f"model in MENAGERIE_ROOT {root}", robot, known)
    files = {
        path.stem: path
        for path in sorted(folder.glob("*.xml"))
        if "scene" not in path.stem
    }
    if entry:
        return look_up("file", entry, files)
    if not files:
        raise ConfigError(f"{folder}: it has no model.")
    return files[min(files, key=len)]


def _description(name: str) -> Path:
    package = _package(DESCRIPTIONS, "robot_descriptions", "")
    known = [
        found.name
        for found in pkgutil.iter_modules(package.__path__)
        if found.name.endswith("_description")
    ]
    wanted = name if name in known else f"{name}_description"
    if wanted not in known:
        raise UnknownNameError("robot of robot_descriptions", name, known)
    try:
        module: Any = importlib.import_module(f"{DESCRIPTIONS}.{wanted}")
    except Exception as error:  # it clones a repository, which fails in many ways
        raise ConfigError(
            f"robot_descriptions:{name}: it is not in the cache and cannot be fetched: "
            f"{error}"
        ) from error
    for key in ("MJCF_PATH", "URDF_PATH"):
        if path := getattr(module, key, None):
            return Path(path)
    raise ConfigError(f"robot_descriptions:{name}: it has neither URDF nor MJCF.")


def _package(module: str, distribution: str, other: str) -> Any:
    if importlib.util.find_spec(module) is None:
        raise ConfigError(
            f"Names of this collection need the package {distribution}{other}. Install "
            f"it with: pip install {distribution}"
        )
    return importlib.import_module(module)
