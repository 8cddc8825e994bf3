"""Controllers: robosuite's default configs, its registries, and classes of users."""

from wbc_suite.compat.robosuite.controllers.configs import (
    ALL_COMPOSITE_CONTROLLERS,
    ALL_PART_CONTROLLERS,
    PART_CONTROLLER_INFO,
    is_part_controller_config,
    load_composite_controller_config,
    load_part_controller_config,
    refactor_composite_controller_config,
)
from wbc_suite.compat.robosuite.controllers.part_view import (
    InverseKinematicsController,
    JointPositionController,
    JointTorqueController,
    JointVelocityController,
    MobileBaseJointVelocityController,
    OperationalSpaceController,
    SimpleGripController,
)
from wbc_suite.compat.robosuite.controllers.part_view import (
    PartController as Controller,
)
from wbc_suite.compat.robosuite.controllers.user_controllers import (
    REGISTERED_COMPOSITE_CONTROLLERS_DICT,
    CompositeController,
    HybridMobileBase,
    WholeBody,
    WholeBodyIK,
    register_composite_controller,
)

__all__ = [
    "ALL_COMPOSITE_CONTROLLERS",
    "ALL_PART_CONTROLLERS",
    "PART_CONTROLLER_INFO",
    "REGISTERED_COMPOSITE_CONTROLLERS_DICT",
    "CompositeController",
    "Controller",
    "HybridMobileBase",
    "InverseKinematicsController",
    "JointPositionController",
    "JointTorqueController",
    "JointVelocityController",
    "MobileBaseJointVelocityController",
    "OperationalSpaceController",
    "SimpleGripController",
    "WholeBody",
    "WholeBodyIK",
    "is_part_controller_config",
    "load_composite_controller_config",
    "load_part_controller_config",
    "refactor_composite_controller_config",
    "register_composite_controller",
]
