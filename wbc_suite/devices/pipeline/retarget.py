"""Hand retargeting: from the user's fingers to the synergies of a robot's hand."""

from collections.abc import Sequence

import numpy as np

from wbc_suite.typing import Matrix, Vector

FINGERS = {
    "thumb": (1, 2, 3, 4),
    "index": (5, 6, 7, 8, 9),
    "middle": (10, 11, 12, 13, 14),
    "ring": (15, 16, 17, 18, 19),
    "pinky": (20, 21, 22, 23, 24),
}
"""Joints of each finger from palm to tip, in the order of WebXR; the wrist is 0."""

FIST = {"thumb": 1.6}  # rad; likewise, of its two joints
FIST_FINGER = 3.6  # rad; sum of a finger's three joint angles in a fist
OPEN_PINCH, CLOSED_PINCH = 0.9, 0.15  # thumb to index, in widths of the palm
FAR_THUMB, NEAR_THUMB = 1.6, 0.5  # thumb's tip to the ring finger's root, likewise
SPREAD_WORDS = ("yaw", "rotation", "opposition", "abduction")


def curls(joints: Matrix) -> dict[str, float]:
    """Return the flexion of each finger, 0 straight .. 1 as in a fist.

    Only angles between bones count, so pose and size of the hand do not matter. The
    positions of its joints have shape (25, 3).
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
    """Return the pinch of thumb and index, 0 apart .. 1 together."""
    return _closeness(joints, 4, 9, OPEN_PINCH, CLOSED_PINCH)


def opposition(joints: Matrix) -> float:
    """Return the opposition of the thumb, 0 beside the palm .. 1 across it."""
    return _closeness(joints, 4, 16, FAR_THUMB, NEAR_THUMB)


def retarget(joints: Matrix, labels: Sequence[str], *, by_pinch: bool) -> Vector:
    """Return a value for each synergy of a robot's hand, -1 open .. 1 closed.

    A synergy named after a finger follows it; one that rotates the thumb follows its
    opposition; any other follows the mean of the four fingers. A gripper of one synergy
    follows the pinch, and with `by_pinch` every synergy does. The joints of the user's
    hand are in m, shape (25, 3).
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
    """Return the closeness of two joints, 0 .. 1, measured in widths of the palm."""
    palm = max(float(np.linalg.norm(joints[6] - joints[21])), 1e-9)
    distance = float(np.linalg.norm(joints[a] - joints[b])) / palm
    return float(np.clip((far - distance) / (far - near), 0.0, 1.0))
