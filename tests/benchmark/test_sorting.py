"""What PickPlace and NutAssembly share: all in its place, and the hand withdrawn."""

from functools import cache

import numpy as np
import pytest
from conftest import put
from sorted_goals import BINS, PEGS, RESTING, goals, put_at

import wbc_suite


@cache
def made(name):
    return wbc_suite.make(name, robots="Panda")


@pytest.fixture(params=RESTING)
def env(request):
    return made(request.param)


@pytest.mark.slow
def test_everything_in_its_place_is_a_success(env):
    benchmark = put_at(env, goals(env))
    assert benchmark.success()
    assert benchmark.reward(shaped=False) == benchmark.reward(shaped=True) == 1.0
    for _ in range(10):
        _, reward, _, _, info = env.step(env.hold_action)
        assert info["success"]
        assert reward == 1.0


def moved(name, by=(0.0, 0.0), height=None):
    """Return a change of places: one thing aside by x y, at a height, m."""

    def change(places):
        x, y, z = places[name]
        places[name] = (x + by[0], y + by[1], z if height is None else height)

    return change


def swapped(first, second):
    def change(places):
        places[first], places[second] = places[second], places[first]

    return change


def without(name):
    return lambda places: places.pop(name)


NEAR_MISSES = {
    "NutAssembly": {
        "on top of its peg": moved("RoundNut", height=PEGS + 0.11),
        "on the table beside": moved("SquareNut", by=(-0.08, 0.0)),
        "aside both ways": moved("RoundNut", by=(0.025, -0.025)),
        "swapped": swapped("SquareNut", "RoundNut"),
        "only one": without("SquareNut"),
        "under the table": moved("RoundNut", height=0.011),
    },
    "PickPlace": {
        "swapped": swapped("Milk", "Bread"),
        "one left": without("Can"),
        "too high": moved("Cereal", height=BINS + 0.101),
        "below the bin": moved("Bread", height=0.022),
        "over the edge": moved("Can", by=(0.1375, 0.0)),
    },
}
LEAST = {"NutAssembly": 0.0, "PickPlace": 0.5}
"""Shaped reward of the things that are in their places still."""


@pytest.mark.parametrize(
    ("name", "miss"),
    [(name, miss) for name in NEAR_MISSES for miss in NEAR_MISSES[name]],
)
def test_near_misses_are_no_success(name, miss):
    env = made(name)
    places = goals(env)
    NEAR_MISSES[name][miss](places)
    benchmark = put_at(env, places)
    assert not benchmark.success()
    assert benchmark.reward(shaped=False) == 0.0
    assert LEAST[name] <= benchmark.reward(shaped=True) < 1.0


def test_a_hand_that_has_not_left_is_no_success(env):
    benchmark = put_at(env, goals(env))
    hand = benchmark.hands[0].position
    held = {
        "NutAssembly": lambda: benchmark.site("RoundNut_handle"),
        "PickPlace": lambda: benchmark.states["Can"].position,
    }[benchmark.name]
    for distance, done in ((0.04, False), (0.05, True)):
        x, y, z = held()
        hand[:] = x, y, z + distance
        assert benchmark.success() is done


@pytest.mark.parametrize(
    ("kind", "middle", "reach"),
    [("PickPlace", (0.1, -0.25, BINS), 0.25), ("NutAssembly", (0.0, 0.0, PEGS), 0.25)],
)
def test_single_draws_one_thing_and_puts_the_others_away(kind, middle, reach):
    env, names = made(f"{kind}Single"), tuple(RESTING[kind])
    seen = set()
    for seed in range(12):
        observation, _ = env.reset(seed=seed)
        (name,) = env.benchmark.sorting.active
        seen.add(name)
        assert names[int(observation["obj_id"][0])] == name
        near = {
            other: np.abs(env.simulation.data.body(other).xpos - middle).max() < reach
            for other in names
        }
        assert near == {other: other == name for other in names}
        at = env.simulation.data.body(name).xpos
        np.testing.assert_array_equal(observation["obj_pos"], at)
        assert observation["object-state"].shape == (15,)
        places = goals(env, [name])
        assert put(env, **{name: (places[name], None)}).success()
    assert seen == set(names)
