"""Kinematics over Pinocchio, and the one place where engines' conventions meet."""

from wbc_suite.kinematics.configuration import Axes, Configuration
from wbc_suite.kinematics.conversions import Conversion
from wbc_suite.kinematics.forward import RobotArrays

__all__ = ["Axes", "Configuration", "Conversion", "RobotArrays"]
