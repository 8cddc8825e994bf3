"""Whole-body control toolkit on MuJoCo, Pinocchio, mink and QP solvers.

Importing the package is light: each public name is loaded when it is first used.
"""

import importlib
from typing import TYPE_CHECKING, Any

from wbc_suite.registration import register_environments

if TYPE_CHECKING:
    from wbc_suite import errors, kinematics, qp
    from wbc_suite.catalogue import Catalogue
    from wbc_suite.control import load_composite_controller_config
    from wbc_suite.envs import make
    from wbc_suite.envs.exporting import export_model
    from wbc_suite.robot import RobotDescription, load_robot

__version__ = "0.1.0"

_HOME = {
    "Catalogue": "catalogue",
    "RobotDescription": "robot",
    "export_model": "envs.exporting",
    "load_composite_controller_config": "control",
    "load_robot": "robot",
    "make": "envs",
}

__all__ = [
    "Catalogue",
    "RobotDescription",
    "errors",
    "export_model",
    "kinematics",
    "load_composite_controller_config",
    "load_robot",
    "make",
    "qp",
]

register_environments()


def __getattr__(name: str) -> Any:
    if name in ("errors", "kinematics", "qp"):
        return importlib.import_module(f"wbc_suite.{name}")
    if name in _HOME:
        return getattr(importlib.import_module(f"wbc_suite.{_HOME[name]}"), name)
    raise AttributeError(f"module 'wbc_suite' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
