import copy

import numpy as np
import pytest

import wbc_suite
from wbc_suite.catalogue import Catalogue
from wbc_suite.config_files import load_model
from wbc_suite.control import (
    COMPOSITES,
    build_composite_controller,
    load_composite_controller_config,
    register_composite,
)
from wbc_suite.control.ik.command_lead import MAX_LEAD
from wbc_suite.control.ik.config import (
    WholeBodyIKConfig,
    default_whole_body_config,
)
from wbc_suite.control.ik.report import lagging_joint
from wbc_suite.control.reasons import TorqueLimit, TrackingError
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.planning import GoalSearch
from wbc_suite.qp import ActiveLimit, LimitKind
from wbc_suite.robot import load_robot

SIDES = ("right", "left")

ROBOTS = ("Panda", "GR1", "Tiago", "SpotWithArm")
STEP = np.array([0.03, 0.04, -0.03, 0.0, 0.1, 0.1])


@pytest.mark.slow
@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize(
    "controller",
    ["WHOLE_BODY_IK", pytest.param("WHOLE_BODY_MINK_IK", marks=pytest.mark.slow)],
)
def test_the_hand_arrives_in_simulation(alone, robot, controller):
    scene = alone(robot, controller)
    before = scene.site("right_tcp")
    report = scene.act({"right_hand": STEP}, 1.5)["frames"]["right_hand"]
    # mink has no strict levels: what a lower level asks for costs a little.
    bound = 1e-3 if robot == "SpotWithArm" or "MINK" in controller else 1e-4
    assert report["position_error"] < bound
    assert report["orientation_error"] < 2e-3
    assert report["reached"]
    assert report["reasons"] == []
    moved = scene.site("right_tcp") - before
    np.testing.assert_allclose(moved, STEP[:3], atol=bound)


@pytest.mark.slow
def test_a_hand_that_creeps_past_a_singularity_takes_another_way(alone):
    """It came 4 cm a second nearer: 7 mm were left after two seconds."""
    scene = alone("SpotWithArm")
    goal = np.array([0.64872, 0.05719, 0.99177, 1.14274, 1.34491, 1.13593])
    part = scene.controller.layout["right_hand"]
    now = scene.controller.hold_action[part.start : part.stop]
    report = scene.act({"right_hand": goal - now}, 1.0)["frames"]["right_hand"]
    assert report["position_error"] < 1e-3
    assert report["orientation_error"] < 3e-3


@pytest.mark.parametrize("planning", [True, False])
def test_planning_is_switched_off_by_one_line(alone, monkeypatch, planning):
    """A distant goal is searched for only with planning; the hand arrives anyway."""
    searches, start = [], GoalSearch.start
    monkeypatch.setattr(
        GoalSearch, "start", lambda *args: (searches.append(1), start(*args))
    )
    change = np.array([-0.1, 0.3, 0.1, 0.0, 0.0, 0.0])
    scene = alone("Panda", planning=planning)
    before = scene.site("right_tcp")
    report = scene.act({"right_hand": change}, 2.0)
    assert report["reached"]
    moved = scene.site("right_tcp") - before
    np.testing.assert_allclose(moved, change[:3], atol=1e-3)
    assert bool(searches) is planning


@pytest.mark.slow
@pytest.mark.parametrize("robot", ROBOTS)
def test_a_goal_out_of_reach_is_reported_and_forgotten(alone, robot):
    scene = alone(robot)
    report = scene.act({"right_hand": np.array([0, 4.0, 1.0, 0, 0, 0])}, 1.0)
    assert not report["reached"]
    hand = report["frames"]["right_hand"]
    assert hand["position_error"] > 1.0
    assert hand["reasons"]
    limited = np.flatnonzero(scene.state.model.jnt_limited)
    model, data = scene.state.model, scene.state.data
    q = data.qpos[model.jnt_qposadr[limited]]
    low, high = model.jnt_range[limited].T
    assert (low - q).max() < 1e-3
    assert (q - high).max() < 1e-3
    back = scene.act({"right_hand": np.array([0, -4.0, -1.0, 0, 0, 0])}, 2.0)
    assert back["frames"]["right_hand"]["position_error"] < 1e-3


@pytest.mark.slow
def test_reasons_say_what_is_in_the_way(alone):
    scene = alone("Panda")
    down = scene.act({"right_hand": np.array([-0.4, 0, 0.9, 0, 1.5, 0])}, 2.0)
    words = " ".join(map(str, down["frames"]["right_hand"]["reasons"]))
    assert "limit: panda_joint" in words or "out of reach" in words


