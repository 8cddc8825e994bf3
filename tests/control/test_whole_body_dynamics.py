"""WHOLE_BODY_ID: its terms, its QP, and robots that stand, walk and are pushed."""

import tomllib

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from textbook_laws import write_once

import wbc_suite
from wbc_suite.cli.teleop import default_controller
from wbc_suite.control import load_composite_controller_config
from wbc_suite.control.contact.arrays import EDGES
from wbc_suite.control.contact.qp_fallback import QpFallback
from wbc_suite.control.contact.terms import write_frame_terms, write_terms
from wbc_suite.control.ground.physics import bind_physics
from wbc_suite.control.reasons import Contact, InMotion
from wbc_suite.control.walking.config import (
    default_dynamics_config,
)
from wbc_suite.control.walking.report import FallCause
from wbc_suite.errors import ConfigError
from wbc_suite.qp import ActiveLimit, OutOfReach
from wbc_suite.qp.solution import Fallback
from wbc_suite.robot import load_robot

ROBOTS = ("GR1FreeBody", "SpotWithArm")


class Walker:
    """A robot under WHOLE_BODY_ID."""

    def __init__(self, alone, name, **changes):
        found = alone(name, "WHOLE_BODY_ID", **changes)
        self.state, self.controller = found.state, found.controller
        self.simulation, self.robot = found.simulation, found.robot
        self.model, self.data = self.state.model, self.state.data
        self.body = self.controller.dynamics
        self.simulation.start()
        self.link = int(self.body.state["body"][0])

    def act(self, seconds, walk=(0.0, 0.0, 0.0), push=(0.0, 0.0, 0.0), each=None):
        layout = self.controller.layout
        action = layout.pack({"walk": walk}, base=self.controller.hold_action)
        for _ in range(round(seconds / 0.02)):
            self.controller.set_goal(action, 0.02)
            self.data.xfrc_applied[self.link, :3] = push
            self.simulation.tick(10)
            if each is not None:
                each()
        return self

    @property
    def balance(self):
        return self.controller.info(self.state)["balance"]

    def forces(self):
        """Return the contact forces that MuJoCo applies to the robot, upwards, N."""
        total, force = 0.0, np.zeros(6)
        for k in range(self.data.ncon):
            mujoco.mj_contactForce(self.model, self.data, k, force)
            frame = self.data.contact[k].frame.reshape(3, 3)
            total += abs((frame.T @ force[:3])[2])
        return total


@pytest.fixture(scope="module", params=ROBOTS)
def walking(request, alone):
    """A robot in the middle of a step."""
    return Walker(alone, request.param).act(1.9, (0.2, 0.1, 0.2))


@pytest.fixture(scope="module", params=ROBOTS)
def standing(request, alone):
    return Walker(alone, request.param).act(1.0)


def stepped(walker):
    """Bring MuJoCo's arrays to the state of the last tick's end."""
    mujoco.mj_step1(walker.model, walker.data)


def test_terms_are_those_of_mujoco(walking):
    body, data, model = walking.body, walking.data, walking.model
    stepped(walking)
    solve_once(walking)
    dofs, full = body.dofs, np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    np.testing.assert_allclose(body.terms.M, full[np.ix_(dofs, dofs)], atol=1e-12)
    np.testing.assert_allclose(body.terms.v, data.qvel[dofs])
    robot, q, v = walking.robot.to_pinocchio(), walking.state.q, walking.state.v
    free = robot.createData()
    pin.computeCentroidalMomentum(robot, free, q, v)
    np.testing.assert_allclose(body.terms.com, free.com[0], atol=1e-9)
    fingers = 2e-3 * np.abs(free.hg.linear).max()  # they are not in the law
    measured = body.terms.M[:3] @ body.terms.v
    np.testing.assert_allclose(measured, free.hg.linear, atol=fingers + 1e-6)
    np.testing.assert_allclose(body.terms.spin, free.hg.angular, atol=5e-3)


