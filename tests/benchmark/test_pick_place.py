import mujoco
import numpy as np
import pytest
from sorted_goals import goals, put_at

import wbc_suite
from wbc_suite.benchmark import load_benchmark
from wbc_suite.benchmark.pick_place import GROCERIES
from wbc_suite.scene.placement import Region, UniformSampler


@pytest.fixture(scope="module")
def env():
    return wbc_suite.make("PickPlace", robots="Panda")


def test_each_thing_in_place_is_a_quarter(env):
    places = goals(env)
    for count in range(4):
        given = {name: places[name] for name in GROCERIES[:count]}
        reward = put_at(env, given).reward(shaped=True)
        assert count / 4 <= reward < count / 4 + 0.1 / 4 + 1e-9


def test_stages_rise(env):
    stages = env.benchmark.config.stages

    def reward(distance, grasped=False, missing=0.25, aside=0.5, over=False):
        return stages.value(
            distance=distance, grasped=grasped, missing=missing, aside=aside, over=over
        )

    rewards = [
        reward(0.3),
        reward(0.0),
        reward(0.0, True),
        reward(0.0, True, 0.0),
        reward(0.0, True, 0.0, 0.2),
        reward(0.0, True, 0.0, 0.05, True),
        reward(0.0, True, 0.0, 0.0, True),
    ]
    assert sorted(rewards) == rewards
    assert rewards[-1] == pytest.approx(0.7)
    assert rewards[1] == pytest.approx(0.1)
    assert 0.35 <= rewards[2] < rewards[3]
    assert reward(0.5, False, 0.25, 0.0, True) == pytest.approx(0.7)  # let go
    assert reward(0.0, False, 0.0, 0.2, False) == pytest.approx(0.1)  # thrown


def test_observed_poses_are_those_of_the_hand(env):
    observation, _ = env.reset(seed=1)
    data = env.simulation.data
    site = data.site(f"robot0_{env.benchmark.hands[0].frame}")
    R = site.xmat.reshape(3, 3)
    for name in GROCERIES:
        body = data.body(name)
        at = R @ observation[f"{name}_to_robot0_eef_pos"] + site.xpos
        np.testing.assert_allclose(at, body.xpos, atol=1e-12)
        x, y, z, w = observation[f"{name}_to_robot0_eef_quat"]
        seen = np.empty(9)
        mujoco.mju_quat2Mat(seen, np.array([w, x, y, z]))
        turn = R @ seen.reshape(3, 3)
        np.testing.assert_allclose(turn, body.xmat.reshape(3, 3), atol=1e-12)
    assert observation["object-state"].shape == (56,)


def test_a_variant_says_only_what_differs():
    full, can = load_benchmark("PickPlace"), load_benchmark("PickPlaceCan")
    assert can.config.objects == ("Can",)
    assert can.config.source == full.config.source
    assert can.config.name == "PickPlaceCan"


@pytest.mark.parametrize(
    ("name", "thing"), [("PickPlaceCan", "Can"), ("NutAssemblySquare", "SquareNut")]
)
def test_a_sampler_of_ones_own_places_the_things(name, thing):
    here = Region(x=(0.01, 0.01), y=(-0.02, -0.02))
    origin = (0.1, -0.2, 0.9)
    own = UniformSampler(names=[thing], region=here, origin=origin)
    env = wbc_suite.make(name, placement_initializer=own)
    for seed in range(3):
        seen, _ = env.reset(seed=seed)
        np.testing.assert_allclose(seen[f"{thing}_pos"][:2], (0.11, -0.22))
