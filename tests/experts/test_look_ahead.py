"""The look-ahead against the robot's own kinematics."""

import itertools

import numpy as np
import pinocchio as pin
import pytest

import wbc_suite
from wbc_suite.evaluation import make_policy
from wbc_suite.experts import look_ahead
from wbc_suite.experts.grasp_choice import Approach, choose_grasp
from wbc_suite.experts.look_ahead import LookAhead
from wbc_suite.experts.scene import ExpertScene
from wbc_suite.experts.skills import close_in, come_before
from wbc_suite.kinematics import Configuration

MOVING = "waist", *(f"{s}_{j}" for s in ("left", "right") for j in ("sh", "el", "wr"))
ARM = "sh0", "sh1", "el0", "el1", "wr0", "wr1"


@pytest.fixture(scope="module")
def scene():
    env = wbc_suite.make("Lift", robots="Panda")
    env.reset(seed=0)
    return ExpertScene(env, env.benchmark, np.random.default_rng(0))


def shifted(pose, offset):
    return pin.SE3(pose.rotation, pose.translation + np.asarray(offset))


def test_poses_in_reach_are_met_by_the_configurations_found(scene):
    (arm,) = scene.arms
    poses = [shifted(arm.pose, o) for o in ((0.1, 0.0, 0.0), (0.1, 0.1, -0.1))]
    prediction = arm.look_ahead(poses)
    assert prediction.error < 1e-3
    robot = Configuration(arm.state.robot.to_pinocchio())
    for q, pose in zip(prediction.q, poses, strict=True):
        robot.update(arm.configuration(q))
        found = robot.frame_pose(arm.hand.frame)
        assert np.linalg.norm(found.translation - pose.translation) < 1e-3
        low, high = robot.model.lowerPositionLimit, robot.model.upperPositionLimit
        assert ((robot.q >= low - 1e-9) & (robot.q <= high + 1e-9)).all()


def test_a_pose_out_of_reach_costs_more_than_any_other(scene):
    (arm,) = scene.arms
    near = arm.look_ahead([shifted(arm.pose, (0.1, 0.0, 0.0))])
    far = arm.look_ahead([shifted(arm.pose, (1.5, 0.0, 0.0))])
    assert far.error > 0.5
    assert far.cost > near.cost + 50.0


def test_a_look_ahead_with_a_bound_leaves_only_what_costs_more(scene):
    (arm,) = scene.arms
    rng = np.random.default_rng(0)
    left = 0
    for _ in range(40):
        chain = [shifted(arm.pose, rng.uniform(-0.25, 0.25, 3)) for _ in range(2)]
        whole = arm.look_ahead(chain)
        most = rng.uniform(0.3, 3.0)
        found = arm.look_ahead(chain, most=most)
        assert (found.cost > most) == (whole.cost > most)
        if found.cost > most:
            left += 1
        else:
            assert found.cost == whole.cost
    assert 10 < left < 30


def test_a_sweep_ends_at_the_pose_of_its_joints(scene):
    (arm,) = scene.arms
    goal = shifted(arm.pose, (0.1, 0.1, -0.1))
    q, period = arm.look_ahead([goal]).q[-1], 0.05
    poses = arm.sweep(q, period)
    assert poses[-1].isApprox(goal, 2e-3)
    way = np.abs(q - arm.home_joints)
    speed = arm.state.robot.to_pinocchio().velocityLimit[:7]
    assert len(poses) == np.ceil((way / speed).max() / 0.4 / period)
    steps = [
        np.linalg.norm(b.translation - a.translation)
        for a, b in itertools.pairwise(poses)
    ]
    assert max(steps) < 2.0 * np.mean(steps)


def test_a_chain_in_two_parts_is_the_chain(scene):
    (arm,) = scene.arms
    a, b = (shifted(arm.pose, o) for o in ((0.05, 0.0, 0.0), (0.0, 0.1, 0.0)))
    whole, parts = (
        arm.look_ahead([a, b]),
        arm.look_ahead([b], after=arm.look_ahead([a])),
    )
    np.testing.assert_allclose(parts.q[-1], whole.q[-1], atol=1e-6)
    assert parts.duration == pytest.approx(whole.duration, rel=1e-6)
    assert parts.error == pytest.approx(whole.error, abs=1e-9)


