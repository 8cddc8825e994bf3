"""What the tests of single robots share: each defines `robot` for its own file."""

import mujoco
import pytest


@pytest.fixture(scope="module")
def model(robot):
    """The robot alone, compiled."""
    return robot.to_mjspec().compile()


@pytest.fixture
def data(model):
    """Its state at `ready`."""
    return state_at_ready(model)


@pytest.fixture(scope="session")
def at_ready():
    """A function from a robot to its model and state at `ready`."""

    def build(robot):
        model = robot.to_mjspec().compile()
        return model, state_at_ready(model)

    return build


def state_at_ready(model):
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("ready").id)
    mujoco.mj_forward(model, data)
    return data
