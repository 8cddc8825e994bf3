"""What actions of OSC_POSE and OSC_POSITION mean."""

import numpy as np
import pinocchio as pin
import pytest
from osc_rig import OscRig

from wbc_suite.control import load_composite_controller_config
from wbc_suite.control.part.osc_controller import OscConfig
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.robot import load_robot

X = np.eye(6)[0]
ARMS = ("Panda", "Sawyer", "UR5e", "Baxter", "Tiago", "PandaOmron")


def stepped(pose, step):
    """Return a pose shifted and turned along the world's axes."""
    turn = pin.exp3(step[3:])
    return pin.SE3(turn @ pose.rotation, pose.translation + step[:3])


@pytest.fixture
def rig(alone):
    return lambda name="Panda", **settings: OscRig(alone, name, **settings)


@pytest.mark.parametrize(
    ("kind", "mode", "size"),
    [
        ("OSC_POSE", "fixed", 6),
        ("OSC_POSE", "variable_kp", 12),
        ("OSC_POSE", "variable", 18),
        ("OSC_POSITION", "fixed", 3),
        ("OSC_POSITION", "variable_kp", 9),
        ("OSC_POSITION", "variable", 15),
    ],
)
@pytest.mark.parametrize("name", ["Panda", "Baxter"])
def test_the_action_has_the_table_s_size_and_order(rig, name, kind, mode, size):
    one = rig(name, type=kind, impedance_mode=mode)
    slices = [s for s in one.controller.layout.slices if s.name.startswith("right")]
    slices = [s for s in slices if s.kind != "gripper"]
    assert sum(len(s.labels) for s in slices) == size
    names = ["right", "right_kp", "right_kd"]
    assert [s.name for s in slices] == names[: len(slices)]
    motion = slices[0]
    assert motion.kind == ("pose" if kind == "OSC_POSE" else "position")
    assert motion.labels == ("x", "y", "z", "rx", "ry", "rz")[: len(motion.labels)]
    units = (("0.05 m",) * 3 + ("0.5 rad",) * 3)[: len(motion.labels)]
    assert tuple(map(str, motion.units)) == units
    for gains, high in zip(slices[1:], (500.0, 100.0), strict=False):
        assert (gains.low, gains.high) == ((0.0,) * 6, (high,) * 6)


def test_absolute_bounds_are_the_limits_of_goals(rig):
    limits = ((0.2, -0.3, 0.1), (0.7, 0.3, 0.6))
    one = rig(input_type="absolute", position_limits=limits)
    part = one.controller.layout["right"]
    assert part.low == (*limits[0], *(-2.0 * np.pi,) * 3)
    assert part.high == (*limits[1], *(2.0 * np.pi,) * 3)
    assert tuple(map(str, part.units)) == ("m",) * 3 + ("rad",) * 3


def test_the_input_range_scales_steps(rig):
    one = rig(input_min=-2.0, input_max=2.0, output_max=0.1, output_min=-0.1)
    part = one.controller.layout["right"]
    assert (part.low[0], part.high[0], str(part.units[0])) == (-2.0, 2.0, "0.05 m")
    start = one.position
    one.act(2.0 * X)
    np.testing.assert_allclose(one.part.goal.translation - start, [0.1, 0, 0])


@pytest.mark.sample(12)
@pytest.mark.slow
@pytest.mark.parametrize("name", ARMS)
@pytest.mark.parametrize("frame", ["world", "base", "eef"])
@pytest.mark.parametrize("mode", ["achieved", "desired"])
def test_zero_steps_hold_the_hand(rig, name, frame, mode):
    settings = {"input_ref_frame": frame, "goal_update_mode": mode}
    for more in ({}, {"interpolation": "linear"}, {"disturbance_observer": 20.0}):
        one = rig(name, **settings, **more)
        start = one.pose
        one.act(np.zeros(6), 40)
        assert np.linalg.norm(one.position - start.translation) < 1e-7
        assert np.linalg.norm(pin.log3(start.rotation.T @ one.pose.rotation)) < 1e-7


