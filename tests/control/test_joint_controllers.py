"""Rows of the table of controllers whose actions are of joints."""

import numpy as np
import pytest

from wbc_suite.catalogue import Catalogue
from wbc_suite.control.robot_parts import parts_of
from wbc_suite.errors import ConfigError
from wbc_suite.robot import load_robot

PERIOD = 0.05
ROBOTS = [
    name if name in ("panda", "tiago") else pytest.param(name, marks=pytest.mark.slow)
    for name in Catalogue().names("robots")
]


def arm(alone, kind, robot="Panda", part="right", **settings):
    rig = alone(robot, "BASIC", body_parts={part: {"type": kind} | settings})
    rig.simulation.start()
    return rig


def run(rig, action, seconds, part="right"):
    for _ in range(round(seconds / PERIOD)):
        rig.controller.set_goal(action, PERIOD)
        rig.simulation.tick(round(PERIOD / rig.simulation.timestep))


def q_of(rig, part="right"):
    return rig.state.data.qpos[rig.controller.parts[part].law.drives["qpos"]].copy()


def v_of(rig, part="right"):
    return rig.state.data.qvel[rig.controller.parts[part].law.drives["dof"]].copy()


def act(rig, values, part="right"):
    return rig.controller.layout.pack({part: values}, base=rig.controller.hold_action)


@pytest.mark.sample(10)
@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_every_part_has_the_dimensions_and_bounds_of_the_table(alone, name):
    robot = load_robot(name)
    for part, joints in parts_of(robot).items():
        if part == "base":
            continue
        n = len(joints)
        ranges = [robot.joint(j).range or (-np.inf, np.inf) for j in joints]
        for mode, blocks in (("fixed", 1), ("variable_kp", 2), ("variable", 3)):
            for kind in ("delta", "absolute"):
                config = {"type": "JOINT_POSITION", "impedance_mode": mode}
                config |= {"input_type": kind, "gripper": None, "kp_limits": (0, 1200)}
                rig = alone(robot, "BASIC", body_parts={part: config}, may_fall=True)
                layout = rig.controller.layout
                assert layout.size == blocks * n
                names = (part, f"{part}_kp", f"{part}_kd")[:blocks]
                assert tuple(s.name for s in layout.slices) == names
                q_low, q_high = zip(*ranges, strict=True)
                if kind == "delta":
                    q_low, q_high = (-1.0,) * n, (1.0,) * n
                assert layout.low[:n].tolist() == list(q_low)
                assert layout.high[:n].tolist() == list(q_high)
                assert layout.low[n:].tolist() == [0.0] * (blocks - 1) * n
                ends = [1200.0] * n + [100.0] * n
                assert layout.high[n:].tolist() == ends[: (blocks - 1) * n]
        for kind in ("JOINT_VELOCITY", "JOINT_TORQUE"):
            config = {"type": kind, "gripper": None}
            rig = alone(robot, "BASIC", body_parts={part: config}, may_fall=True)
            assert rig.controller.layout.size == n
            assert rig.controller.layout.high.tolist() == [1.0] * n
            config["input_type"] = "absolute"
            rig = alone(robot, "BASIC", body_parts={part: config}, may_fall=True)
            field = "velocity" if kind == "JOINT_VELOCITY" else "effort"
            most = [getattr(robot.joint(j), field) for j in joints]
            assert rig.controller.layout.high.tolist() == most


@pytest.mark.parametrize("update", ["achieved", "desired"])
@pytest.mark.parametrize("ramp", [None, "linear"])
def test_steps_of_positions_add_up(alone, update, ramp):
    rig = arm(
        alone, "JOINT_POSITION", kp=400.0, interpolation=ramp, goal_update_mode=update
    )
    start = q_of(rig)
    action = act(rig, [0.4, -0.4, 0, 0, 0.4, 0, 0])
    run(rig, action, 3 * PERIOD)
    run(rig, rig.controller.hold_action, 1.0)
    moved = q_of(rig) - start
    if update == "desired":
        steps = 3 * 0.02 * np.array([1, -1, 0, 0, 1, 0, 0])
        assert moved == pytest.approx(steps, abs=1e-4)
    else:  # each step starts where the joint is
        assert 0.02 < moved[0] < 0.07
        assert moved[[2, 3, 5, 6]] == pytest.approx(np.zeros(4), abs=1e-4)


def test_absolute_positions_are_reached_and_kept_within_limits(alone):
    rig = arm(
        alone,
        "JOINT_POSITION",
        input_type="absolute",
        kp=400.0,
        qpos_limits=(-2.0, 0.5),
    )
    start = q_of(rig)
    low, high = rig.controller.layout.low[:7], rig.controller.layout.high[:7]
    assert (low >= -2.0 - 1.1).all()
    assert (high <= 0.5).all()
    goal = np.clip(start + 0.3, low, high)
    action = act(rig, goal)
    run(rig, action, 1.5)
    assert q_of(rig) == pytest.approx(goal, abs=1e-3)