@pytest.mark.slow
def test_what_the_hand_presses_on_is_named(alone):
    scene = alone(load_robot("Panda", base="NullMount"))
    height = scene.site("right_tcp")[2]
    for z in (0.1, -0.03):  # m; the floor is at 0
        down = scene.act({"right_hand": np.array([0, 0, z - height, 0, 0, 0])}, 2.0)
        height = z
    hand = down["frames"]["right_hand"]
    assert hand["position_error"] > 0.01
    assert hand["reasons"]
    assert all(
        isinstance(reason, ActiveLimit)
        and reason.kind is LimitKind.OBSTACLE
        and str(reason).endswith("- floor")
        for reason in hand["reasons"]
    )


@pytest.mark.slow
def test_a_limb_that_gives_way_is_no_goal_out_of_reach(alone):
    scene = alone("UR5e")
    state = scene.state
    state.data.body("robot0_robotiq_85_base").xfrc_applied[2] = -60.0  # N, unannounced
    hand = scene.act({"right_hand": 0.5 * STEP}, 3.0)["frames"]["right_hand"]
    assert hand["position_error"] > 1e-3
    (reason,) = hand["reasons"]
    assert isinstance(reason, TrackingError)
    assert reason.error > 1e-4
    joints = state.robot.joint_names[:2]
    elsewhere = state.data.qpos[state.joint_addresses(joints)[0]] + [0.1, 0.2]
    lagging = lagging_joint(state, joints, elsewhere)
    assert isinstance(lagging, TrackingError)
    assert (lagging.joint, str(lagging)) == (joints[1], f"lag: {joints[1]}")
    assert lagging.error == pytest.approx(0.2)
    state.data.ctrl[state.actuator_ids[1]] = 1e3
    limited = lagging_joint(state, joints, elsewhere)
    assert isinstance(limited, TorqueLimit)
    assert str(limited) == f"motor limit: {joints[1]}"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("robot", "name"),
    [("Panda", "panda_joint4"), ("GR1", "right_elbow_pitch_joint")],
)
def test_a_command_waits_for_a_joint_that_is_held(alone, robot, name):
    """It went on to the goal before, and the joint jumped when it came free."""
    scene = alone(robot)
    joint = scene.state.data.joint(f"robot0_{name}")
    law = scene.controller.laws[0]
    most = float(law.drives["windup_max"][law.joints.index(name)])
    held, leads, kinds = float(joint.qpos[0]), [], set()
    part = scene.controller.layout["right_hand"]
    goal = scene.controller.hold_action
    goal[part.start : part.stop] += 5.0 * STEP
    scene.controller.set_goal(goal)
    for _ in range(500):
        scene.simulation.tick(1)
        joint.qpos[0], joint.qvel[0] = held, 0.0
        leads.append(abs(scene.controller.joint_targets[name] - held))
        report = scene.controller.info(scene.state)["ik"]["frames"]["right_hand"]
        kinds |= {r.kind for r in report["reasons"] if isinstance(r, ActiveLimit)}
    assert max(leads) == pytest.approx(most, rel=0.02)
    assert LimitKind.TRACKING in kinds
    report = scene.act({}, 2.0)["frames"]["right_hand"]
    assert report["reached"]


@pytest.mark.slow
def test_a_blow_does_not_carry_a_wrist_past_its_limit(alone):
    scene = alone("GR1")
    scene.simulation.tick(10)
    model, data = scene.state.model, scene.state.data
    wrist = data.joint("robot0_right_wrist_pitch_joint")
    high = model.joint("robot0_right_wrist_pitch_joint").range[1]
    wrist.qpos[0], wrist.qvel[0] = high - 0.05, 6.0
    most = -np.inf
    for _ in range(50):
        scene.simulation.tick(1)
        most = max(most, wrist.qpos[0] - high)
    assert -0.05 < most < 2e-3


@pytest.mark.slow
def test_a_base_brakes_while_a_contact_drives_an_arm_too_fast(alone):
    scene = alone("Tiago")
    joint = scene.state.data.joint("robot0_arm_left_5_joint")
    part, goal = scene.controller.layout["base"], scene.controller.hold_action
    goal[part.start] += 2.0
    scene.controller.set_goal(goal)

    def speed(seconds, of_joint):
        """Return the commanded speed of the base after a time, m/s."""
        at = []
        for _ in range(round(seconds / 0.002)):
            if of_joint is not None:
                joint.qvel[0] = of_joint
            scene.simulation.tick(1)
            at.append(scene.controller.joint_targets["root_x"])
        return (at[-1] - at[-51]) / 0.1

    fast = speed(0.5, 0.0)
    assert fast > 0.1
    assert abs(speed(0.5, 6.0)) < 0.1 * fast
    assert speed(2.0, None) > 0.5 * fast


