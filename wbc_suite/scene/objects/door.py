"""A door on a frame, with or without a latch that its lever draws back."""

from functools import partial

from wbc_suite.scene.objects.grasp_site import GraspSite
from wbc_suite.scene.objects.scene_object import Color, Hinge, Part, SceneObject

FRAME: Color = (0.62, 0.64, 0.67, 1.0)
PANEL: Color = (0.42, 0.27, 0.16, 1.0)
INLAY: Color = (0.50, 0.33, 0.20, 1.0)
BRASS: Color = (0.83, 0.62, 0.27, 1.0)

HALF_WIDTH, HALF_HEIGHT, HALF_THICK = 0.145, 0.165, 0.012  # of the panel, m
POST = 0.018  # radius of the two posts, m
GAP = 0.006  # between panel and posts, m
HANDLE_OUT = 0.058
"""From the panel's middle to the lever's axis, m: fingers fit behind the lever."""
LEVER = 0.055  # half length of the lever, m

metal = partial(Part, color=FRAME, material="metal")
brass = partial(Part, color=BRASS, material="metal")


def door(name: str, *, latch: bool = True) -> SceneObject:
    """Make a door across y that opens towards +y and is hinged at its -x end.

    Its origin is on the floor, below the middle of the panel. The panel is the body
    `{name}_panel`, the lever `{name}_handle`; their joints are `{name}_panel_joint` (0
    closed) and `{name}_handle_joint` (0 level). Sites: `{name}_handle_grip`. With a
    latch, a bolt behind the far post keeps it shut until the lever is turned by 72
    degrees; otherwise the lever is fixed.
    """
    hinge_x = -(HALF_WIDTH + GAP)
    places, half = (hinge_x - POST, -hinge_x + POST), HALF_HEIGHT + 0.03
    post = partial(metal, kind="cylinder", size=(POST, half))
    foot = partial(metal, kind="box", size=(0.03, 0.07, 0.006))
    posts = [post(pos=(x, 0.0, half)) for x in places]
    feet = [foot(pos=(x, 0.0, 0.006)) for x in places]
    return SceneObject(
        name=name,
        parts=(*posts, *feet),
        motion="fixed",
        children=(_panel(name, hinge_x, latch),),
    )


def _panel(name: str, hinge_x: float, latch: bool) -> SceneObject:
    middle = HALF_WIDTH + GAP
    board = Part(
        kind="box",
        size=(HALF_WIDTH, HALF_THICK, HALF_HEIGHT),
        pos=(middle, 0.0, 0.0),
        color=PANEL,
        material="wood",
        friction=(0.3, 0.005, 0.0001),
    )
    inlay = partial(
        Part,
        kind="box",
        size=(HALF_WIDTH - 0.035, HALF_THICK + 0.002, 0.058),
        color=INLAY,
        material="wood",
        solid=False,
    )
    inlays = [inlay(pos=(middle, 0.0, z)) for z in (-0.085, 0.085)]
    return SceneObject(
        name=f"{name}_panel",
        parts=(board, *inlays),
        motion=Hinge(axis=(0.0, 0.0, 1.0), range=(0.0, 1.4), damping=0.1, friction=0.1),
        pos=(hinge_x, 0.0, HALF_HEIGHT + 0.02),
        children=(_handle(name, latch),),
    )


def _handle(name: str, latch: bool) -> SceneObject:
    """Return the lever; its bolt leaves the post as it turns."""
    out, axis = HANDLE_OUT, (0.0, -1.0, 0.0)
    hinge = partial(Hinge, axis=axis, damping=0.05, armature=0.001)
    turned = hinge(range=(0.0, 1.6), stiffness=0.2, friction=0.03)
    fixed = hinge(range=(0.0, 0.001))
    spindle = brass(
        kind="cylinder",
        size=(0.009, HANDLE_OUT / 2),
        pos=(0.0, out / 2, 0.0),
        quat=(0.7071067811865476, 0.7071067811865476, 0.0, 0.0),
    )
    lever = brass(
        kind="box",
        size=(LEVER, 0.011, 0.011),
        pos=(-LEVER + 0.011, out, 0.0),
        density=500.0,
    )
    bolt = metal(
        kind="box",
        size=(0.045, 0.005, 0.006),
        pos=(0.045, -(HALF_THICK + POST + 0.008), 0.0),
    )
    return SceneObject(
        name=f"{name}_handle",
        parts=(spindle, lever, bolt) if latch else (spindle, lever),
        sites={"grip": (-LEVER, out, 0.0)},
        grasps=tuple(
            GraspSite(
                pos=(-LEVER, out, 0.0),
                approach=(0.0, -1.0, 0.0),
                closing=(0.0, 0.0, side),
                tilt=0.6,
            )
            for side in (1.0, -1.0)
        ),
        motion=turned if latch else fixed,
        pos=(2 * HALF_WIDTH + GAP - 0.03, 0.0, 0.0),
    )
