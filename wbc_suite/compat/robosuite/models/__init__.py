"""Models: robots, grippers, bases, arenas, objects and tasks."""

from pathlib import Path

from wbc_suite.compat.robosuite.models.base import MujocoModel, MujocoXML
from wbc_suite.compat.robosuite.models.tasks import MujocoWorldBase

__all__ = ["MujocoModel", "MujocoWorldBase", "MujocoXML", "assets_root"]

assets_root = str(Path(__file__).parent)
"""robosuite's folder of MJCF files; there are none here."""
