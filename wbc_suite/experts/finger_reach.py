"""Where the fingers of a closing gripper are, and how far they reach forward."""

from collections.abc import Sequence

import mujoco
import numpy as np

from wbc_suite.control import RobotState
from wbc_suite.robot.elements import Synergy
from wbc_suite.sensing.hands import Hand

SAMPLES = 6


def finger_reach(
    state: RobotState, hand: Hand, synergies: Sequence[Synergy], grasp: str, frame: str
) -> float:
    """Return how far solid shapes get along the frame's z axis while closing, m.

    Fingers on linkages move forward as they close, and may meet what an object lies on.
    The simulation is not changed.
    """
    model, data = state.model, mujoco.MjData(state.model)
    own = [g for g in range(model.ngeom) if hand.owns(g) and model.geom_contype[g]]
    if not own or not synergies:
        return 0.0
    farthest = 0.0
    for posture in closing_postures(state, synergies, grasp):
        data.qpos[:] = state.data.qpos
        for joint, value in posture.items():
            data.joint(state.prefix + joint).qpos = value
        mujoco.mj_kinematics(model, data)
        site = data.site(state.prefix + frame)
        z = site.xmat.reshape(3, 3)[:, 2]
        rows = z @ data.geom_xmat[own].reshape(-1, 3, 3)
        middle = (data.geom_xpos[own] - site.xpos) @ z
        middle += np.sum(rows * model.geom_aabb[own, :3], axis=1)
        half = np.sum(np.abs(rows) * model.geom_aabb[own, 3:], axis=1)
        farthest = max(farthest, float((middle + half).max()))
    return farthest


def closing_postures(
    state: RobotState, synergies: Sequence[Synergy], grasp: str
) -> list[dict[str, float]]:
    """Return the joints of a gripper from open to closed, for a kind of grasp."""
    shares = np.linspace(0.0, 1.0, SAMPLES).tolist()
    return [_posture(state, synergies, grasp, share) for share in shares]


def _posture(
    state: RobotState, synergies: Sequence[Synergy], grasp: str, share: float
) -> dict[str, float]:
    """Return the joints of a gripper that has closed to a share of its way."""
    values: dict[str, float] = {}
    for synergy in synergies:
        before, after = synergy.grasps.get(grasp, (-1.0, 1.0))
        closed = 0.5 * ((1.0 - share) * before + share * after + 1.0)
        for joint, value in synergy.open.items():
            values[joint] = (1.0 - closed) * value + closed * synergy.closed[joint]
    for joint in state.robot.joints:
        mimic = joint.mimic
        if mimic is not None and mimic.joint in values:
            values[joint.name] = mimic.ratio * values[mimic.joint] + mimic.offset
    return values
