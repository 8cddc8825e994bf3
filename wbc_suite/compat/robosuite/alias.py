"""robosuite's module tree: modules that only re-export names, and the alias.

robosuite has a module for nearly every class. Those without code of their own here are
rows of `REEXPORTS`, made when they are imported.
"""

import importlib
import sys
from collections.abc import Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

ROOT = "wbc_suite.compat.robosuite"
ALIAS = "robosuite"

SUBMODULES = (
    *("controllers", "devices", "environments", "macros", "models", "renderers"),
    *("robots", "utils", "wrappers"),
)
"""Modules directly below `robosuite`."""

_TASKS = (
    *("lift", "stack", "nut_assembly", "pick_place", "door", "wipe", "tool_hang"),
    *("two_arm_lift", "two_arm_peg_in_hole", "two_arm_handover", "two_arm_transport"),
    *("manipulation_env", "two_arm_env"),
)
_GRIPPERS = (
    *("gripper_model", "gripper_factory", "panda_gripper"),
    *("rethink_gripper", "robotiq_85_gripper", "robotiq_140_gripper"),
    *("robotiq_three_finger_gripper", "jaco_three_finger_gripper", "bd_gripper"),
    *("wiping_gripper", "null_gripper", "inspire_hands", "fourier_hands"),
    "xarm7_gripper",
)
_BASES = (
    *("mount_model", "robot_base_model", "robot_base_factory", "mobile_base_model"),
    *("leg_base_model", "null_base_model", "rethink_mount", "rethink_minimal_mount"),
    *("null_mount", "omron_mobile_base", "null_mobile_base", "no_actuation_base"),
    *("floating_legged_base", "null_base", "spot_base"),
)
_ROBOTS = (
    *("robot_model", "manipulators", "compositional"),
    *(
        f"manipulators.{name}_robot"
        for name in (
            *("baxter", "gr1", "iiwa", "jaco", "kinova3", "panda", "sawyer"),
            *("tiago", "ur5e", "xarm7"),
        )
    ),
    *("manipulators.manipulator_model", "manipulators.spot_arm"),
    *("manipulators.humanoid_model", "manipulators.legged_manipulator_model"),
)
_ARENAS = (
    *("arena", "table_arena", "multi_table_arena", "pegs_arena", "bins_arena"),
    *("empty_arena", "wipe_arena"),
)

REEXPORTS = {
    **{f"environments.manipulation.{t}": "environments.manipulation" for t in _TASKS},
    **{f"models.grippers.{g}": "models.grippers" for g in _GRIPPERS},
    **{f"models.bases.{b}": "models.bases" for b in _BASES},
    **{f"models.robots.{r}": "models.robots" for r in _ROBOTS},
    **{f"models.arenas.{a}": "models.arenas" for a in _ARENAS},
    **{
        f"robots.{r}": "robots"
        for r in (
            *("fixed_base_robot", "mobile_robot"),
            *("wheeled_robot", "legged_robot"),
        )
    },
    **{
        f"models.objects.{o}": "models.objects"
        for o in (
            *("objects", "generated_objects", "xml_objects", "primitive"),
            *("primitive.box", "primitive.ball", "primitive.capsule"),
            *("primitive.cylinder", "composite", "object_groups", "group"),
            *("composite_body", "composite.bin", "composite.hammer", "composite.lid"),
            *("composite.hollow_cylinder", "composite.pot_with_handles"),
            *("composite.hook_frame", "composite.stand_with_mount"),
        )
    },
    "models.tasks.manipulation_task": "models.tasks",
    "models.tasks.task": "models.tasks",
    "models.world": "models.tasks",
    "controllers.composite": "controllers",
    "controllers.composite.composite_controller": "controllers",
    "controllers.composite.composite_controller_factory": "controllers",
    "controllers.parts": "controllers",
    "controllers.parts.controller_factory": "controllers",
    **{
        f"controllers.parts.{p}": "controllers"
        for p in (
            *("controller", "arm", "arm.osc", "arm.ik", "generic", "gripper"),
            *("generic.joint_pos", "generic.joint_vel", "generic.joint_tor"),
            *("gripper.gripper_controller", "gripper.simple_grip", "mobile_base"),
            *("mobile_base.mobile_base_controller", "mobile_base.joint_vel"),
        )
    },
    "wrappers.wrapper": "wrappers",
    "wrappers.gym_wrapper": "wrappers",
    "wrappers.data_collection_wrapper": "wrappers",
    "wrappers.visualization_wrapper": "wrappers",
    "wrappers.domain_randomization_wrapper": "wrappers",
    "wrappers.demo_sampler_wrapper": "wrappers",
    "devices.keyboard": "devices",
    "devices.spacemouse": "devices",
    "renderers.base": "renderers",
    "renderers.viewer": "renderers",
    "renderers.mjviewer": "renderers",
    "renderers.mjviewer.mjviewer_renderer": "renderers",
    "utils.opencv_renderer": "renderers",
    "utils.numba": "utils.control_utils",
    "utils.robot_utils": "utils.robot_composition_utils",
    "models.grippers.gripper_tester": "models.grippers.tester",
    "utils.usd": "utils.usd_export",
    "utils.usd.exporter": "utils.usd_export",
}
"""Modules that re-export the names of another, and that other; both below `ROOT`."""


class _Reexporter(Loader):
    """Makes a module whose attributes are those of another."""

    def __init__(self, source: str) -> None:
        self.source = source

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        return _Reexport(spec.name)

    def exec_module(self, module: ModuleType) -> None:
        source = importlib.import_module(self.source)
        module.__dict__["_source"] = source
        module.__doc__ = source.__doc__
        module.__path__ = []  # modules below it are found in the table


class _Reexport(ModuleType):
    """A module without names of its own."""

    _source: ModuleType

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(self.__dict__["_source"], name)

    def __dir__(self) -> list[str]:
        return dir(self._source)


class _Same(Loader):
    """Imports a module under another name, as the same module."""

    def __init__(self, name: str) -> None:
        self.name = name

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        self.module = importlib.import_module(self.name)
        self.spec = self.module.__spec__
        return self.module

    def exec_module(self, module: ModuleType) -> None:
        module.__spec__ = self.spec


class _Finder(MetaPathFinder):
    """Finds the modules of `REEXPORTS`, and of the alias while it is installed."""

    def find_spec(
        self,
        fullname: str,
        path: Sequence[str] | None,
        target: ModuleType | None = None,
    ) -> ModuleSpec | None:
        if fullname.startswith(f"{ROOT}."):
            source = REEXPORTS.get(fullname.removeprefix(f"{ROOT}."))
            if source is not None:
                loader = _Reexporter(f"{ROOT}.{source}")
                return ModuleSpec(fullname, loader, is_package=True)
        elif fullname.startswith(f"{ALIAS}.") and _is_installed():
            return ModuleSpec(fullname, _Same(ROOT + fullname.removeprefix(ALIAS)))
        return None


def _is_installed() -> bool:
    return getattr(sys.modules.get(ALIAS), "__name__", "") == ROOT


def install_finder() -> None:
    """Let Python import the modules of the table; done when the package is imported."""
    if not any(isinstance(finder, _Finder) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Finder())


def install_alias() -> None:
    """Let `import robosuite`, and its modules, import this package.

    The same as `sys.modules["robosuite"] = wbc_suite.compat.robosuite`. A robosuite
    that is installed is hidden in this process.
    """
    for name in [n for n in sys.modules if n == ALIAS or n.startswith(f"{ALIAS}.")]:
        del sys.modules[name]
    sys.modules[ALIAS] = importlib.import_module(ROOT)
