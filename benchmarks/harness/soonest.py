"""How soon joints at their top speeds can bring a hand to a pose, on any path.

A lower bound for every control law: accelerations, torques and paths are not limited.
"""

import mujoco
import numpy as np
import pinocchio as pin
from scipy.optimize import least_squares

from harness.motion import BAND
from harness.stand import Stand

__all__ = ["soonest"]

LONGEST = 2.0  # s
EXACT = 2e-3  # s; as the physics' steps
STARTS = 6


def soonest(stand: Stand, goal: np.ndarray, *, site: str, drives: np.ndarray) -> float:
    """Return the least time until a hand can be within a step's band, s.

    In the time t joint j is within `v_j t` of where it is; t is halved while some such
    configuration, within its limits, has the hand in the band.

    Args:
        stand: The robot where it starts; it is not moved.
        goal: Where to, relative to where the hand is, as in `harness.motion`.
        site: The hand.
        drives: The joints' table of the law that moves it.
    """
    scratch = mujoco.MjData(stand.model)
    scratch.qpos[:] = stand.data.qpos
    q0 = scratch.qpos[drives["qpos"]].copy()
    lowest, highest = drives["position_min"], drives["position_max"]
    mujoco.mj_kinematics(stand.model, scratch)
    hand = scratch.site(site)
    start, turned = hand.xpos.copy(), hand.xmat.reshape(3, 3).copy()
    band = BAND * np.repeat([np.linalg.norm(half) for half in np.split(goal, 2)], 3)

    def turn_at(q: np.ndarray) -> np.ndarray:
        scratch.qpos[drives["qpos"]] = q
        mujoco.mj_kinematics(stand.model, scratch)
        return hand.xmat.reshape(3, 3) @ turned.T

    def off(q: np.ndarray) -> np.ndarray:
        turn = pin.log3(turn_at(q))
        return (np.concatenate([hand.xpos - start, turn]) - goal) / band

    def slope(q: np.ndarray) -> np.ndarray:
        R, J = turn_at(q), np.zeros((2, 3, stand.model.nv))
        mujoco.mj_comPos(stand.model, scratch)
        mujoco.mj_jacSite(stand.model, scratch, J[0], J[1], hand.id)
        J[1] = pin.Jlog3(R) @ R.T @ J[1]
        return J.reshape(6, -1)[:, drives["dof"]] / band[:, None]

    def is_possible(time: float) -> bool:
        rng, reach = np.random.default_rng(0), time * drives["velocity_max"]
        low, high = np.maximum(lowest, q0 - reach), np.minimum(highest, q0 + reach)
        for k in range(STARTS):
            first = rng.uniform(low, high) if k else (low + high) / 2.0
            found = least_squares(
                off, first, slope, bounds=(low, high), method="dogbox"
            ).x
            if np.linalg.norm(np.split(off(found), 2), axis=1).max() <= 1.0:
                return True
        return False

    least, most = 0.0, LONGEST
    while most - least > EXACT:
        middle = (least + most) / 2.0
        least, most = (least, middle) if is_possible(middle) else (middle, most)
    return most
