import math

import mujoco
import numpy as np
import pytest
from conftest import hand_touches, put

import wbc_suite

TOP = 0.8
UPRIGHT = (1.0, 0.0, 0.0, 0.0)
INSERTED = ((0.05, 0.0, TOP + 0.02 + 0.095 - 1e-4), None)
HANGING = np.column_stack([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])


def quat_of(R):
    quat = np.empty(4)
    mujoco.mju_mat2Quat(quat, np.asarray(R).ravel())
    return tuple(quat)


@pytest.fixture(scope="module")
def env():
    return wbc_suite.make("ToolHang", robots="Panda")


def hang(env, *, aside=0.0, frame=INSERTED):
    """Put the frame somewhere, and the wrench's eye around its arm or beside it."""
    task = put(env, frame=frame)
    eye = task.site("frame_hook") - [0.0, aside, 0.0072]
    at = tuple(eye - HANGING @ [0.07, 0.0, 0.0])
    return put(env, tool=(at, quat_of(HANGING)))


def settle(env, steps=12):
    for _ in range(steps):
        *_, info = env.step(env.hold_action)
        assert "physics_error" not in info
    return env.benchmark


def test_a_wrench_on_an_inserted_frame_is_a_success(env):
    env.reset(seed=0)
    hang(env)
    task = settle(env)
    assert task.is_inserted()
    assert task.is_hanging()
    assert task.success()
    assert task.reward(shaped=False) == task.reward(shaped=True) == 1.0
    seen = env.observation()
    assert seen["frame_is_assembled"] == seen["tool_on_frame"] == 1.0


def test_the_frame_alone_is_half(env):
    env.reset(seed=0)
    put(env, frame=INSERTED)
    task = settle(env, 4)
    assert task.is_inserted()
    assert not task.success()
    assert 0.5 <= task.reward(shaped=True) < 0.6


def test_a_wrench_beside_the_hook_is_no_success(env):
    env.reset(seed=0)
    task = hang(env, aside=0.03)
    assert task.is_inserted()
    assert not task.success()
    assert not settle(env).success()  # it falls


def test_a_wrench_on_a_frame_that_leans_is_no_success(env):
    env.reset(seed=0)
    lean = (math.cos(0.1), 0.0, math.sin(0.1), 0.0)
    task = hang(env, frame=(INSERTED[0], lean))
    assert not task.is_inserted()
    assert not task.success()


def test_a_wrench_on_a_frame_beside_its_stand_is_no_success(env):
    env.reset(seed=0)
    x, y, z = INSERTED[0]
    task = hang(env, frame=((x, y + 0.15, z), None))
    assert not task.success()


def test_a_frame_half_in_is_no_success(env):
    env.reset(seed=0)
    x, y, z = INSERTED[0]
    task = hang(env, frame=((x, y, z + 0.06), None))
    assert not task.is_inserted()
    assert not task.success()


def test_a_wrench_that_a_hand_holds_is_no_success(env, monkeypatch):
    env.reset(seed=0)
    hang(env)
    task = settle(env)
    assert task.success()
    with monkeypatch.context() as held:
        hand_touches(held, task, "tool")
        assert not task.is_hanging()
    hand_touches(monkeypatch, task, "frame")
    assert task.is_hanging()
    assert not task.success()


def test_a_wrench_lying_through_which_nothing_goes_is_no_success(env):
    env.reset(seed=0)
    put(env, frame=INSERTED)
    hook = env.benchmark.site("frame_hook")
    task = put(env, tool=((hook[0], hook[1], hook[2] + 0.0149), UPRIGHT))
    assert task.scene.touching("tool", "frame")
    assert not task.is_hanging()


def test_things_are_observed_as_datasets_have_them(env):
    observation, _ = env.reset(seed=0)
    assert observation["object-state"].shape == (44,)
