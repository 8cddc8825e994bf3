"""Hand retargeting: how a person's fingers close a robot's hand."""

from collections.abc import Sequence

import numpy as np

from wbc_suite.typing import Matrix, Vector

__all__ = ["curls", "opposition", "pinch", "retarget"]

FINGERS = {
    "thumb": (1, 2, 3, 4),
    "index": (5, 6, 7, 8, 9),
    "middle": (10, 11, 12, 13, 14),
    "ring": (15, 16, 17, 18, 19),
    "pinky": (20, 21, 22, 23, 24),
}
"""Joints of each finger from palm to tip, in the order of WebXR; the wrist is 0."""

FIST = {"thumb": 1.6}
FIST_FINGER = 3.6  # rad; bends of a finger's three joints in a fist, added up
OPEN_PINCH, CLOSED_PINCH = 0.9, 0.15  # thumb to index, in widths of the palm
FAR_THUMB, NEAR_THUMB = 1.6, 0.5  # thumb's tip to the ring finger's root, likewise
SPREAD_WORDS = ("yaw", "rotation", "opposition", "abduction")


def curls(joints: Matrix) -> dict[str, float]:
    """Return how far each finger is bent, 0 straight .. 1 as in a fist.

    Only angles between bones count, so it does not matter where the hand is, how it is
    turned, or how large it is.

    Args:
        joints: Positions, shape (25, 3).
    """
    found = {}
    for name, indices in FINGERS.items():
        bones = np.diff(joints[list(indices)], axis=0)
        bones = bones / np.maximum(np.linalg.norm(bones, axis=1, keepdims=True), 1e-9)
        cosines = np.clip((bones[1:] * bones[:-1]).sum(axis=1), -1.0, 1.0)
        bent = float(np.arccos(cosines).sum()) / FIST.get(name, FIST_FINGER)
        found[name] = min(bent, 1.0)
    return found


def pinch(joints: Matrix) -> float:
    """Return how far thumb and index are closed, 0 apart .. 1 together."""
    return _closeness(joints, 4, 9, OPEN_PINCH, CLOSED_PINCH)


def opposition(joints: Matrix) -> float:
    """Return how far the thumb lies across the palm, 0 beside .. 1 across."""
    return _closeness(joints, 4, 16, FAR_THUMB, NEAR_THUMB)


def retarget(joints: Matrix, labels: Sequence[str], *, by_pinch: bool) -> Vector:
    """Return a value for each synergy of a robot's hand, -1 open .. 1 closed.

    A synergy that is named after a finger follows it; one that turns the thumb follows
    its opposition; any other closes with the four fingers together. A gripper of one
    synergy, and all of them if asked, close with the pinch.

    Args:
        joints: The person's hand, shape (25, 3).
        labels: Names of the synergies.
        by_pinch: Whether the whole hand follows thumb and index.
    """
    if by_pinch or len(labels) == 1:
        return np.full(len(labels), 2.0 * pinch(joints) - 1.0)
    bent = curls(joints)
    together = float(np.mean([bent[name] for name in bent if name != "thumb"]))
    values = []
    for label in labels:
        finger = next((name for name in FINGERS if name in label), None)
        if finger == "thumb" and any(word in label for word in SPREAD_WORDS):
            values.append(opposition(joints))
        else:
            values.append(together if finger is None else bent[finger])
    return 2.0 * np.array(values) - 1.0


def _closeness(joints: Matrix, a: int, b: int, far: float, near: float) -> float:
    """Return 0 .. 1 as two joints come closer, measured in widths of the palm."""
    palm = max(float(np.linalg.norm(joints[6] - joints[21])), 1e-9)
    distance = float(np.linalg.norm(joints[a] - joints[b])) / palm
    return float(np.clip((far - distance) / (far - near), 0.0, 1.0))