def test_a_ramp_takes_its_part_of_the_period(alone):
    rig = arm(alone, "JOINT_POSITION", interpolation="linear", ramp_ratio=0.5, kp=400.0)
    law = rig.controller.parts["right"].law
    start = law.target()[0].copy()
    rig.controller.set_goal(act(rig, np.ones(7)), 0.1)
    for part, seconds in ((0.5, 0.024), (1.0, 0.026), (1.0, 0.05)):
        rig.simulation.tick(round(seconds / rig.simulation.timestep))
        way = law.target()[0] - start
        assert way == pytest.approx(np.full(7, 0.05 * part), abs=0.05 * 0.05)


def test_speed_limits_of_positions_limit(alone):
    rig = arm(
        alone,
        "JOINT_POSITION",
        input_type="absolute",
        kp=900.0,
        velocity_limits=(-0.4, 0.4),
    )
    goal = q_of(rig) + np.array([0.5, 0.3, -0.5, 0.5, -0.5, -0.5, 0.5])
    worst = 0.0
    rig.controller.set_goal(act(rig, goal), PERIOD)
    for _ in range(800):
        rig.simulation.tick(1)
        worst = max(worst, float(np.abs(v_of(rig)).max()))
    assert 0.38 < worst < 0.405
    assert q_of(rig) == pytest.approx(goal, abs=2e-3)


def test_gains_of_the_action_are_those_of_the_law(alone):
    rig = arm(alone, "JOINT_POSITION", impedance_mode="variable", kp_limits=(0, 1000))
    layout = rig.controller.layout
    kp, kd = np.linspace(100, 700, 7), np.linspace(5, 35, 7)
    action = layout.pack(
        {"right_kp": kp, "right_kd": kd}, base=rig.controller.hold_action
    )
    rig.controller.set_goal(action, PERIOD)
    law = rig.controller.parts["right"].law
    np.testing.assert_allclose(law.drives["kp"], kp)
    np.testing.assert_allclose(law.drives["kd"], kd)  # a damping, not a ratio
    np.testing.assert_allclose(rig.controller.hold_action[7:21], [*kp, *kd])
    rig = arm(alone, "JOINT_POSITION", impedance_mode="variable_kp")
    action = rig.controller.layout.pack(
        {"right_kp": np.full(7, 225.0)}, base=rig.controller.hold_action
    )
    rig.controller.set_goal(action, PERIOD)
    kd = rig.controller.parts["right"].law.drives["kd"]
    np.testing.assert_allclose(kd, 30.0)  # 2 sqrt(kp)


def test_a_joint_pushed_yields_by_its_stiffness(alone):
    for kp in (100.0, 300.0):
        rig = arm(alone, "JOINT_POSITION", kp=kp)
        start = q_of(rig)
        push = np.zeros(7)
        push[3] = 5.0
        dofs = rig.controller.parts["right"].law.drives["dof"]
        rig.state.data.qfrc_applied[dofs] = push
        run(rig, rig.controller.hold_action, 3.0)
        M = rig.state.mass_matrix()[np.ix_(dofs, dofs)]
        expected = np.linalg.solve(M, push) / kp
        assert q_of(rig) - start == pytest.approx(expected, rel=0.05, abs=1e-4)


def test_speeds_are_followed_and_kept_under_load(alone):
    rig = arm(alone, "JOINT_VELOCITY")
    dofs = rig.controller.parts["right"].law.drives["dof"]
    rig.state.data.qfrc_applied[dofs] = 3.0  # unknown to the law
    run(rig, act(rig, [0.5, 0.5, -0.5, 0.5, 1.0, -1.0, 1.0]), 0.6)
    wanted = np.array([0.25, 0.25, -0.25, 0.25, 0.5, -0.5, 0.5])
    assert v_of(rig) == pytest.approx(wanted, abs=0.02)


def test_a_joint_driven_into_its_stop_stops_smoothly_and_comes_back_at_once(alone):
    rig = arm(alone, "JOINT_VELOCITY", input_type="absolute")
    joint = rig.robot.joint("panda_joint4")
    speeds = []
    rig.controller.set_goal(act(rig, [0, 0, 0, 1.0, 0, 0, 0]), PERIOD)
    for _ in range(2000):
        rig.simulation.tick(1)
        speeds.append(v_of(rig)[3])
        assert q_of(rig)[3] <= joint.range[1] + 1e-3
    assert max(speeds) == pytest.approx(1.0, abs=0.02)
    assert abs(speeds[-1]) < 1e-3
    jolt = np.abs(np.diff(speeds)).max() / rig.simulation.timestep
    assert jolt < 60.0  # rad/s^2; a stop by contact takes thousands
    run(rig, act(rig, [0, 0, 0, -0.5, 0, 0, 0]), 0.3)
    assert v_of(rig)[3] == pytest.approx(-0.5, abs=0.05)


