"""Environments: robots, controllers and benchmarks behind the Gymnasium API."""

from wbc_suite.envs.env import RobotEnv
from wbc_suite.envs.making import make
from wbc_suite.envs.simulation import Simulation
from wbc_suite.envs.vector import VectorRobotEnv

__all__ = ["RobotEnv", "Simulation", "VectorRobotEnv", "make"]
