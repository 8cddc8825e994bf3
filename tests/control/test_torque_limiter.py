import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.control.ik.reduced_robot import lock_groups
from wbc_suite.control.ik.torque_limiter import (
    CHANGE_SHARE_MIN,
    EFFORT_SHARE,
    TorqueLimiter,
)
from wbc_suite.kinematics import Configuration
from wbc_suite.robot import load_robot

DT = 0.01
RATE = 5.0  # rad/s^2


@pytest.fixture(scope="module")
def robot():
    return lock_groups(load_robot("GR1"), ["legs"])


@pytest.fixture
def configuration(robot):
    found = Configuration(robot.to_pinocchio())
    found.update(found.model.referenceConfigurations["ready"])
    return found


def torque(configuration, before, v):
    model, a = configuration.model, (v - before) / DT
    return pin.rnea(model, model.createData(), configuration.q, v, a)


def efforts(robot, configuration):
    model = configuration.model
    found = np.full(configuration.nv, np.inf)
    for joint in robot.joints:
        if joint.effort:
            v = model.joints[configuration.joint_id(joint.name)].idx_v
            found[v] = joint.effort
    return found


def guard_of(robot, configuration):
    return TorqueLimiter(robot, configuration, np.full(configuration.nv, RATE))


def index(configuration, name):
    return configuration.model.joints[configuration.joint_id(name)].idx_v


def test_what_motors_can_give_is_left_alone(robot, configuration):
    guard = guard_of(robot, configuration)
    before = np.zeros(configuration.nv)
    v = np.full(configuration.nv, 0.01)
    assert guard.apply(before, v, DT) is v


def test_no_motor_is_asked_for_more_than_it_has(robot, configuration):
    guard = guard_of(robot, configuration)
    most = efforts(robot, configuration)
    rng = np.random.default_rng(0)
    before = np.zeros(configuration.nv)
    slowed = 0
    for _ in range(100):
        v = rng.uniform(-0.5, 0.5, configuration.nv)
        found = guard.apply(before, v, DT)
        asked = np.abs(torque(configuration, before, v)) / most
        got = np.abs(torque(configuration, before, found)) / most
        if found is v or asked.max() > 4.0:  # some change is always left
            continue
        slowed += 1
        # Coriolis terms change a little with the velocity that is given up.
        assert got.max() < EFFORT_SHARE + 0.03
    assert slowed > 20


def test_a_weak_motor_slows_its_own_joint_alone(robot, configuration):
    v = np.zeros(configuration.nv)
    v[index(configuration, "waist_pitch_joint")] = 0.45  # more than the neck can follow
    found = guard_of(robot, configuration).apply(np.zeros_like(v), v, DT)
    neck = index(configuration, "head_pitch_joint")
    got = torque(configuration, np.zeros_like(v), found)[neck]
    assert found[neck] < -0.005
    assert got == pytest.approx(
        EFFORT_SHARE * efforts(robot, configuration)[neck], rel=0.01
    )
    np.testing.assert_array_equal(np.delete(found, neck), np.delete(v, neck))


def test_all_joints_are_slowed_where_one_could_not_stop(robot, configuration):
    model = configuration.model
    waist = index(configuration, "waist_pitch_joint")
    q = configuration.q.copy()
    k = model.joints[configuration.joint_id("waist_pitch_joint")].idx_q
    q[k] = model.upperPositionLimit[k] - 0.01
    configuration.update(q)
    before, v = np.zeros(configuration.nv), np.zeros(configuration.nv)
    before[waist], v[waist] = 1.0, 0.4  # to brake with 60 rad/s^2, where it can with 20
    v[index(configuration, "left_elbow_pitch_joint")] = 0.1
    found = guard_of(robot, configuration).apply(before, v, DT)
    change = (found - before)[v != before] / (v - before)[v != before]
    np.testing.assert_allclose(change, change[0], rtol=1e-9)  # the same direction
    assert CHANGE_SHARE_MIN <= change[0] < 0.5


def test_slowed_joints_stay_within_their_limits(robot, configuration):
    model = configuration.model
    joint = model.joints[configuration.joint_id("waist_roll_joint")]
    q = configuration.q.copy()
    q[joint.idx_q] = model.upperPositionLimit[joint.idx_q] - 1e-4
    configuration.update(q)
    before = np.zeros(configuration.nv)
    before[joint.idx_v] = 1.0  # too late to brake: 100 rad/s^2
    v = np.zeros(configuration.nv)
    found = guard_of(robot, configuration).apply(before, v, DT)
    assert found[joint.idx_v] * DT <= 1e-4 + 1e-12
