"""Every variant of a benchmark: one success and five near misses, set by hand."""

import pytest
from conftest import hand_touches, put

import wbc_suite
from wbc_suite.benchmark.pick_place import GROCERIES, REST

FLOOR, TOP = 0.8, 0.82
GROCERY = {
    **{f"PickPlace{name}": name for name in GROCERIES},
    "PickPlaceSingle": "Cereal",
}
NUT = {
    "NutAssemblySquare": "SquareNut",
    "NutAssemblyRound": "RoundNut",
    "NutAssemblySingle": "RoundNut",
}


def started(name, thing):
    """Return an environment whose episode is about a thing."""
    env = wbc_suite.make(name, robots="Panda")
    for seed in range(40):
        env.reset(seed=seed)
        if env.benchmark.sorting.active == (thing,):
            return env
    raise AssertionError(f"{name} never draws {thing}")


def check(env, thing, good, misses, monkeypatch):
    """Check a place that is a success, and that near it nothing else is."""
    task = put(env, **{thing: (good, None)})
    assert task.success()
    assert task.reward(shaped=False) == task.reward(shaped=True) == 1.0
    with monkeypatch.context() as held:
        hand_touches(held, task, thing)
        assert not task.success()
    for place in misses:
        task = put(env, **{thing: (place, None)})
        assert not task.success(), place
        assert task.reward(shaped=False) == 0.0
        assert 0.0 <= task.reward(shaped=True) < 1.0


@pytest.mark.parametrize(("name", "thing"), GROCERY.items())
def test_a_grocery_counts_in_its_own_quadrant_only(name, thing, monkeypatch):
    env = started(name, thing)
    z = FLOOR + REST[thing] - 1e-4
    x, y = env.benchmark.goal(thing)
    others = [env.benchmark.goal(n) for n in GROCERIES if n != thing]
    misses = [*((*at, z) for at in others), (x, y, FLOOR + 0.101), (x, y, 0.022)]
    check(env, thing, (x, y, z), misses, monkeypatch)


@pytest.mark.parametrize(("name", "thing"), NUT.items())
def test_a_nut_counts_around_its_own_peg_only(name, thing, monkeypatch):
    env = started(name, thing)
    z = TOP + 0.01 - 1e-4
    x, y = env.benchmark.goal(thing)
    wrong = next(n for n in NUT.values() if n != thing)
    misses = [
        (*env.benchmark.goal(wrong), z),
        (x + 0.031, y, z),  # 3 cm from the axis count
        (x, y - 0.031, z),
        (x, y, TOP + 0.051),  # on its way down
        (x, y, 0.011),  # under the table
    ]
    check(env, thing, (x, y, z), misses, monkeypatch)