def test_the_hold_action_keeps_an_absolute_goal(rig):
    one = rig(input_type="absolute", input_ref_frame="world")
    start = one.pose
    one.act(one.controller.hold_action[:6], 20)
    np.testing.assert_allclose(one.pose.homogeneous, start.homogeneous, atol=1e-9)


def test_a_load_does_not_creep_while_the_hand_steps_aside(rig):
    """Steps count from where the hand is, but only along axes that they move."""
    stiffness = 300.0
    one = rig(goal_update_mode="achieved", kp=stiffness)
    height = one.position[2]
    one.push([0.0, 0.0, -20.0])
    for step in (X, -X) * 20:
        one.act(0.2 * step)
    one.act(np.zeros(6), 20)
    _, _, mobility = one.dynamics()
    sag = 20.0 * mobility[2, 2] / stiffness
    assert 0.5 * sag < height - one.position[2] < 1.5 * sag


def test_steps_count_from_the_hand_or_from_the_goal(rig):
    ends = {}
    for mode in ("achieved", "desired"):
        one = rig(goal_update_mode=mode)
        start = one.position
        one.act(0.4 * X, 5)
        ends[mode] = one.part.goal.translation - start
    np.testing.assert_allclose(ends["desired"], [0.1, 0.0, 0.0], atol=1e-12)
    assert 0.02 < ends["achieved"][0] < 0.08
    np.testing.assert_allclose(ends["achieved"][1:], 0.0, atol=1e-12)


@pytest.mark.parametrize("frame", ["world", "base", "eef"])
def test_a_step_goes_along_the_axes_of_its_frame(rig, frame):
    one = rig("PandaOmron", input_ref_frame=frame)
    state, yaw = one.state, 0.7
    one.data.qpos[state.model.joint("robot0_root_yaw").qposadr[0]] = yaw
    one.simulation.start()
    site = one.data.site_xmat[int(one.law.record["site"][0])].reshape(3, 3).copy()
    before = one.data.site_xpos[int(one.law.record["site"][0])].copy()
    one.act(X)
    one.act(np.zeros(6), 20)
    moved = one.data.site_xpos[int(one.law.record["site"][0])] - before
    c, s = np.cos(yaw), np.sin(yaw)
    along = {"world": [1.0, 0, 0], "base": [c, s, 0], "eef": site[:, 0]}[frame]
    np.testing.assert_allclose(moved, 0.05 * np.array(along), atol=2e-4)


@pytest.mark.parametrize("frame", ["world", "base", "eef"])
def test_goals_in_the_base_s_axes_move_with_the_base(rig, frame):
    one = rig("PandaOmron", input_ref_frame=frame)
    site = int(one.law.record["site"][0])
    before = one.data.site_xpos[site].copy()
    inside = one.pose.translation.copy()
    for _ in range(20):
        one.act(np.zeros(6), base=[0.0, 0.2, 0.0])
    one.act(np.zeros(6), 20)
    if frame == "world":
        np.testing.assert_allclose(one.data.site_xpos[site], before, atol=5e-4)
    else:
        np.testing.assert_allclose(one.position, inside, atol=5e-4)
        assert np.linalg.norm(one.data.site_xpos[site] - before) > 0.1


def test_osc_position_holds_the_first_orientation(rig):
    one = rig(type="OSC_POSITION")
    start = one.pose
    one.act(np.ones(3), 10)
    one.act(np.zeros(3), 20)
    moved = one.position - start.translation
    assert (moved > 0.1).all()
    assert np.linalg.norm(pin.log3(start.rotation.T @ one.pose.rotation)) < 1e-3


def test_limits_of_goals_are_kept(rig):
    one = rig(
        position_limits=((-9, -0.05, -9), (9, 0.05, 9)), goal_update_mode="desired"
    )
    middle = one.position
    assert abs(middle[1]) < 0.05
    for sign in (1, -1):
        one.act(sign * np.eye(6)[1], 10)
        one.act(np.zeros(6), 12)
        assert one.position[1] == pytest.approx(sign * 0.05, abs=5e-4)
    one = rig(orientation_limits=(-0.2, 0.2), goal_update_mode="desired")
    start = one.pose.rotation
    one.act(np.eye(6)[5], 4)
    one.act(np.zeros(6), 12)
    turn = pin.log3(one.pose.rotation @ start.T)
    np.testing.assert_allclose(turn, [0.0, 0.0, 0.2], atol=2e-3)


