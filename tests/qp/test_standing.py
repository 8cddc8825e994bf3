"""Limits of robots that stand: where they would tip, what their motors carry."""

import numpy as np
import pinocchio as pin
import pytest

import wbc_suite
from wbc_suite.errors import ConfigError
from wbc_suite.kinematics import Configuration
from wbc_suite.qp import (
    ComTask,
    FrameEquality,
    LimitKind,
    Sole,
    SupportLimit,
    TaskStack,
    VelocityLimit,
    WeightLimit,
)
from wbc_suite.qp.standing_limits import convex_hull

DT = 0.01
FEET = ("right_foot", "left_foot")
SOLES = [Sole(frame=foot, x=(-0.06, 0.13), y=(-0.03, 0.03)) for foot in FEET]


@pytest.fixture
def standing() -> Configuration:
    model = wbc_suite.load_robot("GR1FreeBody").to_pinocchio()
    return Configuration(model, model.referenceConfigurations["ready"])


def test_the_hull_of_two_soles_leaves_out_what_is_inside():
    points = np.array([[0, 0], [2, 0], [1, 0], [2, 1], [0, 1], [1, 0.5]], dtype=float)
    assert convex_hull(points).tolist() == [[0, 0], [2, 0], [2, 1], [0, 1]]


def test_the_centre_of_mass_stops_before_the_toes(standing: Configuration):
    task = ComTask(1.0, gain=0.5)
    task.set_target(standing.com + np.array([0.5, 0.0, 0.0]))
    limit = SupportLimit(SOLES, margin=0.03)
    equalities = [FrameEquality(foot) for foot in FEET]
    limits = [VelocityLimit(), limit]
    stack = TaskStack(
        standing, [task], limits=limits, joint_limits=False, equalities=equalities
    )
    for _ in range(250):
        solution = stack.solve(DT)
        standing.update(standing.integrate(solution.dq))
    toes = standing.frame_pose("left_foot").translation[0] + 0.13
    assert standing.com[0] == pytest.approx(toes - 0.03, abs=2e-3)
    words = [str(x) for x in solution.active if x.kind is LimitKind.BALANCE]
    assert words == ["balance: centre of mass at the toes"]


@pytest.mark.parametrize("margin", [None, 0.0])
def test_the_first_step_keeps_the_pressure_point_in(
    standing: Configuration, margin: float | None
):
    """Only with a pressure margin; reckoned here from the momentum of the step."""
    task = ComTask(1.0, gain=0.5)
    task.set_target(standing.com + np.array([0.5, 0.0, 0.0]))
    limit = SupportLimit(SOLES, margin=0.0, pressure_margin=margin)
    equalities = [FrameEquality(foot) for foot in FEET]
    limits = [VelocityLimit(), limit]
    stack = TaskStack(
        standing, [task], limits=limits, joint_limits=False, equalities=equalities
    )
    v = stack.solve(DT).v
    model, data = standing.model, standing.model.createData()
    rate = pin.computeCentroidalMomentum(model, data, standing.q, v).vector / DT
    weight = 9.81 * pin.computeTotalMass(model)
    height = standing.com[2] - standing.frame_pose("left_foot").translation[2]
    pressure = standing.com[0] - (height * rate[0] + rate[4]) / weight
    heel = standing.frame_pose("left_foot").translation[0] - 0.06
    assert (pressure > heel - 1e-3) == (margin is not None)


def test_a_motor_carries_no_more_than_its_limit(standing: Configuration):
    joint = "waist_pitch_joint"
    index = standing.model.joints[standing.joint_id(joint)].idx_v
    task = ComTask(1.0, gain=0.5)
    task.set_target(standing.com + np.array([0.3, 0.0, -0.3]))
    limits = [VelocityLimit(), WeightLimit({joint: 15.0})]
    equalities = [FrameEquality(foot) for foot in FEET]
    stack = TaskStack(
        standing, [task], limits=limits, joint_limits=False, equalities=equalities
    )
    for _ in range(100):
        standing.update(standing.integrate(stack.solve(DT).dq))
    model, data = standing.model, standing.model.createData()
    torque = pin.computeGeneralizedGravity(model, data, standing.q)[index]
    assert abs(torque) < 15.0 + 0.5


def test_a_robot_without_soles_has_nothing_to_balance_on():
    with pytest.raises(ConfigError, match="sole"):
        SupportLimit([])
