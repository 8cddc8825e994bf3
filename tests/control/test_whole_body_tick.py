"""Ticks that the loop runs do what ticks that Python runs do, bit by bit."""

import numpy as np
import pytest

from wbc_suite import make
from wbc_suite.control.ik.whole_body_ik import WholeBodyIK


def made(robot, monkeypatch, *, in_loop):
    with monkeypatch.context() as patch:
        if not in_loop:
            patch.setattr(WholeBodyIK, "loop_ticks", lambda _: ())
        env = make("Lift", robots=robot, controller_configs="WHOLE_BODY_IK").unwrapped
    env.reset(seed=0)
    return env


def states(env, *, far=0.15, actions=24, weaken=1.0):
    """Return states and numbers of calls of the loop, over some actions."""
    controller, rng = env.controllers[0], np.random.default_rng(0)
    limiter = controller._backend.torque_limiter
    limiter._arrays.max_torque[:] *= weaken
    hold = action = env.hold_action
    found, calls = [], []
    for k in range(actions):
        if k % 8 == 0:
            action = hold + far * rng.uniform(-1.0, 1.0, len(hold))
            low, high = env.action_space.low, env.action_space.high
            action = np.clip(action, low, high).astype(env.action_space.dtype)
        env.step(action)
        calls.append(env.simulation.loop_calls)
        found.append(env.simulation.data.qpos.copy())
    return np.array(found), calls


@pytest.mark.parametrize("robot", ["Tiago", "SpotWithArm", "GR1FreeBody"])
def test_loop_and_python_move_alike(robot, monkeypatch):
    by_loop, calls = states(made(robot, monkeypatch, in_loop=True))
    by_python, _ = states(made(robot, monkeypatch, in_loop=False))
    np.testing.assert_array_equal(by_loop, by_python)
    assert max(calls) > 1, "the planner has led a motion"


def test_saturated_motors_move_alike(monkeypatch):
    by_loop, _ = states(made("Panda", monkeypatch, in_loop=True), weaken=0.4)
    by_python, _ = states(made("Panda", monkeypatch, in_loop=False), weaken=0.4)
    np.testing.assert_array_equal(by_loop, by_python)


def test_an_action_near_the_goal_is_one_call(monkeypatch):
    env = made("Panda", monkeypatch, in_loop=True)
    _, calls = states(env, far=0.01, actions=4)
    assert calls == [1] * 4


def test_a_reset_forgets_the_progress_of_plans(monkeypatch):
    env = made("Panda", monkeypatch, in_loop=True)
    _, calls = states(env)
    assert max(calls) > 1, "the planner has led a motion"
    env.reset(seed=0)
    *progress, _, _, _ = env.controllers[0]._planner.memory
    assert not any(np.any(part) for part in progress)
