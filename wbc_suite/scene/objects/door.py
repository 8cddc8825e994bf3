"""A door on a frame, with or without a latch that its handle draws back."""

from wbc_suite.scene.objects.thing import Color, Hinge, Part, Thing

__all__ = ["door"]

FRAME: Color = (0.62, 0.64, 0.67, 1.0)
PANEL: Color = (0.42, 0.27, 0.16, 1.0)
BRASS: Color = (0.83, 0.62, 0.27, 1.0)

HALF_WIDTH, HALF_HEIGHT, HALF_THICK = 0.145, 0.165, 0.012
POST = 0.018
"""Radius of the two posts, m."""
GAP = 0.006
"""Between panel and posts, m."""
HANDLE_OUT = 0.058
"""From the panel's middle to the lever's axis, m: fingers fit behind the lever."""
LEVER = 0.055
"""Half length of the lever, m."""


def door(name: str, *, latch: bool = True) -> Thing:
    """Make a door that stands across y; it opens towards +y, hinged at its -x end.

    Its origin is on the floor, below the middle of the panel. The panel is the body
    `{name}_panel`, the lever `{name}_handle`; their joints are `{name}_panel_joint` (0
    closed) and `{name}_handle_joint` (0 level). Sites: `{name}_handle_grip`.

    Args:
        name: Its name.
        latch: Whether a bolt behind the far post keeps it shut until the lever is
            turned by 80 degrees. Without it the lever is just a handle.
    """
    hinge_x = -(HALF_WIDTH + GAP)
    posts = tuple(
        Part(
            kind="cylinder",
            size=(POST, HALF_HEIGHT + 0.03),
            pos=(x, 0.0, HALF_HEIGHT + 0.03),
            color=FRAME,
            material="metal",
        )
        for x in (hinge_x - POST, -hinge_x + POST)
    )
    feet = tuple(
        Part(
            kind="box",
            size=(0.03, 0.07, 0.006),
            pos=(x, 0.0, 0.006),
            color=FRAME,
            material="metal",
        )
        for x in (hinge_x - POST, -hinge_x + POST)
    )
    panel = _panel(name, hinge_x, latch)
    return Thing(name=name, parts=(*posts, *feet), motion="fixed", children=(panel,))


def _panel(name: str, hinge_x: float, latch: bool) -> Thing:
    middle = (HALF_WIDTH + GAP, 0.0, 0.0)
    board = Part(
        kind="box",
        size=(HALF_WIDTH, HALF_THICK, HALF_HEIGHT),
        pos=middle,
        color=PANEL,
        material="wood",
        friction=(0.3, 0.005, 0.0001),
    )
    inlays = tuple(
        Part(
            kind="box",
            size=(HALF_WIDTH - 0.035, HALF_THICK + 0.002, 0.058),
            pos=(middle[0], 0.0, z),
            color=(0.50, 0.33, 0.20, 1.0),
            material="wood",
            solid=False,
        )
        for z in (-0.085, 0.085)
    )
    return Thing(
        name=f"{name}_panel",
        parts=(board, *inlays),
        motion=Hinge(axis=(0.0, 0.0, 1.0), range=(0.0, 1.4), damping=0.1, friction=0.1),
        pos=(hinge_x, 0.0, HALF_HEIGHT + 0.02),
        children=(_handle(name, latch),),
    )


def _handle(name: str, latch: bool) -> Thing:
    """Return the lever; its bolt leaves the post's shadow as it turns."""
    out = HANDLE_OUT
    spindle = Part(
        kind="cylinder",
        size=(0.009, HANDLE_OUT / 2),
        pos=(0.0, out / 2, 0.0),
        quat=(0.7071067811865476, 0.7071067811865476, 0.0, 0.0),
        color=BRASS,
        material="metal",
    )
    lever = Part(
        kind="box",
        size=(LEVER, 0.011, 0.011),
        pos=(-LEVER + 0.011, out, 0.0),
        color=BRASS,
        material="metal",
        density=500.0,
    )
    bolt = Part(
        kind="box",
        size=(0.045, 0.005, 0.006),
        pos=(0.045, -(HALF_THICK + POST + 0.008), 0.0),
        color=FRAME,
        material="metal",
    )
    turn = (
        Hinge(
            axis=(0.0, -1.0, 0.0),
            range=(0.0, 1.6),
            damping=0.05,
            stiffness=0.2,
            friction=0.03,
        )
        if latch
        else Hinge(axis=(0.0, -1.0, 0.0), range=(0.0, 0.001), damping=0.05)
    )
    return Thing(
        name=f"{name}_handle",
        parts=(spindle, lever, bolt) if latch else (spindle, lever),
        sites={"grip": (-LEVER, out, 0.0)},
        motion=turn,
        pos=(2 * HALF_WIDTH + GAP - 0.03, 0.0, 0.0),
    )
