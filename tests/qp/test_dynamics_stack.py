"""Stacks for contact forces and accelerations, against Pinocchio and in simulation."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.control import RobotState
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.kinematics import Configuration
from wbc_suite.qp import (
    AccelerationLimit,
    ComTask,
    Contact,
    DynamicsStack,
    Fallback,
    FrameTask,
    LookAtTask,
    MomentumTask,
    PositionLimit,
    PostureTask,
    RelativeFrameTask,
    VelocityLimit,
)
from wbc_suite.qp.dynamics_space import DynamicsSpace
from wbc_suite.robot import load_robot
from wbc_suite.scene import attach_robot, empty_arena

SOLE = [(x, y, 0.0) for x in (-0.055, 0.125) for y in (-0.031, 0.031)]
FEET = [Contact(frame=name, points=SOLE) for name in ("left_foot", "right_foot")]
LIMITS = (PositionLimit(), VelocityLimit(), AccelerationLimit(500.0))


def humanoid():
    robot = load_robot("GR1FreeBody")
    configuration = Configuration(robot.to_pinocchio())
    q = pin.neutral(configuration.model)
    q[:3] = robot.root.pos
    for joint, value in robot.keyframe("ready").items():
        index = configuration.model.joints[configuration.joint_id(joint)].idx_q
        q[index] = value
    configuration.update(q)
    return configuration, q


def arm(name="Panda"):
    robot = load_robot(name)
    configuration = Configuration(robot.to_pinocchio())
    q = pin.neutral(configuration.model)
    for joint, value in robot.keyframe("ready").items():
        q[configuration.model.joints[configuration.joint_id(joint)].idx_q] = value
    configuration.update(q)
    return configuration, q


def standing_tasks(configuration):
    hands = [FrameTask("right_eef"), FrameTask("left_eef")]
    for hand in hands:
        hand.set_target(configuration.frame_pose(hand.frame))
    trunk = FrameTask("pelvis", position_cost=0.0, orientation_cost=5.0)
    trunk.set_target(configuration.frame_pose("pelvis"))
    posture = PostureTask(0.1)
    posture.set_target(configuration.q.copy())
    return [ComTask(10.0), *hands, trunk, posture]


def random_state(configuration, q, seed):
    rng = np.random.default_rng(seed)
    nv = configuration.nv
    return pin.integrate(configuration.model, q, rng.normal(0, 0.05, nv)), rng.normal(
        0, 0.3, nv
    )


@pytest.mark.parametrize("seed", range(3))
def test_torques_and_forces_are_those_of_the_equations_of_motion(seed):
    configuration, q = humanoid()
    stack = DynamicsStack(
        configuration, standing_tasks(configuration), LIMITS, contacts=FEET
    )
    q, v = random_state(configuration, q, seed)
    solution = stack.solve(q, v, 0.002)
    model, data = configuration.model, configuration.model.createData()
    needed = pin.rnea(model, data, q, v, solution.a)
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    for contact in FEET:
        frame = model.getFrameId(contact.frame)
        J = pin.getFrameJacobian(
            model, data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        )
        R = data.oMf[frame].rotation
        for point, force in zip(SOLE, solution.forces[contact.frame], strict=True):
            needed -= J.T @ np.concatenate([force, np.cross(R @ point, force)])
    np.testing.assert_allclose(needed[:6], 0.0, atol=1e-7)
    np.testing.assert_allclose(needed[6:], solution.tau, atol=1e-7)


def test_forces_keep_the_cone_and_torques_their_limits():
    configuration, q = humanoid()
    tasks = standing_tasks(configuration)
    tasks[0].set_target(
        configuration.com + np.array([0.3, 0.2, -0.1])
    )  # more than feet can do
    stack = DynamicsStack(configuration, tasks, LIMITS, contacts=FEET, kp=400.0)
    for seed in range(5):
        solution = stack.solve(*random_state(configuration, q, seed), 0.002)
        assert np.isfinite(solution.a).all()
        for force in np.concatenate(list(solution.forces.values())):
            assert force[2] >= -1e-9
            assert np.hypot(*force[:2]) <= 0.6 * force[2] + 1e-8
        if solution.ok:
            effort = configuration.model.upperEffortLimit[6:]
            assert (np.abs(solution.tau) <= effort + 1e-7).all()


def test_standing_still_carries_the_weight():
    configuration, q = humanoid()
    stack = DynamicsStack(
        configuration, standing_tasks(configuration), LIMITS, contacts=FEET
    )
    solution = stack.solve(q, np.zeros(configuration.nv), 0.002)
    weight = 9.81 * pin.computeTotalMass(configuration.model)
    total = sum(force.sum(axis=0) for force in solution.forces.values())
    assert total == pytest.approx([0.0, 0.0, weight], rel=1e-3, abs=0.5)
    assert np.abs(solution.a).max() < 0.05
    text = str(solution)
    assert "solved as stated" in text
    assert "left_foot" in text


def test_an_unloaded_foot_carries_nothing():
    configuration, q = humanoid()
    left, right = (Contact(frame=c.frame, points=SOLE) for c in FEET)
    left.stage = 0.0
    stack = DynamicsStack(configuration, [PostureTask(1.0)], contacts=(left, right))
    solution = stack.solve(q, np.zeros(configuration.nv), 0.002)
    assert np.abs(solution.forces["left_foot"]).max() < 1e-9
    assert solution.forces["right_foot"][:, 2].sum() > 100.0


@pytest.mark.parametrize("kind", ["frame", "relative", "com", "look"])
def test_the_drift_is_that_of_the_motion(kind):
    """J' v + J a is the second difference of the error along a motion."""
    configuration, q = arm("GR1")
    task = {
        "frame": FrameTask("right_eef"),
        "relative": RelativeFrameTask("right_eef", "left_eef"),
        "com": ComTask(),
        "look": LookAtTask("head", target=(1.0, 0.2, 0.3)),
    }[kind]
    task.bind(configuration)
    space = DynamicsSpace(configuration, ())
    _, v = random_state(configuration, q, 4)
    drift = space.drift(task, q, v)
    h, rates = 1e-4, []
    for side in (h, -h):
        configuration.update(pin.integrate(configuration.model, q, side * v))
        rates.append(task.jacobian(configuration) @ v)
    assert drift == pytest.approx((rates[0] - rates[1]) / (2 * h), abs=1e-5)
    if kind == "frame":
        model, data = configuration.model, configuration.model.createData()
        pin.forwardKinematics(model, data, q, v, 0 * v)
        frame = model.getFrameId("right_eef")
        classical = pin.getFrameClassicalAcceleration(
            model, data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        )
        assert drift[:3] == pytest.approx(classical.linear, abs=1e-5)


