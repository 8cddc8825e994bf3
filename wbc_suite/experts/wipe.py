"""The expert of Wipe."""

import math

import numpy as np
import pinocchio as pin

from wbc_suite.benchmark.wipe import Wipe
from wbc_suite.experts.arm import Arm
from wbc_suite.experts.scene import ExpertScene, Steps
from wbc_suite.experts.skills import UP, move
from wbc_suite.typing import Vector

FORCE = 20.0  # N; below 60 N nothing is subtracted from the reward
SOFT = 2e-4  # m/N, change of depth per control period for a wrong force
DEEPEST = 0.05  # m, of the goal below the table
ABOVE = 0.02  # m
SLIDING = 0.3  # m/s
TURNS = tuple(k * math.pi / 4 for k in range(8))


def wipe(scene: ExpertScene[Wipe]) -> Steps[None]:
    """Press the pad on the table, and slide it over the nearest mark that is left."""
    arm, marks = scene.arms[0], scene.benchmark.marks
    flat = _rotation(arm, [marks[0], marks[-1], marks.mean(axis=0)])
    distances = [np.linalg.norm(arm.pose.translation - marks[k]) for k in (0, -1)]
    start = marks[-int(np.argmin(distances))]
    yield from move(arm, pin.SE3(flat, start + ABOVE * UP), tolerance=0.02)
    depth = 0.0
    while not scene.benchmark.success():
        left = marks[~scene.benchmark.wiped]
        at = arm.pose.translation
        target = left[np.argmin(np.linalg.norm(left[:, :2] - at[:2], axis=1))]
        error = FORCE - scene.benchmark.force
        depth = float(np.clip(depth + SOFT * error, 0.0, DEEPEST))
        goal = pin.SE3(flat, target - depth * UP)
        arm.aim(goal, speed=SLIDING, exact=False)
        yield


def _rotation(arm: Arm, points: list[Vector]) -> np.ndarray:
    """Return the rotation of a hand that points down and reaches all points best."""
    x, y = arm.pose.rotation[:2, 0]
    down = np.diag([1.0, -1.0, -1.0])
    heading = math.atan2(y, x)
    ways = [pin.exp3((heading + turn) * UP) @ down for turn in TURNS]
    costs = [arm.look_ahead([pin.SE3(R, point) for point in points]).cost for R in ways]
    return ways[int(np.argmin(costs))]