def test_speeds_jump_without_overshoot_and_end_without_turning_back(alone):
    rig = arm(alone, "JOINT_VELOCITY")
    speeds = []
    for value in (1.0, 0.0):
        rig.controller.set_goal(act(rig, np.full(7, value)), PERIOD)
        for _ in range(250):
            rig.simulation.tick(1)
            speeds.append(v_of(rig))
    assert np.max(speeds) < 0.5 * 1.01
    assert np.min(speeds) > -0.5 * 0.01
    assert np.min(speeds[80]) > 0.5 * 0.95  # after 0.16 s, 3 time constants
    assert np.abs(speeds[-1]).max() < 1e-3


def test_a_blocked_joint_does_not_wind_up(alone):
    rig = arm(alone, "JOINT_VELOCITY", windup_limit=0.05)
    law = rig.controller.parts["right"].law
    dof = law.drives["dof"][0]
    rig.state.data.qfrc_applied[dof] = -200.0  # more than the motor
    run(rig, act(rig, [1, 0, 0, 0, 0, 0, 0]), 1.0)
    gap = law.drives["position"] - q_of(rig)
    assert np.abs(gap).max() <= 0.05 + 1e-2


def test_a_default_torque_moves_the_arm_visibly(alone):
    rig = arm(alone, "JOINT_TORQUE")
    start = q_of(rig)
    run(rig, act(rig, [1, 0, 0, 0, 0, 0, 0]), 0.3)
    moved = q_of(rig) - start
    assert moved[0] > 0.05


def test_torques_are_those_asked_for_on_top_of_gravity(alone):
    rig = arm(alone, "JOINT_TORQUE", input_type="absolute", torque_limits=(-30, 30))
    assert rig.controller.layout.high[:7].tolist() == [30] * 4 + [12] * 3
    law = rig.controller.parts["right"].law
    asked = np.array([1.0, -2.0, 0.5, 1.0, 0.2, 0.3, -0.1])
    rig.controller.set_goal(act(rig, asked), PERIOD)
    rig.simulation.tick(1)
    data = rig.state.data
    gravity = data.qfrc_bias[law.drives["dof"]]
    assert data.ctrl[law.drives["ctrl"]] == pytest.approx(asked + gravity, abs=0.5)
    assert (np.abs(law.drives["command"]) <= 30.0).all()


@pytest.mark.parametrize("kind", ["JOINT_POSITION", "JOINT_VELOCITY", "JOINT_TORQUE"])
def test_without_compensation_an_arm_sinks(alone, kind):
    rig = arm(alone, kind, use_torque_compensation=False)
    start = q_of(rig)
    run(rig, rig.controller.hold_action, 0.3)
    assert np.abs(q_of(rig) - start).max() > 1e-3


def test_torque_limits_limit(alone):
    rig = arm(
        alone,
        "JOINT_POSITION",
        input_type="absolute",
        kp=900.0,
        torque_limits=(-40.0, 40.0),
    )
    law = rig.controller.parts["right"].law
    rig.controller.set_goal(act(rig, q_of(rig) + 0.5), PERIOD)
    for _ in range(50):
        rig.simulation.tick(1)
        assert np.abs(rig.state.data.ctrl[law.drives["ctrl"]]).max() <= 40.0


@pytest.mark.parametrize(
    ("settings", "word"),
    [
        ({"kp": [1.0, 2.0]}, "kp"),
        ({"output_max": [0.1] * 6}, "output_max"),
        ({"qpos_limits": (1.0, -1.0)}, "qpos_limits"),
        ({"input_min": 1.0}, "input_min"),
        ({"impedance_mode": "variable", "kd_limits": (9.0, 1.0)}, "kd_limits"),
    ],
)
def test_a_wrong_number_of_values_or_an_empty_range_is_named(alone, settings, word):
    with pytest.raises(ConfigError, match=word):
        arm(alone, "JOINT_POSITION", **settings)


@pytest.mark.parametrize(
    ("kind", "key", "value"),
    [
        ("JOINT_POSITION", "qpos_limits", (5.0, 6.0)),
        ("JOINT_POSITION", "velocity_limits", (8.0, 9.0)),
        ("JOINT_VELOCITY", "qpos_limits", (-9.0, -8.0)),
        ("JOINT_TORQUE", "torque_limits", (200.0, 300.0)),
        ("OSC_POSE", "torque_limits", (-300.0, -200.0)),
    ],
)
def test_limits_outside_the_robots_own_are_refused(alone, kind, key, value):
    with pytest.raises(ConfigError, match=f"key '{key}': .* nothing in common"):
        arm(alone, kind, **{key: value})
