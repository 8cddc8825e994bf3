"""The law in operational space against NumPy, QP solvers and Pinocchio."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest
import qpsolvers
from osc_rig import OscRig
from textbook_laws import commands, kernel_commands, textbook

from wbc_suite.catalogue import Catalogue
from wbc_suite.control.law.osc_saturation import POSTURE_COST, SHORTENING_COST
from wbc_suite.qp import Problem
from wbc_suite.qp.least_change import least_change
from wbc_suite.qp.solver import DaqpSolver
from wbc_suite.robot import load_robot

ARMS = [
    name
    for name in Catalogue().names("robots")
    for robot in [load_robot(name)]
    if "right" in robot.hands and robot.root.kind != "free"  # see test_stance_law
]
FEW = ("Panda", "UR5e", "Tiago")


def random_state(rig, rng):
    """Put robot, gains, target and disturbance anywhere; return nothing."""
    model, data, law = rig.state.model, rig.data, rig.law
    drives = law.drives
    low, high = (
        np.maximum(drives["position_min"], -3.0),
        np.minimum(drives["position_max"], 3.0),
    )
    data.qpos[drives["qpos"]] = rng.uniform(low, high)
    data.qvel[:] = 0.5 * rng.normal(size=model.nv)
    mujoco.mj_step1(model, data)
    law.record["kp"], law.record["kd"] = rng.uniform(0, 600, 6), rng.uniform(1, 60, 6)
    law.record["speed"] = rng.choice([np.inf, 0.3], 2)
    pose = law.site_pose(rig.state)
    goal = pin.SE3(
        pin.exp3(0.3 * rng.normal(size=3)) @ pose.rotation,
        pose.translation + 0.1 * rng.normal(size=3),
    )
    law.set_goal(goal, start=pose, duration=rng.uniform(0.0, 0.1))
    drives["disturbance"] = rng.normal(size=len(drives))
    drives["last_velocity"] = data.qvel[drives["dof"]]
    drives["position"] = data.qpos[drives["qpos"]] + 0.2 * rng.normal(size=len(drives))


def disagreement(rig, seed):
    """Return how far kernel and formula are apart, relative, in one state."""
    random_state(rig, np.random.default_rng(seed))
    simulation = rig.simulation
    tables = simulation._laws.copy(), simulation._drives.copy()
    expected = commands(rig.state, rig.controller.laws)
    asked = rig.law.drives["desired"].copy()
    simulation._laws[:], simulation._drives[:] = tables
    compiled = kernel_commands(simulation, rig.state)
    size = 1.0 + np.abs(asked).max()
    apart = np.abs(rig.law.drives["desired"] - asked).max() / size
    return max(apart, np.abs(compiled - expected).max() / size)


@pytest.mark.slow
@pytest.mark.parametrize("saturation", ["clip", "qp"])
@pytest.mark.parametrize("name", FEW)
def test_the_kernel_equals_the_formula(alone, name, saturation):
    rig = OscRig(alone, name, saturation=saturation)
    assert max(disagreement(rig, seed) for seed in range(60)) < 1e-10


@pytest.mark.sample(6)
@pytest.mark.slow
@pytest.mark.parametrize("saturation", ["clip", "qp"])
@pytest.mark.parametrize("name", ARMS)
def test_the_kernel_equals_the_formula_everywhere(alone, name, saturation):
    rig = OscRig(alone, name, saturation=saturation)
    assert max(disagreement(rig, seed) for seed in range(1000)) < 1e-10


def accelerations(rig):
    """Return what the kernel asks of the arm's joints, at the present time."""
    rig.law.record["since"] -= rig.simulation.timestep  # which the kernel adds
    kernel_commands(rig.simulation, rig.state)
    return rig.law.drives["desired"].copy()


