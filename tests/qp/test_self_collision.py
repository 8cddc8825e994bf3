"""Distances and their derivative against brute force; no penetration under attack."""

import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.errors import ConfigError
from wbc_suite.kinematics import Configuration
from wbc_suite.qp import (
    FrameTask,
    LimitKind,
    PostureTask,
    SelfCollisionLimit,
    TaskStack,
)
from wbc_suite.qp.self_collision_rows import segment_parameters
from wbc_suite.robot import load_robot
from wbc_suite.robot.collision_capsules import collision_pairs, enclosing_capsules

DT = 5e-3


def gr1() -> tuple:
    """Return GR1 and its configuration in the posture that it is ready in."""
    robot = load_robot("GR1", root="fixed")
    model = robot.to_pinocchio()
    q = pin.neutral(model)
    for joint, value in robot.keyframes["ready"].items():
        q[model.joints[model.getJointId(joint)].idx_q] = value
    return robot, Configuration(model, q)


def all_distances(robot, configuration) -> np.ndarray:
    """Return the distance of every allowed capsule pair, one by one."""
    capsules, pairs = enclosing_capsules(robot), collision_pairs(robot)
    ends = []
    for c in capsules:
        pose = configuration.frame_pose(c.link)
        ends.append((pose.act(np.asarray(c.start)), pose.act(np.asarray(c.end))))
    out = []
    for i, a in enumerate(capsules):
        for j, b in enumerate(capsules[:i]):
            if frozenset((a.link, b.link)) in pairs:
                s, t = segment_parameters(*ends[i], *ends[j])
                p = ends[i][0] + s * (ends[i][1] - ends[i][0])
                q = ends[j][0] + t * (ends[j][1] - ends[j][0])
                out.append(np.linalg.norm(p - q) - a.radius - b.radius)
    return np.sort(out)


def test_nearest_points_beat_a_grid(rng):
    grid = np.linspace(0, 1, 101)
    for k in range(200):
        p0, p1, q0, q1 = rng.normal(size=(4, 3))
        if k % 4 == 1:
            q1 = q0 + (p1 - p0) * rng.normal()  # parallel
        if k % 4 == 2:
            p1 = p0.copy()  # a point
        if k % 8 == 6:
            q1 = q0.copy()
        s, t = segment_parameters(p0, p1, q0, q1)
        assert 0 <= s <= 1
        assert 0 <= t <= 1
        ours = np.linalg.norm(p0 + s * (p1 - p0) - q0 - t * (q1 - q0))
        P = p0 + grid[:, None] * (p1 - p0)
        Q = q0 + grid[:, None] * (q1 - q0)
        best = np.linalg.norm(P[:, None] - Q[None], axis=2).min()
        assert ours <= best + 1e-12


@pytest.mark.slow
def test_rows_are_the_nearest_pairs_and_the_derivative_of_their_distance(rng):
    robot, configuration = gr1()
    capsules, pairs = enclosing_capsules(robot), collision_pairs(robot)
    limit = SelfCollisionLimit(capsules, pairs)
    limit.bind(configuration)
    model = configuration.model
    for _ in range(5):
        q = rng.uniform(model.lowerPositionLimit, model.upperPositionLimit) * 0.7
        configuration.update(q)
        G, h = np.zeros((limit.dim, model.nv)), np.zeros(limit.dim)
        limit.rows(configuration, DT, G, h)
        used = limit.found >= 0
        expected = all_distances(robot, configuration)
        expected = expected[expected < limit.influence][: limit.dim]
        np.testing.assert_allclose(limit.distances[used], expected, atol=1e-12)
        found, before = limit.found.copy(), limit.distances.copy()
        for i in rng.permutation(model.nv)[:10]:
            dq = np.zeros(model.nv)
            dq[i] = 1e-7
            configuration.update(q + dq)
            limit.rows(configuration, DT, np.zeros_like(G), h.copy())
            for row in np.flatnonzero(used):
                at = np.flatnonzero(limit.found == found[row])
                if len(at):
                    slope = (limit.distances[at[0]] - before[row]) / 1e-7
                    assert slope == pytest.approx(-G[row, i], abs=1e-5)
        configuration.update(q)


def test_pairs_remembered_from_tick_to_tick_are_those_sought_anew(rng):
    robot, configuration = gr1()
    capsules, pairs = enclosing_capsules(robot), collision_pairs(robot)
    limit = SelfCollisionLimit(capsules, pairs)
    limit.bind(configuration)
    anew = SelfCollisionLimit(capsules, pairs)
    anew.bind(configuration)
    model = configuration.model
    q, listed = configuration.q.copy(), set()
    for k in range(400):
        stride = 1.0 if k % 50 == 49 else 0.02  # a jump among small steps
        q = q + stride * rng.normal(size=model.nq)
        q = np.clip(q, model.lowerPositionLimit, model.upperPositionLimit)
        configuration.update(q)
        G, h = np.zeros((limit.dim, model.nv)), np.zeros(limit.dim)
        limit.rows(configuration, DT, G, h)
        anew.reset()
        G_anew, h_anew = np.zeros_like(G), np.zeros_like(h)
        anew.rows(configuration, DT, G_anew, h_anew)
        np.testing.assert_array_equal(limit.found, anew.found)
        np.testing.assert_array_equal(limit.distances, anew.distances)
        np.testing.assert_array_equal(G, G_anew)
        np.testing.assert_array_equal(h, h_anew)
        listed.add(limit.listed_count)
    assert 3 < len(listed) < 200  # lists were made anew at times, not at every step
    assert max(listed) < limit.pair_count