def test_frames_have_mujocos_jacobians_and_drifts(walking):
    body, data, model = walking.body, walking.data, walking.model
    stepped(walking)
    physics = bind_physics(model, data)
    write_terms(physics, body)
    for site in [*body.site, *body.hand]:
        link, p = int(model.site_bodyid[site]), data.site_xpos[site].copy()
        write_frame_terms(physics, body, link, p)
        linear, angular = np.zeros((2, 3, model.nv))
        mujoco.mj_jac(model, data, linear, angular, p, link)
        J = np.vstack([linear, angular])
        np.testing.assert_allclose(body.terms.J, J[:, body.dofs], atol=1e-12)
        np.testing.assert_allclose(body.terms.velocity, J @ data.qvel, atol=1e-10)
        mujoco.mj_jacDot(model, data, linear, angular, p, link)
        drift = np.vstack([linear, angular]) @ data.qvel
        np.testing.assert_allclose(body.terms.drift, drift, atol=1e-9)


def solve_once(walker):
    """Run the law's tick once more in the present state, without physics."""
    walker.body.state["stage"] = 0
    while not write_once(walker.simulation):
        walker.controller.finish_tick()


def test_the_answer_keeps_the_equations_of_motion_and_its_limits(walking):
    body, data = walking.body, walking.data
    stepped(walking)
    solve_once(walking)
    terms, n = body.terms, len(body.qpos)
    f, edges = body.qp.x[: len(terms.B)], len(terms.B)
    total = terms.M @ terms.a + terms.h - terms.B.T @ f
    np.testing.assert_allclose(total[:6], 0.0, atol=1e-9 * np.abs(terms.h).max())
    tau = data.ctrl[walking.controller.laws[0].drives["ctrl"]]
    np.testing.assert_allclose(total[6:], tau, atol=1e-8)
    _, _, _, low, high = body.limits
    assert (tau >= low - 1e-9).all()
    assert (tau <= high + 1e-9).all()
    assert (f >= body.qp.lower[:edges] - 1e-9).all()
    assert (terms.a[6:] >= body.qp.lower[edges : edges + n] - 1e-9).all()
    assert (terms.a[6:] <= body.qp.upper[edges : edges + n] + 1e-9).all()
    for k in range(len(body.site)):
        if body.plan.load[k] == 0.0:
            first, last = body.first_edge[k], body.first_edge[k + 1]
            np.testing.assert_array_equal(f[first:last], 0.0)


def test_daqp_finds_the_same_optimum(walking):
    qp, checked = walking.body.qp, 0
    for _ in range(20):
        walking.act(0.02, (0.2, 0.1, 0.2))
        stepped(walking)
        solve_once(walking)
        x = qp.x.copy()
        assert QpFallback(qp).solve(qp) is Fallback.NONE
        scale = np.maximum(1.0, np.abs(x))
        checked += 1
        found, best = cost(qp, x), cost(qp, qp.x)
        assert found <= best + 1e-6 * abs(best) + 1e-6
        np.testing.assert_allclose(
            (x / scale)[len(walking.body.terms.B) :],
            (qp.x / scale)[len(walking.body.terms.B) :],
            atol=2e-3,
        )
        qp.x[:] = x
    assert checked == 20


def cost(qp, x):
    square = 0.5 * np.sum((qp.W @ x - qp.e) ** 2)
    return square + 0.5 * qp.diagonal[0] @ x**2 - qp.diagonal[1] @ x


def test_the_root_is_eliminated_by_its_equations_of_motion(standing):
    body, rng = standing.body, np.random.default_rng(0)
    stepped(standing)
    solve_once(standing)
    terms, edges = body.terms, len(body.terms.B)
    for _ in range(5):
        y = rng.normal(size=len(body.qp.x))
        root = terms.root[:, :-1] @ y + terms.root[:, -1]
        left = terms.M[:6] @ np.concatenate([root, y[edges:]]) + terms.h[:6]
        right = terms.B[:, :6].T @ y[:edges]
        np.testing.assert_allclose(left, right, atol=1e-9 * np.abs(terms.h).max())


