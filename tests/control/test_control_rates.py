"""Controllers reach their goals at any rate of actions as they do at 20 Hz."""

from functools import cache

import pytest
from control_rates import CASES, RATES, result

FAST = ("OSC_POSE absolute", "IK_POSE absolute", "JOINT_VELOCITY")
reference = cache(lambda name: result(CASES[name], 20.0))


@pytest.mark.sample(40)
@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("name", CASES)
@pytest.mark.slow
def test_goals_are_reached_at_every_rate(name, rate):
    case, found, usual = CASES[name], result(CASES[name], rate), reference(name)
    if case.relative:
        for x, x_usual, most in zip(found, usual, case.tolerance, strict=False):
            assert x == pytest.approx(x_usual, abs=most)
        return
    linear, angular, settled = found
    assert linear < case.tolerance[0]
    assert angular < case.tolerance[1]
    assert settled < 1.3 * usual[2] + 2.0 / rate  # found after a period at most


@pytest.mark.parametrize("name", FAST)
def test_goals_are_reached_at_30_hz(name):
    linear, angular, settled = result(CASES[name], 30.0)
    assert linear < 1e-3
    assert angular < 1e-3
    assert settled < 1.3
