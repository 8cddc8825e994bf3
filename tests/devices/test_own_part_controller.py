"""A part controller written outside the package, in teleoperation."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import wbc_suite
from wbc_suite.control.part.registry import PART_CONTROLLERS
from wbc_suite.devices import DeviceState, LimbInput, Pipeline, PipelineConfig

EXAMPLE = Path(__file__).parents[2] / "examples" / "11_own_part_controller.py"


@pytest.fixture
def env(forget):
    forget(PART_CONTROLLERS, "CYLINDER")
    runpy.run_path(str(EXAMPLE))
    env = wbc_suite.make("Lift", robots="Panda", controller_configs="CYLINDER")
    env.reset(seed=0)
    yield env
    env.close()


@pytest.mark.slow
def test_a_device_moves_the_hand_of_a_users_controller(env):
    """Up at 0.2 m/s for half a second, then still: 10 cm, and no drift after it."""
    pipeline = Pipeline(env, PipelineConfig(ramp=0.0))
    pipeline.reset()
    port = pipeline.limbs["right"].port
    start, twist = port.measure().translation.copy(), np.zeros(6)
    heights = []
    for k in range(40):
        twist[2] = 0.2 if k < 10 else 0.0
        state = DeviceState(time=k / 20.0, limbs={"right": LimbInput(twist=twist)})
        env.step(pipeline.update(state))
        heights.append(port.measure().translation[2] - start[2])
    moved = port.measure().translation - start
    np.testing.assert_allclose(moved, [0.0, 0.0, 0.1], atol=0.01)
    assert abs(heights[-1] - heights[-10]) < 2e-3
