"""Each expert solves its benchmark."""

import numpy as np
import pinocchio as pin
import pytest

import wbc_suite
from wbc_suite.benchmark import BENCHMARKS, load_benchmark
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.evaluation import make_policy
from wbc_suite.experts import EXPERTS, expert, register_expert
from wbc_suite.experts.stack import aligned

SINGLE = (
    *("Lift", "Stack", "Door", "Wipe"),
    *("PickPlaceMilk", "PickPlaceBread", "PickPlaceCereal", "PickPlaceCan"),
    *("NutAssemblySquare", "NutAssemblyRound"),
    *("TwoArmLift", "TwoArmPegInHole", "TwoArmHandover"),
)
LONG = ("TwoArmTransport", "ToolHang", "NutAssembly", "PickPlace")


def solve(env, seed):
    """Return the rewards of an episode up to its first success, and whether it is."""
    observation, _ = env.reset(seed=seed)
    policy, rewards = make_policy("expert", env, seed), []
    for _ in range(env.horizon):
        observation, reward, _, _, info = env.step(policy(observation))
        rewards.append(reward)
        if info["success"]:
            return rewards, True
    return rewards, False


@pytest.mark.slow
@pytest.mark.parametrize("name", [*SINGLE, *LONG])
def test_the_expert_solves_its_benchmark(name):
    horizon = 500 if name in SINGLE else 1000
    env = wbc_suite.make(name, horizon=horizon, reward_shaping=True)
    for seed in (1, 2, 3):
        rewards, success = solve(env, seed)
        assert success, f"seed {seed}"
        assert min(rewards) >= 0.0
        assert rewards[-1] == 1.0 > max(rewards[:-1])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "robots"),
    [
        ("Stand", ["Spot"]),
        ("Reach", ["SpotWithArm", "GR1FreeBody"]),
        ("WalkTo", ["Spot", "GR1FreeBody"]),
        ("LocoLift", ["SpotWithArm", "GR1FreeBody"]),
        ("Carry", ["GR1FreeBody"]),
    ],
)
def test_robots_on_their_feet_have_experts(name, robots):
    for robot in robots:
        env = wbc_suite.make(name, robots=robot, reward_shaping=True)
        rewards, success = solve(env, 1)
        assert success, robot
        assert rewards[-1] == 1.0 > max(rewards[:-1])


def test_each_benchmark_has_an_expert():
    for name in BENCHMARKS:
        benchmark = type(load_benchmark(name))
        assert {k.__name__ for k in benchmark.__mro__} & {*EXPERTS}, name


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["UR5e", "Sawyer", "Kinova3", "PandaOmron"])
def test_other_robots_take_the_same_expert(robot):
    for name in ("Lift", "Stack"):
        env = wbc_suite.make(name, robots=robot, horizon=500)
        assert solve(env, 1)[1], name


@pytest.mark.slow
def test_a_long_finger_does_not_sweep_the_other_cube_away():
    config = {"robots": "SpotWithArm", "controller_configs": "WHOLE_BODY_IK"}
    env = wbc_suite.make("Stack", horizon=500, **config)
    for seed in (7, 28):
        rewards, success = solve(env, seed)
        assert success
        assert len(rewards) < 150


@pytest.mark.slow
def test_a_long_jaw_stays_clear_of_the_door_behind_the_lever():
    config = {"robots": "SpotWithArm", "controller_configs": "WHOLE_BODY_IK"}
    env = wbc_suite.make("Door", horizon=150, **config)
    assert solve(env, 1)[1]


@pytest.mark.slow
@pytest.mark.parametrize("controller", [None, "WHOLE_BODY_IK"])
def test_a_base_drives_to_where_both_hands_reach(controller):
    config = {"robots": "Tiago", "controller_configs": controller}
    env = wbc_suite.make("TwoArmLift", horizon=120, **config)
    for seed in (1, 2, 3):
        assert solve(env, seed)[1], f"seed {seed}"


@pytest.mark.slow
def test_thumbs_come_slowly_into_handles():
    config = {"robots": "GR1", "controller_configs": "WHOLE_BODY_IK"}
    env = wbc_suite.make("TwoArmLift", horizon=500, **config)
    assert sum(solve(env, seed)[1] for seed in (100, 102, 103)) >= 2


def test_a_tipped_cube_stays_on_its_face():
    rng = np.random.default_rng(0)
    for _ in range(100):
        there = pin.SE3.Random()
        tilt = pin.exp3(rng.uniform(-0.3, 0.3, 3))
        tipped = pin.exp3(np.pi / 2 * np.eye(3)[rng.integers(3)])
        cube = pin.SE3(there.rotation @ tilt @ tipped, rng.normal(size=3))
        found = aligned(cube, there)
        np.testing.assert_allclose(found.rotation, there.rotation @ tipped, atol=1e-9)
        np.testing.assert_array_equal(found.translation, there.translation)


@pytest.mark.slow
def test_an_expert_is_the_same_each_time():
    env = wbc_suite.make("Stack", reward_shaping=True)
    assert solve(env, 7) == solve(env, 7)


@pytest.mark.slow
def test_letting_go_over_the_target_does_not_lower_the_reward():
    for name in ("PickPlaceCan", "NutAssemblySquare"):
        rewards, success = solve(wbc_suite.make(name, reward_shaping=True), 1)
        assert success
        reached = next(k for k, r in enumerate(rewards) if r > 0.6)
        assert min(rewards[reached:]) > 0.5, name


def test_a_benchmark_without_an_expert_is_named(monkeypatch):
    monkeypatch.delitem(EXPERTS._items, "reach")
    env = wbc_suite.make("Reach", robots="SpotWithArm")
    env.reset(seed=0)
    with pytest.raises(UnknownNameError, match="No expert named 'Reach'"):
        expert(env, np.random.default_rng(0))


def test_an_action_without_poses_of_hands_is_refused():
    parts = {"right": {"type": "JOINT_POSITION"}}
    config = {"type": "BASIC", "body_parts": parts}
    env = wbc_suite.make("Lift", controller_configs=config)
    env.reset(seed=0)
    with pytest.raises(ConfigError, match="needs a controller of hand poses"):
        expert(env, np.random.default_rng(0))


def test_an_expert_of_your_own_is_found_by_its_benchmark(forget):
    class MyLift(wbc_suite.benchmark.Lift):
        pass

    def wave(scene):
        scene.arms[0].open()
        yield

    forget(EXPERTS, "MyLift")
    register_expert(MyLift, wave)
    assert EXPERTS["mylift"] == (MyLift, wave)
    with pytest.raises(ConfigError, match="expert named 'MyLift' exists already"):
        register_expert(MyLift, wave)


def test_what_no_hand_reaches_is_told(caplog):
    env = wbc_suite.make("Lift", robots="GR1ArmsOnly")
    seen, _ = env.reset(seed=0)
    policy = make_policy("expert", env, 0)
    for _ in range(60):
        seen, *_ = env.step(policy(seen))
        if "No hand can reach 'cube'" in caplog.text:
            break
    env.close()
    assert "No hand can reach 'cube'" in caplog.text
