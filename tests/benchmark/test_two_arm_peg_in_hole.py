import numpy as np
import pytest
from posing import act_at_random, reach

import wbc_suite
from wbc_suite.errors import ConfigError

CENTER = np.array([0.0, 0.0, 1.1])
HALF = np.sqrt(0.5)
PEG_HAND = np.array([[0, 1, 0], [HALF, 0, HALF], [HALF, 0, -HALF]])
"""R of arm 0's hand, which looks down and ahead, along +y."""
PLATE_HAND = np.array([[-1, 0, 0], [0, HALF, -HALF], [0, -HALF, -HALF]])
"""R of arm 1's hand, which looks down and ahead, along -y; its y axis is the peg's."""


def turned(angle):
    """Return a rotation about the world's x axis."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0, 0], [0, c, -s], [0, s, c]])


@pytest.fixture(scope="module")
def env():
    """Arm 1 holds the plate, its hole at CENTER."""
    env = wbc_suite.make("TwoArmPegInHole", initialization_noise=None)
    env.reset(seed=0)
    reach(env, 1, CENTER - 0.15 * PLATE_HAND[:, 2], PLATE_HAND)
    return env


def point(env, depth=0.0, aside=0.0, angle=0.0):
    """Let arm 0 point the peg at the hole, its middle `depth` before it."""
    rotation = turned(angle) @ PEG_HAND
    axis = rotation[:, 2]
    middle = CENTER - depth * axis + aside * rotation[:, 1]
    reach(env, 0, middle - 0.13 * axis, rotation)
    return env.benchmark


def test_a_peg_through_the_hole_is_a_success(env):
    peg = point(env)
    np.testing.assert_allclose(peg.alignment(), (0.0, 0.0, 1.0), atol=1e-5)
    assert peg.success()
    assert peg.reward(shaped=False) == peg.reward(shaped=True) == 1.0


@pytest.mark.parametrize(
    "state", [{"depth": 0.119}, {"depth": -0.119}, {"aside": 0.0449}]
)
def test_anywhere_along_the_peg_is_a_success(env, state):
    assert point(env, **state).success()


@pytest.mark.parametrize(
    "state",
    [
        {"depth": 0.121},
        {"depth": 0.139, "aside": 0.05},  # the tip on the plate, beside the hole
        {"depth": -0.121},
        {"aside": 0.0451},
        {"angle": np.arccos(0.95) + 1e-3},
        {"angle": -np.arccos(0.95) - 1e-3},
    ],
)
def test_near_misses_are_no_success(env, state):
    peg = point(env, **state)
    assert not peg.success()
    assert peg.reward(shaped=False) == 0.0
    assert 0.0 <= peg.reward(shaped=True) < 1.0


def test_one_arm_alone_at_its_place_is_no_success():
    env = wbc_suite.make("TwoArmPegInHole", initialization_noise=None)
    env.reset(seed=0)
    peg = point(env)
    assert not peg.success()
    env.reset(seed=0)
    reach(env, 1, CENTER - 0.15 * PLATE_HAND[:, 2], PLATE_HAND)
    assert not peg.success()


def test_the_shaped_reward_is_as_it_is_written(env):
    peg = point(env, depth=0.2, aside=0.1, angle=0.3)
    t, d, cosine = peg.alignment()
    assert (t, d, cosine) == pytest.approx((0.2, 0.1, np.cos(0.3)), abs=1e-5)
    near = 3 - np.tanh(np.hypot(0.2, 0.1)) - np.tanh(0.1) - np.tanh(0.2)
    assert peg.reward(shaped=True) == pytest.approx((near + np.cos(0.3)) / 5, abs=1e-5)


def test_the_pegs_radius_follows_the_seed():
    env = wbc_suite.make("TwoArmPegInHole")
    model = env.simulation.model
    seen = {}
    for seed in (0, 1, 0, 2):
        observation, _ = env.reset(seed=seed)
        radius, half = model.geom("peg").size[:2]
        assert 0.015 <= radius <= 0.03
        assert half == 0.13
        assert model.geom("peg").rbound == pytest.approx(np.hypot(radius, half))
        assert model.body("peg").mass == pytest.approx(0.3)
        assert seen.setdefault(seed, radius) == radius
    assert len(set(seen.values())) == 3
    assert observation["object-state"].shape == (17,)


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    "robots", ["Baxter", pytest.param("GR1", marks=pytest.mark.slow)]
)
def test_random_actions_leave_everything_in_bounds(robots):
    env = wbc_suite.make("TwoArmPegInHole", robots=robots, reward_shaping=True)
    env.reset(seed=1)
    act_at_random(env, 500)


@pytest.mark.slow
def test_nothing_touches_at_reset():
    for robots in (["Panda", "Panda"], ["UR5e", "Sawyer"], "Baxter", "Tiago"):
        env = wbc_suite.make("TwoArmPegInHole", robots=robots)
        things = env.benchmark.states.values()
        own = {geom for thing in things for geom in thing.geoms}
        for seed in range(10):
            env.reset(seed=seed)
            pairs = env.simulation.data.contact.geom.tolist()
            assert not [pair for pair in pairs if own & set(pair)], robots


def test_robots_with_grippers_are_refused():
    with pytest.raises(ConfigError, match="leave gripper_types"):
        wbc_suite.make("TwoArmPegInHole", gripper_types="PandaGripper")
