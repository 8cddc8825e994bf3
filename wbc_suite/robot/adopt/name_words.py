"""Words in the names of links, joints and frames: the kind and the side of a limb."""

import re
from collections.abc import Collection, Iterator, Sequence

FINGERS = {"finger", "fingers", "thumb"}
KINDS = {
    "gripper": "finger fingers thumb gripper index middle ring little pinky jaw "
    "knuckle",
    "head": "head neck",
    "torso": "torso waist trunk spine chest abdomen lift",
    "leg": "leg hip knee ankle thigh calf shin foot toe haa hfe kfe",
    "arm": "arm shoulder elbow wrist forearm upperarm",
    "base": "wheel caster castor rotacastor",
}
"""Words of each kind of limb."""
KIND_OF = {word: kind for kind, words in KINDS.items() for word in words.split()}

SIDES = ("left", "right")
SIDE_OF = {"left": "left", "l": "left", "right": "right", "r": "right"}
PAIRS = {
    "front_left": "fl lf",
    "front_right": "fr rf",
    "rear_left": "hl lh rl bl",
    "rear_right": "hr rh rr br",
}
"""Words for the legs of quadrupeds."""
PAIR_OF = {word: pair for pair, words in PAIRS.items() for word in words.split()}
ENDS = {
    "front": "front",
    "fore": "front",
    "rear": "rear",
    "hind": "rear",
    "back": "rear",
}

ENDINGS = {
    "arm": "eef ee effector tcp tool flange grasp grasping tip",
    "gripper": "tcp grasp grasping tool",
    "leg": "foot sole toe",
}
END_WORDS = {kind: set(words.split()) for kind, words in ENDINGS.items()}
"""Words in the names of frames and links at the end of a limb."""


_PART = re.compile(r"left|right|[A-Z]?[a-z]+|[A-Z]+(?![a-z])")
_OPPOSITE = {"l": "r", "r": "l"}


def words_of(name: str) -> list[str]:
    """Split a name: `LHipYaw` is l, hip, yaw; `leftarm_1` left, arm; `LARM` l, arm."""
    return [word for _, word in _placed_words(name)]


def _placed_words(name: str) -> Iterator[tuple[int, str]]:
    """Yield the words of a name with the places where they begin."""
    for part in _PART.finditer(name):
        start, word = part.start(), part[0].lower()
        if word[0] in SIDE_OF and word not in KIND_OF and word[1:] in KIND_OF:
            yield start, word[0]
            start, word = start + 1, word[1:]
        yield start, word


def words_in(names: Collection[str]) -> dict[str, list[str]]:
    """Return the words of names, without `l` and `r` that are no sides.

    These are a side where the same name with the other letter exists: `l_wrist` beside
    `r_wrist`, but not `l1` to `l6` alone.
    """
    known = {name.casefold() for name in names}

    def is_kept(name: str, place: int, word: str) -> bool:
        other = _OPPOSITE.get(word, "")
        swapped = f"{name[:place]}{other}{name[place + 1 :]}".casefold()
        return not other or swapped in known

    return {
        name: [w for place, w in _placed_words(name) if is_kept(name, place, w)]
        for name in names
    }


def side_of(words: Sequence[str], *, pairs: bool) -> str:
    """Return `left`, with `pairs` also `front_left`, or "" if no word gives a side."""
    spelt = [w for w in words if w in SIDES] or words  # "r2_left_arm" is a left one
    side = next((SIDE_OF[w] for w in spelt if w in SIDE_OF), "")
    if not pairs:
        return side
    pair = next((PAIR_OF[w] for w in words if w in PAIR_OF), "")
    end = next((ENDS[w] for w in words if w in ENDS), "")
    return pair or (f"{end}_{side}" if end and side else side)


def kind_of(words: Sequence[str]) -> str | None:
    """Return the kind of limb that the first known word names."""
    return next((KIND_OF[word] for word in words if word in KIND_OF), None)
