"""Objects, of shapes or of MJCF files."""

from wbc_suite.compat.robosuite.models.objects.bodies import (
    MujocoGeneratedObject,
    MujocoObject,
    MujocoXMLObject,
)
from wbc_suite.compat.robosuite.models.objects.shapes import (
    BallObject,
    BoxObject,
    CapsuleObject,
    CylinderObject,
    PrimitiveObject,
)

__all__ = [
    "BallObject",
    "BoxObject",
    "CapsuleObject",
    "CylinderObject",
    "MujocoGeneratedObject",
    "MujocoObject",
    "MujocoXMLObject",
    "PrimitiveObject",
]
