"""Tools under the names of robosuite."""

from wbc_suite.compat.robosuite.utils.errors import (
    RandomizationError,
    SimulationError,
    XMLError,
    robosuiteError,
)

__all__ = ["RandomizationError", "SimulationError", "XMLError", "robosuiteError"]
