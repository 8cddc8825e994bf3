"""Robots on their feet that track a motion, against MuJoCo, Pinocchio and quadprog."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest
import qpsolvers
from textbook_laws import textbook, write_once

from wbc_suite.control import load_composite_controller_config
from wbc_suite.control.contact.arrays import EDGES
from wbc_suite.control.contact.friction import FOOT_LOAD_MAX, STANCE_FORCE_MIN
from wbc_suite.control.contact.qp_bounds import FORCE_COST, MOTION_COST
from wbc_suite.control.contact.qp_rows import STANCE_FOOT
from wbc_suite.locomotion.gait import GRAVITY

ROBOTS = ("Spot", "SpotWithArm", "GR1FreeBody")


def random_state(scene, home, rng):
    """Put robot and motion anywhere near; some ask more than feet can give."""
    model, data = scene.state.model, scene.state.data
    body, law = scene.controller.standing.dynamics, scene.controller.laws[0]
    n, tracked = len(body.qpos), body.tracked
    data.qpos[:] = home
    data.qpos[body.qpos] += rng.uniform(0.0, 0.3) * rng.normal(size=n)
    data.qpos[:7] += 0.03 * rng.normal(size=7)
    data.qpos[3:7] /= np.linalg.norm(data.qpos[3:7])
    data.qvel[:] = rng.uniform(0.0, 0.5) * rng.normal(size=model.nv)
    mujoco.mj_step1(model, data)
    far = rng.choice([0.01, 0.1])
    tracked.joints[:] = 0.3 * rng.normal(size=(4, n))
    tracked.joints[0] = data.qpos[body.qpos] + far * rng.normal(size=n)
    law.aim(*tracked.joints)
    pose = pin.XYZQUATToSE3(data.qpos[[0, 1, 2, 4, 5, 6, 3]])
    start = pose * pin.exp6(far * rng.normal(size=6))
    tracked.start[:7] = pin.SE3ToXYZQUAT(start)
    sizes = np.array([[1e-5], [0.1], [0.3], [1.0]])
    tracked.root[:], tracked.since[:] = sizes * rng.normal(size=(4, 6)), 0.0


def solve_once(scene):
    """Compute commands in the present state; return the robot's QP."""
    standing = scene.controller.standing
    standing.dynamics.state["stage"] = 0
    while not write_once(scene.simulation):
        standing.finish_tick()
    return standing.dynamics


