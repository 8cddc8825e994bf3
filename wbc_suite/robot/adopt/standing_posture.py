"""Compute a standing posture of legs: knees bent, feet below the hips."""

import numpy as np
import pinocchio as pin

from wbc_suite.robot.adopt.foot_shapes import sole_normal
from wbc_suite.robot.adopt.posed_robot import PosedRobot
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import Frame
from wbc_suite.typing import Matrix, Vector

LEVEL = 0.02  # largest difference of the heights of feet that stand, m
TOLERANCE = 0.02  # largest residual in m of a posture that is accepted

AT_FRAME = 0.01
"""m; greatest distance of a ball's centre or a wheel's axis from a foot's frame."""
MIN_COSINE = 0.8
"""Smallest cosine between the axis of a pitch joint and y; that of H2's hip is 0.87."""
TILTED = 0.98  # cosine; below, joints about other axes keep the foot level
STAY = 0.02  # m/rad; cost of their motion

START = {2: ((0.55, -1.1), 0.85), 3: ((-0.3, 0.6, -0.3), 0.95)}
"""By number of hinges: initial angles about y, rad, and height of the hip as part of
the leg's length. Knees of quadrupeds point backward, those of humanoids forward."""


def standing_legs(robot: RobotDescription) -> dict[str, float]:
    """Return positions of the pitch joints of legs, by name, rad.

    In each chain to a frame with role `foot` the hinges about y are moved so that the
    foot is below the uppermost of them and its sole is flat on the ground. Other joints
    stay as in `ready`, unless a hinge is tilted. A leg without such a posture has no
    entry.
    """
    posed = PosedRobot(robot)
    found: dict[str, float] = {}
    for frame in robot.frames:
        if frame.role == "foot":
            found |= _bent_leg(posed, frame)
    return found


def feet_are_level(robot: RobotDescription) -> bool:
    """Whether all feet have nearly the same height in the posture `ready`."""
    posed = PosedRobot(robot)
    feet = [frame.name for frame in robot.frames if frame.role == "foot"]
    heights = [posed.pose(name).translation[2] for name in feet]
    return not feet or float(np.ptp(heights)) < LEVEL


def wheel_axis(robot: RobotDescription, frame: str) -> Vector | None:
    """Return the axis (3,) of a foot's link that turns without limits at its frame."""
    joint = robot.link(robot.link_of(frame)).joint
    if joint is None or joint.range is not None:
        return None
    axis = np.asarray(joint.axis)
    away = float(np.linalg.norm(np.cross(axis, robot.frame(frame).pos)))
    return axis if away < AT_FRAME else None


def _bent_leg(posed: PosedRobot, frame: Frame) -> dict[str, float]:
    robot, model, data = posed.robot, posed.model, posed.data
    start, foot = posed.q.copy(), model.getFrameId(frame.name)
    chain = model.supports[model.frames[foot].parentJoint].tolist()
    along = {joint: _along_y(posed, joint) for joint in chain}
    if wheel_axis(robot, frame.name) is not None:
        chain = chain[:-1]
    hinges = [joint for joint in chain if abs(along[joint]) > MIN_COSINE]
    if len(hinges) not in START:
        return {}
    angles, left = START[len(hinges)]
    places = np.array([model.joints[joint].idx_q for joint in hinges])
    points = np.array(
        [*(data.oMi[j].translation for j in hinges), data.oMf[foot].translation]
    )
    length = float(np.linalg.norm(np.diff(points[:, [0, 2]], axis=0), axis=1).sum())
    level = _flat(robot, frame.name, data.oMf[foot].rotation)
    aside = points[-1, 1] - points[0, 1]
    tilted = len(hinges) > 2 and min(abs(along[j]) for j in hinges) < TILTED
    others = [j for j in chain if tilted and j not in hinges and _is_hinge(posed, j)]
    hinges += others
    places = np.array([model.joints[joint].idx_q for joint in hinges])
    low, high = model.lowerPositionLimit[places], model.upperPositionLimit[places]

    def residuals(angles: Vector) -> Vector:
        """Return the errors of the foot's x and z, m, and of its tilt times length."""
        posed.q[places] = angles
        posed.update()
        off = data.oMf[foot].translation - data.oMi[hinges[0]].translation
        tilt = length * pin.log3(data.oMf[foot].rotation @ level.T)
        place = [off[0], off[2] + left * length]
        if others:
            moved = STAY * (angles[-len(others) :] - kept)
            return np.concatenate([place, [off[1] - aside], tilt, moved])
        # a point foot has no sole
        return np.array([*place, tilt[1] if len(hinges) > 2 else 0.0])

    kept = start[places][len(hinges) - len(others) :]
    signs = np.sign([along[joint] for joint in hinges])
    bent = signs[: len(signs) - len(others)] * np.asarray(angles)
    first: Vector = np.clip(np.concatenate([bent, kept]), low, high)
    from scipy.optimize import least_squares  # takes 0.3 s to import

    best = least_squares(residuals, first, bounds=(low - 1e-9, high + 1e-9))
    posed.q[:] = start
    posed.update()
    if not np.linalg.norm(best.fun) < TOLERANCE:
        return {}
    names = [model.names[joint] for joint in hinges]
    return dict(zip(names, best.x.round(4).clip(low, high).tolist(), strict=True))


def _flat(robot: RobotDescription, frame: str, R: Matrix) -> Matrix:
    """Return a foot's orientation, turned from R so that its sole is horizontal."""
    normal = sole_normal(robot, frame, -R[2])
    if normal is None:
        return R.copy()
    turn = pin.Quaternion.FromTwoVectors(R @ normal, np.array([0.0, 0.0, -1.0]))
    return turn.matrix() @ R


def _is_hinge(posed: PosedRobot, joint: int) -> bool:
    name = posed.model.names[joint]
    ready = posed.robot.keyframes["ready"]
    return name in ready and posed.robot.joint(name).type == "hinge"


def _along_y(posed: PosedRobot, joint: int) -> float:
    """Return the cosine between a hinge's axis and y; 0 for other joints."""
    robot, name = posed.robot, posed.model.names[joint]
    if name not in robot.keyframes["ready"] or robot.joint(name).type != "hinge":
        return 0.0  # a root joint, a follower or a slide
    axis = np.asarray(robot.joint(name).axis)
    return float(posed.data.oMi[joint].rotation[1] @ axis)
