import numpy as np
import pytest
from conftest import put

import wbc_suite

TOP = 0.82
NUTS = ("SquareNut", "RoundNut")


@pytest.fixture(scope="module")
def env():
    return wbc_suite.make("NutAssembly", robots="Panda")


def goals(env, height=0.01 - 1e-4):
    return {name: (*env.benchmark.goal(name), TOP + height) for name in NUTS}


def put_at(env, places):
    env.reset(seed=0)
    return put(env, **{name: (at, None) for name, at in places.items()})


def test_nuts_around_their_pegs_are_a_success(env):
    nuts = put_at(env, goals(env))
    assert nuts.success()
    for _ in range(10):
        _, reward, _, _, info = env.step(env.hold_action)
        assert info["success"]
        assert reward == 1.0


@pytest.mark.parametrize("name", NUTS)
def test_a_nut_falls_down_its_peg(env, name):
    places = goals(env)
    x, y, _ = places[name]
    places[name] = (x + 0.003, y - 0.003, TOP + 0.115)
    nuts = put_at(env, places)
    assert not nuts.success()
    for _ in range(20):
        env.step(env.hold_action)
    assert nuts.success()


def on_top(places):
    x, y, _ = places["RoundNut"]
    places["RoundNut"] = (x, y, TOP + 0.11)


def on_the_table_beside(places):
    x, y, z = places["SquareNut"]
    places["SquareNut"] = (x - 0.08, y, z)


def swapped(places):
    places["SquareNut"], places["RoundNut"] = places["RoundNut"], places["SquareNut"]


def only_one(places):
    del places["SquareNut"]


def under_the_table(places):
    x, y, _ = places["RoundNut"]
    places["RoundNut"] = (x, y, 0.011)


@pytest.mark.parametrize(
    "change", [on_top, on_the_table_beside, swapped, only_one, under_the_table]
)
def test_near_misses_are_no_success(env, change):
    places = goals(env)
    change(places)
    nuts = put_at(env, places)
    assert not nuts.success()
    assert nuts.reward(shaped=False) == 0.0
    assert 0.0 <= nuts.reward(shaped=True) < 1.0


def test_a_hand_that_has_not_left_is_no_success(env):
    nuts = put_at(env, goals(env))
    hand = nuts.hands[0].position
    for distance, done in ((0.04, False), (0.05, True)):
        x, y, z = nuts.site("RoundNut_handle")
        hand[:] = x, y, z + distance
        assert nuts.success() is done


def test_nuts_start_where_datasets_have_them(env):
    for seed in range(20):
        observation, _ = env.reset(seed=seed)
        for name, (low, high) in (
            ("SquareNut", (0.11, 0.225)),
            ("RoundNut", (-0.225, -0.11)),
        ):
            x, y, z = observation[f"{name}_pos"]
            assert -0.115 <= x <= -0.11
            assert low <= y <= high
            assert z == pytest.approx(TOP + 0.01)
    assert observation["object-state"].shape == (28,)


def test_single_draws_one_nut():
    env = wbc_suite.make("NutAssemblySingle", robots="Panda")
    seen = set()
    for seed in range(8):
        observation, _ = env.reset(seed=seed)
        name = env.benchmark.active[0]
        seen.add(name)
        assert NUTS[int(observation["obj_id"][0])] == name
        position = env.simulation.data.body(name).xpos
        np.testing.assert_array_equal(observation["obj_pos"], position)
        at = (*env.benchmark.goal(name), TOP + 0.01)
        assert put(env, **{name: (at, None)}).success()
    assert seen == set(NUTS)