class Truth:
    """The same robot's equations of motion and motion, in MuJoCo's own words."""

    def __init__(self, scene):
        model, data = scene.state.model, scene.state.data
        body = scene.controller.standing.dynamics
        self.dofs, self.body, self.data = body.dofs, body, data
        M = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, M)
        self.M = M[np.ix_(self.dofs, self.dofs)]
        self.h = (data.qfrc_bias - data.qfrc_passive)[self.dofs]
        self.mass = model.body_subtreemass[int(body.state["body"][0])]
        self.feet, drifts, edges, forces = [], [], [], []
        mu = float(body.state["friction"][0]) / np.sqrt(2.0)
        for k, site in enumerate(body.site):
            link, R = model.site_bodyid[site], data.site_xmat[site].reshape(3, 3)
            way = R @ body.middle[k] if body.is_sole[k] else body.middle[k]
            J, drift = self.jacobian(model, data.site_xpos[site] + way, link)
            count = 6 if body.is_sole[k] else 3
            self.feet.append(J[:count])
            drifts.append(drift[:count])
            for i in range(body.first_edge[k], body.first_edge[k + 1]):
                signs = [(1, 1), (1, -1), (-1, 1), (-1, -1)][i % EDGES]
                force = np.array([mu * signs[0], mu * signs[1], 1.0])
                arm = np.zeros(3)
                if body.is_sole[k]:
                    force = R @ force
                    arm = R @ np.array([*body.corner[i // EDGES], 0.0])
                edges.append(J[:3].T @ force + J[3:].T @ np.cross(arm, force))
                forces.append(force)
        self.J, self.drift = np.concatenate(self.feet), np.concatenate(drifts)
        self.B, self.forces = np.array(edges).T, np.array(forces).T

    def jacobian(self, model, place, link):
        J, rate = np.zeros((6, model.nv)), np.zeros((6, model.nv))
        mujoco.mj_jac(model, self.data, J[:3], J[3:], place, link)
        mujoco.mj_jacDot(model, self.data, rate[:3], rate[3:], place, link)
        return J[:, self.dofs], rate @ self.data.qvel

    def errors(self):
        """Return errors of position and velocity, and the acceleration, (6 + n,)."""
        tracked, s = self.body.tracked, float(self.body.tracked.since[0])
        root, data = tracked.root, self.data
        way = root[0] + s * root[1] + s**2 / 2 * root[2] + s**3 / 6 * root[3]
        v = root[1] + s * root[2] + s**2 / 2 * root[3]
        a = root[2] + s * root[3]
        goal = pin.XYZQUATToSE3(tracked.start[:7]) * pin.exp6(way)
        now = pin.XYZQUATToSE3(data.qpos[[0, 1, 2, 4, 5, 6, 3]])
        R, p, rate, jerk = goal.rotation, *tracked.joints[:2], tracked.joints[3]
        p = p + s * rate + s**2 / 2 * tracked.joints[2] + s**3 / 6 * jerk
        rate = rate + s * tracked.joints[2] + s**2 / 2 * jerk
        e = [goal.translation - now.translation, pin.log3(now.rotation.T @ R)]
        wanted = [R @ (a[:3] + np.cross(v[3:], v[:3])), a[3:]]
        return (
            np.concatenate([*e, p - data.qpos[self.body.qpos]]),
            np.concatenate([R @ v[:3], v[3:], rate]) - data.qvel[self.dofs],
            np.concatenate([*wanted, tracked.joints[2] + s * jerk]),
        )

    def optimum(self, asked):
        """Return a and y of the stated QP by quadprog."""
        body, state = self.body, self.body.state[0]
        size, edges = len(self.dofs), self.B.shape[1]
        e, e_rate, wanted = self.errors()
        kp = np.repeat(state["stiffness"], 3)
        of_root = wanted[:6] + kp * e[:6] + 2.0 * np.sqrt(kp) * e_rate[:6]
        of_joints = wanted + kp[0] * e + 2.0 * np.sqrt(kp[0]) * e_rate
        settling = -STANCE_FOOT[1] * self.J @ self.data.qvel[self.dofs]
        rows = [STANCE_FOOT[0] * np.hstack([self.J, np.zeros((len(self.J), edges))])]
        right = [STANCE_FOOT[0] * (settling - self.drift)]
        com = np.hstack([np.zeros((3, size)), self.forces / self.mass])
        rows.append(state["com_weight"] * com)
        momentum = self.M[:3] @ of_joints + self.h[:3]
        right.append(state["com_weight"] * momentum / self.mass)
        root = np.repeat(state["root_weight"], 3)
        rows.append(root[:, None] * np.eye(size + edges)[:6])
        right.append(root * of_root)
        weights = np.r_[np.zeros(6), body.posture_weight, np.full(edges, FORCE_COST)]
        rows.append(np.diag(weights))
        right.append(weights * np.r_[np.zeros(6), asked, np.zeros(edges)])
        W, b = np.vstack(rows), np.concatenate(right)
        least_cost = np.r_[np.zeros(6), np.full(size - 6, MOTION_COST), np.zeros(edges)]
        H = W.T @ W + np.diag(least_cost)
        motion = np.hstack([self.M, -self.B])
        low, high = body.limits[3] - self.h[6:], body.limits[4] - self.h[6:]
        counts = np.repeat(np.diff(body.first_edge), np.diff(body.first_edge))
        bound = np.r_[np.full(size, np.inf), np.full(edges, 0.0)]
        bound[size:] = FOOT_LOAD_MAX * self.mass * GRAVITY / EDGES
        least = np.r_[np.full(size, -np.inf), STANCE_FORCE_MIN / counts]
        x = qpsolvers.solve_qp(
            H,
            -W.T @ b,
            G=np.vstack([motion[6:], -motion[6:]]),
            h=np.concatenate([high, -low]),
            A=motion[:6],
            b=-self.h[:6],
            lb=least,
            ub=bound,
            solver="quadprog",
        )
        return None if x is None else (x[:size], x[size:])


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_the_answer_is_the_optimum_of_the_stated_qp(alone, name):
    scene = alone(name)
    home, found, limited = scene.state.data.qpos.copy(), 0, 0
    for seed in range(30):
        random_state(scene, home, np.random.default_rng(seed))
        body = solve_once(scene)
        truth, law = Truth(scene), textbook(scene.controller.laws[0])
        nothing = np.zeros(scene.state.model.nv)
        expected = truth.optimum(law.acceleration(scene.state, nothing))
        if expected is None:  # no torques carry it: the fallback answers
            continue
        found += 1
        a, y = expected
        limited += int((y < 1.01 * STANCE_FORCE_MIN / 4).any())
        scale = 1.0 + np.abs(a).max()
        np.testing.assert_allclose(body.terms.a, a, atol=1e-4 * scale)
        np.testing.assert_allclose(body.qp.x[: len(y)], y, atol=1e-3 * y.max())
    assert found > 20
    assert limited > 3


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_torques_and_contact_forces_move_the_robot_as_asked(alone, name):
    """The equations of motion hold, root included, and feet stay where they are."""
    scene = alone(name)
    home, data = scene.state.data.qpos.copy(), scene.state.data
    for seed in range(10):
        random_state(scene, home, np.random.default_rng(seed))
        body = solve_once(scene)
        truth, edges = Truth(scene), len(body.terms.B)
        missing = truth.M @ body.terms.a + truth.h - truth.B @ body.qp.x[:edges]
        np.testing.assert_allclose(missing[:6], 0.0, atol=1e-8)
        drives = scene.controller.laws[0].drives
        tau = drives["command"] - drives["saturation"]
        np.testing.assert_allclose(missing[6:], tau, atol=1e-8)
        if not scene.controller.standing.fallback:
            assert (tau <= body.limits[4] + 1e-6).all()
            assert (tau >= body.limits[3] - 1e-6).all()
        settling = -STANCE_FOOT[1] * truth.J @ data.qvel[body.dofs]
        slip = truth.J @ body.terms.a + truth.drift - settling
        assert np.abs(slip).max() < 0.02 * (1.0 + np.abs(body.terms.a).max())


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

    What is left is the trunk, which leans: legs have no observer of their own.
    """
    moved = []
    for bandwidth in (0.0, 10.0):
        arm = {"type": "OSC_POSE", "disturbance_observer": bandwidth}
        parts = {"right": arm, "legs": {"type": "STANCE"}}
        scene = alone("SpotWithArm", "BASIC", body_parts=parts)
        model, data = scene.state.model, scene.state.data
        start = scene.site("right_tcp")
        hand = model.site_bodyid[model.site("robot0_right_tcp").id]
        data.xfrc_applied[hand, 2] = -10.0
        scene.simulation.tick(round(2.0 / scene.simulation.timestep))
        moved.append(np.linalg.norm(scene.site("right_tcp") - start))
    assert moved[0] > 10e-3
    assert moved[1] < 0.25 * moved[0]