def test_planned_forces_are_those_of_the_simulation(standing):
    planned = standing.body.qp.x[: len(standing.body.terms.B)].sum()
    weight = 9.81 * standing.model.body_subtreemass[standing.link]
    assert planned == pytest.approx(weight, rel=0.01)
    mujoco.mj_forward(standing.model, standing.data)
    assert standing.forces() == pytest.approx(weight, rel=0.01)


def test_standing_feet_do_not_slip(standing):
    feet = standing.data.site_xpos[standing.body.site].copy()
    standing.act(1.0)
    moved = standing.data.site_xpos[standing.body.site] - feet
    np.testing.assert_allclose(moved, 0.0, atol=1e-3)
    assert len(standing.balance["stance"]) == len(feet)
    assert standing.balance["margin"] > 0.02
    assert standing.balance["unsolved"] == 0


@pytest.mark.parametrize(
    ("name", "speed"),
    [
        *(("GR1FreeBody", 0.3), ("G1FreeBody", 0.3)),
        *(("Spot", 0.8), ("SpotWithArm", 0.8), ("Go2", 0.6)),
        *(("Go2Arx5", 0.6), ("B1Z1", 0.6)),
    ],
)
def test_a_robot_walks_as_commanded_and_stands_again(alone, name, speed):
    walker = Walker(alone, name).act(2.5, (speed, 0.0, 0.0))
    start = walker.data.qpos[:3].copy()
    walker.act(2.0, (speed, 0.0, 0.0))
    way = walker.data.qpos[:3] - start
    np.testing.assert_allclose(way[:2], [2.0 * speed, 0.0], atol=0.06)
    walker.act(3.0)
    assert not walker.balance["walking"]
    assert walker.balance["fell"] is None
    np.testing.assert_allclose(walker.data.qvel[:3], 0.0, atol=0.02)


def test_h1_walks_on_blades_that_roll(alone):
    """Legs of five joints hold no sole flat while the weight shifts: it fell so."""
    walker = Walker(alone, "H1FreeBody").act(2.5, (0.3, 0.0, 0.0))
    start = walker.data.qpos[:3].copy()
    walker.act(2.0, (0.3, 0.0, 0.0))
    way = walker.data.qpos[:3] - start
    assert way[0] == pytest.approx(0.6, abs=0.06)
    walker.act(3.0)
    assert walker.balance["fell"] is None


@pytest.mark.parametrize("push", [(400, 0, 0), (-400, 0, 0), (0, 300, 0), (0, -300, 0)])
def test_gr1_steps_when_it_is_pushed(alone, push):
    walker = Walker(alone, "GR1FreeBody").act(1.0)
    walker.act(0.1, push=push).act(0.2)
    assert walker.balance["walking"]
    walker.act(3.5)
    assert walker.balance["fell"] is None
    assert walker.data.xmat[walker.link][8] > 0.98


@pytest.mark.parametrize("push", [(1500, 900, 0), (0, 0, -6000)])
def test_a_fall_is_reported_before_the_trunk_has_dropped_20_cm(alone, push):
    walker, torques, told = Walker(alone, "GR1FreeBody").act(0.7), [], []
    start = float(walker.data.xpos[walker.link][2])

    def note():
        torques.append(walker.data.ctrl.copy())
        if walker.balance["fell"] is not None and not told:
            told.append(start - walker.data.xpos[walker.link][2])

    walker.act(0.1, push=push, each=note).act(1.5, each=note)
    assert np.isfinite(torques).all()
    fall = walker.balance["fell"]
    assert fall.drop < 0.2
    assert told[0] < (0.2 if push[2] == 0 else 0.4)  # seen every 20 ms, at 8 m/s
    low = fall.drop > 0.15
    assert low == (fall.cause is FallCause.HEIGHT)
    assert ("too low" in str(fall)) == low
    assert (fall.tilt > np.deg2rad(53.0)) == (not low)


