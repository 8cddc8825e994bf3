import pytest
from sorted_goals import goals, put_at

import wbc_suite

TOP = 0.82
NUTS = ("SquareNut", "RoundNut")


@pytest.fixture(scope="module")
def env():
    return wbc_suite.make("NutAssembly", robots="Panda")


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
