"""Controllers: actions in, actuator commands out, without an environment."""

from wbc_suite.control.action import (
    ActionLayout,
    ActionPart,
    ActionSlice,
    Axis,
    SliceKind,
    Unit,
)
from wbc_suite.control.composite.basic import BasicController, default_basic_config
from wbc_suite.control.composite.protocols import (
    CompositeController,
    SteppedController,
)
from wbc_suite.control.composite.registry import (
    COMPOSITES,
    CompositeControllerName,
    build_composite_controller,
    default_composite,
    load_composite_controller_config,
    register_composite,
    register_config_converter,
)
from wbc_suite.control.ik.frame_kinds import (
    FRAME_KINDS,
    FrameKind,
    register_frame_kind,
)
from wbc_suite.control.law.joint_laws import JointLaw, VelocityLaw
from wbc_suite.control.law.law import LAWS, Law, ServoLaw, TorqueLaw, register_law
from wbc_suite.control.law.osc import OscLaw
from wbc_suite.control.part.controller import PartController, PoseInput
from wbc_suite.control.part.part_settings import PartSettings
from wbc_suite.control.part.registry import (
    PART_CONTROLLERS,
    PartControllerName,
    load_part_controller_config,
    register_part_controller,
)
from wbc_suite.control.robot_parts import RobotPart
from wbc_suite.control.state import RobotState

__all__ = [
    "COMPOSITES",
    "FRAME_KINDS",
    "LAWS",
    "PART_CONTROLLERS",
    "ActionLayout",
    "ActionPart",
    "ActionSlice",
    "Axis",
    "BasicController",
    "CompositeController",
    "CompositeControllerName",
    "FrameKind",
    "JointLaw",
    "Law",
    "OscLaw",
    "PartController",
    "PartControllerName",
    "PartSettings",
    "PoseInput",
    "RobotPart",
    "RobotState",
    "ServoLaw",
    "SliceKind",
    "SteppedController",
    "TorqueLaw",
    "Unit",
    "VelocityLaw",
    "build_composite_controller",
    "default_basic_config",
    "default_composite",
    "load_composite_controller_config",
    "load_part_controller_config",
    "register_composite",
    "register_config_converter",
    "register_frame_kind",
    "register_law",
    "register_part_controller",
]