class Truth:
    """The same arm in Pinocchio."""

    def __init__(self, rig):
        state, law = rig.state, rig.law
        self.rig, self.model = rig, state.robot.to_pinocchio()
        self.data = self.model.createData()
        self.q, self.v = state.q, state.v
        joints = [self.model.joints[self.model.getJointId(j)] for j in law.joints]
        self.dofs = [joint.idx_v for joint in joints]
        self.frame = self.model.getFrameId(state.robot.hands["right"])
        axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        model, data = self.model, self.data
        self.h = pin.nonLinearEffects(model, data, self.q, self.v)
        self.M = pin.crba(model, data, self.q)
        self.M = np.triu(self.M) + np.triu(self.M, 1).T
        pin.forwardKinematics(model, data, self.q, self.v, np.zeros(model.nv))
        pin.computeJointJacobians(model, data, self.q)
        pin.updateFramePlacements(model, data)
        J = pin.getFrameJacobian(model, data, self.frame, axes)
        self.J, self.velocity = J[:, self.dofs], J @ self.v
        drift = pin.getFrameClassicalAcceleration(model, data, self.frame, axes)
        self.drift, self.pose = drift.vector, data.oMf[self.frame]

    def push(self):
        """Return x'' of a goal in the world without speed limits."""
        return self.pull() - self.rig.law.record["kd"][0] * self.velocity

    def pull(self):
        """Return what of x'' the goal asks for, `kd u`."""
        record = self.rig.law.record[0]
        target, twist = self.rig.law.target_pose()
        turn = pin.log3(target.rotation @ self.pose.rotation.T)
        error = np.concatenate([target.translation - self.pose.translation, turn])
        return record["kp"] * error + record["kd"] * twist


def in_the_world(alone, *, limits=True, **settings):
    """Return a Panda at a random state, goals in the world, and its truth."""
    rig = OscRig(alone, "Panda", input_ref_frame="world", **settings)

    def at(seed):
        random_state(rig, np.random.default_rng(seed))
        rig.law.record["speed"] = np.inf
        if not limits:
            drives = rig.law.drives
            drives["velocity_max"] = drives["position_max"] = np.inf
            drives["position_min"] = -np.inf
        return rig, Truth(rig)

    return at


def test_the_law_solves_the_stated_qp(alone):
    at = in_the_world(alone, limits=False, saturation="clip")
    for seed in range(25):
        rig, truth = at(seed)
        law, dofs = rig.law, truth.dofs
        M = truth.M[np.ix_(dofs, dofs)]
        if np.linalg.cond(truth.J @ np.linalg.solve(M, truth.J.T)) > 1e4:
            continue  # damped there
        rest = textbook(law)._rest(rig.state)
        a = qpsolvers.solve_qp(
            M,
            -M @ rest,
            A=truth.J,
            b=truth.push() - truth.drift,
            solver="quadprog",
        )
        found = accelerations(rig)
        np.testing.assert_allclose(found, a, rtol=1e-8, atol=1e-8 * np.abs(a).max())


def test_torques_are_those_of_pinocchio_s_dynamics(alone):
    at = in_the_world(alone, saturation="clip")
    for seed in range(25):
        rig, truth = at(seed)
        law, data = rig.law, rig.data
        kernel_commands(rig.simulation, rig.state)
        a = np.zeros(truth.model.nv)
        a[truth.dofs] = law.drives["desired"]
        tau = (truth.M @ a + truth.h)[truth.dofs]
        # passive forces are MuJoCo's own; the observer's part is known
        tau -= data.qfrc_passive[law.drives["dof"]] + law.drives["disturbance"]
        found = law.drives["command"] - law.drives["saturation"]
        np.testing.assert_allclose(found, tau, atol=1e-8 * (1 + np.abs(tau).max()))


