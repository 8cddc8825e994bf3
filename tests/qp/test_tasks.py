"""Every Jacobian against finite differences of its own error."""

import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.kinematics import Configuration
from wbc_suite.qp import (
    ComTask,
    DampingTask,
    FrameTask,
    JointCouplingTask,
    LookAtTask,
    PostureTask,
    RelativeFrameTask,
    TaskStack,
)

STEP = 1e-6  # central differences of smooth maps: error about 1e-8


def random_pose(rng: np.random.Generator) -> pin.SE3:
    return pin.exp6(rng.normal(size=6))


def tasks_with_jacobian(rng):
    return [
        FrameTask("rarm_wrist2_joint", target=random_pose(rng)),
        FrameTask("lleg_wrist2_joint", target=random_pose(rng)),
        ComTask(target=rng.normal(size=3)),
        RelativeFrameTask(
            "rarm_wrist2_joint", "lleg_elbow_joint", target=random_pose(rng)
        ),
        RelativeFrameTask("chest2_joint", "larm_wrist2_joint", target=random_pose(rng)),
        LookAtTask("head2_joint", axis=(0.0, 1.0, 2.0), target=rng.normal(size=3)),
        JointCouplingTask(
            "larm_elbow_joint", "rarm_elbow_joint", ratio=-0.7, offset=0.1
        ),
    ]


@pytest.mark.parametrize("index", range(7))
def test_jacobian_is_minus_the_derivative_of_the_error(humanoid, rng, index):
    task = tasks_with_jacobian(rng)[index]
    task.bind(humanoid)
    for _ in range(5):
        dq0 = rng.normal(size=humanoid.nv) * 0.3
        q = humanoid.integrate(dq0)
        humanoid.update(q)
        J = np.array(task.jacobian(humanoid))
        numeric = np.empty_like(J)
        for i in range(humanoid.nv):
            dq = np.zeros(humanoid.nv)
            dq[i] = STEP
            humanoid.update(pin.integrate(humanoid.model, q, dq))
            ahead = task.error(humanoid)
            humanoid.update(pin.integrate(humanoid.model, q, -dq))
            numeric[:, i] = -(ahead - task.error(humanoid)) / (2 * STEP)
        humanoid.update(q)
        np.testing.assert_allclose(J, numeric, atol=2e-7)


@pytest.mark.parametrize("behind", [(-1, 0, 0), (-1, 0, 0.1), (-1, 1e-9, 0)])
def test_looking_at_a_point_behind_turns_round(behind):
    """A camera on a vertical axis; the chord to the point pulls nowhere there."""
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "pan")
    model.addFrame(
        pin.Frame("camera", joint, 0, pin.SE3.Identity(), pin.FrameType.BODY)
    )
    camera = Configuration(model, np.zeros(1))
    task = LookAtTask("camera", target=np.array(behind, dtype=float))
    stack = TaskStack(camera, [task])
    assert np.linalg.norm(task.error(camera)) > np.pi - 0.35
    for _ in range(150):
        camera.update(camera.integrate(stack.solve(0.01).dq))
    assert abs(camera.q[0]) == pytest.approx(np.pi, abs=1e-3)


def test_the_error_of_looking_is_the_angle_to_the_point(arm, rng):
    for _ in range(20):
        point = arm.frame_pose("hand").translation + rng.normal(size=3)
        task = LookAtTask("hand", axis=(0.0, 0.0, 1.0), target=point)
        task.bind(arm)
        pose = arm.frame_pose("hand")
        way = point - pose.translation
        angle = np.arccos(pose.rotation[:, 2] @ way / np.linalg.norm(way))
        if angle < np.pi - 0.35:
            assert np.linalg.norm(task.error(arm)) == pytest.approx(angle, abs=1e-9)
        turned = pin.exp3(pose.rotation @ task.error(arm)) @ pose.rotation[:, 2]
        if angle < np.pi - 0.35:
            np.testing.assert_allclose(turned, way / np.linalg.norm(way), atol=1e-9)


def test_looking_at_a_point_within_the_frame_backs_off(arm):
    start = arm.frame_pose("hand")
    task = LookAtTask("hand", target=start.translation + np.array([1e-3, 0.0, 2e-3]))
    stack = TaskStack(arm, [task])
    J, numeric, q = task.jacobian(arm), np.empty((3, arm.nv)), arm.q.copy()
    for i, dq in enumerate(STEP * np.eye(arm.nv)):
        arm.update(q + dq)
        ahead = task.error(arm)
        arm.update(q - dq)
        numeric[:, i] = -(ahead - task.error(arm)) / (2 * STEP)
    np.testing.assert_allclose(J, numeric, atol=1e-6)  # 1 / r is 50 / m here
    arm.update(q)
    for _ in range(400):
        arm.update(arm.integrate(stack.solve(5e-3).dq))
    assert np.linalg.norm(task.error(arm)) < 1e-3
    away = np.linalg.norm(arm.frame_pose("hand").translation - task.target)
    assert 0.019 < away < 0.03


