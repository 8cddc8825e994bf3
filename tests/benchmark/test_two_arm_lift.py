import mujoco
import numpy as np
import pytest
from conftest import penetration, put
from posing import DOWN, act_at_random, fingers, reach

import wbc_suite
from wbc_suite.errors import ConfigError

TOP, HALF = 0.8, 0.07
RAISED = TOP + HALF + 0.105
HANDLE = np.array([0.0, 0.15, 0.05])
HALF_TURN = (0.0, 0.0, 0.0, 1.0)  # handle0 towards -y
CLOSED, OPEN = 0.0095, 0.03


@pytest.fixture(scope="module")
def env():
    return wbc_suite.make("TwoArmLift", robots=["Panda", "Panda"])


@pytest.fixture(scope="module")
def both_hold():
    """Both hands on the cross bars of a pot that is 10.5 cm up, fingers open."""
    env = wbc_suite.make("TwoArmLift", initialization_noise=None)
    env.reset(seed=0)
    for arm, side in ((0, -1.0), (1, 1.0)):
        reach(env, arm, (0.0, side * HANDLE[1], RAISED + HANDLE[2]), DOWN)
    return env


def raise_pot(env, height=0.105, roll=0.0, left=CLOSED, right=CLOSED):
    """Put the pot between the hands, rolled about the line through its handles."""
    fingers(env, 0, right)
    fingers(env, 1, left)
    half, z = roll / 2, RAISED - 0.105 + height + HANDLE[2]
    quat = (0.0, np.sin(half), 0.0, np.cos(half))  # a half turn about z, after the roll
    arm = HANDLE[2] * np.array([np.sin(roll), 0.0, np.cos(roll)])
    return put(env, pot=(np.array([0.0, 0.0, z]) - arm, quat))


def test_a_level_pot_held_high_by_both_is_a_success(both_hold):
    lift = raise_pot(both_hold)
    assert lift.height == pytest.approx(0.105, abs=1e-6)
    assert lift.success()
    assert lift.reward(shaped=False) == lift.reward(shaped=True) == 1.0


@pytest.mark.parametrize(
    "state",
    [
        {"left": OPEN},  # arm 0 alone
        {"right": OPEN},  # arm 1 alone
        {"left": OPEN, "right": OPEN},  # in the air
        {"height": 0.0995},
        {"height": 0.11, "roll": np.radians(31.0)},
        {"height": 0.11, "roll": np.radians(-31.0)},
    ],
)
def test_near_misses_are_no_success(both_hold, state):
    lift = raise_pot(both_hold, **state)
    assert not lift.success()
    assert lift.reward(shaped=False) == 0.0
    assert 0.0 <= lift.reward(shaped=True) < 1.0


def test_only_the_tilt_is_wrong_in_the_tilted_miss(both_hold):
    lift = raise_pot(both_hold, height=0.11, roll=np.radians(31.0))
    assert not lift.level
    assert lift.height > 0.1
    assert all(hand.grasps(lift.states["pot"].geoms) for hand in lift.hands)
    assert raise_pot(both_hold, height=0.11, roll=np.radians(29.0)).success()


def test_a_pot_that_slips_through_the_hands_is_not_held(both_hold):
    lift = raise_pot(both_hold)
    model, data = both_hold.simulation.model, both_hold.simulation.data
    address = model.body_dofadr[model.body("pot").id]
    for speed, success in ((0.15, True), (0.25, False), (0.0, True)):
        data.qvel[address + 2] = speed
        mujoco.mj_forward(model, data)
        assert lift.success() == success


def test_the_reward_rises_from_reach_to_grasp_to_lift(both_hold):
    low = raise_pot(both_hold, left=OPEN, right=OPEN).reward(shaped=True)
    one = raise_pot(both_hold, left=OPEN).reward(shaped=True)
    assert one == pytest.approx(low + 0.25 / 3.0)
    # Hands 1 cm from their handles, the pot 4.5 cm beyond the 5 cm that count.
    wanted = 10 * 0.045 + 2 * (0.25 + 0.5 * (1 - np.tanh(10 * 0.01)))
    held = raise_pot(both_hold, height=0.095).reward(shaped=True)
    assert held == pytest.approx(wanted / 3.0, abs=2e-3)


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "robots",
    ["Baxter", pytest.param("GR1", marks=pytest.mark.slow)],
)
def test_random_actions_leave_everything_in_bounds(robots):
    env = wbc_suite.make("TwoArmLift", robots=robots, reward_shaping=True)
    env.reset(seed=1)
    act_at_random(env, 500)


def test_keys_and_sizes_are_those_of_datasets(env):
    seen, _ = env.reset(seed=0)
    assert seen["object-state"].shape == (19,)
    way = seen["handle0_xpos"] - seen["robot0_eef_pos"]
    assert seen["gripper0_to_handle0"].shape == way.shape
    hand = env.benchmark.hands[1].position
    np.testing.assert_allclose(
        seen["gripper1_to_handle1"], seen["handle1_xpos"] - hand, atol=1e-12
    )


def test_handle_0_starts_towards_arm_0_and_the_pot_stays_where_it_is(env):
    for seed in range(20):
        seen, _ = env.reset(seed=seed)
        assert seen["handle0_xpos"][1] < seen["handle1_xpos"][1]
        assert np.abs(seen["pot_pos"][:2]).max() <= 0.03
        assert penetration(env) < 5e-4


@pytest.mark.slow
def test_robots_stand_as_they_are_told():
    def bases(**arguments):
        env = wbc_suite.make("TwoArmLift", **arguments)
        return [robot.root.pos[:2] for robot in env.robots]

    np.testing.assert_allclose(bases(), [(0, -0.56), (0, 0.56)], atol=1e-12)
    beside = bases(env_configuration="parallel")
    np.testing.assert_allclose(beside, [(-0.56, -0.25), (-0.56, 0.25)])
    assert bases(robots="Baxter") == [(-0.66, 0.0)]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"robots": "Panda"}, "needs two arms"),
        ({"robots": ["Panda"] * 3}, "needs two arms"),
        ({"robots": ["Baxter", "Panda"]}, "needs two arms"),
        ({"robots": "Baxter", "env_configuration": "opposed"}, "is not for 1"),
        ({"env_configuration": "single-robot"}, "is not for 2"),
    ],
)
def test_wrong_arms_and_places_are_refused(arguments, told):
    with pytest.raises(ConfigError, match=told):
        wbc_suite.make("TwoArmLift", **arguments)
