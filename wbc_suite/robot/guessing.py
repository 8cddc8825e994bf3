"""Guess what a file without groups means: limbs, end effectors, a ready posture.

URDF and MJCF name links and joints, and leave it to people to see an arm in them. The
guesses here follow the words in the names and the shape of the tree; they are a first
draft for the user to edit after `to_toml()`.
"""

import itertools
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from wbc_suite.robot.naming import NameTable
from wbc_suite.robot.parts import Frame, Joint, Link
from wbc_suite.robot.validation import rigid_bodies

__all__ = ["Limb", "guess_frames", "guess_limbs", "guess_ready", "guess_role"]

KINDS = {
    "gripper": "finger fingers thumb gripper index middle ring pinky jaw knuckle",
    "head": "head neck",
    "torso": "torso waist trunk spine chest lift",
    "leg": "leg hip knee ankle thigh calf shin foot toe haa hfe kfe",
    "arm": "arm shoulder elbow wrist forearm upperarm",
    "base": "wheel caster",
}
"""Words that tell the kind of limb, in the order in which they are tried."""
KIND_OF = {word: kind for kind, words in KINDS.items() for word in words.split()}

SIDE_OF = {"left": "left", "l": "left", "right": "right", "r": "right"}
PAIR_OF = {
    a + b: f"{long}_{side}"
    for (a, long), (b, side) in itertools.product(
        (("f", "front"), ("h", "rear"), ("r", "rear"), ("b", "rear")),
        (("l", "left"), ("r", "right")),
    )
} | {b + a: f"{long}_{side}" for a, long, b, side in (
    ("f", "front", "l", "left"), ("f", "front", "r", "right"),
    ("h", "rear", "l", "left"), ("h", "rear", "r", "right"),
)}  # fmt: skip
"""`fl` and `lf` are the front left leg of a quadruped."""
ENDS = {"front": "front", "fore": "front", "rear": "rear", "hind": "rear"}

END_OF = {"arm": "eef", "leg": "foot", "head": "head", "torso": "torso"}
"""Role of the frame at the end of a limb."""

ROLE_WORDS = {
    "imu": "imu gyro accelerometer",
    "eef": "eef ee effector",
    "tcp": "tcp tool flange grasp grasping",
    "foot": "foot sole toe",
    "tip": "tip",
}


