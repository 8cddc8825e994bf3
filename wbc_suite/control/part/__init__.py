"""Controllers of single parts of a robot; those of the package are registered here."""

from wbc_suite.control.part.base_velocity import (
    BaseVelocityConfig,
    BaseVelocityController,
)
from wbc_suite.control.part.ik_pose import IkPoseConfig, IkPoseController
from wbc_suite.control.part.joint_controllers import (
    JointPositionConfig,
    JointPositionController,
    JointTorqueConfig,
    JointTorqueController,
    JointVelocityConfig,
    JointVelocityController,
)
from wbc_suite.control.part.osc_controller import OscConfig, OscController
from wbc_suite.control.part.registry import register_part_controller
from wbc_suite.control.part.stance_controller import StanceConfig, StanceController

register_part_controller("OSC_POSE", OscController, OscConfig)
register_part_controller("OSC_POSITION", OscController, OscConfig)
register_part_controller("IK_POSE", IkPoseController, IkPoseConfig)
register_part_controller("JOINT_POSITION", JointPositionController, JointPositionConfig)
register_part_controller("JOINT_VELOCITY", JointVelocityController, JointVelocityConfig)
register_part_controller("JOINT_TORQUE", JointTorqueController, JointTorqueConfig)
register_part_controller("BASE_VELOCITY", BaseVelocityController, BaseVelocityConfig)
register_part_controller("STANCE", StanceController, StanceConfig)