@pytest.mark.slow
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_command_follows_a_joint_that_a_contact_drives_away(alone, sign):
    """It stayed, and the QP kept a hand off a table where the hand was not."""
    scene = alone("GR1")
    name = "right_wrist_pitch_joint"
    joint = scene.state.data.joint(f"robot0_{name}")
    scene.controller.set_goal(scene.controller.hold_action)
    start = joint.qpos[0]
    for _ in range(200):
        joint.qvel[0] = 2.0 * sign * ((joint.qpos[0] - start) * sign < 0.5)
        scene.simulation.tick(1)
    assert abs(joint.qpos[0] - start) > 0.45
    lead = scene.controller.joint_targets[name] - joint.qpos[0]
    assert 0.05 < -lead * sign < MAX_LEAD  # 0.5 before
    scene.simulation.tick(1000)
    report = scene.controller.info(scene.state)["ik"]["frames"]["right_hand"]
    assert report["reached"]


@pytest.mark.slow
def test_each_hand_is_told_its_own_collisions(alone):
    scene = alone("GR1")
    back = np.array([-1.0, 0.0, 0.3, 0.0, 0.0, 0.0])
    frames = scene.act({"right_hand": back, "left_hand": back}, 0.3)["frames"]
    for side, other in (("right", "left"), ("left", "right")):
        collisions = [
            str(reason.subject)
            for reason in frames[f"{side}_hand"]["reasons"]
            if isinstance(reason, ActiveLimit)
            and reason.kind is LimitKind.SELF_COLLISION
        ]
        assert any(f"{side}_upper_arm" in pair for pair in collisions)
        assert not any(f"{other}_upper_arm" in pair for pair in collisions)


@pytest.mark.parametrize("reference", ["world", "base", "eef"])
def test_deltas_are_along_the_axes_of_their_reference(alone, reference):
    scene = alone("Panda", input_type="delta", input_ref_frame=reference)
    before = scene.site("right_tcp")
    axes = {
        "world": np.eye(3),
        "base": np.eye(3),
        "eef": scene.state.data.site("robot0_right_tcp").xmat.reshape(3, 3).copy(),
    }[reference]
    scene.act({"right_hand": np.array([0, 0, 0.04, 0, 0, 0])}, 1.5)
    moved = scene.site("right_tcp") - before
    np.testing.assert_allclose(moved, axes @ [0, 0, 0.04], atol=2e-4)


@pytest.mark.slow
def test_zero_deltas_never_move_the_hand(alone):
    scene = alone("GR1", input_type="delta")
    before = scene.site("left_tcp")
    for _ in range(10):
        scene.act({}, 0.2)
    assert np.linalg.norm(scene.site("left_tcp") - before) < 1e-4


@pytest.mark.slow
def test_base_goals_of_tiago_move_the_base(alone):
    scene = alone("Tiago")
    before = scene.site("base")
    hand = scene.site("right_tcp")
    report = scene.act({"base": np.array([0.1, 0.05, 0.2])}, 3.0)
    assert report["frames"]["right_hand"]["reached"]
    np.testing.assert_allclose(
        scene.site("base")[:2] - before[:2], [0.1, 0.05], atol=5e-3
    )
    np.testing.assert_allclose(scene.site("right_tcp"), hand, atol=2e-4)


@pytest.mark.slow
@pytest.mark.parametrize(
    "robot", ["GR1FloatingBody", "TiagoDifferential", "SpotWithArmFloating"]
)
def test_bases_that_glide_move_beneath_the_hands(alone, robot):
    scene = alone(robot)
    before = scene.site("right_tcp")
    frames = scene.act({"base": np.array([-0.1, 0.0, 0.0])}, 2.5)["frames"]
    assert frames["base"]["position_error"] < 1e-3
    np.testing.assert_allclose(scene.site("right_tcp"), before, atol=1e-3)


@pytest.mark.slow
def test_spot_stands_and_keeps_its_feet_while_the_body_moves(alone):
    scene = alone("SpotWithArm")
    feet = [f.name for f in scene.robot.frames if f.role == "foot"]
    before = {foot: scene.site(foot) for foot in feet}
    body = scene.site("base")
    scene.act({"torso": np.array([0.03, 0.0, -0.04, 0, 0, 0])}, 2.0)
    np.testing.assert_allclose(scene.site("base") - body, [0.03, 0.0, -0.04], atol=5e-3)
    for foot in feet:
        assert np.linalg.norm(scene.site(foot) - before[foot]) < 5e-3


