import numpy as np
import pinocchio as pin
import pytest

PERIOD = 0.05


def arm(alone, robot="Panda", part="right", **settings):
    rig = alone(robot, "BASIC", body_parts={part: {"type": "IK_POSE"} | settings})
    rig.simulation.start()
    return rig


def run(rig, action, seconds):
    for _ in range(round(seconds / PERIOD)):
        rig.controller.set_goal(action, PERIOD)
        rig.simulation.tick(round(PERIOD / rig.simulation.timestep))


def hand(rig, name="right_tcp"):
    site = rig.state.data.site(f"robot0_{name}")
    return pin.SE3(site.xmat.reshape(3, 3).copy(), site.xpos.copy())


def test_the_action_is_a_position_and_a_quaternion(alone):
    for kind, reach in (("delta", 1.0), ("absolute", 10.0)):
        part = arm(alone, input_type=kind).controller.layout["right"]
        assert part.labels == ("x", "y", "z", "qx", "qy", "qz", "qw")
        assert part.high == (*(reach,) * 3, *(1.0,) * 4)
        assert part.low == tuple(-x for x in part.high)


def test_an_absolute_pose_is_reached(alone):
    rig = arm(alone, input_type="absolute", input_ref_frame="world")
    start = hand(rig)
    goal = start * pin.SE3(
        pin.exp3(np.array([0.2, -0.1, 0.3])), np.array([0.03, 0.05, -0.04])
    )
    action = rig.controller.hold_action
    action[:7] = pin.SE3ToXYZQUAT(goal)
    run(rig, action, 1.0)
    assert pin.log6(hand(rig).actInv(goal)).np == pytest.approx(np.zeros(6), abs=1e-5)
    report = rig.controller.info(rig.state)["ik"]
    assert report["reached"]
    assert report["frames"]["right"]["reasons"] == ()


@pytest.mark.parametrize("frame", ["world", "base", "eef"])
def test_a_delta_goes_along_the_axes_of_its_frame(alone, frame):
    rig = arm(alone, "Tiago", input_ref_frame=frame)
    data = rig.state.data
    data.qpos[2] = 1.0  # the base has turned
    rig.simulation.start()
    start = hand(rig)
    base = data.body("robot0_" + rig.robot.links[0].name).xmat.reshape(3, 3).copy()
    axes = {"world": np.eye(3), "base": base, "eef": start.rotation}[frame]
    turn = np.array([0.0, 0.0, 0.3])
    action = rig.controller.hold_action
    action[:3] = (0.5, 0.0, 0.2)
    action[3:7] = pin.Quaternion(pin.exp3(turn)).coeffs()
    rig.controller.set_goal(action, PERIOD)
    run(rig, rig.controller.hold_action, 1.5)
    moved = hand(rig)
    shift = axes @ np.array([0.025, 0.0, 0.01])
    assert moved.translation - start.translation == pytest.approx(shift, abs=1e-4)
    rotation = pin.log3(moved.rotation @ start.rotation.T)
    assert rotation == pytest.approx(axes @ turn, abs=1e-3)


def test_a_goal_in_the_base_goes_with_the_base(alone):
    parts = {"right": {"type": "IK_POSE"}, "base": {"type": "BASE_VELOCITY"}}
    rig = alone("Tiago", "BASIC", body_parts=parts)
    rig.simulation.start()
    body = rig.state.data.body("robot0_" + rig.robot.links[0].name)

    def in_base():
        base = pin.SE3(body.xmat.reshape(3, 3).copy(), body.xpos.copy())
        return base.actInv(hand(rig))

    start = in_base()
    run(
        rig,
        rig.controller.layout.pack(
            {"base": [0.3, 0.2, 0.4]}, base=rig.controller.hold_action
        ),
        2.0,
    )
    assert np.linalg.norm(rig.state.data.qpos[:2]) > 0.3
    assert pin.log6(start.actInv(in_base())).np == pytest.approx(np.zeros(6), abs=5e-3)


def test_a_goal_in_the_world_stays_while_the_base_drives(alone):
    parts = {
        "right": {"type": "IK_POSE", "input_ref_frame": "world"},
        "base": {"type": "BASE_VELOCITY"},
    }
    rig = alone("Tiago", "BASIC", body_parts=parts)
    rig.simulation.start()
    start = hand(rig).translation
    layout, hold = rig.controller.layout, rig.controller.hold_action
    run(rig, layout.pack({"base": [-0.05, 0.0, 0.1]}, base=hold), 1.0)
    run(rig, hold, 0.5)
    assert rig.state.data.qpos[0] < -0.02
    assert hand(rig).translation == pytest.approx(start, abs=1e-3)


def test_a_turn_is_limited_and_its_quaternion_may_have_any_length(alone):
    rig = arm(alone, turn_limit=0.2)
    start = hand(rig)
    action = rig.controller.hold_action
    action[3:7] = 0.5 * pin.Quaternion(pin.exp3(np.array([0.0, 0.0, 1.0]))).coeffs()
    rig.controller.set_goal(action, PERIOD)
    run(rig, rig.controller.hold_action, 1.0)
    turned = pin.log3(hand(rig).rotation @ start.rotation.T)
    assert turned == pytest.approx([0.0, 0.0, 0.2], abs=1e-4)


@pytest.mark.slow
def test_a_goal_out_of_reach_gives_a_reason_and_no_chatter(alone):
    rig = arm(alone, input_type="absolute", input_ref_frame="world")
    action = rig.controller.hold_action
    action[:3] += (3.0, 1.0, 0.0)
    run(rig, action, 4.0)
    speeds = []
    for _ in range(200):
        rig.simulation.tick(1)
        speeds.append(rig.state.data.qvel[:7].copy())
    assert np.abs(speeds).max() < 1e-2  # it still settles, evenly
    assert np.abs(np.diff(speeds, axis=0)).max() / rig.simulation.timestep < 0.05
    frame = rig.controller.info(rig.state)["ik"]["frames"]["right"]
    assert not frame["reached"]
    assert frame["reasons"]


def test_velocity_limits_of_the_joints_are_kept_on_a_long_way(alone):
    rig = arm(
        alone,
        input_type="absolute",
        input_ref_frame="world",
        motion={"speed": (5.0, 9.0)},
    )
    most = np.array([rig.robot.joint(f"panda_joint{i}").velocity for i in range(1, 8)])
    action = rig.controller.hold_action
    action[:3] += (-0.1, 0.6, -0.2)
    worst = np.zeros(7)
    rig.controller.set_goal(action, PERIOD)
    for _ in range(1000):
        rig.simulation.tick(1)
        worst = np.maximum(worst, np.abs(rig.state.data.qvel[:7]))
    assert (worst <= most * 1.01).all()
    assert worst.max() > 0.8  # it hurried
    assert hand(rig).translation == pytest.approx(action[:3], abs=1e-3)


def test_goals_stay_within_their_limits(alone):
    rig = arm(
        alone,
        input_ref_frame="world",
        goal_update_mode="desired",
        position_limits=((-9, -0.02, 0), (9, 0.02, 9)),
        orientation_limits=(-0.1, 0.1),
    )
    start = hand(rig)
    action = rig.controller.hold_action
    action[1] = 1.0
    action[3:7] = pin.Quaternion(pin.exp3(np.array([0.0, 0.3, 0.0]))).coeffs()
    run(rig, action, 1.0)
    assert hand(rig).translation[1] == pytest.approx(0.02, abs=1e-4)
    turned = pin.log3(hand(rig).rotation @ start.rotation.T)
    assert turned == pytest.approx([0.0, 0.1, 0.0], abs=1e-3)