@pytest.mark.slow
def test_a_configuration_in_the_table_is_not_clear(scene):
    (arm,) = scene.arms
    into = shifted(arm.pose, (0.0, 0.0, -0.3))
    q = arm.configuration(arm.look_ahead([into]).q[-1])
    assert scene.overlap(arm, q, but="cube") > 0.01
    here = arm.configuration(arm.look_ahead([arm.pose]).q[-1])
    assert scene.overlap(arm, here, but="cube") == 0.0


@pytest.mark.slow
def test_open_fingers_meet_what_lies_beside_an_object_and_closed_ones_do_not():
    env = wbc_suite.make("Stack", robots="Panda")
    env.reset(seed=0)
    scene = ExpertScene(env, env.benchmark, np.random.default_rng(0))
    (arm,) = scene.arms
    a, b = (env.benchmark.states[name] for name in ("cubeA", "cubeB"))
    a.move((0.0, 0.0, 0.82))
    at = pin.SE3(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 0.83]))
    q = arm.configuration(arm.look_ahead([at]).q[-1])
    fingers = arm.closing("pinch")
    for y, is_met in ((0.07, True), (0.15, False)):
        b.move((0.0, y, 0.825))
        depths = [scene.overlap(arm, q, but="cubeA", fingers=f) for f in fingers]
        assert (depths[0] > 0.003) == is_met
        assert depths[-1] == 0.0


def test_a_choice_of_grasp_among_many_ways_descends_to_few_poses(monkeypatch):
    """18 grasps and 16 places of 3 poses each: 918 descents, if none is left out."""
    env = wbc_suite.make("PickPlaceCan", robots="Panda")
    env.reset(seed=7000)
    descents, descend = [], look_ahead.descend
    monkeypatch.setattr(
        look_ahead, "descend", lambda *a: descents.append(a) or descend(*a)
    )
    policy = make_policy("expert", env, 7000)
    for _ in range(22):
        env.step(policy({}))
    assert 100 < len(descents) < 500


@pytest.mark.slow
def test_a_hand_beside_its_way_stays_back():
    env = wbc_suite.make("Lift", robots="Panda")
    env.reset(seed=0)
    scene = ExpertScene(env, env.benchmark, np.random.default_rng(0))
    choice = choose_grasp(scene, "cube", arms=scene.arms, approach=Approach())

    def run(skill):
        for _ in skill:
            env.step(scene.action())
            yield choice.hand_at(scene.pose("cube")).actInv(choice.arm.pose).translation

    assert all(len(place) == 3 for place in run(come_before(scene, choice)))
    x, y, z = scene.object("cube").position
    scene.object("cube").move((x, y + 0.04, z))
    places = np.array([*run(close_in(scene, "cube", choice))])
    beside, back = np.linalg.norm(places[:, :2], axis=1), -places[:, 2]
    assert beside[0] > 0.02
    assert back[beside > 0.015].min() > 0.04
    assert np.linalg.norm(places[-1]) < 0.006


@pytest.mark.slow
def test_a_hand_presses_nothing_into_the_table():
    """Scene 9019: a finger that missed its way by 4 mm pressed cube B 25 mm deep."""
    env = wbc_suite.make("Stack", robots="Panda", horizon=120)
    env.reset(seed=9019)
    policy, deepest = make_policy("expert", env, 9019), 0.0
    for _ in range(120):
        *_, info = env.step(policy({}))
        deepest = max(deepest, info["penetration"])
    assert info["success"]
    assert 0.0 < deepest < 0.003


