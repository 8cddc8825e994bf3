"""Plan for one's own model, without an environment or a controller."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.errors import ConfigError
from wbc_suite.kinematics import Conversion
from wbc_suite.planning import LimitChecker, SceneCollisionChecker, plan_motion
from wbc_suite.qp import WeightLimit
from wbc_suite.robot import load_robot


@pytest.fixture(scope="module")
def scene():
    """Return a Panda's model and the checker of a scene with a pillar before it."""
    robot = load_robot("Panda")
    spec = robot.to_mjspec()
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=[0.05, 0.2, 0], pos=[0.6, 0.0, 1.4]
    )
    model, pinocchio_model = spec.compile(), robot.to_pinocchio()
    data = mujoco.MjData(model)
    conversion = Conversion(model, pinocchio_model)
    return pinocchio_model, SceneCollisionChecker(model, data, conversion)


def turned(model, angle):
    """Return a configuration with the arm stretched out to one side."""
    q = pin.neutral(model)
    q[:7] = angle, 0.4, 0.0, -1.6, 0.0, 2.0, 0.8
    return q


def test_links_in_contact_may_come_apart_but_not_closer():
    """Two blocks on slides, with faces 2 mm inside of one another."""
    block = '<geom type="box" size="0.05 0.05 0.05" contype="1" conaffinity="1"/>'
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><worldbody><body>
        <body name="a">{block}</body>
        <body name="b" pos="0.098 0 0"><joint name="j" type="slide" axis="1 0 0"/>
        {block}</body></body></worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.ncon

    class Slide:
        def q_to_mujoco(self, q, qpos):
            qpos[:] = q

    checker = SceneCollisionChecker(model, data, Slide())
    at = [checker.clearance(np.array([x])) for x in (-0.002, 0.0, 0.001, 0.01)]
    assert at[0] < 0.0 < at[1] < at[2] < at[3] == np.inf
    data.qpos[0] = 0.01  # apart, contacts less deep than before are collisions
    mujoco.mj_forward(model, data)
    assert checker.clearance(np.array([0.0015])) < 0.0


def test_the_motion_goes_around_an_obstacle(scene):
    model, checker = scene
    start, goal = turned(model, -0.9), turned(model, 0.9)
    assert checker.clearance(start) > 0.0
    assert checker.clearance(goal) > 0.0
    assert checker.clearance(turned(model, 0.0)) < 0.0
    motion = plan_motion(
        model, start, goal, clearance=checker.clearance, acceleration=8.0
    )
    assert motion is not None
    times = np.linspace(0.0, motion.trajectory.duration, 400)
    np.testing.assert_allclose(motion.configuration(0.0), start, atol=1e-9)
    np.testing.assert_allclose(motion.goal, goal, atol=1e-6)
    # Checked every 5 ms: in between the hand goes on by less than 10 mm.
    found = min(checker.clearance(motion.configuration(time)) for time in times)
    assert found > -5e-3
    velocities = np.array([motion.trajectory.state(time)[1] for time in times])
    assert (np.abs(velocities) <= model.velocityLimit + 1e-9).all()
    changes = np.abs(np.diff(velocities, axis=0)) / times[1]
    assert changes.max() <= 8.0 * (1.0 + 1e-6)


def test_a_free_motion_is_direct(scene):
    model, _ = scene
    start, goal = turned(model, -0.9), turned(model, 0.9)
    motion = plan_motion(
        model, start, goal, clearance=lambda q: 1.0, acceleration=8.0, speed=1.0
    )
    assert len(motion.trajectory.segments) == 1
    assert motion.trajectory.duration == pytest.approx(1.8 / 1.0 + 1.0 / 8.0)


def test_there_is_no_motion_through_a_closed_wall(scene):
    model, _ = scene
    motion = plan_motion(
        model,
        turned(model, -0.9),
        turned(model, 0.9),
        clearance=lambda q: abs(q[0]) - 0.2,
        acceleration=8.0,
    )
    assert motion is None


@pytest.mark.parametrize(
    ("robot", "limits", "match"),
    [
        ("SpotWithArm", {"acceleration": 8.0}, "nq = .* and nv = "),
        ("Panda", {"acceleration": 0.0}, "must be positive"),
        ("Panda", {"acceleration": 8.0, "speed": -1.0}, "must be positive"),
    ],
)
def test_what_cannot_be_planned_is_refused(robot, limits, match):
    model = load_robot(robot).to_pinocchio()
    q = pin.neutral(model)
    with pytest.raises(ConfigError, match=match):
        plan_motion(model, q, q, clearance=lambda q: 1.0, **limits)


def test_a_motor_that_cannot_hold_the_weight_is_no_clearance(scene):
    model, _ = scene
    shoulder, index = model.names[2], model.joints[2].idx_v
    checker = LimitChecker(model, (), [WeightLimit({shoulder: 20.0})])
    data, found = model.createData(), []
    for lift in np.linspace(-1.5, 1.5, 13):
        q = turned(model, 0.0)
        q[1] = lift
        weight = abs(pin.computeGeneralizedGravity(model, data, q)[index])
        found.append(weight < 20.0)
        least = np.inf if weight < 20.0 else 20.0 - weight
        assert checker.clearance(q) == pytest.approx(least, rel=1e-12)
    assert 0 < sum(found) < len(found)
