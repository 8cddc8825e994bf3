"""Which links of a gripper are its fingers, of which side, and what touches objects."""

import re
from collections.abc import Iterable

from wbc_suite.robot import RobotDescription

PADS = (
    r"pad",
    r"tip",
    r"distal|intermediate|_link_3|_2_link|hand_\w+_1_link",
    r"finger",
)
"""Parts of names of links that touch what is held, the likeliest first."""


def moved_links(
    robot: RobotDescription, links: Iterable[str], arm_joints: set[str]
) -> list[str]:
    """Return the links of a gripper that its joints move, parents before children."""
    own, found = set(links), []
    for link in robot.links:
        driven = link.joint is not None and link.joint.name not in arm_joints
        if link.name in own and (driven or link.parent in found):
            found.append(link.name)
    return found


def finger_sides(
    fingers: list[str], others: Iterable[str], arm: str
) -> dict[str, list[str]]:
    """Return the fingers by robosuite's sides, `left_finger` and `right_finger`.

    A thumb is left, all fingers that oppose it right; of Jaco's, which has no middle
    finger, it is the other way round. A jaw that moves alone closes on one of `others`.
    """
    short = {
        name: re.sub(rf"^({arm}_)?(gripper_|hand_)?", "", name) for name in fingers
    }
    if any("thumb" in name for name in fingers):
        thumb = [name for name in fingers if "thumb" in name]
        rest = [name for name in fingers if name not in thumb]
        hand = any("middle" in name for name in fingers)
        lefts, rights = (thumb, rest) if hand else (rest, thumb)
    else:
        pattern = r"left|(^|_)l_|finger_[12]_"
        lefts = [name for name in fingers if re.search(pattern, short[name])]
        rights = [name for name in fingers if name not in lefts]
    fixed = [name for name in others if name not in fingers]
    return {"left_finger": lefts or fixed, "right_finger": rights or fixed}


def pads(links: list[str]) -> list[str]:
    """Return the links of one side that touch what is held."""
    for pattern in PADS:
        found = [name for name in links if re.search(pattern, name)]
        if found:
            return found
    return links[-1:]