@dataclass(frozen=True, kw_only=True, slots=True)
class Limb:
    """Joints that belong together.

    Attributes:
        name: Name of the group, such as `right_arm`.
        kind: One of `KINDS`.
        side: `left`, `right`, `front_left`, ... or empty.
        links: The links that its joints move, in depth-first order.
    """

    name: str
    kind: str
    side: str
    links: tuple[Link, ...]

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints that have a will of their own."""
        moving = (link.joint for link in self.links)
        return tuple(j.name for j in moving if j is not None and _independent(j))


def guess_limbs(links: Sequence[Link]) -> tuple[Limb, ...]:
    """Sort the moving links into limbs.

    A link whose names hold no telling word belongs to the limb of the moving link
    above it; where that branches from an arm it is a gripper, and below a torso or the
    root it is an arm.
    """
    above = _moving_parents(links)
    branching = _branching(above)
    kinds: dict[str, str] = {}
    sides: dict[str, str] = {}
    tops: dict[str, str] = {}
    for link in links:
        if link.joint is None:
            continue
        parent = above[link.name]
        inherited = kinds.get(parent or "", "")
        words = [*_words(link.joint.name), *_words(link.name)]
        kind = next((KIND_OF[w] for w in words if w in KIND_OF), None)
        kind = kind or _inherited_kind(inherited, branches=parent in branching)
        limb_goes_on = inherited in ("arm", "leg", "gripper")
        sides[link.name] = _side(words, pairs=kind == "leg") or (
            sides[str(parent)] if limb_goes_on else ""
        )
        kinds[link.name] = kind
        tops[link.name] = tops[str(parent)] if inherited == kind else link.name
    return tuple(_collect(links, kinds, sides, tops))


def _inherited_kind(above: str, *, branches: bool) -> str:
    if above == "arm" and branches:
        return "gripper"
    return above if above in ("arm", "leg", "gripper", "head") else "arm"


def _collect(
    links: Sequence[Link],
    kinds: dict[str, str],
    sides: dict[str, str],
    tops: dict[str, str],
) -> Iterable[Limb]:
    """Gather the links of each limb; arms without a side are numbered."""
    arms = [top for name, top in tops.items() if kinds[name] == "arm"]
    members: dict[str, list[Link]] = {}
    about: dict[str, tuple[str, str]] = {}
    for link in links:
        kind = kinds.get(link.name)
        if kind is None:
            continue
        side = sides[link.name] if kind in ("arm", "gripper") else ""
        name = "legs" if kind == "leg" else "_".join(filter(None, (side, kind)))
        if kind == "arm" and not side:
            several = list(dict.fromkeys(a for a in arms if not sides[a]))
            number = several.index(tops[link.name]) + 1 if len(several) > 1 else 0
            name += f"_{number}" if number else ""
        members.setdefault(name, []).append(link)
        about[name] = (kind, side)
    for name, own in members.items():
        yield Limb(
            name=name, kind=about[name][0], side=about[name][1], links=tuple(own)
        )


def guess_frames(
    links: Sequence[Link],
    limbs: Sequence[Limb],
    given: Sequence[Frame],
    names: NameTable,
) -> tuple[Frame, ...]:
    """Place `eef` at the end of arms, and `foot`, `head` and `torso` frames."""
    found: list[Frame] = []
    known = {frame.name for frame in given}
    for limb in limbs:
        role = END_OF.get(limb.kind)
        for tip in _tips(links, limb) if role else ():
            name = limb.name.replace(limb.kind, str(role))
            if limb.kind == "leg":
                side = _side(_words(tip.name), pairs=True)
                name = "_".join(filter(None, (side, role)))
            if name in known or _marked(links, tip, given, str(role)):
                continue
            placed = _placed(links, limb, tip, given)
            fields = {"name": names.take(name, "frame"), "role": role, **placed}
            found.append(Frame.model_validate(fields))
    return tuple(found)


def _marked(
    links: Sequence[Link], tip: Link, given: Sequence[Frame], role: str
) -> bool:
    """Tell whether the file itself marks the end of this limb."""
    rigid = rigid_bodies(tuple(links))
    return any(rigid[f.link] == tip.name and f.role == role for f in given)


def guess_role(name: str) -> str:
    """Return the role of a frame from the words in its name."""
    if name in ("head", "torso", "base"):
        return name
    words = set(_words(name))
    for role, telling in ROLE_WORDS.items():
        if words & set(telling.split()):
            return role
    return "other"


def guess_ready(links: Sequence[Link]) -> dict[str, float]:
    """Return a posture with each joint at the value in its range nearest to zero."""
    joints = [link.joint for link in links if link.joint is not None]
    return {j.name: _nearest_zero(j) for j in joints if _independent(j)}


def _nearest_zero(joint: Joint) -> float:
    low, high = joint.range or (0.0, 0.0)
    return min(max(0.0, low), high)


def _independent(joint: Joint) -> bool:
    return joint.mimic is None and not joint.passive


def _words(name: str) -> list[str]:
    """Split a name: `LHipYaw` gives l, hip, yaw; `arm_left_1` gives arm, left."""
    parts = re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)
    return [part.lower() for part in parts]


def _side(words: Sequence[str], *, pairs: bool) -> str:
    """Return `left`, or with `pairs` also `front_left`, when the words tell."""
    side = next((SIDE_OF[w] for w in words if w in SIDE_OF), "")
    if not pairs:
        return side
    pair = next((PAIR_OF[w] for w in words if w in PAIR_OF), "")
    end = next((ENDS[w] for w in words if w in ENDS), "")
    return pair or (f"{end}_{side}" if end and side else side)


def _moving_parents(links: Sequence[Link]) -> dict[str, str | None]:
    """Map each moving link to the moving link above it."""
    rigid = rigid_bodies(tuple(links))
    moving = {link.name for link in links if link.joint is not None}
    above: dict[str, str | None] = {}
    for link in links:
        if link.joint is not None:
            owner = rigid[str(link.parent)]
            above[link.name] = owner if owner in moving else None
    return above


def _branching(above: dict[str, str | None]) -> set[str | None]:
    parents = list(above.values())
    return {parent for parent in parents if parents.count(parent) > 1}


def _tips(links: Sequence[Link], limb: Limb) -> list[Link]:
    """Return the last moving links of legs, and the farthest one of other limbs."""
    above = _moving_parents(links)
    followed = {above[link.name] for link in limb.links}
    tips = [link for link in limb.links if link.name not in followed]
    if limb.kind == "leg":
        return tips
    return [max(tips, key=lambda tip: _depth(tip.name, above))]


def _depth(name: str | None, above: dict[str, str | None]) -> int:
    return 0 if name is None else 1 + _depth(above[name], above)


def _placed(
    links: Sequence[Link], limb: Limb, tip: Link, given: Sequence[Frame]
) -> dict[str, Any]:
    """Return where a guessed frame sits: at a telling frame or link, or at the tip."""
    rigid = rigid_bodies(tuple(links))
    telling = {"arm": ("eef", "tcp"), "leg": ("foot",)}.get(limb.kind, ())
    for frame in given:
        if rigid[frame.link] == tip.name and frame.role in telling:
            return {"link": frame.link, "pos": frame.pos, "quat": frame.quat}
    fixed = [link for link in links if rigid[link.name] == tip.name]
    for link in fixed:
        if guess_role(link.name) in telling:
            return {"link": link.name}
    if limb.kind == "arm":
        carriers = {link.parent for link in links if link.joint is not None}
        palms = [link for link in fixed if link.name in carriers]
        if palms:
            return {"link": palms[-1].name}
    return {"link": tip.name}
