"""Random stacks under targets that stay: robots come to rest and say what stops them.

Robots start anywhere inside, at or up to 0.1 rad outside their limits, often with links
inside each other; targets are finite, mostly out of reach or in conflict, some asked
for by tasks of lower levels.
"""

import numpy as np
import pinocchio as pin
import pytest
from test_stacks import ROBOTS, Draw

from wbc_suite.kinematics import Configuration
from wbc_suite.qp import (
    ComTask,
    DampingTask,
    Fallback,
    FrameEquality,
    FrameTask,
    JointCouplingTask,
    LookAtTask,
    PositionLimit,
    PostureTask,
    RelativeFrameTask,
    SelfCollisionLimit,
    TaskStack,
)

APART = [SelfCollisionLimit.of_robot(robot) for robot in ROBOTS]
CHATTER = 0.01  # rad/s, p99 over the last second


class Finite(Draw):
    """Draws parts that an application might have."""

    def cost(self):
        return float(self.rng.choice([0.1, 1.0, 1.0, 10.0]))

    def pose(self):
        T, rng = np.eye(4), self.rng
        T[:3, :3] = pin.exp3(rng.normal(size=3) * rng.choice([0.1, 1.0]))
        T[:3, 3] = rng.choice([0.3, 1.0, 3.0]) * rng.normal(size=3)
        return T

    def task(self, k):
        rng = self.rng
        options = {"level": int(rng.choice([0, 0, 1, 2])), "name": f"task{k}"}
        one, other = rng.choice(self.frames, 2, replace=False)
        kind = rng.integers(7)
        if kind == 4:
            return DampingTask(0.1 * self.cost(), **options)
        options["gain"] = float(rng.choice([0.1, 0.5, 1.0]))
        costs = {"position_cost": self.cost(), "orientation_cost": self.cost()}
        pose = self.pose()
        match kind:
            case 0:
                return FrameTask(one, target=pose, **costs, **options)
            case 1:
                return RelativeFrameTask(one, other, target=pose, **costs, **options)
            case 2:
                return ComTask(self.cost(), target=pose[:3, 3], **options)
            case 3:
                return PostureTask(
                    0.1 * self.cost(), target=self.q("inside"), **options
                )
            case 5:
                pair = rng.choice(self.robot.joint_names, 2, replace=False)
                ratio = float(rng.normal())
                return JointCouplingTask(
                    *pair, ratio=ratio, cost=self.cost(), **options
                )
        axis = rng.normal(size=3)
        return LookAtTask(
            one, axis=axis, target=pose[:3, 3], cost=self.cost(), **options
        )

    def limits(self):
        gain = self.rng.choice([0.5, 1.0])
        apart = [APART[ROBOTS.index(self.robot)]] if self.rng.random() < 0.5 else []
        return {"limits": [PositionLimit(gain=gain), *apart]}

    def feet(self):
        feet = [f.name for f in self.robot.frames if f.role == "foot"]
        return [FrameEquality(f) for f in feet] if self.rng.random() < 0.6 else []


def random_stack(seed):
    draw = Finite(seed)
    kind = draw.rng.choice(["inside", "edge", "outside"])
    robot = Configuration(draw.model, draw.q(kind))
    tasks = [draw.task(k) for k in range(draw.rng.integers(1, 6))]
    return TaskStack(robot, tasks, **draw.limits(), equalities=draw.feet())


def run(stack, seconds, dt):
    """Return the last solution, the velocities, shape (ticks, nv), and fallbacks."""
    robot, velocities, fallbacks = stack.configuration, [], []
    for _ in range(round(seconds / dt)):
        solution = stack.solve(dt)
        robot.update(robot.integrate(solution.dq))
        velocities.append(solution.v)
        fallbacks.append(solution.fallback)
    return solution, np.array(velocities), fallbacks


def flutter(velocities, dt):
    """Return the p99, over the last second, of changes of velocity that are reversed.

    A robot still on its way speeds up and slows down steadily; what flutters goes back
    at the next tick.
    """
    changes = np.diff(velocities[-round(1.0 / dt) :], axis=0)
    one, next_one = changes[:-1], changes[1:]
    back = np.minimum(np.abs(one), np.abs(next_one)) * (one * next_one < 0.0)
    return float(np.percentile(back.max(axis=1), 99))


def check(seed, dt=0.02, seconds=12.0):
    """Return the flutter of a stack, having checked what else it promises."""
    stack = random_stack(seed)
    solution, velocities, fallbacks = run(stack, seconds, dt)
    assert max(fallbacks) < Fallback.BOX
    if np.abs(solution.v).max() < 1e-3:
        for report in stack.explain().values():
            assert report.reached or report.reasons
    return flutter(velocities, dt)


@pytest.mark.parametrize("seed", range(12))
def test_random_stacks_come_to_rest_and_say_why(seed):
    assert check(seed) <= CHATTER


@pytest.mark.sample(1)
@pytest.mark.slow
@pytest.mark.parametrize("first", range(12, 132, 40))
def test_many_random_stacks_come_to_rest_and_say_why(first):
    """One in forty may still be on its way along a contact, and flutter there."""
    found = {seed: check(seed) for seed in range(first, first + 40)}
    restless = {seed: value for seed, value in found.items() if value > CHATTER}
    assert len(restless) <= 1, restless


@pytest.mark.sample(5)
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(200, 220))
def test_random_stacks_come_to_rest_at_200_hz(seed):
    assert check(seed, dt=5e-3) <= CHATTER
