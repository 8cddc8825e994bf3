"""One colour per limb, the same in the scene, the panel and the plots."""

import colorsys
from collections.abc import Iterable
from types import MappingProxyType

__all__ = ["css", "limb_colours"]

Colour = tuple[int, int, int]

# Right is warm, left is cool, the middle of the body is green and violet.
_BY_WORD: tuple[tuple[tuple[str, ...], Colour], ...] = (
    (("right", "foot"), (196, 92, 60)),
    (("left", "foot"), (52, 104, 178)),
    (("right",), (235, 131, 45)),
    (("left",), (20, 152, 168)),
    (("head",), (138, 102, 190)),
    (("torso",), (88, 148, 88)),
    (("com",), (88, 148, 88)),
    (("base",), (94, 106, 126)),
    (("hand",), (235, 131, 45)),
    (("gripper",), (235, 131, 45)),
)


def limb_colours(names: Iterable[str]) -> MappingProxyType[str, Colour]:
    """Return a colour, as RGB from 0 to 255, for every limb, no two alike."""
    colours: dict[str, Colour] = {}
    for name in names:
        known = (c for words, c in _BY_WORD if all(w in name for w in words))
        colour = next((c for c in known if c not in colours.values()), None)
        colours[name] = colour or _spare(len(colours))
    return MappingProxyType(colours)


def css(colour: Colour) -> str:
    """Write a colour as a style sheet does."""
    return f"#{colour[0]:02x}{colour[1]:02x}{colour[2]:02x}"


def _spare(index: int) -> Colour:
    """Return a calm colour; steps of the golden ratio keep neighbours far apart."""
    r, g, b = colorsys.hls_to_rgb((0.11 + 0.618 * index) % 1.0, 0.48, 0.45)
    return round(255 * r), round(255 * g), round(255 * b)