def test_an_arm_without_limits_obeys_the_textbook_law():
    """With one task, a = J^+ (kp e - kd J v - J' v) in its rows."""
    configuration, q = arm()
    task = FrameTask("right_eef")
    goal = configuration.frame_pose("right_eef") * pin.exp6(np.full(6, 0.01))
    task.set_target(goal)
    stack = DynamicsStack(configuration, [task], kp=50.0)
    q, v = random_state(configuration, q, 1)
    solution = stack.solve(q, v, 0.002)
    assert np.abs(solution.missing["right_eef"]).max() < 1e-3
    model = configuration.model
    torque = pin.rnea(model, model.createData(), q, v, solution.a)
    np.testing.assert_allclose(torque, solution.tau, atol=1e-9)


def test_a_lower_level_leaves_the_level_above_alone():
    configuration, q = arm()
    hand = FrameTask("right_eef")
    hand.set_target(configuration.frame_pose("right_eef") * pin.exp6(np.full(6, 0.01)))
    posture = PostureTask(10.0, level=1)
    posture.set_target(pin.neutral(configuration.model))
    alone = DynamicsStack(configuration, [hand]).solve(
        q, 0 * q[: configuration.nv], 0.01
    )
    both = DynamicsStack(configuration, [hand, posture]).solve(
        q, 0 * q[: configuration.nv], 0.01
    )
    np.testing.assert_allclose(
        both.missing["right_eef"], alone.missing["right_eef"], atol=1e-6
    )
    assert np.abs(both.a - alone.a).max() > 0.1


