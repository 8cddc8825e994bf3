"""Torques and steps between configurations, held to Pinocchio."""

import numpy as np
import pinocchio as pin
import pytest

from wbc_suite import load_robot
from wbc_suite.compiling import as_argument
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.inverse_dynamics import compute_torques, inertia_arrays
from wbc_suite.kinematics.tangent_space import difference, integrate


@pytest.fixture(params=["Panda", "GR1", "Tiago", "SpotWithArm"])
def configuration(request):
    return Configuration(load_robot(request.param).to_pinocchio())


def test_torques_are_those_of_pinocchio(configuration):
    model, rng = configuration.model, np.random.default_rng(0)
    data, inertias = model.createData(), as_argument(inertia_arrays(model))
    tau = np.zeros(model.nv)
    for _ in range(50):
        step = 2.0 * rng.standard_normal(model.nv)
        configuration.update(pin.integrate(model, pin.neutral(model), step))
        v, a = rng.standard_normal((2, model.nv))
        compute_torques(configuration.robot, inertias, v, a, tau)
        expected = pin.rnea(model, data, configuration.q, v, a)
        scale = np.abs(expected).max()
        np.testing.assert_allclose(tau, expected, rtol=0.0, atol=1e-13 * scale)


def test_differences_are_those_of_pinocchio_and_lead_back(configuration):
    model, rng = configuration.model, np.random.default_rng(1)
    robot, out = configuration.robot, np.zeros(configuration.nv)
    for size in 10.0 ** np.linspace(-8.0, 0.3, 40):
        q = pin.integrate(model, pin.neutral(model), rng.standard_normal(model.nv))
        goal = pin.integrate(model, q, size * rng.standard_normal(model.nv))
        difference(robot, q, goal, out)
        expected = pin.difference(model, q, goal)
        np.testing.assert_allclose(out, expected, rtol=0.0, atol=1e-13)
        reached = q.copy()
        integrate(robot, reached, out)
        assert pin.isSameConfiguration(model, reached, goal, 1e-12)
