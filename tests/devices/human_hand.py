"""A human hand for tests: recorded poses, and one that closes around an object."""

import json
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

RECORDED = json.loads((Path(__file__).parent / "recorded_hands.json").read_text())
NAMES = RECORDED["names"]  # of joints, in the order of WebXR
MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])
TO_FRAME = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""From the axes of WebXR to x forward, y left, z up."""
CHAINS = {
    "thumb": (1, 2, 3, 4),
    "index": (5, 6, 7, 8, 9),
    "middle": (10, 11, 12, 13, 14),
    "ring": (15, 16, 17, 18, 19),
    "pinky": (20, 21, 22, 23, 24),
}
TIPS = {name: chain[-1] for name, chain in CHAINS.items()}


def recorded(name):
    """Return poses of a left hand's joints in WebXR's axes, shape (25, 4, 4)."""
    columns = np.array(RECORDED[name]).reshape(25, 4, 4)
    return columns.transpose(0, 2, 1)


def mirrored(joints):
    """Return the right hand that mirrors a left one, and the other way round."""
    return MIRROR @ joints @ MIRROR


def points(joints):
    """Return positions in the axes of pose frames, m, shape (25, 3)."""
    return joints[:, :3, 3] @ TO_FRAME.T


def bent(angles):
    """Return a left hand with bent fingers.

    Args:
        angles: Bending of root, middle and end of index, middle, ring and little finger
            (12), then the thumb: two at its root, one at each other joint (4), rad.
    """
    relaxed, joints = recorded("relaxed"), recorded("relaxed")
    bends = {
        name: [(0, 0, 0), *((-a, 0, 0) for a in angles[3 * k : 3 * k + 3])]
        for k, name in enumerate(("index", "middle", "ring", "pinky"))
    }
    side, up, middle, end = angles[12:]
    bends["thumb"] = [(up, side, 0), (middle, 0, 0), (end, 0, 0)]
    for name, chain in CHAINS.items():
        for k, joint in enumerate(chain):
            if k == 0:
                pose = relaxed[joint].copy()
            else:
                step = np.linalg.inv(relaxed[chain[k - 1]]) @ relaxed[joint]
                pose = joints[chain[k - 1]] @ step
            if k < len(bends[name]):
                turn = Rotation.from_rotvec(bends[name][k]).as_matrix()
                pose[:3, :3] = pose[:3, :3] @ turn
            joints[joint] = pose
    return joints


def around(aperture):
    """Return a left hand whose thumb is opposite three fingers, `aperture` m apart."""
    nominal = np.array([0.6, 0.3, 0.15] * 3 + [0.3, 0.2, 0.1, -0.5, -0.4, 0.0, 0.0])

    def errors(angles):
        tips = {name: bent(angles)[joint, :3, 3] for name, joint in TIPS.items()}
        apart = {n: np.linalg.norm(t - tips["thumb"]) for n, t in tips.items()}
        wanted = {"index": 0.0, "middle": 0.004, "ring": 0.016}
        gaps = [30.0 * (apart[n] - aperture - more) for n, more in wanted.items()]
        return np.concatenate([gaps, 0.15 * (angles - nominal)])

    return bent(least_squares(errors, nominal).x)


def sign():
    """Return a left hand whose thumb touches the little finger."""
    nominal = np.array([0.1, 0.1, 0.1] * 3 + [0.9, 0.9, 0.5, -0.6, -0.6, 0.5, 0.5])

    def errors(angles):
        hand = bent(angles)
        apart = hand[TIPS["thumb"], :3, 3] - hand[TIPS["pinky"], :3, 3]
        return np.concatenate([60.0 * apart, 0.1 * (angles - nominal)])

    return bent(least_squares(errors, nominal).x)