def test_a_hand_outside_its_limits_is_held_where_it_is(rig):
    one = rig(position_limits=((-9, -9, -9), (9, 9, 0.05)))
    start = one.position
    assert start[2] > 0.05
    one.act(np.zeros(6), 20)
    np.testing.assert_allclose(one.position, start, atol=1e-7)


def test_speeds_are_limited(rig):
    one = rig(
        input_type="absolute",
        input_ref_frame="world",
        velocity_limits=(0.1, 0.3),
        interpolation="linear",  # the target itself would go at 4 m/s
    )
    goal = stepped(one.pose, np.array([0.2, 0.05, 0, 0, 0, 0.5]))
    one.controller.set_goal(one.action(one.values(goal)), 0.05)
    poses = np.array([p.translation for p in one.run(3.0)])
    speed = np.linalg.norm(np.diff(poses, axis=0), axis=1) / one.simulation.timestep
    assert speed.max() == pytest.approx(0.1, rel=0.02)
    np.testing.assert_allclose(poses[-1], goal.translation, atol=5e-4)


def test_torques_are_limited(rig):
    one = rig(torque_limits=(-30.0, 30.0), saturation="clip")
    for _ in range(20):
        one.act(np.random.default_rng(0).uniform(-1, 1, 6))
        assert np.abs(one.law.drives["command"]).max() <= 30.0
    assert (np.abs(one.law.drives["command_max"][-3:]) == 12.0).all()  # the motors' own


@pytest.mark.slow
def test_the_arm_stops_at_its_joints_limits(rig):
    for saturation in ("clip", "qp"):
        one = rig(goal_update_mode="desired", saturation=saturation)
        limits = [one.one.robot.joint(j).range for j in one.law.joints]
        low, high = np.array(limits).T
        rng = np.random.default_rng(3)
        for _ in range(8):
            step = rng.choice([-1.0, 1.0], 6)
            for _ in range(10):
                one.act(step)
                q = one.data.qpos[one.law.drives["qpos"]]
                assert (q > low - 1e-2).all()
                assert (q < high + 1e-2).all()


@pytest.mark.slow
def test_joints_keep_their_speeds_and_the_hand_its_way(rig):
    """Two joints of Baxter would have to go too fast: the hand goes slower instead."""
    one = rig("Baxter", input_type="absolute", input_ref_frame="world")
    start, speeds = one.pose, []
    goal = stepped(start, np.array([-0.05, 0, 0, 0, 0, -0.35]))
    one.controller.set_goal(one.action(one.values(goal)))
    drives = one.law.drives
    look = lambda: speeds.append(one.data.qvel[drives["dof"]] / drives["velocity_max"])  # noqa: E731
    moved = [pose.translation - start.translation for pose in one.run(1.0, look)]
    assert 0.99 < np.abs(speeds).max() < 1.01
    assert np.linalg.norm(np.array(moved)[:, 1:], axis=1).max() < 0.003
    np.testing.assert_allclose(one.position, goal.translation, atol=1e-4)


def test_a_ramp_goes_evenly_from_the_present_target(rig):
    one = rig(
        input_type="absolute",
        input_ref_frame="world",
        interpolation="linear",
        ramp_ratio=1.0,
    )
    start, goal = one.pose, stepped(one.pose, 0.02 * X)
    one.controller.set_goal(one.action(one.values(goal)), 0.1)
    one.simulation.tick(25)
    target, twist = one.law.target_pose()
    np.testing.assert_allclose(
        target.translation - start.translation, [0.01, 0, 0], atol=1e-9
    )
    np.testing.assert_allclose(twist[:3], [0.2, 0.0, 0.0], atol=1e-9)
    one.controller.set_goal(one.action(one.values(goal)), 0.1)  # again, half way
    one.simulation.tick(50)
    np.testing.assert_allclose(one.law.target_pose()[0], goal, atol=1e-9)
    one.simulation.tick(1)
    np.testing.assert_array_equal(one.law.target_pose()[1], 0.0)