@pytest.mark.slow
def test_joints_of_a_robot_that_fell_come_to_rest_without_a_qp(alone):
    """A step cost 60 ms: no active set was found, and another solver was asked."""
    walker = Walker(alone, "GR1FreeBody").act(0.7)
    walker.act(0.1, push=(1500, 900, 0)).act(1.0)
    assert walker.balance["fell"] is not None
    before, calls = walker.balance["unsolved"], []
    for _ in range(250):
        walker.simulation.tick(10)
        calls.append(walker.simulation.loop_calls)
    assert walker.balance["unsolved"] == before
    assert max(calls) == 1
    joints = walker.controller.laws[0].drives["dof"]
    assert np.abs(walker.data.qvel[joints]).max() < 0.05
    assert np.isfinite(walker.data.ctrl).all()


def test_loads_of_feet_are_the_forces_of_the_simulation(standing):
    forces = [standing.balance["loads"][foot] for foot in standing.balance["stance"]]
    weight = 9.81 * standing.model.body_subtreemass[standing.link]
    np.testing.assert_allclose(
        np.sum(forces, axis=0), [0, 0, weight], atol=0.02 * weight
    )


@pytest.mark.parametrize("name", ROBOTS)
def test_a_hand_out_of_reach_is_reported_with_its_reason(alone, name):
    walker = Walker(alone, name).act(0.2)
    hand = walker.controller.info(walker.state)["ik"]["frames"]["right_hand"]
    assert hand["reached"]
    action = walker.controller.hold_action
    part = walker.controller.layout["right_hand"]
    action[part.start : part.start + 3] += [1.5, 0.0, 0.5]
    walker.controller.set_goal(action, 0.02)
    walker.simulation.tick(100)
    report = walker.controller.info(walker.state)["ik"]
    assert InMotion() in report["frames"]["right_hand"]["reasons"]
    walker.simulation.tick(4000)
    report = walker.controller.info(walker.state)["ik"]
    assert not report["reached"]
    reasons = report["frames"]["right_hand"]["reasons"]
    assert any(isinstance(r, ActiveLimit | OutOfReach) for r in reasons), reasons
    assert walker.balance["fell"] is None


def test_robots_with_a_file_walk_by_default():
    found = {
        name: load_composite_controller_config(robot=name)["type"]
        for name in ("GR1FreeBody", "Spot", "SpotWithArm", "GR1", "SpotWithArmFloating")
    }
    assert list(found.values()) == ["WHOLE_BODY_ID"] * 3 + ["WHOLE_BODY_IK"] * 2
    assert default_controller("Spot") == "WHOLE_BODY_ID"
    assert default_controller("Spot", "GR1") == "WHOLE_BODY_IK"


def test_a_load_in_the_hands_is_observed_and_held(alone):
    walker = Walker(alone, "GR1FreeBody", input_ref_frame="world").act(0.6)
    hands = walker.model.site_bodyid[walker.body.hand]
    walker.data.xfrc_applied[hands, 2] = -2.0 * 9.81
    before = walker.data.site_xpos[walker.body.hand].copy()
    walker.act(2.5)
    for hand in ("right_hand", "left_hand"):
        load = walker.balance["loads"][hand]
        np.testing.assert_allclose(load, [0.0, 0.0, -2.0 * 9.81], atol=2.0)
    moved = walker.data.site_xpos[walker.body.hand] - before
    np.testing.assert_allclose(moved, 0.0, atol=2e-3)


def test_a_load_that_is_gone_pushes_no_joint_past_its_limit(alone):
    """Such as that of a hand that slips off the edge of a table."""
    walker = Walker(alone, "SpotWithArm", input_ref_frame="world").act(0.5)
    wrist = walker.data.joint("robot0_arm_wr0")
    high = walker.model.joint("robot0_arm_wr0").range[1]
    walker.body.load[0, 3:] = -8.0 * walker.data.xaxis[wrist.id]
    wrist.qpos[0], wrist.qvel[0] = high - 0.15, 2.0
    passed = []
    walker.act(0.5, each=lambda: passed.append(wrist.qpos[0] - high))
    assert -0.15 < max(passed) < -0.03


