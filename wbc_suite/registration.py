"""Registration of the benchmarks as Gymnasium environments, `wbc_suite/{name}-v{n}`.

Importing Gymnasium and NumPy takes 0.15 s, and `import wbc_suite` stays light. So the
environments are registered at once if Gymnasium is imported already, and otherwise
right after it is imported, by a finder of Python's import system that removes itself.
(Gymnasium 1.0 removed its entry points for plugins.)
"""

import importlib.util
import sys
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType

WITH_ID = (
    "Carry",
    "Door",
    "Lift",
    "LocoLift",
    *("NutAssembly", "NutAssemblySingle", "NutAssemblySquare", "NutAssemblyRound"),
    *("PickPlace", "PickPlaceSingle"),
    *("PickPlaceMilk", "PickPlaceBread", "PickPlaceCereal", "PickPlaceCan"),
    "Reach",
    "Stack",
    "Stand",
    "ToolHang",
    *("TwoArmHandover", "TwoArmLift", "TwoArmPegInHole", "TwoArmTransport"),
    "WalkTo",
    "Wipe",
)
"""Benchmarks with an id."""

GOALS = (
    *("Lift", "Stack", "Reach", "PickPlace", "PickPlaceSingle"),
    *("PickPlaceMilk", "PickPlaceBread", "PickPlaceCereal", "PickPlaceCan"),
)
"""Benchmarks with an id `wbc_suite/{name}-Goal-v0` too; see `wrappers.Goals`."""

_CHANGED = (
    *("Carry", "Door", "Lift", "LocoLift", "NutAssembly", "PickPlace", "Stack"),
    *("Stand", "ToolHang"),
    *("TwoArmHandover", "TwoArmLift", "TwoArmPegInHole", "TwoArmTransport", "Wipe"),
)
"""Beginnings of the names whose reward, success or scene has changed: version 1."""


def environment_id(name: str) -> str:
    """Return the id of a benchmark, `wbc_suite/{name}-v0`, or v1 if it has changed."""
    return f"wbc_suite/{name}-v{int(name.startswith(_CHANGED))}"


def register_environments() -> None:
    """Register the environments, now or as soon as Gymnasium is imported."""
    if "gymnasium" in sys.modules:
        _register()
    else:
        sys.meta_path.insert(0, _GymnasiumFinder())


def _register() -> None:
    from gymnasium.envs.registration import register, registry

    for name in WITH_ID:
        if environment_id(name) not in registry:
            register(
                id=environment_id(name),
                entry_point="wbc_suite.envs.env:RobotEnv",
                vector_entry_point="wbc_suite.envs.vector:VectorRobotEnv",
                kwargs={"benchmark": name},
            )
    for name in GOALS:
        if f"wbc_suite/{name}-Goal-v0" not in registry:
            register(
                id=f"wbc_suite/{name}-Goal-v0",
                entry_point="wbc_suite.wrappers.goals:make_goal_env",
                kwargs={"benchmark": name},
            )


class _GymnasiumFinder(MetaPathFinder):
    """Finds Gymnasium as usual, once, and lets its loader register when it is done."""

    def find_spec(
        self, fullname: str, path: object, target: object = None
    ) -> ModuleSpec | None:
        if fullname != "gymnasium":
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(fullname)
        if spec is not None and spec.loader is not None:
            load = spec.loader.exec_module

            def load_and_register(module: ModuleType) -> None:
                load(module)
                _register()

            spec.loader.exec_module = load_and_register
        return spec