@pytest.mark.slow
def test_at_limits_the_law_solves_the_stated_qp(alone):
    at = in_the_world(alone, saturation="qp")
    active = 0
    for seed in range(60):
        rig, truth = at(seed)
        law, dofs, n = rig.law, truth.dofs, 7
        M, J = truth.M[np.ix_(dofs, dofs)], truth.J
        mobility = J @ np.linalg.solve(M, J.T)
        if np.linalg.cond(mobility) > 1e3:
            continue
        law.record["keep_direction"] = 0.0
        nothing = np.zeros(rig.state.model.nv)
        a = textbook(law).acceleration(rig.state, nothing)
        law.record["keep_direction"] = 1.0
        full = np.zeros(truth.model.nv)
        full[dofs] = a
        tau = (truth.M @ full + truth.h)[dofs]
        tau -= rig.data.qfrc_passive[law.drives["dof"]] + law.drives["disturbance"]
        L, pull = np.linalg.inv(mobility), truth.pull()
        lower, upper = textbook(law).window(rig.state)
        longest, halves = np.zeros(2), np.zeros((6, 2))
        for k in (0, 1):
            x = np.where(np.arange(6) // 3 == k, pull, 0.0)
            longest[k] = np.sqrt(x @ L @ x)
            halves[:, k] = x / longest[k]
        W = np.hstack([J, halves])
        cost = np.diag(np.r_[np.zeros(n), np.full(2, SHORTENING_COST)])
        cost[:n, :n] = POSTURE_COST * M
        G = np.hstack([np.vstack([M, -M]), np.zeros((2 * n, 2))])
        h = np.r_[law.drives["command_max"] - tau, tau - law.drives["command_min"]]
        x = qpsolvers.solve_qp(
            W.T @ L @ W + cost,
            np.zeros(n + 2),
            G=G,
            h=h,
            lb=np.r_[lower - a, 0.0, 0.0],
            ub=np.r_[upper - a, longest],
            solver="quadprog",
        )
        found = accelerations(rig) - a
        if x is not None and np.abs(x).max() > 1e-6:
            active += 1
            np.testing.assert_allclose(found, x[:n], atol=1e-8 * np.abs(a).max())
    assert active > 5


def test_least_change_is_the_qp_s_solution():
    rng, found = np.random.default_rng(0), 0
    for _ in range(300):
        rows = rng.normal(size=(16, 9))
        rows /= np.linalg.norm(rows, axis=1)[:, None]
        middle, half = 0.8 * rng.normal(size=16), rng.uniform(0.0, 2.0, 16)
        problem = Problem(9, 16)
        problem.G[:], problem.h[:] = rows, middle + half
        problem.lower[9:] = middle - half
        answer, x = DaqpSolver().solve(problem), np.empty(9)
        work = np.empty((31, 9))
        assert least_change(rows, middle - half, middle + half, x, work) == (
            answer is not None
        )
        if answer is not None:
            found += 1
            np.testing.assert_allclose(x, answer[0], atol=1e-9)
    assert 50 < found < 300


def test_qp_keeps_the_direction_that_clip_loses(alone):
    """With 8 N m to spare, `clip` turns the hand aside, `qp` hardly."""
    aside = {}
    for saturation in ("clip", "qp"):
        rig = OscRig(
            alone,
            "Panda",
            input_type="absolute",
            input_ref_frame="world",
            saturation=saturation,
            kp=900.0,
        )
        drives = rig.law.drives
        bias = rig.data.qfrc_bias[drives["dof"]]
        drives["command_min"], drives["command_max"] = bias - 8.0, bias + 8.0
        start = rig.pose
        goal = pin.SE3(start.rotation, start.translation + np.array([0.1, 0.1, 0.0]))
        rig.controller.set_goal(rig.action(rig.values(goal)))
        rig.simulation.tick(20)
        moved = rig.position - start.translation
        along = np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0)
        assert moved @ along > 1e-3
        aside[saturation] = np.linalg.norm(moved - along * (moved @ along))
        aside[saturation] /= moved @ along
    assert aside["qp"] < 0.15
    assert aside["clip"] > 1.0
