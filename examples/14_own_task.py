"""A task and a limit of your own in the whole-body controller, named in its file."""

import tomllib

import numpy as np

import wbc_suite
from wbc_suite.kinematics import Configuration
from wbc_suite.qp import (
    BoxLimit,
    JointBounds,
    RowTask,
    register_limit,
    register_task,
)


class LevelTask(RowTask):
    """Keep an axis of a frame upright, so that a cup is not spilled: e = a x z, rad."""

    def __init__(self, frame: str, *, axis: list[float], cost: float = 1.0) -> None:
        super().__init__(f"{frame} level", dim=3, cost=cost, gain=0.2, max_speed=2.0)
        self.frame, self.axis = frame, np.asarray(axis)

    def bind(self, configuration: Configuration) -> None:
        """Resolve the frame."""
        self.index = configuration.frame_id(self.frame)

    def evaluate(
        self, configuration: Configuration, error: np.ndarray, jacobian: np.ndarray
    ) -> None:
        """Write `e = a x z` and J, with a in world axes: `d(e) = -J dq`."""
        a = configuration.frame_pose(self.index).rotation @ self.axis
        up = np.array([0.0, 0.0, 1.0])
        J_w = configuration.frame_jacobian(self.index, "aligned")[3:]
        error[:] = np.cross(a, up)
        jacobian[:] = np.dot(up, a) * J_w - np.outer(a, up @ J_w)


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
