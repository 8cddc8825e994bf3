import mujoco
import numpy as np
import pytest
from conftest import penetration
from feet import count, hold, lie_at, make, stand_at

import wbc_suite
from wbc_suite.errors import ConfigError

HOLD, TOP = 20, 0.8


@pytest.fixture(scope="module")
def env():
    return make("LocoLift", "SpotWithArm", reward_shaping=True)


def before_the_table(env):
    env.reset(seed=0)
    stand_at(env, -0.95, 0.0)
    return env.benchmark


def grip(env, monkeypatch, held=True):
    hand = env.benchmark.hands[0]
    monkeypatch.setattr(hand, "grasps", lambda geoms: held)
    monkeypatch.setattr(hand, "clamps", lambda geoms, angle: held)
    monkeypatch.setattr(hand, "bears", lambda geoms, load: held)
    monkeypatch.setattr(hand, "slip", lambda body: 0.0)
    monkeypatch.setattr(hand, "spin", lambda body: 0.0)


def put_cube(env, z, velocity=(0.0, 0.0, 0.0)):
    env.benchmark.states["cube"].move((-0.25, 0.0, z))
    env.simulation.data.joint("cube_joint").qvel[:3] = velocity
    mujoco.mj_forward(env.simulation.model, env.simulation.data)


def test_a_cube_that_is_held_up_for_a_second_is_a_success(env, monkeypatch):
    task = before_the_table(env)
    grip(env, monkeypatch)
    put_cube(env, TOP + 0.0401)
    task.standing.observe(False)
    assert not count(env, HOLD - 1).success()
    assert count(env, 1).success()
    assert task.reward(shaped=True) == task.reward(shaped=False) == 1.0


@pytest.mark.parametrize(
    ("z", "velocity", "held"),
    [
        (TOP + 0.0399, (0.0, 0.0, 0.0), True),
        (TOP + 0.2, (0.0, 0.0, 0.0), False),  # in the air, or on a back
        (TOP + 0.2, (0.0, 0.0, 0.2), True),  # thrown
        (TOP + 0.2, (0.2, 0.0, 0.0), True),
        (0.021, (0.0, 0.0, 0.0), True),  # from the floor
    ],
)
def test_near_misses_are_no_success(env, monkeypatch, z, velocity, held):
    task = before_the_table(env)
    grip(env, monkeypatch, held)
    put_cube(env, z, velocity)
    task = count(env, 2 * HOLD)
    assert not task.success()
    assert task.reward(shaped=False) == 0.0
    assert 0.0 < task.reward(shaped=True) < 1.0


@pytest.mark.parametrize(("bears", "slip"), [(False, 0.0), (True, 0.3)])
def test_a_cube_that_two_links_touch_is_held_only_if_clamped(
    env, monkeypatch, bears, slip
):
    before_the_table(env)
    grip(env, monkeypatch)
    hand = env.benchmark.hands[0]
    monkeypatch.setattr(hand, "bears", lambda geoms, load: bears)
    monkeypatch.setattr(hand, "slip", lambda body: slip)
    put_cube(env, TOP + 0.1)
    assert not count(env, 2 * HOLD).success()


def test_a_cube_that_is_let_go_and_caught_counts_anew(env, monkeypatch):
    task = before_the_table(env)
    put_cube(env, TOP + 0.1)
    grip(env, monkeypatch)
    count(env, HOLD - 1)
    grip(env, monkeypatch, held=False)
    count(env, 1)
    grip(env, monkeypatch)
    assert not count(env, HOLD - 1).success()
    assert count(env, 1).success()
    assert task.failure() is None


def test_a_cube_that_is_thrown_up_is_no_success_at_any_time(env):
    before_the_table(env)
    put_cube(env, TOP + 0.05, (0.0, 0.0, 2.0))
    highest = 0.0
    for _ in range(30):
        *_, info = env.step(env.hold_action)
        highest = max(highest, env.benchmark.height)
        assert not info["success"]
    assert highest > 0.1


def test_a_fallen_robot_with_the_cube_is_no_success(env, monkeypatch):
    task = before_the_table(env)
    grip(env, monkeypatch)
    lie_at(env, -1.5, 0.0)
    put_cube(env, TOP + 0.1)
    *_, terminated, _, info = env.step(env.hold_action)
    put_cube(env, TOP + 0.1)
    assert terminated
    assert "SpotWithArm fell" in info["failure"]
    stand_at(env, -0.95, 0.0)
    put_cube(env, TOP + 0.1)
    assert not count(env, 2 * HOLD).success()
    assert task.failure() is not None


def test_a_trotting_robot_with_the_cube_is_no_success(env, monkeypatch):
    before_the_table(env)
    grip(env, monkeypatch)
    for _ in range(2 * HOLD):
        put_cube(env, TOP + 0.1)
        *_, info = hold(env, 1, walk=[0.0, 0.0, 0.002])
        assert not info["success"]


def test_robots_start_as_far_off_as_said_and_clear_of_all(env):
    places = []
    for seed in range(40):
        observation, info = env.reset(seed=seed)
        places.append(
            [*observation["robot0_base_pos"][:2], env.benchmark.standing.heading]
        )
        assert not info["success"]
        assert penetration(env) < 5e-4
    x, y, yaw = np.array(places).T
    assert (x >= -0.4 - 2.5).all()
    assert (x <= -0.4 - 1.5).all()
    assert np.ptp(x) > 0.7
    assert np.ptp(y) > 0.7
    assert np.abs(yaw).max() <= 0.5 + 1e-6


def test_the_reward_rises_from_approach_to_grasp_to_lift(env, monkeypatch):
    env.reset(seed=0)
    far = env.benchmark.reward(shaped=True)
    before_the_table(env)
    put_cube(env, TOP + 0.021)
    near = env.benchmark.reward(shaped=True)
    grip(env, monkeypatch)
    held = env.benchmark.reward(shaped=True)
    put_cube(env, TOP + 0.039)
    lifted = env.benchmark.reward(shaped=True)
    assert far < near < held < lifted < 1.0


def test_a_robot_without_hands_is_refused():
    with pytest.raises(ConfigError, match=r"LocoLift needs 1 hand\(s\); Spot has 0"):
        wbc_suite.make("LocoLift", robots="Spot")