def test_spot_holds_its_hand_in_the_world_while_it_marches(alone):
    walker = Walker(alone, "SpotWithArm", input_ref_frame="world").act(0.5)
    start = walker.data.site_xpos[walker.body.hand].copy()
    errors = []

    def note():
        errors.append(np.abs(walker.data.site_xpos[walker.body.hand] - start).max())

    walker.act(2.0, (0.0, 0.0, 0.0011), each=note)
    assert walker.body.gait.state["steps"][0] > 8
    assert max(errors) < 3e-3


def test_a_hand_follows_a_goal_in_the_heading_of_the_robot(alone):
    walker = Walker(alone, "SpotWithArm")
    layout, hold = walker.controller.layout, walker.controller.hold_action
    part = layout["right_hand"]
    hold[part.start] += 0.05
    walker.controller.set_goal(hold)
    before = walker.data.site_xpos[walker.body.hand[0]].copy()
    walker.simulation.tick(500)
    moved = walker.data.site_xpos[walker.body.hand[0]] - before
    np.testing.assert_allclose(moved, [0.05, 0.0, 0.0], atol=3e-3)


def test_plain_python_computes_the_same_torques(alone):
    found = []
    for compiled in (True, False):
        walker = Walker(alone, "Spot")
        pairs = walker.simulation.pairs
        simulation = type(walker.simulation)(
            walker.model, walker.data, pairs, compiled=compiled
        )
        simulation.start()
        simulation.tick(2)
        found.append(walker.data.ctrl.copy())
    np.testing.assert_allclose(*found, atol=1e-8)


def test_configs_are_refused_in_words():
    def load(robot, **changes):
        config = load_composite_controller_config("WHOLE_BODY_ID", "GR1FreeBody")
        return load_composite_controller_config(config | changes, robot)

    with pytest.raises(ConfigError, match="fixed root"):
        load("GR1")
    with pytest.raises(ConfigError, match="has a free root"):
        load_composite_controller_config({"type": "WHOLE_BODY_ID"}, "GR1FreeBody")
    with pytest.raises(ConfigError, match="two feet"):
        load("GR1FreeBody", foot=[{"frame": "left_foot"}, {"frame": "right_foot"}])
    with pytest.raises(ConfigError, match="four feet"):
        load("GR1FreeBody", gait={"type": "trot"})
    feet = load_composite_controller_config("WHOLE_BODY_ID", "GR1FreeBody")["foot"]
    with pytest.raises(ConfigError, match="Did you mean 'left_foot'"):
        load("GR1FreeBody", foot=[feet[0] | {"frame": "left_fot"}, feet[1]])
    with pytest.raises(ConfigError, match="heel < toes"):
        load("GR1FreeBody", foot=[{"frame": "left_foot", "sole": [1, 0, 0, 1]}] * 2)


def test_a_biped_without_a_file_stands_on_the_soles_of_its_shapes(caplog):
    robot = load_robot("GR1FreeBody")
    given = load_composite_controller_config("WHOLE_BODY_ID", robot)["foot"]
    found = default_dynamics_config(robot)
    assert [foot["frame"] for foot in found["foot"]] == ["left_foot", "right_foot"]
    for own, foot in zip(found["foot"], given, strict=True):
        np.testing.assert_allclose(own["sole"], foot["sole"], atol=0.02)
    text = caplog.text
    config = tomllib.loads(text[text.index("format = 1") :])
    read = load_composite_controller_config(config, robot)
    for own, foot in zip(read["foot"], found["foot"], strict=True):
        np.testing.assert_allclose(own["sole"], foot["sole"], atol=1e-3)


