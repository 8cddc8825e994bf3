"""Tools under the names of robosuite: its errors, its logger, its USD writer."""

import logging
from typing import Any

from wbc_suite.errors import DescriptionError, PhysicsError, PlacementError

robosuiteError = Exception
XMLError, SimulationError = DescriptionError, PhysicsError
RandomizationError = PlacementError

ROBOSUITE_DEFAULT_LOGGER = logging.getLogger("wbc_suite.compat.robosuite")


def __getattr__(name: str) -> Any:
    if name == "USDExporter":  # MuJoCo's, which needs `usd-core`
        from mujoco.usd.exporter import USDExporter

        return USDExporter
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
