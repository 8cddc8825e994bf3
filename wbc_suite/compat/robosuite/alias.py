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

PARTS_OF = {
    "controllers": """
        composite composite.composite_controller composite.composite_controller_factory
        parts parts.controller parts.controller_factory parts.arm parts.arm.osc
        parts.arm.ik parts.generic parts.generic.joint_pos parts.generic.joint_vel
        parts.generic.joint_tor parts.gripper parts.gripper.gripper_controller
        parts.gripper.simple_grip parts.mobile_base parts.mobile_base.joint_vel
        parts.mobile_base.mobile_base_controller""",
    "devices": "device keyboard spacemouse",
    "environments.manipulation": """
        lift stack nut_assembly pick_place door wipe tool_hang two_arm_lift
        two_arm_peg_in_hole two_arm_handover two_arm_transport manipulation_env
        two_arm_env""",
    "models.arenas": """
        arena table_arena multi_table_arena pegs_arena bins_arena empty_arena
        wipe_arena""",
    "models.bases": """
        mount_model robot_base_model robot_base_factory mobile_base_model
        leg_base_model null_base_model rethink_mount rethink_minimal_mount null_mount
        omron_mobile_base null_mobile_base no_actuation_base floating_legged_base
        null_base spot_base""",
    "models.grippers": """
        gripper_model gripper_factory gripper_tester panda_gripper rethink_gripper
        robotiq_85_gripper robotiq_140_gripper robotiq_three_finger_gripper
        jaco_three_finger_gripper bd_gripper wiping_gripper null_gripper inspire_hands
        fourier_hands xarm7_gripper""",
    "models.objects": """
        objects generated_objects xml_objects primitive primitive.box primitive.ball
        primitive.capsule primitive.cylinder composite object_groups group
        composite_body composite.bin composite.hammer composite.lid
        composite.hollow_cylinder composite.pot_with_handles composite.hook_frame
        composite.stand_with_mount""",
    "models.robots": """
        robot_model compositional manipulators manipulators.baxter_robot
        manipulators.gr1_robot manipulators.iiwa_robot manipulators.jaco_robot
        manipulators.kinova3_robot manipulators.panda_robot manipulators.sawyer_robot
        manipulators.tiago_robot manipulators.ur5e_robot manipulators.xarm7_robot
        manipulators.manipulator_model manipulators.spot_arm
        manipulators.humanoid_model manipulators.legged_manipulator_model""",
    "models.tasks": "manipulation_task task",
    "renderers": "base viewer mjviewer mjviewer.mjviewer_renderer",
    "robots": "fixed_base_robot mobile_robot wheeled_robot legged_robot",
    "utils": "errors log_utils usd usd.exporter usd_export",
    "wrappers": """
        wrapper gym_wrapper data_collection_wrapper visualization_wrapper
        domain_randomization_wrapper demo_sampler_wrapper""",
}
"""Packages, and the modules below them that re-export their names."""

REEXPORTS = {
    f"{package}.{module}": package
    for package, modules in PARTS_OF.items()
    for module in modules.split()
} | {
    "models.world": "models.tasks",
    "utils.numba": "utils.control_utils",
    "utils.opencv_renderer": "renderers",
    "utils.robot_utils": "utils.robot_composition_utils",
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
