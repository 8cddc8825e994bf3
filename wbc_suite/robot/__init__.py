"""Robots described once: files, validation, assembly, and exports to each engine."""

from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.loading import load_robot

__all__ = ["RobotDescription", "load_robot"]
