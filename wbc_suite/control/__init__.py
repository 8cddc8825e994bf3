"""Controllers: actions in, actuator commands out. They know no environment."""

from wbc_suite.control.action import ActionLayout, ActionPart, ActionSlice
from wbc_suite.control.composite import (
    BasicController,
    CompositeController,
    build_composite_controller,
    composite_names,
    default_basic_config,
    default_composite,
    load_composite_controller_config,
    register_composite,
)
from wbc_suite.control.state import RobotState

__all__ = [
    "ActionLayout",
    "ActionPart",
    "ActionSlice",
    "BasicController",
    "CompositeController",
    "RobotState",
    "build_composite_controller",
    "composite_names",
    "default_basic_config",
    "default_composite",
    "load_composite_controller_config",
    "register_composite",
]
