"""The catalogue's robots before targets out of reach: they stand still, and say why."""

import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.kinematics import Configuration
from wbc_suite.qp import ComTask, Fallback, FrameEquality, FrameTask, PostureTask
from wbc_suite.qp.stack import TaskStack
from wbc_suite.robot import load_robot

CHATTER = 0.01  # rad/s, p99 of the change of velocity between ticks, last second
HANDS = ("right_eef", "left_eef")
FEET = ("right_foot", "left_foot")
ROBOTS = [  # name, root, hands, feet
    ("GR1", "free", HANDS, FEET),
    ("GR1", "fixed", HANDS, ()),
    ("Tiago", None, HANDS, ()),
    ("Panda", None, HANDS[:1], ()),
    ("SpotWithArm", None, HANDS[:1], ()),
]
OFFSETS = {  # m, of the right hand; y is mirrored for the left one
    "far ahead": (5.0, 0.0, 0.0),
    "apart": (0.0, -5.0, 0.0),
    "just too far": (0.6, -0.3, 0.6),
}


def build(name, root, hands, feet, level):
    robot = load_robot(name, root=root)
    model = robot.to_pinocchio()
    q = pin.neutral(model)
    for joint, value in robot.keyframes["ready"].items():
        q[model.joints[model.getJointId(joint)].idx_q] = value
    tasks = [FrameTask(hand) for hand in hands]
    tasks += [ComTask()] if feet else []
    tasks.append(PostureTask(1e-2, level=level))
    held = [FrameEquality(foot) for foot in feet]
    return TaskStack(Configuration(model, q), tasks, equalities=held)


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda r: f"{r[0]}-{r[1]}")
@pytest.mark.parametrize("offset", OFFSETS)
@pytest.mark.parametrize("level", [0, 1])
def test_robots_stand_still_before_targets_out_of_reach(robot, offset, level):
    stack, dt = build(*robot, level), 0.02
    for side, hand in zip((1.0, -1.0), robot[2], strict=False):
        task = next(t for t in stack.tasks if t.name == hand)
        target = task.target
        x, y, z = OFFSETS[offset]
        target.translation = target.translation + np.array([x, side * y, z])
        task.set_target(target)
    velocities, configuration = [], stack.configuration
    for _ in range(400):
        solution = stack.solve(dt)
        assert solution.fallback <= Fallback.LEVEL
        velocities.append(solution.v)
        configuration.update(configuration.integrate(solution.dq))
    changes = np.abs(np.diff(velocities, axis=0)).max(axis=1)
    assert np.percentile(changes[-50:], 99) <= CHATTER
    for name, report in stack.explain().items():
        if not report.reached and name in robot[2]:
            assert report.reasons
    for equality in stack.equalities:
        assert np.abs(equality.error(configuration)).max() < 1e-3
