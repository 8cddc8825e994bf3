"""Infer groups, end-effector frames and a ready posture of an imported robot.

Words of names and the structure of the tree give them. Users edit the result.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from wbc_suite.robot.adopt.jaws import closes_on_parent, is_hand
from wbc_suite.robot.adopt.name_words import (
    END_WORDS,
    FINGERS,
    KIND_OF,
    kind_of,
    side_of,
    words_in,
    words_of,
)
from wbc_suite.robot.elements import Frame, Link, rigid_bodies
from wbc_suite.robot.shape_geometry import farthest_point

END_OF = {
    "arm": "eef",
    "gripper": "tcp",
    "leg": "foot",
    "head": "head",
    "torso": "torso",
}
"""Role of the frame at the end of a limb."""

MIN_ARM = 3  # joints; a shorter chain beside a left and a right arm, or beside one of
LONG_ARM = 5  # so many, is a head
POINT_FOOT = 3  # joints of a leg that stands on its outermost point, if it has no name


@dataclass(frozen=True, kw_only=True, slots=True)
class Limb:
    """Joints of one arm, gripper, head, torso or base, or of all legs."""

    name: str
    kind: str
    links: tuple[Link, ...]

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the independent joints."""
        joints = (link.joint for link in self.links)
        return tuple(j.name for j in joints if j is not None and j.independent)


class _Traits(NamedTuple):
    """Kind and side of a moving link's limb, and the first link of the limb."""

    kind: str = ""
    side: str = ""
    top: str = ""


def infer_limbs(
    links: Sequence[Link], kinds: Mapping[str, str] | None = None
) -> tuple[Limb, ...]:
    """Sort the moving links into limbs; `kinds` are known, by name of the link.

    A link without a known word in its names belongs to the limb of its parent. Branches
    of an arm form a gripper; a chain below a torso or the root is an arm. A single arm
    is the right one; several arms without a side are numbered. Two slides and a hinge
    that move all others in a plane are a base. The last joint of an arm is a gripper if
    its link closes on what carries it. A hand alone is one gripper.
    One or two joints without a side beside two arms that have one are a head.
    """
    traits = _without_masts(_traits(links, kinds or {}))
    if is_hand(links, {own.kind for own in traits.values()}):
        moving = tuple(link for link in links if link.joint is not None)
        return (Limb(name="gripper", kind="gripper", links=moving),)
    if not any(own.kind == "arm" for own in traits.values()):
        traits = _fingers_as_arms(traits, _moving_parents(links))
    traits = _with_jaws(links, traits)
    arms = list(dict.fromkeys(x.top for x in traits.values() if x.kind == "arm"))
    unnamed = [top for top in arms if not traits[top].side]
    grippers = [x.side for x in traits.values() if x.kind == "gripper"]
    single = len(arms) == len(unnamed) == 1 and not any(grippers)
    numbers = {top: unnamed.index(top) + 1 for top in unnamed if len(unnamed) > 1}
    above = _moving_parents(links)
    members: dict[tuple[str, str], list[Link]] = {}

    def arm_of(name: str | None) -> str:
        """Return the top of the arm that a link belongs to or is carried by."""
        while name is not None and traits[name].kind != "arm":
            name = above[name]
        return "" if name is None else traits[name].top

    for link in links:
        if link.joint is None:
            continue
        kind, side, _ = traits[link.name]
        side = "right" if single else side
        name = "legs" if kind == "leg" else kind
        if kind in ("arm", "gripper") and side:
            name = f"{side}_{kind}"
        elif kind in ("arm", "gripper") and (number := numbers.get(arm_of(link.name))):
            name = f"{kind}_{number}"
        members.setdefault((name, kind), []).append(link)
    return tuple(
        Limb(name=name, kind=kind, links=tuple(own))
        for (name, kind), own in members.items()
    )


def _traits(links: Sequence[Link], kinds: Mapping[str, str]) -> dict[str, _Traits]:
    """Return kind, side and top of each moving link, by name."""
    parents, said = _moving_parents(links), _words(links)
    owners, driving = list(parents.values()), _planar_base(links, parents)
    named = _named_kinds(links, parents)
    traits: dict[str, _Traits] = {}
    for link in links:
        if link.joint is None:
            continue
        parent = parents[link.name]
        above = traits.get(parent or "", _Traits())
        words = [*said[link.joint.name], *said[link.name]]
        kind = named[link.name]
        if link.name in driving:
            kind = "base"
        elif _is_finger(said[link.joint.name], said[link.name]):
            kind = "gripper"
        if kind is None and above.kind == "arm" and owners.count(parent) > 1:
            kind = "gripper"
        elif kind is None:
            rolls = above.kind == "base" and parent not in driving  # rim of a wheel
            inherits = rolls or above.kind in ("leg", "gripper", "head")
            kind = above.kind if inherits else "arm"
        kind = kinds.get(link.name, kind)
        if kind == "base" and above.kind == "leg":
            kind = "leg"  # on wheels
        if kind == "torso" and side_of(words, pairs=False):
            kind = "arm"  # "waist" of the left one of two arms
        same_limb = above.kind in ("arm", "leg", "gripper")
        side = above.side if same_limb else ""
        if not (kind == "gripper" and same_limb):  # "left finger" of a right hand
            side = side_of(words, pairs=kind == "leg") or side
        top = above.top if above.kind == kind else link.name
        traits[link.name] = _Traits(kind, side, top)
    return traits


