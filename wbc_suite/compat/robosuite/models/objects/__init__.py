"""Objects, of shapes or of MJCF files."""

from wbc_suite.compat.robosuite.models.objects.bodies import (
    MujocoGeneratedObject,
    MujocoObject,
    MujocoXMLObject,
)
from wbc_suite.compat.robosuite.models.objects.composites import (
    CompositeBodyObject,
    CompositeObject,
    ObjectGroup,
)
from wbc_suite.compat.robosuite.models.objects.ready_made import READY_MADE
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
    "CompositeBodyObject",
    "CompositeObject",
    "CylinderObject",
    "MujocoGeneratedObject",
    "MujocoObject",
    "MujocoXMLObject",
    "ObjectGroup",
    "PrimitiveObject",
]

globals().update(READY_MADE)