def test_momentum_follows_its_target():
    configuration, q = humanoid()
    task = MomentumTask(target=np.zeros(6), cost=(1.0, 1.0), gain=3.0)
    stack = DynamicsStack(configuration, [task, PostureTask(1e-4)], contacts=FEET)
    q, v = random_state(configuration, q, 3)
    v *= 0.2
    solution = stack.solve(q, v, 0.002)
    model, data = configuration.model, configuration.model.createData()
    pin.computeCentroidalMomentumTimeVariation(model, data, q, v, solution.a)
    rate = data.dhg.vector + 3.0 * data.hg.vector
    np.testing.assert_allclose(rate, -solution.missing["momentum"], atol=1e-6)


def test_windows_keep_position_limits():
    configuration, q = arm()
    model = configuration.model
    posture = PostureTask(1.0)
    target = q.copy()
    target[0] = model.upperPositionLimit[0] + 1.0
    posture.set_target(target)
    stack = DynamicsStack(
        configuration,
        [posture],
        (PositionLimit(), VelocityLimit(), AccelerationLimit(20.0)),
    )
    v, dt = np.zeros(configuration.nv), 0.01
    for _ in range(600):
        v = v + dt * stack.solve(q, v, dt).a
        q = pin.integrate(model, q, dt * v)
        assert q[0] <= model.upperPositionLimit[0] + 1e-9
    assert q[0] == pytest.approx(model.upperPositionLimit[0], abs=1e-3)


def test_what_cannot_be_kept_falls_back_and_says_so():
    configuration, q = arm()
    model = configuration.model
    model.upperEffortLimit[:] = 0.5
    model.lowerEffortLimit[:] = -0.5
    stack = DynamicsStack(configuration, [PostureTask(1.0)], [AccelerationLimit(1.0)])
    solution = stack.solve(q, np.zeros(configuration.nv), 0.002)
    assert solution.fallback is not Fallback.NONE
    assert np.isfinite(solution.tau).all()
    assert "solved as stated" not in str(solution)


def test_wrong_names_and_numbers_are_refused():
    configuration, q = arm()
    tasks = [PostureTask(1.0)]
    with pytest.raises(UnknownNameError, match="task"):
        DynamicsStack(configuration, tasks, gains={"hand": (1.0, 1.0)})
    with pytest.raises(UnknownNameError, match="frame"):
        DynamicsStack(configuration, tasks, contacts=[Contact(frame="foot")])
    stack = DynamicsStack(configuration, tasks)
    v = np.zeros(configuration.nv)
    for bad in ((q[:-1], v, 0.1), (q, v * np.nan, 0.1), (q, v, 0.0)):
        with pytest.raises(ConfigError):
            stack.solve(*bad)


@pytest.mark.slow
def test_a_humanoid_stands_in_simulation_and_moves_its_hand():
    robot = load_robot("GR1FreeBody")
    spec = empty_arena()
    attach_robot(spec, robot, "robot0_")
    model = spec.compile()
    data = mujoco.MjData(model)
    state = RobotState(model, data, robot, prefix="robot0_")
    posture = robot.keyframe("ready")
    places, _ = state.joint_addresses(tuple(posture))
    data.qpos[places] = list(posture.values())
    data.qpos[:7] = (*robot.root.pos, *robot.root.quat)
    configuration = Configuration(robot.to_pinocchio())
    configuration.update(state.q)
    tasks = standing_tasks(configuration)
    goal = configuration.frame_pose("right_eef")
    goal.translation += [0.05, -0.05, 0.1]
    tasks[1].set_target(goal)
    gains = {"right_eef": (600.0, 50.0), "left_eef": (600.0, 50.0)}
    stack = DynamicsStack(configuration, tasks, LIMITS, contacts=FEET, gains=gains)
    names = list(configuration.model.names)[2:]
    order = [names.index(name) for name in state.actuators]
    height = data.qpos[2]
    for _ in range(400):
        mujoco.mj_step1(model, data)
        solution = stack.solve(state.q, state.v, model.opt.timestep)
        data.ctrl[state.actuator_ids] = solution.tau[order]
        mujoco.mj_step2(model, data)
    assert data.qpos[2] == pytest.approx(height, abs=0.02)
    mujoco.mj_kinematics(model, data)
    hand = data.site("robot0_right_eef").xpos
    assert hand == pytest.approx(goal.translation, abs=0.01)