def test_a_biped_whose_soles_are_unsure_is_refused_with_what_its_shapes_suggest():
    robot = load_robot("GR1FreeBody")
    frames = {frame.name: frame for frame in robot.frames}
    x, y, z = frames["left_foot"].pos
    frames["left_foot"] = frames["left_foot"].model_copy(update={"pos": (x + 1, y, z)})
    moved = robot.model_copy(update={"frames": tuple(frames.values())})
    with pytest.raises(ConfigError, match="m beside its sole") as raised:
        default_dynamics_config(moved)
    text = str(raised.value)
    assert tomllib.loads(text[text.index("format = 1") :])["gait"]["type"] == "walk"
    legs = [
        link.model_copy(update={"collision": ()})
        if link.name == robot.link_of("left_foot")
        else link
        for link in robot.links
    ]
    with pytest.raises(ConfigError, match="no area of its collision shapes"):
        default_dynamics_config(robot.model_copy(update={"links": tuple(legs)}))
    without = robot.model_copy(update={"frames": ()})
    with pytest.raises(ConfigError, match="0 frames with the role 'foot'"):
        default_dynamics_config(without)


def test_an_environment_walks(alone):
    env = wbc_suite.make("Lift", robots="Spot", controller_configs="WHOLE_BODY_ID")
    env.reset(seed=0)
    layout = env.action_layout
    action = layout.pack({"walk": [-0.5, 0.0, 0.0]}, base=env.hold_action)
    for _ in range(30):
        *_, info = env.step(action)
    assert info["balance"]["walking"]
    assert info["balance"]["fell"] is None
    assert EDGES == 4
    env.close()


@pytest.mark.parametrize("name", ["Panda", "PandaOmron"])
def test_hands_reach_their_goals_without_feet_and_within_torques(alone, name):
    arm = alone(name, "WHOLE_BODY_ID", input_ref_frame="world")
    arm.simulation.start()
    own, data = arm.controller.dynamics, arm.state.data
    before, worst = data.site_xpos[own.hand[0]].copy(), 0.0
    way = np.array([0.08, -0.05, 0.06])
    action = arm.controller.hold_action
    start = arm.controller.layout["right_hand"].start
    action[start : start + 3] += way
    arm.controller.set_goal(action)
    for _ in range(1500):
        arm.simulation.tick(1)
        tau = data.ctrl[arm.controller.laws[0].drives["ctrl"]]
        worst = max(worst, *(own.limits[3] - tau), *(tau - own.limits[4]))
    assert worst <= 1e-9
    np.testing.assert_allclose(data.site_xpos[own.hand[0]] - before, way, atol=1e-3)
    assert "balance" not in arm.controller.info(arm.state)
    assert arm.controller.info(arm.state)["ik"]["reached"]
    assert ("walk" in [part.name for part in arm.controller.layout.slices]) == (
        name == "PandaOmron"
    )


@pytest.mark.parametrize("frame", ["world", "base"])
def test_a_base_drives_as_commanded_while_its_hand_stays_where_it_is(alone, frame):
    robot = alone("PandaOmron", "WHOLE_BODY_ID", input_ref_frame=frame)
    robot.simulation.start()
    own, data = robot.controller.dynamics, robot.state.data
    body = int(own.state["body"][0])

    def hand():
        p, R = data.xpos[body], data.xmat[body].reshape(3, 3)
        point = data.site_xpos[own.hand[0]]
        return point.copy() if frame == "world" else R.T @ (point - p)

    walk = [-0.1, 0.05, 0.1] if frame == "world" else [0.3, 0.1, 0.5]
    before, start = hand(), data.xpos[body].copy()
    layout = robot.controller.layout
    robot.controller.set_goal(
        layout.pack({"walk": walk}, base=robot.controller.hold_action)
    )
    robot.simulation.tick(1000)
    R = data.xmat[body].reshape(3, 3)
    assert np.arctan2(R[1, 0], R[0, 0]) == pytest.approx(2.0 * walk[2], abs=0.15)
    assert np.linalg.norm(data.xpos[body] - start) > 0.15
    np.testing.assert_allclose(hand(), before, atol=5e-3)