@pytest.mark.slow
@pytest.mark.parametrize("controller", ["WHOLE_BODY_IK", "WHOLE_BODY_MINK_IK"])
@pytest.mark.parametrize("seed", range(3))
def test_the_trunk_of_spot_arrives_over_its_feet(alone, controller, seed):
    """By mink it missed by 16 to 88 mm: point contacts held their orientation."""
    scene, rng = alone("Spot", controller), np.random.default_rng(seed)
    change = np.concatenate([rng.uniform(-0.07, 0.07, 3), rng.uniform(-0.15, 0.15, 3)])
    before = scene.site("base")
    trunk = scene.act({"torso": change}, 4.0)["frames"]["torso"]
    assert trunk["position_error"] < 1e-3
    assert trunk["orientation_error"] < 2e-3
    np.testing.assert_allclose(scene.site("base") - before, change[:3], atol=2e-3)


def test_grippers_open_and_close(alone):
    scene = alone("Panda")
    part = scene.controller.layout["right_gripper"]
    finger = scene.state.data.joint("robot0_panda_finger_joint1")
    for goal, where in ((-1.0, 0.04), (1.0, 0.0)):
        action = scene.controller.hold_action
        action[part.start] = goal
        scene.controller.set_goal(action)
        scene.simulation.tick(500)
        assert finger.qpos[0] == pytest.approx(where, abs=2e-3)


@pytest.mark.slow
def test_the_hold_action_holds(alone):
    scene = alone("GR1")
    before = scene.site("right_tcp")
    scene.controller.set_goal(scene.controller.hold_action)
    scene.simulation.tick(500)
    assert np.linalg.norm(scene.site("right_tcp") - before) < 1e-4


def test_every_shipped_file_is_valid_and_builds(alone):
    known = Catalogue().files("controllers")
    files = [path for path in known if path.stem.endswith("_whole_body_ik")]
    assert len(files) >= 4
    for path in files:
        load_model(WholeBodyIKConfig, path)
        robot = path.stem.removesuffix("_whole_body_ik")
        config = load_composite_controller_config("WHOLE_BODY_IK", robot)
        assert config["type"] == "WHOLE_BODY_IK"
        assert config["frame"]


def test_a_robot_without_a_file_gets_hands_and_held_feet():
    robot = load_robot("gr1_free_body")
    config = load_composite_controller_config("WHOLE_BODY_IK", robot)
    names = [frame["name"] for frame in config["frame"]]
    assert {"right_hand", "left_hand"} <= set(names)
    assert {held["frame"] for held in config["held"]} == {"right_foot", "left_foot"}


@pytest.mark.parametrize(
    ("robot", "gripper", "frames"),
    [
        ("UR5e", None, {"right_hand": "right_tcp"}),
        ("UR5e", "none", {"right_hand": "right_tcp"}),
        ("PandaDexLH", None, {"left_hand": "left_tcp"}),
        (
            "Baxter",
            {"left": "none"},
            {"right_hand": "right_tcp", "left_hand": "left_tcp"},
        ),
    ],
)
def test_hands_are_named_after_their_side(robot, gripper, frames):
    config = default_whole_body_config(load_robot(robot, gripper=gripper))
    assert {f["name"]: f["frame"] for f in config["frame"]} == frames


@pytest.mark.slow
def test_an_arm_put_on_a_mobile_base_can_be_driven(alone):
    scene = alone(load_robot("UR5e", base="OmronMobileBase"))
    before = scene.site("right_tcp")
    frames = scene.act({"base": np.array([-0.1, 0.1, 0.0])}, 3.0)["frames"]
    assert frames["base"]["position_error"] < 1e-3
    np.testing.assert_allclose(scene.site("right_tcp"), before, atol=1e-3)


def test_a_robot_without_hands_is_moved_by_its_trunk():
    config = default_whole_body_config(load_robot("Spot"))
    assert [frame["frame"] for frame in config["frame"]] == ["base"]


def test_another_robot_of_a_name_we_know_gets_no_file_of_ours(caplog):
    ours = load_robot("UR5e", gripper="none")
    frames = tuple(
        f.model_copy(update={"name": f"my_{f.name}"}) if f.role == "tcp" else f
        for f in ours.frames
    )
    theirs = ours.model_copy(update={"name": "tiago", "frames": frames})
    config = load_composite_controller_config("WHOLE_BODY_IK", theirs)
    assert config["frame"][0]["frame"] == "my_right_tcp"
    assert "tiago_whole_body_ik.toml is not for this 'tiago'" in caplog.text


