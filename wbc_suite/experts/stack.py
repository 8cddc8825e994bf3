"""The expert of Stack."""

import math

import numpy as np
import pinocchio as pin

from wbc_suite.benchmark.stack import A, B, Stack
from wbc_suite.experts.scene import ExpertScene, Steps
from wbc_suite.experts.skills import UP, carry, pick, release, shifted

QUARTERS = tuple(pin.exp3(k * math.pi / 2 * UP) for k in range(4))


def stack(scene: ExpertScene[Stack]) -> Steps[None]:
    """Put cube A on cube B, its faces parallel to those of B."""
    config = scene.benchmark.config
    height = config.cube_a.half_size + config.cube_b.half_size
    for _ in range(3):
        on_top = shifted(aligned(scene.pose(A), scene.pose(B)), (height + 0.002) * UP)
        ways = [turned(on_top, R) for R in QUARTERS]
        plans = [(shifted(way, 0.06 * UP), way) for way in ways]
        choice = yield from pick(scene, A, then=plans, raised=0.07)
        if choice is None:
            return
        above, goal = choice.then
        yield from carry(scene, choice.arm, A, above, tolerance=0.008)
        yield from carry(scene, choice.arm, A, goal, tolerance=0.003, speed=0.15)
        yield from release(choice.arm)
        if scene.benchmark.success():
            return


def aligned(pose: pin.SE3, to: pin.SE3) -> pin.SE3:
    """Return another pose, with one of the 24 rotations that keep a cube's axes.

    It is the nearest to a pose's, so that a cube which has tipped over stays so.
    """
    cosines, R = to.rotation.T @ pose.rotation, np.zeros((3, 3))
    for _ in range(3):
        row, column = np.unravel_index(np.abs(cosines).argmax(), (3, 3))
        R[row, column] = np.sign(cosines[row, column])
        cosines[row], cosines[:, column] = 0.0, 0.0
    return pin.SE3(to.rotation @ R, to.translation)


def turned(pose: pin.SE3, R: np.ndarray) -> pin.SE3:
    """Return a pose turned about its origin, by a rotation in the world."""
    return pin.SE3(R @ pose.rotation, pose.translation)
