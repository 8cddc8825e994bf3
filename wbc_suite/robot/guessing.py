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

END_OF = {
    "arm": "eef",
    "gripper": "tcp",
    "leg": "foot",
    "head": "head",
    "torso": "torso",
}
"""Role of the frame at the end of a limb."""

TELLING = {
    "arm": {"eef", "ee", "effector", "tcp", "tool", "flange", "grasp", "grasping"},
    "gripper": {"tcp", "grasp", "grasping", "tool"},
    "leg": {"foot", "sole", "toe"},
}
"""Words of frames and links that mark the end of a limb."""


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
        side = sides[str(parent)] if limb_goes_on else ""
        own = _side(words, pairs=kind == "leg")
        fingers = kind == "gripper" and limb_goes_on  # "left finger" of a right hand
        sides[link.name] = side if fingers else own or side
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
    """Gather the links of each limb; several arms without a side are numbered.

    An only arm is the right one, as everywhere in this package.
    """
    arms = {top for name, top in tops.items() if kinds[name] == "arm"}
    grippers = [name for name, kind in kinds.items() if kind == "gripper"]
    if len(arms) == 1 and not any(sides[name] for name in (*arms, *grippers)):
        sides = dict.fromkeys(sides, "right")
    members: dict[str, list[Link]] = {}
    about: dict[str, tuple[str, str]] = {}
    for link in links:
        kind = kinds.get(link.name)
        if kind is None:
            continue
        side = sides[link.name] if kind in ("arm", "gripper") else ""
        name = "legs" if kind == "leg" else "_".join(filter(None, (side, kind)))
        if kind == "arm" and not side:
            several = [x.name for x in links if x.name in arms and not sides[x.name]]
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
    """Return the given frames, and `eef`, `foot`, `head`, `torso` at the limbs' ends.

    There is one for each end: a given frame of the right name is taken, and a given
    frame or link with a telling word says where it sits. A gripper has a `tcp` where a
    given frame marks the grasp.
    """
    frames = {frame.name: frame for frame in given}
    for limb in limbs:
        role = END_OF.get(limb.kind)
        for tip in _tips(links, limb) if role else ():
            name = limb.name.replace(limb.kind, str(role))
            if limb.kind == "leg":
                side = _side(_words(tip.name), pairs=True)
                name = "_".join(filter(None, (side, role)))
            placed = _placed(links, limb, tip, given)
            if name in frames:
                frames[name] = frames[name].model_copy(update={"role": role})
            elif placed is not None:
                name = names.take(name, "frame")
                fields = {"name": name, "role": role, **placed}
                frames[name] = Frame.model_validate(fields)
    return tuple(frames.values())


def guess_role(name: str) -> str:
    """Return the role of a frame in the file, when its name leaves no doubt."""
    words = _words(name)
    if name in ("head", "torso", "base"):
        return name
    if words and words[-1] in ("tip", "foot"):
        return words[-1]
    return "imu" if "imu" in words else "other"


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
) -> dict[str, Any] | None:
    """Return where a guessed frame sits: at a telling frame or link, or at the tip.

    That of a gripper sits on its palm, and is left out where nothing tells.
    """
    rigid = rigid_bodies(tuple(links))
    if limb.kind == "gripper":
        palm = rigid[str(limb.links[0].parent)]
        tip = next(link for link in links if link.name == palm)
    telling = TELLING.get(limb.kind, set[str]())
    for frame in given:
        if rigid[frame.link] == tip.name and telling.intersection(_words(frame.name)):
            return {"link": frame.link, "pos": frame.pos, "quat": frame.quat}
    fixed = [link for link in links if rigid[link.name] == tip.name]
    for link in fixed:
        if telling.intersection(_words(link.name)):
            return {"link": link.name}
    if limb.kind == "gripper":
        return None
    if limb.kind == "arm":
        carriers = {link.parent for link in links if link.joint is not None}
        palms = [link for link in fixed if link.name in carriers]
        if palms:
            return {"link": palms[-1].name}
    return {"link": tip.name}