@pytest.mark.slow
def test_a_cube_that_slips_away_is_grasped_again():
    env = wbc_suite.make("Lift", robots="Panda", horizon=300)
    env.reset(seed=3)
    policy, cube = make_policy("expert", env, 3), env.benchmark.states["cube"]
    moved = False
    for _ in range(300):
        *_, info = env.step(policy({}))
        if not moved and env.benchmark.scene.grasped("cube"):
            moved = True
            cube.move((0.06, -0.05, 0.83))
        if info["success"] and moved:
            break
    assert moved
    assert info["success"]


@pytest.mark.slow
def test_both_hands_of_a_shared_waist_meet_their_poses():
    env = wbc_suite.make("TwoArmLift", robots="GR1", controller_configs="WHOLE_BODY_IK")
    env.reset(seed=0)
    arms = ExpertScene(env, env.benchmark, np.random.default_rng(0)).arms
    assert arms[0].shares_joints(arms[1])
    robot = Configuration(arms[0].state.robot.to_pinocchio())
    joints = [n for n in arms[0].state.robot.joint_names if n.startswith(MOVING)]
    frames = [arm.hand.frame for arm in arms]
    robot.update(arms[0].state.q)
    # Turning the waist brings one hand forward and takes the other back.
    poses = [robot.frame_pose(frame) for frame in frames]
    apart = [shifted(p, (x, 0.0, 0.0)) for p, x in zip(poses, (0.3, 0.0), strict=True)]
    look_ahead = LookAhead(arms[0].state, joints, *frames)
    prediction = look_ahead.along([apart])
    assert prediction.error < 1e-3
    robot.update(look_ahead.full(prediction.q[-1]))
    for frame, pose in zip(frames, apart, strict=True):
        found = robot.frame_pose(frame)
        assert np.linalg.norm(found.translation - pose.translation) < 1e-3
    both = [shifted(p, (x, 0.0, 0.0)) for p, x in zip(poses, (0.4, -0.4), strict=True)]
    assert look_ahead.along([both]).error > max(
        arm.look_ahead([pose]).error for arm, pose in zip(arms, both, strict=True)
    )


@pytest.mark.slow
def test_the_trunk_of_a_robot_on_its_feet_stays_where_it_is():
    env = wbc_suite.make(
        "Lift", robots="SpotWithArm", controller_configs="WHOLE_BODY_IK"
    )
    env.reset(seed=0)
    (arm,) = ExpertScene(env, env.benchmark, np.random.default_rng(0)).arms
    model = arm.state.robot.to_pinocchio()
    own = [model.joints[model.getJointId(f"arm_{j}")].idx_q for j in ARM]
    others = np.setdiff1d(np.arange(model.nq), own)
    before, away = arm.state.q, shifted(arm.pose, (2.0, 0.0, 0.0))
    q = arm.configuration(arm.look_ahead([away]).q[-1])
    np.testing.assert_array_equal(q[others], before[others])
    assert np.abs(q[own] - before[own]).max() > 0.1


@pytest.mark.slow
def test_a_torso_that_stays_upright_does_not_help_a_hand_to_reach():
    env = wbc_suite.make("Reach", robots="GR1FreeBody")
    env.reset(seed=0)
    arm = ExpertScene(env, env.benchmark, np.random.default_rng(0)).arms[0]
    model = arm.state.robot.to_pinocchio()
    waist = [
        j.idx_q for n, j in zip(model.names, model.joints, strict=True) if "waist" in n
    ]
    before, away = arm.state.q, shifted(arm.pose, (0.5, 0.0, -0.2))
    q = arm.configuration(arm.look_ahead([away]).q[-1])
    np.testing.assert_array_equal(q[waist], before[waist])


def test_dexterity_is_the_bound_of_the_least_singular_value(scene):
    (arm,) = scene.arms
    robot = Configuration(arm.state.robot.to_pinocchio())
    robot.update(arm.state.q)
    values = np.linalg.svd(robot.frame_jacobian(arm.hand.frame)[:, :7])[1]
    found = arm.look_ahead([arm.pose]).dexterity
    assert found == pytest.approx((values**-2.0).sum() ** -0.5, rel=1e-6)
    assert found < values[-1]