def _words(links: Sequence[Link]) -> dict[str, list[str]]:
    """Return the words in the names of links and joints."""
    joints = [link.joint.name for link in links if link.joint is not None]
    return words_in([*(link.name for link in links), *joints])


def _is_finger(joint: Sequence[str], link: Sequence[str]) -> bool:
    """Whether one is: joint `arm_hand_index`, or link `finger_2` of joint `arm_9`."""
    part = next((w for w in joint if w in KIND_OF), "arm")
    if part != "arm":
        return bool(FINGERS.intersection(joint))
    return "gripper" in map(KIND_OF.get, joint) or bool(FINGERS.intersection(link))


def _named_kinds(
    links: Sequence[Link], parents: dict[str, str | None]
) -> dict[str, str | None]:
    """Return the kind that words give each moving link, None without one.

    What carries only legs is a leg, and what carries a left and a right arm a torso: a
    long chain with a side is an arm even if no word says so.
    """
    kinds, said = dict[str, str | None](), _words(links)
    arms: dict[str, set[str]] = {}  # sides of the arms from a link on
    length: dict[str, int] = {}  # joints from a link on
    for link in reversed(links):
        if link.joint is None:
            continue
        words = [*said[link.joint.name], *said[link.name]]
        kind = kind_of(words)
        below = [name for name, own in parents.items() if own == link.name]
        arms[link.name] = set[str]().union(*(arms[name] for name in below))
        length[link.name] = 1 + max((length[name] for name in below), default=0)
        is_long = kind is None and length[link.name] >= LONG_ARM
        if kind in (None, "arm") and {kinds[name] for name in below} == {"leg"}:
            kind = "leg"
        elif kind is None and len(arms[link.name]) > 1:
            kind = "torso"
        elif (kind == "arm" or is_long) and (side := side_of(words, pairs=False)):
            arms[link.name].add(side)
        kinds[link.name] = kind
    return kinds


def _fingers_as_arms(
    traits: dict[str, _Traits], parents: dict[str, str | None]
) -> dict[str, _Traits]:
    """Return the traits with each chain of a gripper as an arm without a side."""
    changed = dict(traits)
    for name, own in traits.items():
        if own.kind == "gripper":
            above = changed.get(parents[name] or "", _Traits())
            top = above.top if above.kind == "arm" else name
            changed[name] = _Traits("arm", "", top)
    return changed


def _with_jaws(links: Sequence[Link], traits: dict[str, _Traits]) -> dict[str, _Traits]:
    """Return the traits with a last link that closes on its parent as a gripper.

    What carries it belongs to the arm.
    """
    above, changed = _moving_parents(links), dict(traits)
    carried = Counter(above.values())
    for name, own in traits.items():
        parent = above[name]
        if carried[name] or parent is None or own.kind not in ("arm", "gripper"):
            continue
        chain = [parent]
        while traits[chain[-1]].kind == "gripper" and (top := above[chain[-1]]):
            chain.append(top)
        single = all(carried[x] == 1 for x in chain[: len(chain) - 1] or chain)
        arm = traits[chain[-1]]
        if not single or arm.kind != "arm" or not closes_on_parent(links, name):
            continue
        changed |= dict.fromkeys(chain[:-1], arm)
        changed[name] = _Traits("gripper", own.side, name)
    return changed


def _without_masts(traits: dict[str, _Traits]) -> dict[str, _Traits]:
    """Return the traits with what is too short for an arm beside others as a head."""
    arms = [own for own in traits.values() if own.kind == "arm"]
    length = Counter(own.top for own in arms)
    several = {"left", "right"} <= {own.side for own in arms}
    if not several and max(length.values(), default=0) < LONG_ARM:
        return traits
    masts = {top for top, joints in length.items() if joints < MIN_ARM}
    masts -= {own.top for own in arms if own.side}
    heads = {n: x._replace(kind="head") for n, x in traits.items() if x.top in masts}
    return traits | heads


def _planar_base(
    links: Sequence[Link], parents: dict[str, str | None]
) -> tuple[str, ...]:
    """Return the names of three links that move all others in a plane, if any."""
    names = list(parents)[:3]
    joints = [link.joint for link in links if link.name in names and link.joint]
    chained = [parents[name] for name in names] == [None, *names[:2]]
    level = [joint.type == "slide" and abs(joint.axis[2]) < 0.1 for joint in joints]
    if not chained or level != [True, True, False]:
        return ()
    return tuple(names) if abs(joints[2].axis[2]) > 0.9 else ()


