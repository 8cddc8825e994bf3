"""robosuite 1.5's interface on our engine: replace `import robosuite` by this package.

Modules, names, arguments and return values are robosuite's; robots, scenes and control
loops are ours. `docs/from_robosuite.md` lists the differences. Everything is imported
when it is asked for, so that reading a controller file stays cheap.

    import wbc_suite.compat.robosuite as suite
    suite.install_alias()  # from here on `import robosuite.utils.transform_utils` works
"""

import importlib
from typing import TYPE_CHECKING, Any

from wbc_suite.compat.robosuite.alias import SUBMODULES, install_alias, install_finder

if TYPE_CHECKING:
    from wbc_suite.compat.robosuite.controllers.configs import (
        ALL_COMPOSITE_CONTROLLERS,
        ALL_PART_CONTROLLERS,
        load_composite_controller_config,
        load_part_controller_config,
    )
    from wbc_suite.compat.robosuite.environments import (
        make_from_dataset,
        make_from_env_args,
    )
    from wbc_suite.compat.robosuite.environments.base import ALL_ENVIRONMENTS, make
    from wbc_suite.compat.robosuite.models.grippers import ALL_GRIPPERS
    from wbc_suite.compat.robosuite.robots import ALL_ROBOTS
    from wbc_suite.compat.robosuite.wrappers.gym import GymWrapper

__all__ = [
    "ALL_COMPOSITE_CONTROLLERS",
    "ALL_ENVIRONMENTS",
    "ALL_GRIPPERS",
    "ALL_PART_CONTROLLERS",
    "ALL_ROBOTS",
    "GymWrapper",
    "install_alias",
    "load_composite_controller_config",
    "load_part_controller_config",
    "make",
    "make_from_dataset",
    "make_from_env_args",
]

__version__ = "1.5.2"  # the robosuite version of this interface
__logo__ = "wbc_suite, with robosuite's interface"

_NAMES = {
    "controllers": """
        ALL_COMPOSITE_CONTROLLERS ALL_PART_CONTROLLERS load_composite_controller_config
        load_part_controller_config""",
    "environments": "ALL_ENVIRONMENTS make make_from_dataset make_from_env_args",
    "environments.manipulation": """
        Lift Stack NutAssembly PickPlace Door Wipe ToolHang TwoArmLift TwoArmPegInHole
        TwoArmHandover TwoArmTransport""",
    "models.grippers": "ALL_GRIPPERS",
    "robots": "ALL_ROBOTS",
    "utils": "ROBOSUITE_DEFAULT_LOGGER",
    "wrappers": "GymWrapper",
}
"""Names of robosuite's top level, by the modules that define them."""
_PLACES = {name: module for module, names in _NAMES.items() for name in names.split()}

install_finder()


def __getattr__(name: str) -> Any:
    if name in _PLACES:
        return getattr(importlib.import_module(f"{__name__}.{_PLACES[name]}"), name)
    if name in SUBMODULES:
        return importlib.import_module(f"{__name__}.{name}")
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
