"""Scaling of inputs, gains and limits that part controllers share."""

from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from wbc_suite.control import PartSettings, SliceKind, Unit
from wbc_suite.control.ground.feasible_acceleration import (
    LEAST_ACCELERATION,
    feasible_accelerations,
    greatest_loads,
)
from wbc_suite.control.part.impedance import Impedance, ImpedanceSettings
from wbc_suite.control.part.part_settings import InputScaling, limits_of, spread
from wbc_suite.errors import ConfigError
from wbc_suite.robot import load_robot

NUMBERS = st.floats(-10.0, 10.0)


class Settings(PartSettings):
    """Settings of no controller in particular."""

    type: Literal["X"] = "X"


def scaling(size=1, inputs=(-1.0, 1.0), outputs=(-1.0, 1.0)):
    settings = Settings(input_min=inputs[0], input_max=inputs[1])
    return InputScaling(size, settings, *outputs)


@given(NUMBERS, st.floats(0.01, 10.0), NUMBERS, NUMBERS)
def test_scaling_maps_the_ends_of_the_input_to_those_of_the_output(low, width, a, b):
    scale = scaling(inputs=(low, low + width), outputs=(a, b))
    tolerance = 1e-9 * (1.0 + 1.0 / width)
    assert_allclose(scale(np.array([low])), a, atol=tolerance)
    assert_allclose(scale(np.array([low + width])), b, atol=tolerance)
    assert_allclose(scale(np.array([low + 0.5 * width])), 0.5 * (a + b), atol=tolerance)


@given(NUMBERS, st.floats(0.01, 10.0), NUMBERS, NUMBERS)
def test_the_neutral_input_gives_the_output_nearest_to_zero(low, width, a, b):
    scale = scaling(inputs=(low, low + width), outputs=(a, b))
    [neutral] = scale.neutral
    assert low <= neutral <= low + width
    samples = scale(np.linspace(low, low + width, 11)[:, None])
    assert abs(scale(scale.neutral)[0]) <= np.abs(samples).min() + 1e-6


def test_inverse_scaling_undoes_scaling_and_is_zero_without_gain():
    scale = scaling(3, outputs=((-0.1, 0.2, 0.5), (0.1, 0.8, 0.5)))
    values = np.array([0.3, -0.7, 0.9])
    assert_allclose(scale.inverse(scale(values)), [0.3, -0.7, 0.0], atol=1e-12)


def test_units_of_scaled_inputs_print_what_1_means():
    scale = scaling(2, outputs=((-0.05, -0.5), (0.05, 0.5)))
    units = scale.units((Unit("m"), Unit("rad")))
    assert units == (Unit("m", 0.05), Unit("rad", 0.5))
    assert [str(unit) for unit in units] == ["0.05 m", "0.5 rad"]


@pytest.mark.parametrize("inputs", [(1.0, 1.0), (1.0, -1.0)])
def test_an_empty_input_range_is_refused(inputs):
    with pytest.raises(ConfigError, match="'input_min' must be below 'input_max'"):
        scaling(inputs=inputs)


@pytest.mark.parametrize("values", [0.5, (0.5,), (0.5, 0.5, 0.5)])
def test_one_number_stands_for_all(values):
    assert_array_equal(spread(values, 3, "kp"), np.full(3, 0.5))


def test_wrong_numbers_of_values_and_empty_ranges_name_the_key():
    with pytest.raises(ConfigError, match="key 'kp': 2 values instead of 1 or 3"):
        spread((1.0, 2.0), 3, "kp")
    with pytest.raises(ConfigError, match="key 'kp_limits': least values 2"):
        limits_of((2.0, 1.0), 3, "kp_limits")
    low, high = limits_of((-1.0, (0.0, 1.0)), 2, "x")
    assert_array_equal([low, high], [[-1.0, -1.0], [0.0, 1.0]])


@pytest.mark.parametrize(
    ("mode", "kinds"),
    [
        ("fixed", []),
        ("variable_kp", [SliceKind.STIFFNESS]),
        ("variable", [SliceKind.STIFFNESS, SliceKind.DAMPING]),
    ],
)
def test_the_action_sets_the_gains_of_its_mode(mode, kinds):
    settings = ImpedanceSettings(impedance_mode=mode, kp=100.0, damping_ratio=0.5)
    gains = Impedance("arm", ("x", "y"), settings)
    assert [part.kind for part in gains.slices] == kinds
    assert_allclose(gains.kp, 100.0)
    assert_allclose(gains.kd, 20.0 if mode == "variable_kp" else 10.0)
    given_gains = np.array([64.0, 144.0, 3.0, 4.0])[: 2 * len(kinds)]
    gains.take(given_gains)
    kp, kd = {
        "fixed": ([100.0, 100.0], [10.0, 10.0]),
        "variable_kp": ([64.0, 144.0], [16.0, 24.0]),
        "variable": ([64.0, 144.0], [3.0, 4.0]),
    }[mode]
    assert_allclose(gains.kp, kp)
    assert_allclose(gains.kd, kd)
    assert_array_equal(gains.hold_action, given_gains)


def test_gains_outside_their_limits_start_at_the_nearest():
    settings = ImpedanceSettings(
        impedance_mode="variable", kp=500.0, kd=200.0, kp_limits=(0, 300)
    )
    gains = Impedance("arm", ("x",), settings)
    assert (gains.kp.item(), gains.kd.item()) == (300.0, 100.0)


def test_ramps_take_a_part_of_the_period_with_interpolation_only():
    assert Settings(ramp_ratio=0.5).ramp(0.1) == 0.0
    assert Settings(ramp_ratio=0.5, interpolation="linear").ramp(0.1) == 0.05


@pytest.mark.parametrize("name", ["Panda", "PR2"])
def test_feasible_accelerations_need_no_more_than_the_share_of_effort(name):
    robot = load_robot(name)
    feasible = feasible_accelerations(robot, most=50.0, effort_share=0.6)
    model = robot.to_pinocchio()
    inertia, weight = greatest_loads(model)
    for joint in robot.joints:
        v = model.joints[model.getJointId(joint.name)].idx_v
        a = feasible[joint.name]
        assert 0.0 < a <= 50.0
        if joint.effort is not None and a > LEAST_ACCELERATION:
            left = max(joint.effort - weight[v], 0.2 * joint.effort)
            assert inertia[v] * a <= 0.6 * left + 1e-9


def test_more_effort_or_a_higher_limit_never_lowers_an_acceleration():
    robot = load_robot("UR5e")
    small = feasible_accelerations(robot, most=20.0, effort_share=0.3)
    large = feasible_accelerations(robot, most=50.0, effort_share=0.6)
    assert all(small[name] <= large[name] for name in small)
    assert any(small[name] < large[name] for name in small)
