"""Models built in code, so that these tests need no robot description."""

import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.kinematics import Configuration


def build_arm() -> pin.Model:
    """Return a 7-dof arm: Denavit-Hartenberg figures and limits of the Panda.

    Source: Franka Robotics, "Robot and interface specifications" (modified DH).
    """
    model = pin.Model()
    model.name = "arm"
    half = np.pi / 2
    figures = [  # a, alpha, d of each joint frame in its parent; lower, upper, speed
        (0.0, 0.0, 0.333, -2.8973, 2.8973, 2.175),
        (0.0, -half, 0.0, -1.7628, 1.7628, 2.175),
        (0.0, half, 0.316, -2.8973, 2.8973, 2.175),
        (0.0825, half, 0.0, -3.0718, -0.0698, 2.175),
        (-0.0825, -half, 0.384, -2.8973, 2.8973, 2.61),
        (0.0, half, 0.0, -0.0175, 3.7525, 2.61),
        (0.088, half, 0.0, -2.8973, 2.8973, 2.61),
    ]
    parent = 0
    for k, (a, alpha, d, lower, upper, speed) in enumerate(figures):
        R = pin.utils.rotate("x", alpha)
        placement = pin.SE3(R, np.array([a, 0.0, 0.0])) * pin.SE3(
            np.eye(3), np.array([0.0, 0.0, d])
        )
        parent = model.addJoint(
            parent,
            pin.JointModelRZ(),
            placement,
            f"joint{k + 1}",
            np.array([87.0]),
            np.array([speed]),
            np.array([lower]),
            np.array([upper]),
        )
        model.appendBodyToJoint(
            parent,
            pin.Inertia(2.0, np.array([0.0, 0.0, 0.05]), 0.02 * np.eye(3)),
            pin.SE3.Identity(),
        )
    flange = pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.107]))
    model.addFrame(pin.Frame("hand", parent, 0, flange, pin.FrameType.OP_FRAME))
    return model


def build_humanoid() -> pin.Model:
    """Return a free-floating humanoid with 28 joints, limits of +-2 rad, 3 rad/s."""
    model = pin.buildSampleModelHumanoid()
    model.lowerPositionLimit[7:] = -2.0
    model.upperPositionLimit[7:] = 2.0
    model.velocityLimit[:] = 3.0
    return model


def random_q(model: pin.Model, rng: np.random.Generator, spread: float = 1.0):
    """Return a configuration inside the limits, the root anywhere."""
    lower = np.maximum(model.lowerPositionLimit, -spread)
    upper = np.minimum(model.upperPositionLimit, spread)
    q = rng.uniform(np.minimum(lower, upper), np.maximum(lower, upper))
    if model.joints[1].nq == 7:
        q[3:7] = rng.normal(size=4)
        q[3:7] /= np.linalg.norm(q[3:7])
    return q


READY = np.array([0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8])
FEET = ("rleg_wrist2_joint", "lleg_wrist2_joint")
HANDS = ("rarm_wrist2_joint", "larm_wrist2_joint")


@pytest.fixture
def arm() -> Configuration:
    return Configuration(build_arm(), READY)


@pytest.fixture
def humanoid() -> Configuration:
    model = build_humanoid()
    q = pin.neutral(model)
    q[7:] = np.random.default_rng(3).uniform(-0.6, 0.6, model.nq - 7)
    return Configuration(model, q)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20)