@pytest.mark.parametrize("mode", ["variable_kp", "variable"])
def test_the_action_tells_the_gains(rig, mode):
    one = rig(impedance_mode=mode)
    more = {"right_kp": [10, 20, 30, 40, 50, 60]}
    more |= {"right_kd": [1, 2, 3, 4, 5, 6]} if mode == "variable" else {}
    one.act(np.zeros(6), **more)
    kp, kd = one.law.record["kp"][0], one.law.record["kd"][0]
    np.testing.assert_array_equal(kp, more["right_kp"])
    critical = 2.0 * np.sqrt(kp)
    np.testing.assert_allclose(kd, more.get("right_kd", critical))
    hold = one.controller.layout.unpack(one.controller.hold_action)
    np.testing.assert_array_equal(hold["right_kp"], kp)


def test_zero_stiffness_lets_the_hand_float(rig):
    one = rig(impedance_mode="variable_kp")
    start = one.position
    one.act(np.zeros(6), 20, right_kp=np.zeros(6))
    np.testing.assert_allclose(one.position, start, atol=1e-6)
    one.push([3.0, 0.0, 0.0])
    one.act(np.zeros(6), 10, right_kp=np.zeros(6))
    assert one.position[0] - start[0] > 0.05


@pytest.mark.slow
def test_the_posture_moves_the_arm_but_not_the_hand(rig):
    start = rig()
    q = start.data.qpos[start.law.drives["qpos"]].copy()
    joint = start.law.joints[0]
    one = rig(posture={joint: q[0] + 0.4}, posture_kp=40.0)
    place = one.pose
    farthest = max(
        np.linalg.norm(p.translation - place.translation) for p in one.run(2.0)
    )
    moved = one.data.qpos[one.law.drives["qpos"]] - q
    assert moved[0] > 0.05
    assert farthest < 5e-4
    with pytest.raises(UnknownNameError, match="elbow"):
        rig(posture={"elbow": 0.0})


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"input_type": "absolute", "input_ref_frame": "eef"}, "'eef' is for"),
        ({"position_limits": ((1, 1, 1), (0, 0, 0))}, "position_limits"),
        ({"kp": (1.0, 2.0)}, "kp"),
        ({"output_max": (1.0, 2.0)}, "output_max"),
        ({"saturation": "sometimes"}, "saturation"),
        ({"velocity_limits": (0.0, 1.0)}, "velocity_limits"),
        ({"ramp_ratio": 0.0}, "ramp_ratio"),
        ({"kp": float("nan")}, "kp"),
    ],
)
def test_a_wrong_config_is_refused_in_words(rig, changes, words):
    with pytest.raises(ConfigError, match=words):
        rig(**changes)


def test_defaults_are_in_the_schema_s_ranges():
    config = OscConfig()
    assert config.size == 6
    assert OscConfig(type="OSC_POSITION").outputs()[1] == (0.05, 0.05, 0.05)
    read = load_composite_controller_config("BASIC", load_robot("Panda"))
    assert read["body_parts"]["right"]["type"] == "OSC_POSE"


@pytest.mark.parametrize("seed", range(6))
def test_any_settings_and_actions_keep_the_state_finite(rig, seed):
    rng = np.random.default_rng(seed)
    name = ("Panda", "UR5e", "Tiago")[seed % 3]
    one = rig(
        name,
        impedance_mode="variable",
        kp_limits=(0.0, float(rng.uniform(10, 3000))),
        kd_limits=(0.0, float(rng.uniform(0.1, 150))),
        interpolation=rng.choice([None, "linear"]),
        goal_update_mode=str(rng.choice(["achieved", "desired"])),
        input_ref_frame=str(rng.choice(["world", "base", "eef"])),
        saturation=str(rng.choice(["clip", "qp"])),
        disturbance_observer=float(rng.uniform(0, 100)),
        posture_kp=float(rng.uniform(0, 300)),
        output_max=float(rng.uniform(0.05, 3.0)),
    )
    layout = one.controller.layout
    for _ in range(30):
        one.controller.set_goal(rng.uniform(layout.low, layout.high), 0.05)
        one.simulation.tick(25)  # raises PhysicsError otherwise
    assert np.isfinite(one.data.qpos).all()
    assert np.abs(one.data.qvel).max() < 100.0
