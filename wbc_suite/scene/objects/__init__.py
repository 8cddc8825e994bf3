"""Objects: each is a `SceneObject`, made by a function of its own name.

    objects.can("can").add_to(spec)

A new object is a function that returns a `SceneObject`: a name and a few parts.
`MjcfObject` reads one from a file.
"""

from wbc_suite.scene.objects.door import door
from wbc_suite.scene.objects.food import bottle, bread, can, cereal, lemon, milk
from wbc_suite.scene.objects.object_state import Extent, ObjectState
from wbc_suite.scene.objects.primitives import ball, box, capsule, cylinder, hull
from wbc_suite.scene.objects.scene_object import (
    Hinge,
    MjcfObject,
    Part,
    SceneObject,
)
from wbc_suite.scene.objects.tools import (
    hammer,
    hanging_frame,
    plate_with_hole,
    round_nut,
    square_nut,
    stand,
    wrench,
)
from wbc_suite.scene.objects.vessels import hollow_cylinder, lid, open_bin, pot

__all__ = [
    "Extent",
    "Hinge",
    "MjcfObject",
    "ObjectState",
    "Part",
    "SceneObject",
    "ball",
    "bottle",
    "box",
    "bread",
    "can",
    "capsule",
    "cereal",
    "cylinder",
    "door",
    "hammer",
    "hanging_frame",
    "hollow_cylinder",
    "hull",
    "lemon",
    "lid",
    "milk",
    "open_bin",
    "plate_with_hole",
    "pot",
    "round_nut",
    "square_nut",
    "stand",
    "wrench",
]