def infer_frames(
    links: Sequence[Link],
    limbs: Sequence[Limb],
    given: Sequence[Frame],
    take: Callable[[str, str], str],
) -> tuple[Frame, ...]:
    """Return the given frames, and `eef`, `foot`, `head`, `torso` at the limbs' ends.

    A new frame is placed at a given frame or link with a word of `END_WORDS`, or else
    at the tip, where a leg of a quadruped ends. A gripper gets a `tcp` only in the
    first case. `take` returns a free name near the given one, for a kind of element.
    """
    frames = {frame.name: frame for frame in given}
    for limb in limbs:
        role = END_OF.get(limb.kind)
        for tip in _tips(links, limb) if role else ():
            name = limb.name.replace(limb.kind, str(role))
            if limb.kind == "leg":
                side = side_of(_words(links)[tip.name], pairs=True)
                name = "_".join(filter(None, (side, role)))
            placed = _placed(links, limb, tip, given)
            if any(frame.name == name for frame in given):
                frames[name] = frames[name].model_copy(update={"role": role})
            elif placed is not None:
                name = take(name, "frame")
                fields = {"name": name, "role": role, **placed}
                frames[name] = Frame.model_validate(fields)
    return tuple(frames.values())


def infer_role(name: str) -> str:
    """Return the role of a frame in the file if its name is unambiguous."""
    words = words_of(name)
    if name in ("head", "torso", "base"):
        return name
    if words and words[-1] in ("tip", "foot"):
        return words[-1]
    return "imu" if "imu" in words else "other"


def infer_ready(links: Sequence[Link]) -> dict[str, float]:
    """Return a posture with each joint at the value in its range nearest to zero."""
    ready: dict[str, float] = {}
    for joint in (link.joint for link in links):
        if joint is not None and joint.independent:
            low, high = joint.range or (0.0, 0.0)
            ready[joint.name] = min(max(0.0, low), high)
    return ready


def _moving_parents(links: Sequence[Link]) -> dict[str, str | None]:
    """Map each moving link to its closest moving ancestor."""
    rigid = rigid_bodies(links)
    moving = {link.name for link in links if link.joint is not None}
    above: dict[str, str | None] = {}
    for link in links:
        if link.joint is not None:
            owner = rigid[str(link.parent)]
            above[link.name] = owner if owner in moving else None
    return above


def _tips(links: Sequence[Link], limb: Limb) -> list[Link]:
    """Return the last moving link of each leg (its toe), or the deepest of a limb."""
    above = _moving_parents(links)
    followed = {above[link.name] for link in limb.links}
    tips = [link for link in limb.links if link.name not in followed]
    tops: dict[str, str] = {}
    for link in limb.links:
        tops[link.name] = tops.get(above[link.name] or "", link.name)

    def rank(tip: Link) -> tuple[bool, int]:
        foot = END_WORDS["leg"].intersection(words_of(tip.name))
        return limb.kind == "leg" and bool(foot), _depth(tip.name, above)

    found, said = dict[str, Link](), _words(links)
    for tip in tips:
        side = side_of(said[tip.name], pairs=True)
        key = f"{side} {tops[tip.name]}" if limb.kind == "leg" else ""
        if key not in found or rank(tip) > rank(found[key]):
            found[key] = tip
    return list(found.values())


def _depth(name: str | None, above: dict[str, str | None]) -> int:
    return 0 if name is None else 1 + _depth(above[name], above)


def _placed(
    links: Sequence[Link], limb: Limb, tip: Link, given: Sequence[Frame]
) -> dict[str, Any] | None:
    """Return the pose of an inferred frame; None for a gripper without an end word."""
    rigid = rigid_bodies(links)
    if limb.kind == "gripper":
        palm = rigid[str(limb.links[0].parent)]
        tip = next(link for link in links if link.name == palm)
    end_words = END_WORDS.get(limb.kind, set[str]())
    for frame in sorted(given, key=_is_no_sole):
        if rigid[frame.link] == tip.name and end_words.intersection(
            words_of(frame.name)
        ):
            return {"link": frame.link, "pos": frame.pos, "quat": frame.quat}
    fixed = [link for link in links if rigid[link.name] == tip.name]
    for link in sorted(fixed, key=_is_no_sole):
        if end_words.intersection(words_of(link.name)):
            return {"link": link.name}
    if limb.kind == "gripper":
        return None
    if limb.kind == "arm":
        carriers = {link.parent for link in links if link.joint is not None}
        palms = [link for link in fixed if link.name in carriers]
        if palms:
            return {"link": palms[-1].name}
    above, leg = _moving_parents(links), {link.name for link in limb.links}
    chain = {n: parent if parent in leg else None for n, parent in above.items()}
    if limb.kind == "leg" and _depth(tip.name, chain) <= POINT_FOOT:
        return {"link": tip.name, "pos": farthest_point(tip.collision or tip.visual)}
    return {"link": tip.name}


def _is_no_sole(item: Frame | Link) -> bool:
    """Return the key that sorts soles before ankles and feet."""
    return "sole" not in words_of(item.name)