@pytest.mark.parametrize("angle", [1e-9, 1e-3, 1.0, np.pi - 1e-6])
def test_frame_error_and_jacobian_are_those_of_pinocchio(humanoid, rng, angle):
    for frame in ("rarm_wrist2_joint", "lleg_wrist2_joint", "chest2_joint"):
        turn = pin.SE3(pin.exp3(angle * np.array([0.6, 0.0, 0.8])), rng.normal(size=3))
        task = FrameTask(frame, target=humanoid.frame_pose(frame) * turn)
        task.bind(humanoid)
        pose, target = humanoid.frame_pose(frame), task.target
        rotation = pin.log3(pose.rotation.T @ target.rotation)
        error = np.concatenate([target.translation - pose.translation, rotation])
        J = humanoid.frame_jacobian(frame, "aligned")
        J[3:] = pin.Jlog3(pin.exp3(-rotation)) @ pose.rotation.T @ J[3:]
        np.testing.assert_allclose(task.error(humanoid), error, atol=1e-9)
        np.testing.assert_allclose(task.jacobian(humanoid), J, atol=1e-8)


def test_normal_equations_agree_with_matrix_product(humanoid, rng):
    stack = TaskStack(
        humanoid,
        [FrameTask(n, target=random_pose(rng)) for n in ("chest2_joint",)]
        + [ComTask(target=rng.normal(size=3)), PostureTask(0.3)],
        damping=1e-2,
    )
    humanoid.update(humanoid.integrate(rng.normal(size=humanoid.nv) * 0.2))
    stack.solve(5e-3)
    level, problem = stack.levels[0].qp, stack.problem()
    mu = 1e-2 + np.abs(level.e) @ np.abs(level.W).max(axis=1)
    H = level.W.T @ level.W + np.diag(level.diagonal[0] + mu)
    c = -level.W.T @ level.e - level.diagonal[1]
    np.testing.assert_allclose(problem.H, H, atol=1e-12)
    np.testing.assert_allclose(problem.c, c, atol=1e-12)


def test_rows_are_weighted_jacobian_and_saturated_step(humanoid, rng):
    dt = 1e-2
    for task in tasks_with_jacobian(rng):
        stack = TaskStack(humanoid, [task])
        stack.solve(dt)
        rows = stack.levels[0].qp
        error = task.error(humanoid)
        expected = task.cost[:, None] * task.jacobian(humanoid)
        np.testing.assert_allclose(rows.W, expected, atol=1e-12)
        step = error.copy()
        parts = slice(task.angular_start), slice(task.angular_start, None)
        for part, speed in zip(parts, task.max_speeds, strict=True):
            length = np.linalg.norm(step[part])
            if length > speed * dt:
                step[part] *= speed * dt / length
        np.testing.assert_allclose(rows.e, task.cost * step, atol=1e-12)
        assert np.abs(step).max() < np.abs(error).max()  # some are saturated


def test_every_task_is_met_at_rest(humanoid, rng):
    tasks = [
        RelativeFrameTask("rarm_wrist2_joint", "chest2_joint"),
        LookAtTask("head2_joint", target=np.array([2.0, 0.5, 0.5])),
        JointCouplingTask("larm_elbow_joint", "larm_wrist1_joint", ratio=0.5),
        DampingTask(1e-3),
    ]
    target = pin.SE3(pin.exp3(rng.normal(size=3) * 0.2), rng.normal(size=3) * 0.05)
    stack = TaskStack(humanoid, tasks)
    tasks[0].set_target(tasks[0].target * target)
    for _ in range(600):
        humanoid.update(humanoid.integrate(stack.solve(1e-2).dq))
    for task in tasks[:3]:
        assert np.linalg.norm(task.error(humanoid)) < 1e-4


def test_posture_error_is_zero_at_target_and_ignores_root(humanoid):
    task = PostureTask(1.0)
    task.bind(humanoid)
    np.testing.assert_array_equal(task.error(humanoid), 0.0)
    np.testing.assert_array_equal(task.squared_costs[:6], 0.0)
    np.testing.assert_array_equal(task.squared_costs[6:], 1.0)


def test_posture_of_a_free_root_is_a_difference_of_poses(humanoid, rng):
    costs = {"root_joint": 2.0}
    target = humanoid.integrate(rng.normal(size=humanoid.nv) * 0.1)
    task = PostureTask(1.0, costs=costs, target=target, max_speed=1e3)
    stack = TaskStack(humanoid, [task])
    stack.solve(1e-2)
    error = pin.difference(humanoid.model, humanoid.q, target)
    weights, steps = stack.levels[0].qp.diagonal
    np.testing.assert_array_equal(weights[:6], 4.0)
    np.testing.assert_allclose(steps, weights * error, atol=1e-12)


def test_steps_are_saturated(arm):
    far = arm.frame_pose("hand")
    far.translation = far.translation + np.array([9.0, 0.0, 0.0])
    task = FrameTask("hand", target=far, position_cost=2.0)
    stack = TaskStack(arm, [task])
    stack.solve(0.01)
    e = stack.levels[0].qp.e
    np.testing.assert_allclose(e, [2.0 * 0.01, 0, 0, 0, 0, 0], atol=1e-12)


def test_unknown_frame_names_the_nearest(arm):
    with pytest.raises(UnknownNameError, match="Did you mean 'hand'"):
        TaskStack(arm, [FrameTask("hnad")])


def test_wrong_arguments_are_refused(arm: Configuration):
    with pytest.raises(ConfigError, match="gain"):
        FrameTask("hand", gain=0.0)
    with pytest.raises(ConfigError, match="not negative"):
        FrameTask("hand", position_cost=-1.0)
    with pytest.raises(ConfigError, match="not a rotation"):
        FrameTask("hand", target=np.diag([2.0, 1.0, 1.0, 1.0]))
    with pytest.raises(ConfigError, match=r"dt, a time, is .* greater than 0"):
        TaskStack(arm, [FrameTask("hand")]).solve(0.0)
