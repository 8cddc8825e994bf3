"""The search of a goal configuration, for a model of one's own."""

import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.kinematics import Configuration
from wbc_suite.planning import GoalProblem, GoalSearch, MotionPlanner, TimedState
from wbc_suite.qp import FrameTask, PositionLimit, PostureTask, VelocityLimit
from wbc_suite.robot import load_robot

SPEED, ACCELERATION = np.full(9, 2.0), np.full(9, 8.0)
READY = np.array([0.0, -0.4, 0.0, -2.2, 0.0, 1.8, 0.8, 0.02, 0.02])


@pytest.fixture(scope="module")
def model():
    return load_robot("Panda").to_pinocchio()


def pose_at(model, q):
    """Return the hand's pose, by Pinocchio."""
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    return data.oMf[model.getFrameId("right_tcp")]


def search(model, clearance, target, planner=MotionPlanner):
    configuration = Configuration(model)
    task = FrameTask("right_tcp", max_linear_speed=1e3, max_angular_speed=1e3)
    task.set_target(target)
    problem = GoalProblem(
        configuration=configuration,
        tasks=[task],
        error=lambda: float(np.abs(task.error(configuration)).max()),
        equalities=[],
        limits=[PositionLimit(), VelocityLimit()],
        distance_limits=[],
        start=PostureTask(0.05, max_speed=1e3, name="start"),
        speed=SPEED,
    )
    made = planner(model, clearance, speed=SPEED, acceleration=ACCELERATION)
    return GoalSearch(problem, clearance, made)


def finish(found, now):
    """Return the last motion of a search, and for how many steps it ran."""
    best, steps = None, 0
    while found.is_running:
        best = found.advance(10, now) or best
        steps += 1
        assert steps < 1000
    return best, steps


@pytest.mark.slow
def test_the_motion_ends_at_the_target_within_joint_limits(model):
    goal = READY + np.array([1.2, 0.5, 0.3, 0.6, 0.2, 0.4, 0.5, 0.0, 0.0])
    target = pose_at(model, goal)
    found = search(model, lambda q: 1.0, target)
    now = TimedState(0.0, READY, np.zeros(9))
    found.start([READY], READY)
    motion, _ = finish(found, now)
    assert motion is not None
    np.testing.assert_allclose(motion.configuration(0.0), READY, atol=1e-9)
    missed = pin.log6(pose_at(model, motion.goal).actInv(target))
    assert np.linalg.norm(missed.vector) < 1e-6
    assert (motion.goal > model.lowerPositionLimit).all()
    assert (motion.goal < model.upperPositionLimit).all()


@pytest.mark.slow
def test_a_target_out_of_reach_has_no_motion_and_the_search_ends(model):
    far = pose_at(model, READY)
    far.translation[:] += [3.0, 0.0, 0.0]
    found = search(model, lambda q: 1.0, far)
    found.start([READY], READY)
    motion, steps = finish(found, TimedState(0.0, READY, np.zeros(9)))
    assert motion is None
    assert steps > 1


@pytest.mark.slow
def test_configurations_in_collision_are_no_goals(model):
    goal = READY + np.array([0.6, 0.2, 0.0, 0.2, 0.0, 0.0, 0.0, 0.0, 0.0])
    found = search(model, lambda q: -1.0, pose_at(model, goal))
    found.start([READY], READY)
    motion, _ = finish(found, TimedState(0.0, READY, np.zeros(9)))
    assert motion is None


@pytest.mark.slow
def test_a_stopped_search_does_not_run(model):
    found = search(model, lambda q: 1.0, pose_at(model, READY))
    found.start([READY], READY)
    assert found.is_running
    found.stop()
    assert not found.is_running
    assert found.advance(10, TimedState(0.0, READY, np.zeros(9))) is None


@pytest.mark.slow
def test_a_target_just_out_of_reach_is_approached(model):
    goal = READY.copy()
    goal[3] = -0.467  # shoulder, elbow and wrist are in line
    target, data = pose_at(model, goal), model.createData()
    pin.forwardKinematics(model, data, goal)
    away = data.oMi[6].translation - data.oMi[2].translation
    target.translation[:] += 0.01 * away / np.linalg.norm(away)
    found = search(model, lambda q: 1.0, target)
    found.start([READY], READY)
    motion, _ = finish(found, TimedState(0.0, READY, np.zeros(9)))
    assert motion is not None
    missed = np.abs(pin.log6(pose_at(model, motion.goal).actInv(target)).vector).max()
    assert 1e-3 < missed < 0.02
    assert (motion.goal > model.lowerPositionLimit).all()


def test_endless_joints_are_drawn_too():
    endless = load_robot("Panda").to_pinocchio()
    endless.lowerPositionLimit = np.full(9, -np.inf)
    endless.upperPositionLimit = np.full(9, np.inf)
    found = search(endless, lambda q: q[0] - 1.0, pose_at(endless, READY))
    found.start([READY], READY)
    motion, _ = finish(found, TimedState(0.0, READY, np.zeros(9)))
    assert motion is not None
    assert motion.goal[0] > 1.0
    np.testing.assert_array_equal(motion.goal[7:], READY[7:])  # fingers move no hand


class LateMotions(MotionPlanner):
    """Finds no way to the first thirty configurations."""

    asked = 0

    def direct(self, now, goal):
        self.asked += 1
        return super().direct(now, goal) if self.asked > 30 else None

    def retrace(self, now, goal, trail):
        yield from ()

    def around(self, motion, goals):
        yield from ()
        return False


@pytest.mark.slow
def test_the_search_goes_on_while_all_configurations_are_blocked(model):
    goal = READY + np.array([1.2, 0.5, 0.3, 0.6, 0.2, 0.4, 0.5, 0.0, 0.0])
    target = pose_at(model, goal)
    found = search(model, lambda q: 1.0, target, LateMotions)
    found.start([READY], READY)
    motion, _ = finish(found, TimedState(0.0, READY, np.zeros(9)))
    assert motion is not None
    assert len(motion.trajectory.segments) == 1  # direct, not straight after a stop
    missed = pin.log6(pose_at(model, motion.goal).actInv(target))
    assert np.linalg.norm(missed.vector) < 1e-6
