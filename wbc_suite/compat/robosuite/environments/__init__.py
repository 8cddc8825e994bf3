"""Environments: those of the catalogue, and classes of users."""

from wbc_suite.compat.robosuite.environments.base import (
    REGISTERED_ENVS,
    MujocoEnv,
    make,
    register_env,
)

from wbc_suite.compat.robosuite.environments import manipulation  # isort: skip

__all__ = [
    "ALL_ENVIRONMENTS",
    "REGISTERED_ENVS",
    "MujocoEnv",
    "make",
    "manipulation",
    "register_env",
]

ALL_ENVIRONMENTS = REGISTERED_ENVS.keys()
