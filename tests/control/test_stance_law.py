"""The laws of standing legs against NumPy, QP solvers and MuJoCo."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest
import qpsolvers
from textbook_laws import commands, kernel_commands, textbook

from wbc_suite.control import load_composite_controller_config
from wbc_suite.control.law.balance import SHARE_COST, TRUNK_COST
from wbc_suite.control.law.free_root import RootMotion
from wbc_suite.control.law.stance import LEAST_PRESSURE
from wbc_suite.control.loop.records import LawKind
from wbc_suite.linear_algebra import pseudo_inverse, solve

ROBOTS = ("Spot", "SpotWithArm", "GR1FreeBody")


def stance_of(scene):
    feet = (LawKind.STANCE, LawKind.BALANCE)
    return next(x for x in scene.controller.laws if x.record["kind"][0] in feet)


def random_state(scene, home, rng):
    """Put robot and targets anywhere near; far targets ask more than feet can give."""
    model, data = scene.state.model, scene.state.data
    joints = stance_of(scene).drives["qpos"]
    data.qpos[:] = home
    data.qpos[joints] += rng.uniform(0.0, 0.3) * rng.normal(size=len(joints))
    data.qpos[:7] += 0.03 * rng.normal(size=7)
    data.qpos[3:7] /= np.linalg.norm(data.qpos[3:7])
    data.qvel[:] = rng.uniform(0.0, 0.5) * rng.normal(size=model.nv)
    mujoco.mj_step1(model, data)
    far, n = rng.choice([0.01, 0.1]), len(joints)
    moved = data.qpos[joints] + far * rng.normal(size=n)
    for law in scene.controller.laws:
        if len(law.joints) == n:
            law.aim(moved, 0.3 * rng.normal(size=n), rng.normal(size=n))
    pose = pin.XYZQUATToSE3(data.qpos[[0, 1, 2, 4, 5, 6, 3]])
    stance_of(scene).lead(
        RootMotion(
            start=pose * pin.exp6(far * rng.normal(size=6)),
            behind=0.01 * rng.normal(size=6),
            twist=0.1 * rng.normal(size=6),
            curve=0.3 * rng.normal(size=6),
            bend=rng.normal(size=6),
        )
    )


def disagreement(scene, home, seed):
    """Return how far kernel and formula are apart, relative, in one state."""
    random_state(scene, home, np.random.default_rng(seed))
    simulation = scene.simulation
    tables = simulation._laws.copy(), simulation._drives.copy()
    expected = commands(scene.state, scene.controller.laws)
    force = stance_of(scene).record["stance"]["force"].copy()
    asked = simulation._drives["desired"].copy()
    simulation._laws[:], simulation._drives[:] = tables
    compiled = kernel_commands(simulation, scene.state)
    found = stance_of(scene).record["stance"]["force"]
    size = 1.0 + max(np.abs(asked).max(), np.abs(force).max())
    apart = (compiled - expected, found - force, simulation._drives["desired"] - asked)
    return max(np.abs(values).max() for values in apart) / size


def worst_disagreement(scene, count):
    home = scene.state.data.qpos.copy()
    return max(disagreement(scene, home, seed) for seed in range(count))


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_the_kernel_equals_the_formula(alone, name):
    assert worst_disagreement(alone(name), 100) < 1e-10


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_the_kernel_equals_the_formula_everywhere(alone, name):
    assert worst_disagreement(alone(name), 1000) < 1e-10


class Truth:
    """The same robot's equations of motion, in MuJoCo's own words."""

    def __init__(self, scene):
        model, data, law = scene.state.model, scene.state.data, stance_of(scene)
        self.M = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, self.M)
        self.h = data.qfrc_bias - data.qfrc_passive
        stance = law.record["stance"][0]
        rows, rates = [], []
        for k in range(stance["feet"]):
            J, rate = np.zeros((6, model.nv)), np.zeros((6, model.nv))
            site = int(stance["site"][k])
            mujoco.mj_jacSite(model, data, J[:3], J[3:], site)
            body = int(model.site_bodyid[site])
            place = data.site_xpos[site]
            mujoco.mj_jacDot(model, data, rate[:3], rate[3:], place, body)
            rows.append(J[: stance["rows"][k]])
            rates.append(rate[: stance["rows"][k]] @ data.qvel)
        self.J, self.drift = np.concatenate(rows), np.concatenate(rates)
        self.f = stance["force"][: len(self.J)]
        self.a = np.zeros(model.nv)
        for other in scene.controller.laws:
            if textbook(other, scene.state).is_following:
                self.a[other.drives["dof"]] = other.drives["desired"]
        self.a[:6] = stance["desired"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_torques_and_contact_forces_move_the_robot_as_asked(alone, name):
    """The equations of motion hold, root included, and feet stay where they are."""
    scene = alone(name)
    home, data = scene.state.data.qpos.copy(), scene.state.data
    for seed in range(10):
        random_state(scene, home, np.random.default_rng(seed))
        kernel_commands(scene.simulation, scene.state)
        truth = Truth(scene)
        missing = truth.M @ truth.a + truth.h - truth.J.T @ truth.f
        if (
            truth.f[2::3].min() > 0.0
            or stance_of(scene).record["kind"][0] == LawKind.BALANCE
        ):
            np.testing.assert_allclose(missing[:6], 0.0, atol=1e-8)
        for law in scene.controller.laws:
            if textbook(law, scene.state).is_following:
                tau = law.drives["command"] - law.drives["saturation"]
                np.testing.assert_allclose(missing[law.drives["dof"]], tau, atol=1e-8)
        settling = -30.0 * truth.J @ data.qvel
        feet = truth.J @ truth.a + truth.drift - settling
        assert np.abs(feet).max() < 0.02 * (1.0 + np.abs(truth.a).max())


@pytest.mark.slow
def test_the_law_of_soles_solves_the_stated_qp(alone):
    scene = alone("GR1FreeBody")
    law = textbook(stance_of(scene), scene.state)
    home, changed = scene.state.data.qpos.copy(), 0
    for seed in range(30):
        random_state(scene, home, np.random.default_rng(seed))
        asked = np.zeros(scene.state.model.nv)
        dynamics = law._standing(scene.state, asked[law._dofs])
        wrench = dynamics.A @ law._root_acceleration(scene.state, dynamics) + dynamics.b
        rows, low, high = law._bounds(scene.state, dynamics)
        J, weights = dynamics.J[:, :6], law._weights
        even = np.linalg.solve(
            np.block([[np.diag(weights), J], [J.T, np.zeros((6, 6))]]),
            np.r_[np.zeros(len(J)), wrench],
        )[: len(J)]
        effect = np.vstack(
            [J[:, :3].T / dynamics.M[0, 0], TRUNK_COST * dynamics.lift[3:] @ J.T]
        )
        H = effect.T @ effect + SHARE_COST**2 * np.diag(weights)
        up, down = np.isfinite(high), np.isfinite(low)
        f = qpsolvers.solve_qp(
            1e6 * H,
            -1e6 * H @ even,
            G=np.vstack([rows[up], -rows[down]]),
            h=np.r_[high[up], -low[down]],
            solver="quadprog",
        )
        found = law._forces(scene.state, dynamics, wrench)
        expected = even if f is None else f
        changed += int(f is not None and not np.allclose(f, even, atol=1e-6))
        np.testing.assert_allclose(found, expected, atol=1e-8 * np.abs(even).max())
    assert changed > 5


@pytest.mark.slow
def test_arms_swing_no_harder_than_feet_can_bear(alone):
    """Each foot is left 10 N, exactly so where the arm is held back."""
    scene = alone("SpotWithArm")
    law, data = stance_of(scene), scene.state.data
    scene.simulation.tick(1)
    mujoco.mj_step1(scene.state.model, data)
    arm = [d for d, j in zip(law.drives["dof"], law.joints, strict=True) if "arm" in j]
    pressed, parts = [], []
    for size in (1.0, 30.0, 100.0, 300.0):
        asked = np.zeros(scene.state.model.nv)
        asked[arm[1]] = size
        textbook(law, scene.state).stand(scene.state, asked)
        pressed.append(law.record["stance"]["force"][0, 2:12:3].min())
        parts.append(asked[arm[1]] / size)
    assert parts[0] == 1.0
    assert pressed[0] > LEAST_PRESSURE
    assert parts[-1] < 1.0
    np.testing.assert_allclose(pressed[-1], LEAST_PRESSURE, atol=1e-9)


@pytest.mark.slow
def test_a_hand_that_presses_on_the_floor_does_not_lift_the_feet(alone):
    """It pressed with 140 N, and three feet left the ground.

    The floor is higher than the controller was told: else no hand presses on it.
    """
    config = load_composite_controller_config("WHOLE_BODY_IK", "SpotWithArm")
    scene = alone("SpotWithArm", limits={**config["limits"], "floor": -1.0})
    model, data = scene.state.model, scene.state.data
    feet = [f.name for f in scene.robot.frames if f.role == "foot"]
    start, hardest = np.array([scene.site(foot) for foot in feet]), 0.0
    layout, action = scene.controller.layout, scene.controller.hold_action
    at = layout["right_hand"].start
    action[at : at + 3] = [2.4, 1.1, -3.5]
    scene.controller.set_goal(layout.clip(action)[0])
    floor, wrench = 0, np.zeros(6)
    for _ in range(75):
        scene.simulation.tick(10)
        for i, contact in enumerate(data.contact[: data.ncon]):
            bodies = model.geom_bodyid[[contact.geom1, contact.geom2]]
            other = model.body(bodies.max()).name
            if floor in bodies and "leg" not in other and "foot" not in other:
                mujoco.mj_contactForce(model, data, i, wrench)
                hardest = max(hardest, wrench[0])
        moved = np.array([scene.site(foot) for foot in feet]) - start
        assert np.abs(moved[:, 2]).max() < 2e-3
        assert np.abs(moved).max() < 2e-2  # the lightest foot slips a little
    assert hardest > 10.0


@pytest.mark.slow
def test_an_arm_on_legs_learns_what_pulls_at_its_hand(alone):
    """10 N at the hand: 25 mm without the observer, 4 mm with it.

    What is left is the trunk, which leans: the law of feet has no observer of its own.
    """
    moved = []
    for bandwidth in (0.0, 10.0):
        arm = {"type": "OSC_POSE", "disturbance_observer": bandwidth}
        parts = {"right": arm, "legs": {"type": "STANCE"}}
        scene = alone("SpotWithArm", "BASIC", body_parts=parts)
        model, data, start = (
            scene.state.model,
            scene.state.data,
            scene.site("right_tcp"),
        )
        hand = model.site_bodyid[model.site("robot0_right_tcp").id]
        data.xfrc_applied[hand, 2] = -10.0
        scene.simulation.tick(round(2.0 / scene.simulation.timestep))
        moved.append(np.linalg.norm(scene.site("right_tcp") - start))
    assert moved[0] > 10e-3
    assert moved[1] < 0.25 * moved[0]


def test_small_systems_are_solved():
    rng = np.random.default_rng(0)
    for rank in (6, 5, 3):
        B = rng.normal(size=(6, rank))
        A, out = B @ B.T, np.empty((6, 6))
        pseudo_inverse(A.copy(), 1e-9, out)
        expected = np.linalg.pinv(A, rcond=1e-9)
        np.testing.assert_allclose(out, expected, atol=1e-10 * np.abs(expected).max())
    A, B = rng.normal(size=(6, 6)), rng.normal(size=(6, 7))
    A[0, 0] = 0.0  # needs a pivot
    X = B.copy()
    solve(A.copy(), X, 6)
    np.testing.assert_allclose(A @ X, B, atol=1e-10)