@pytest.mark.parametrize("name", ["GR1FreeBody", "Spot"])
def test_robots_walk_up_slopes(alone, name):
    """Gravity is turned instead of the ground: 5 degrees."""
    walker, angle = Walker(alone, name), np.deg2rad(5.0)
    walker.model.opt.gravity[:] = -9.81 * np.array([np.sin(angle), 0.0, np.cos(angle)])
    walker.simulation.start()
    walker.act(1.5)
    start = walker.data.qpos[:3].copy()
    walker.act(5.0, (0.25, 0.0, 0.0))
    way = walker.data.qpos[:3] - start
    np.testing.assert_allclose(way[:2], [1.1, 0.0], atol=0.25)
    assert walker.balance["fell"] is None


@pytest.mark.slow
@pytest.mark.parametrize("wait", [2.25, 2.75])
def test_gr1_does_not_put_weight_on_a_foot_in_the_air(alone, wait):
    """Pushed as a step begins, a foot is late: it was loaded 6 cm over the ground."""
    walker = Walker(alone, "GR1FreeBody").act(0.5)
    walker.act(wait, (0.2, 0.0, 0.0)).act(0.1, (0.2, 0.0, 0.0), push=(500, 0, 0))
    walker.act(4.0, (0.2, 0.0, 0.0))
    assert walker.balance["fell"] is None
    assert walker.data.xmat[walker.link][8] > 0.98


@pytest.mark.slow
def test_spots_hand_reaches_a_place_over_the_cube_and_reports_what_it_touches():
    config = load_composite_controller_config("WHOLE_BODY_ID", "SpotWithArm")
    config["input_ref_frame"] = "world"
    env = wbc_suite.make("Lift", robots="SpotWithArm", controller_configs=config)
    env.reset(seed=0)
    data, action = env.simulation.data, env.hold_action
    goal = data.body("cube").xpos + np.array([0.0, 0.0, 0.08])
    start = env.action_layout["right_hand"].start
    action[start : start + 3] = goal
    for _ in range(100):
        *_, info = env.step(action)
    hand = data.site(int(env.controllers[0].dynamics.hand[0])).xpos
    assert np.linalg.norm(hand - goal) < 2e-3
    assert info["ik"]["frames"]["right_hand"]["position_error"] < 2e-3
    action[start + 2] -= 0.08
    for _ in range(40):
        *_, info = env.step(action)
    reasons = info["ik"]["frames"]["right_hand"]["reasons"]
    assert {r.other for r in reasons if isinstance(r, Contact)} & {"table", "cube"}
    assert info["balance"]["fell"] is None
    env.close()


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_filtered_velocities_keep_torques_smooth_in_noise(alone, name):
    medians = {}
    for cutoff in (1e6, 25.0):  # Hz; without and with a filter
        noise = {"velocity_noise": 0.02}
        walker = Walker(alone, name, velocity_cutoff=cutoff, sensors=noise)
        changes = []
        layout, hold = walker.controller.layout, walker.controller.hold_action
        walker.controller.set_goal(layout.pack({"walk": [0.2, 0.0, 0.0]}, base=hold))
        for _ in range(1500):
            before = walker.data.ctrl.copy()
            walker.simulation.tick(1)
            changes.append(np.abs(walker.data.ctrl - before).max())
        assert walker.balance["fell"] is None
        assert walker.data.qpos[0] > 0.1
        medians[cutoff] = np.median(changes)
    assert medians[25.0] < min(2.0, medians[1e6])


@pytest.mark.slow
@pytest.mark.parametrize("push", [(250, 0, 0), (-150, 0, 0), (0, -300, 0)])
def test_gr1_turns_its_trunk_where_its_feet_may_not_step(alone, push):
    gait = load_composite_controller_config("WHOLE_BODY_ID", "GR1FreeBody")["gait"]
    walker = Walker(alone, "GR1FreeBody", gait=gait | {"recover": False}).act(1.0)
    tilt = []
    walker.act(0.1, push=push)
    walker.act(3.0, each=lambda: tilt.append(walker.data.xmat[walker.link][8]))
    assert min(tilt) < 0.98
    assert tilt[-1] > 0.99
    assert np.abs(walker.body.load).max() < 60.0  # stops of wrists are no loads
    assert walker.balance["fell"] is None
    assert walker.body.gait.state["steps"][0] == 0
