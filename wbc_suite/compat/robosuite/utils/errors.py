"""Errors under robosuite's names."""

from wbc_suite.errors import ConfigError, DescriptionError, PhysicsError, PlacementError

robosuiteError = Exception
XMLError, SimulationError = DescriptionError, PhysicsError
RandomizationError = PlacementError
__all__ = [
    "ConfigError",
    "RandomizationError",
    "SimulationError",
    "XMLError",
    "robosuiteError",
]
