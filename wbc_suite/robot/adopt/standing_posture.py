"""Compute a standing posture of legs: knees bent, feet below the hips."""

import numpy as np
import pinocchio as pin

from wbc_suite.robot.adopt.posed_robot import PosedRobot
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import Frame
from wbc_suite.typing import Vector

LEVEL = 0.02  # largest difference of the heights of feet that stand, m
TOLERANCE = 0.02  # largest residual in m of a posture that is accepted

AT_FRAME = 0.01
"""m; greatest distance of a ball's centre or a wheel's axis from a foot's frame."""
MIN_COSINE = 0.9  # smallest cosine between the axis of a pitch joint and y

START = {2: ((0.55, -1.1), 0.85), 3: ((-0.3, 0.6, -0.3), 0.95)}
"""By number of hinges: initial angles about y, rad, and height of the hip as part of
the leg's length. Knees of quadrupeds point backward, those of humanoids forward."""


def standing_legs(robot: RobotDescription) -> dict[str, float]:
    """Return positions of the pitch joints of legs, by name, rad.

    In each chain to a frame with role `foot` the hinges about y are moved so that the
    foot is below the uppermost of them and its sole keeps the inclination of the
    posture `ready`, in which other joints stay. A leg without such a posture has no
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
    level = data.oMf[foot].rotation.copy()
    low, high = model.lowerPositionLimit[places], model.upperPositionLimit[places]

    def residuals(angles: Vector) -> Vector:
        """Return the errors of the foot's x and z, m, and of its tilt times length."""
        posed.q[places] = angles
        posed.update()
        off = data.oMf[foot].translation - data.oMi[hinges[0]].translation
        tilt = pin.log3(level.T @ data.oMf[foot].rotation)[1]
        tilt = tilt if len(hinges) > 2 else 0.0  # a point foot has no sole
        return np.array([off[0], off[2] + left * length, length * tilt])

    signs = np.sign([along[joint] for joint in hinges])
    first: Vector = np.clip(signs * np.asarray(angles), low, high)
    from scipy.optimize import least_squares  # takes 0.3 s to import

    best = least_squares(residuals, first, bounds=(low - 1e-9, high + 1e-9))
    posed.q[:] = start
    posed.update()
    if not np.linalg.norm(best.fun) < TOLERANCE:
        return {}
    names = [model.names[joint] for joint in hinges]
    return dict(zip(names, best.x.round(4).clip(low, high).tolist(), strict=True))


def _along_y(posed: PosedRobot, joint: int) -> float:
    """Return the cosine between a hinge's axis and y; 0 for other joints."""
    robot, name = posed.robot, posed.model.names[joint]
    if name not in robot.keyframes["ready"] or robot.joint(name).type != "hinge":
        return 0.0  # a root joint, a follower or a slide
    axis = np.asarray(robot.joint(name).axis)
    return float(posed.data.oMi[joint].rotation[1] @ axis)
