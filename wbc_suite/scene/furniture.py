"""Fixed furniture: bins on legs, pegs, and visual goals."""

from dataclasses import replace
from functools import partial

from pydantic import model_validator

from wbc_suite.config_files import FrozenModel
from wbc_suite.robot.elements import Channel
from wbc_suite.robot.shapes import Size, Vector3
from wbc_suite.scene.objects.scene_object import Color, Part, SceneObject
from wbc_suite.scene.objects.vessels import open_bin

LEG: Color = (0.32, 0.33, 0.35, 1.0)
LEG_RADIUS, INSET = 0.012, 0.03  # m, of legs, and from the edges of the bin
GHOST = 0.3  # opacity of visual goals


class BinConfig(FrozenModel):
    """A bin on legs: inner length, width and height, and middle of its floor, m."""

    size: tuple[Size, Size, Size]
    center: Vector3
    wall: Size = 0.01
    color: tuple[Channel, Channel, Channel, Channel] = (0.80, 0.62, 0.42, 1.0)

    @model_validator(mode="after")
    def _stands_on_the_floor(self) -> "BinConfig":
        if self.center[2] - self.wall < 0.01:
            raise ValueError(f"a bin at {self.center[2]} m has no room for legs")
        return self


def standing_bin(
    name: str, config: BinConfig, *, quadrants: bool = False
) -> SceneObject:
    """Make a bin on legs; with quadrants, two walls divide it.

    Its origin is the middle of its floor.
    """
    (x, y, z), wall = config.size, config.wall
    outer = (x + 2 * wall, y + 2 * wall, z + wall)
    parts = [
        replace(part, pos=(part.pos[0], part.pos[1], part.pos[2] - wall))
        for part in open_bin(name, outer, wall=wall, color=config.color).parts
    ]
    if quadrants:
        wood = partial(Part, kind="box", color=config.color, material="wood")
        parts += [
            wood(size=size, pos=(0.0, 0.0, z / 2))
            for size in ((x / 2, wall / 2, z / 2), (wall / 2, y / 2, z / 2))
        ]
    half = (config.center[2] - wall) / 2
    leg = partial(Part, kind="cylinder", color=LEG, material="metal")
    parts += [
        leg(
            size=(LEG_RADIUS, half),
            pos=(side * (x / 2 - INSET), end * (y / 2 - INSET), -wall - half),
        )
        for side in (-1, 1)
        for end in (-1, 1)
    ]
    return SceneObject(name=name, parts=tuple(parts)).fixed(config.center)


def peg(name: str, part: Part, foot: Vector3) -> SceneObject:
    """Make a peg of an upright part with its lower end at `foot`."""
    x, y, z = foot
    return SceneObject(name=name, parts=(part,)).fixed((x, y, z + part.size[-1]))


def ghost(original: SceneObject, name: str, pos: Vector3) -> SceneObject:
    """Return a translucent copy without collisions."""
    parts = tuple(
        replace(part, solid=False, color=(*part.color[:3], GHOST))
        for part in original.parts
        if part.drawn
    )
    return replace(original, name=name, parts=parts, sites={}).fixed(pos)