def test_pairs_that_overlap_in_a_keyframe_are_left_out():
    robot, configuration = gr1()
    crossed = {"left_hip_roll_joint": -0.3, "right_hip_roll_joint": 0.3}
    robot = robot.model_copy(
        update={"keyframes": {**robot.keyframes, "crossed": crossed}}
    )
    limit = SelfCollisionLimit.of_robot(robot)
    limit.bind(configuration)
    q = configuration.q.copy()
    for joint, angle in crossed.items():
        q[configuration.model.joints[configuration.joint_id(joint)].idx_q] = angle
    configuration.update(q)
    G, h = np.zeros((limit.dim, configuration.nv)), np.zeros(limit.dim)
    limit.rows(configuration, DT, G, h)
    assert limit.distances[0] >= limit.margin
    assert all_distances(robot, configuration)[0] < 0.0


def attack(seconds: float, seed: int) -> tuple[float, set]:
    """Throw random targets at GR1's hands; return the least distance and the kinds."""
    robot, configuration = gr1()
    rng = np.random.default_rng(seed)
    hands = [FrameTask("right_eef"), FrameTask("left_eef")]
    limit = SelfCollisionLimit.of_robot(robot)
    stack = TaskStack(
        configuration,
        [*hands, PostureTask(1e-2)],
        limits=[limit],
    )
    least, kinds = np.inf, set()
    start = [hand.target for hand in hands]
    for k in range(round(seconds / DT)):
        if k % 100 == 0:
            for hand, home in zip(hands, start, strict=True):
                place = home.translation + rng.uniform(-0.5, 0.5, 3)
                place[0], place[1] = rng.uniform(-0.3, 0.4), rng.uniform(-0.4, 0.4)
                hand.set_target(pin.SE3(pin.exp3(rng.normal(size=3)), place))
        solution = stack.solve(DT)
        assert np.isfinite(solution.dq).all()
        kinds |= {a.kind for a in solution.active}
        configuration.update(configuration.integrate(solution.dq))
        G, h = np.zeros((limit.dim, configuration.nv)), np.zeros(limit.dim)
        limit.rows(configuration, DT, G, h)
        least = min(least, limit.distances[0])
    return least, kinds


@pytest.mark.slow
def test_hands_never_touch_the_body():
    least, kinds = attack(6.0, seed=1)
    assert least > 0.0
    assert LimitKind.SELF_COLLISION in kinds


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 3])
def test_hands_never_touch_the_body_in_a_minute(seed):
    least, _ = attack(60.0, seed=seed)
    assert least > 0.0


@pytest.mark.parametrize("name", ["GR1", "SpotWithArm", "Tiago"])
@pytest.mark.parametrize("seed", [0, 1])
def test_a_robot_that_starts_inside_itself_comes_out_smoothly(name, seed):
    robot = load_robot(name, root="fixed")
    model = robot.to_pinocchio()
    configuration = Configuration(model)
    limit = SelfCollisionLimit.of_robot(robot)
    posture = PostureTask(0.1)
    stack = TaskStack(configuration, [posture], limits=[limit])
    posture.set_target(ready(robot, model))
    configuration.update(inside_itself(limit, configuration, seed))
    changes, v = [], np.zeros(model.nv)
    for _ in range(round(8.0 / DT)):
        solution = stack.solve(DT)
        configuration.update(configuration.integrate(solution.dq))
        changes.append(np.abs(solution.v - v).max())
        v = solution.v
    assert max(changes) <= 50.0 * DT + 1e-9  # the acceleration limit, from the start
    assert np.percentile(changes[-round(1.0 / DT) :], 99) <= 0.01  # rad/s
    assert limit.distances[0] > 0.0


def ready(robot, model) -> np.ndarray:
    q = pin.neutral(model)
    for joint, value in robot.keyframe("ready").items():
        q[model.joints[model.getJointId(joint)].idx_q] = value
    return q


def inside_itself(limit, configuration, seed) -> np.ndarray:
    """Return a random posture with links at least 3 cm inside each other."""
    rng, model = np.random.default_rng(seed), configuration.model
    G, h = np.zeros((limit.dim, model.nv)), np.zeros(limit.dim)
    while True:
        low, high = model.lowerPositionLimit, model.upperPositionLimit
        configuration.update(rng.uniform(np.clip(low, -3, 3), np.clip(high, -3, 3)))
        limit.rows(configuration, DT, G, h)
        if limit.distances[0] < -0.03:
            return configuration.q.copy()


def test_wrong_numbers_are_refused():
    with pytest.raises(ConfigError, match="more than the margin"):
        SelfCollisionLimit((), (), margin=0.2, influence=0.1)
