"""A task and a limit of your own in the whole-body controller, named in its file.

The task has a kernel, so that it runs in the compiled control loop as ours do.
"""

import tomllib
from typing import Any

import numpy as np

import wbc_suite
from wbc_suite.kinematics import Configuration
from wbc_suite.qp import (
    BoxLimit,
    JointBounds,
    RowTask,
    record_type,
    register_limit,
    register_task,
)

LEVEL = record_type(("joint", "i8"), ("axis", "f8", (3,)))
"""Numbers of a task: the joint that carries the frame, and the axis in it."""


def level_rows(
    robot: Any, own: np.ndarray, dt: float, rows: np.ndarray, values: np.ndarray
) -> None:
    """Write `e = a x z` and J, with a in world axes: `d(e) = -J dq`."""
    level, a = own.view(LEVEL)[0], np.empty(3)
    T, axis, j = robot.pose[level.joint], level.axis, level.joint
    for i in range(3):  # poses have the rotation column by column
        a[i] = T[i] * axis[0] + T[3 + i] * axis[1] + T[6 + i] * axis[2]
    values[0], values[1], values[2] = a[1], -a[0], 0.0
    while j > 0:  # to the root of the robot
        joint = robot.joints[j]
        for col in range(joint.v_start, joint.v_start + joint.v_count):
            w = robot.jacobian[col, 3:]
            for i in range(3):
                rows[i, col] = a[2] * w[i] - a[i] * w[2]
        j = joint.parent


class LevelTask(RowTask):
    """Keep an axis of a frame upright, so that a cup is not spilled: e = a x z, rad."""

    kernel = level_rows

    def __init__(self, frame: str, *, axis: list[float], cost: float = 1.0) -> None:
        super().__init__(f"{frame} level", dim=3, cost=cost, gain=0.2, max_speed=2.0)
        self.frame, self.axis = frame, np.asarray(axis)

    def own(self, configuration: Configuration) -> np.ndarray:
        """Return what the kernel reads."""
        frame = configuration.model.frames[configuration.frame_id(self.frame)]
        level = np.zeros(1, LEVEL)
        level[0] = frame.parentJoint, frame.placement.rotation @ self.axis
        return level.view(np.float64)


class Slow(BoxLimit):
    """Keep every joint below a speed, rad/s."""

    def __init__(self, speed: float) -> None:
        self.speed = speed

    def apply(self, configuration: Configuration, bounds: JointBounds) -> None:
        """Tighten the bounds of velocities."""
        np.minimum(bounds.v_max, self.speed, out=bounds.v_max)


register_task("Level", LevelTask)
register_limit("Slow", Slow)

CONTROLLER = """
planning = false # plans do not know tasks of your own

[[frame]]
name = "right_hand"
frame = "right_tcp"
kind = "position"

[[task]]
type = "Level"
frame = "right_tcp"
axis = [0, 0, -1] # the hand points down

[[limit]]
type = "Slow"
speed = 0.5 # rad/s
"""
"""What a file of your own with `extends = "WHOLE_BODY_IK"` would say."""


def main() -> None:
    """Carry a level hand slowly to another place."""
    config = wbc_suite.load_composite_controller_config("WHOLE_BODY_IK", robot="Panda")
    config |= tomllib.loads(CONTROLLER)
    env = wbc_suite.make("Lift", robots="Panda", controller_configs=config)
    env.reset(seed=0)
    data = env.simulation.data
    site = data.site("robot0_right_tcp")
    there = site.xpos + np.array([0.1, 0.25, 0.1])
    goal = env.action_layout.pack({"right_hand": there}, base=env.hold_action)
    tilts, speeds = [], []
    for _ in range(60):
        env.step(goal)
        tilts.append(np.arccos(np.clip(-site.xmat[8], -1.0, 1.0)))
        speeds.append(np.abs(data.qvel[:7]).max())  # of the arm
    print(f"the hand tilted by {np.degrees(max(tilts)):.2f} degrees at most")
    print(f"joints turned at {max(speeds):.2f} rad/s at most")
    print(env.step(goal)[4]["ik"]["frames"]["right_hand"])
    env.close()


if __name__ == "__main__":
    main()