def test_a_file_of_ones_own_that_does_not_fit_is_an_error(tmp_path):
    (tmp_path / "controllers").mkdir()
    file = tmp_path / "controllers" / "ur5e_whole_body_ik.toml"
    file.write_text('format = 1\n[[frame]]\nname = "hand"\nframe = "right_tpc"\n')
    with pytest.raises(ConfigError, match="Did you mean 'right_tcp'"):
        load_composite_controller_config(
            "WHOLE_BODY_IK", "UR5e", catalogue=Catalogue(extra=(tmp_path,))
        )


def test_a_robot_without_joints_is_refused_in_words():
    with pytest.raises(ConfigError, match="it has no joint"):
        default_whole_body_config(load_robot("base/rethink_mount"))


def test_a_free_robot_that_nothing_holds_is_refused(alone):
    with pytest.raises(ConfigError, match="UR5e: it has a free root"):
        alone(load_robot("UR5e", base="NoActuationBase"))


@pytest.mark.slow
def test_a_biped_of_unknown_soles_is_warned_of(alone, caplog):
    held = [{"frame": f"{side}_foot", "contact": "surface"} for side in SIDES]
    alone("GR1FreeBody", held=held)
    assert "stands on 2 feet whose soles are unknown" in caplog.text
    caplog.clear()
    alone("SpotWithArm")
    assert not caplog.records


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"solve_hertz": 100}, "Did you mean 'solve_hz'"),
        ({"frame": []}, "1 items or more"),
        ({"frame": [{"name": "a"}]}, "'frame' is needed"),
        ({"frame": [{"name": "a", "frame": "eef", "kind": "poze"}]}, "'pose'"),
        ({"input_ref_frame": "eef"}, "needs input_type 'delta'"),
    ],
)
def test_faulty_configs_are_refused_in_words(alone, changes, message):
    with pytest.raises(ConfigError, match=message):
        alone("Panda", **changes)


def test_unknown_names_get_suggestions(alone):
    frame = {"name": "hand", "frame": "right_tpc", "kind": "pose"}
    with pytest.raises(ConfigError, match=r"frame\[0\]\.frame.*mean 'right_tcp'"):
        alone("Panda", frame=[frame])
    with pytest.raises(ConfigError, match=r"locked.*Did you mean 'legs'"):
        alone("GR1", locked=["leg"])
    with pytest.raises(UnknownNameError, match="Did you mean 'WHOLE_BODY_IK'"):
        load_composite_controller_config("WHOLE_BODY_IKK", "Panda")
    with pytest.raises(ConfigError, match="needs a robot"):
        load_composite_controller_config("WHOLE_BODY_IK")
    with pytest.raises(ConfigError, match="needs a key 'type'"):
        load_composite_controller_config({"frame": []})


@pytest.mark.slow
def test_a_composite_of_ones_own_can_be_registered(alone, forget):
    made = []
    forget(COMPOSITES, "MY_OWN")

    def build(config, state):
        made.append(config["type"])
        return build_composite_controller(config | {"type": "WHOLE_BODY_IK"}, state)

    register_composite(
        "MY_OWN",
        build,
        family="whole_body_ik",
        default=lambda _: {},
    )
    assert "MY_OWN" in COMPOSITES
    assert alone("Tiago", "my_own").act({}, 0.1)["reached"]
    assert made == ["MY_OWN"]
    with pytest.raises(ConfigError, match="exists already"):
        register_composite("my_own", build, family="x", default=lambda _: {})


@pytest.mark.slow
def test_reasons_stay_those_of_their_own_step():
    env = wbc_suite.make("Lift", robots="Panda", controller_configs="WHOLE_BODY_IK")
    told = []
    for _ in range(2):  # the first time reasons are read at once, then at the end
        env.reset(seed=0)
        rng, infos = np.random.default_rng(0), []
        for _ in range(30):
            action = env.unwrapped.hold_action
            action[:3] += rng.uniform(-0.4, 0.4, 3)
            info = env.step(action)[-1]
            infos.append(info if told else copy.deepcopy(info))
        told.append([copy.deepcopy(info["ik"]["frames"]) for info in infos])
    assert told[0] == told[1]
    words = {str(frames["right_hand"]["reasons"]) for frames in told[0]}
    assert len(words) > 3
