"""`[[task]]` and `[[limit]]` of whole-body controllers: ours and users', by name."""

import numpy as np
import pytest

import wbc_suite
from wbc_suite.errors import ConfigError, WbcError
from wbc_suite.qp import LIMITS, TASKS, BoxLimit, RowTask
from wbc_suite.qp import register_limit as add_limit
from wbc_suite.qp import register_task as add_task


class HeightTask(RowTask):
    """Bring a frame to a height, m."""

    def __init__(self, frame, height):
        super().__init__(f"height of {frame}", dim=1, max_speed=0.5)
        self.frame, self.height = frame, height

    def bind(self, configuration):
        self.index = configuration.frame_id(self.frame)

    def evaluate(self, configuration, error, jacobian):
        error[0] = self.height - configuration.frame_pose(self.index).translation[2]
        jacobian[0] = configuration.frame_jacobian(self.index, "aligned")[2]


class Slow(BoxLimit):
    def __init__(self, speed):
        self.speed = speed

    def apply(self, configuration, bounds):
        np.minimum(bounds.v_max, self.speed, out=bounds.v_max)


def config(**changes):
    base = wbc_suite.load_composite_controller_config("WHOLE_BODY_IK", robot="Panda")
    return base | {"planning": False} | changes


def moved(given, actions=40):
    """Return positions of the hand, m, and the arm's speeds, rad/s."""
    env = wbc_suite.make("Lift", robots="Panda", controller_configs=given).unwrapped
    env.reset(seed=0)
    data, goal = env.simulation.data, env.hold_action
    places, speeds = [], []
    for _ in range(actions):
        env.step(goal)
        places.append(data.site("robot0_right_tcp").xpos.copy())
        speeds.append(np.abs(data.qvel[:7]).max())
    env.close()
    return np.array(places), np.array(speeds)


@pytest.mark.slow
def test_a_task_and_a_limit_of_the_users_act(forget):
    add_task("Height", HeightTask)
    add_limit("Slow", Slow)
    forget(TASKS, "Height")
    forget(LIMITS, "Slow")
    height = 1.05
    frame = {"name": "right_hand", "frame": "right_tcp", "kind": "orientation"}
    task = {"type": "height", "frame": "right_tcp", "height": height}
    limit = {"type": "slow", "speed": 0.4}
    given = config(frame=[frame], task=[task], limit=[limit])
    places, speeds = moved(given)
    assert abs(places[0, 2] - height) > 0.02
    assert abs(places[-1, 2] - height) < 2e-3
    assert speeds.max() < 0.4 * 1.05


@pytest.mark.slow
def test_a_task_of_ours_runs_in_the_loop():
    env = wbc_suite.make(
        "Lift",
        robots="Panda",
        controller_configs=config(task=[{"type": "DampingTask", "cost": 1e-3}]),
    ).unwrapped
    env.reset(seed=0)
    env.step(env.hold_action)
    assert env.simulation.loop_calls == 1
    env.close()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"task": [{"type": "Nothing"}]}, "No task named 'Nothing'"),
        ({"task": [{"cost": 1.0}]}, "No task named"),
        ({"task": [{"type": "os:system", "command": "true"}]}, "No task named"),
        ({"limit": [{"type": "FloorLimits"}]}, "FloorLimit"),
        ({"task": [{"type": "DampingTask"}]}, "missing a required argument: 'cost'"),
        ({"task": [{"type": "DampingTask", "cost": -1.0}]}, "cost"),
        ({"task": [{"type": "DampingTask", "cost": 1.0, "n": 1}]}, "'n'"),
        ({"task": [{"type": "LookAtTask", "frame": "nowhere"}]}, "nowhere"),
        ({"limit": {"type": "FloorLimit"}}, "limit"),
        ({"task": [{"type": "FrameTask", "frame": 5}]}, "5"),
        ({"task": [{"type": "FrameTask", "frame": ["a"]}]}, "a"),
        (
            {"task": [{"type": "FrameTask", "frame": "right_tcp", "target": "x"}]},
            "right_tcp",
        ),
        ({"task": [{"type": "PostureTask", "cost": 1.0, "costs": 3}]}, "PostureTask"),
        ({"task": [{"type": "ComTask", "target": [[0.0]]}]}, "target"),
        ({"limit": [{"type": "VelocityLimit", "scale": "1"}]}, "scale"),
        (
            {"limit": [{"type": "AccelerationLimit", "acceleration": {}}]},
            "AccelerationLimit",
        ),
    ],
)
def test_what_is_wrong_is_told(changes, words):
    with pytest.raises(WbcError, match=words):
        moved(config(**changes))


def test_minks_backend_takes_none():
    given = config(task=[{"type": "DampingTask", "cost": 1.0}])
    with pytest.raises(ConfigError, match="WHOLE_BODY_MINK_IK takes no"):
        moved(given | {"type": "WHOLE_BODY_MINK_IK"})
