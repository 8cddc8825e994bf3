"""QP tasks that ask for accelerations: contact forces and torques of a humanoid.

Tasks of a stack give an error e and its Jacobian J. Here they ask for accelerations,
`J a = kp e - kd J v`, of a robot on its feet, whose equations of motion are

    M a + h = S^T tau + E^T f,   f >= 0 along the edges E of friction pyramids.

The variables are y = (f, a of the joints); the root's rows give its acceleration. Terms
of J' are left out, since the robot moves slowly. `WHOLE_BODY_ID` solves such a QP in
each step of the physics, with steps of the feet.
"""

import numpy as np
import pinocchio as pin

from wbc_suite.kinematics import Configuration
from wbc_suite.qp import ComTask, Problem
from wbc_suite.qp.solver import make_solver

KP, KD = 60.0, 16.0  # 1/s^2 and 1/s
DT = 0.005  # s
CORNERS = [(x, y, 0.0) for x in (-0.1, 0.1) for y in (-0.05, 0.05)]  # of each foot, m
FRICTION = 0.6 / np.sqrt(2.0)  # of pyramids within cones
EDGES = np.array([(x, y, 1.0) for x in (1, -1) for y in (1, -1)])
EDGES[:, :2] *= FRICTION
EFFORT = 300.0  # N m
ROOT = 6


def contacts(configuration: Configuration) -> tuple[np.ndarray, np.ndarray]:
    """Return the Jacobians of both feet, (12, nv), and of all edges, (k, nv)."""
    feet, edges = [], []
    for foot in ("lleg_effector_body", "rleg_effector_body"):
        J = configuration.frame_jacobian(foot, "aligned").copy()
        R = configuration.frame_pose(foot).rotation
        feet.append(J)
        points = [J[:3] - pin.skew(R @ np.array(p)) @ J[3:] for p in CORNERS]
        edges += [EDGES @ point for point in points]
    return np.concatenate(feet), np.concatenate(edges)


def main() -> None:
    """Shift the centre of mass to the left, and print what the feet carry."""
    model = pin.buildSampleModelHumanoid()
    q, v = pin.neutral(model), np.zeros(model.nv)
    configuration, data = Configuration(model, q), model.createData()
    com = ComTask(target=configuration.com + np.array([0.0, 0.02, 0.0]))
    com.bind(configuration)
    rest, solver = q.copy(), make_solver("daqp")
    joints = model.nv - ROOT
    for _ in range(200):
        configuration.update(q)
        feet, edges = contacts(configuration)
        M = pin.crba(model, data, q)
        M = np.triu(M) + np.triu(M, 1).T
        h = pin.nonLinearEffects(model, data, q, v)
        k = len(edges)
        # a = X y + x: the root follows from its own rows of the equations of motion
        X, x = np.zeros((model.nv, k + joints)), np.zeros(model.nv)
        X[ROOT:, k:] = np.eye(joints)
        known = np.column_stack([edges.T[:ROOT], -M[:ROOT, ROOT:], -h[:ROOT]])
        solved = np.linalg.solve(M[:ROOT, :ROOT], known)
        X[:ROOT], x[:ROOT] = solved[:, :-1], solved[:, -1]
        posture = pin.difference(model, q, rest)[ROOT:]
        rows = [  # Jacobian, wanted acceleration, cost
            (feet, -30.0 * feet @ v, 100.0),
            (J := com.jacobian(configuration), KP * com.error(configuration), 10.0),
            (np.eye(model.nv)[ROOT:], KP * posture, 1.0),
        ]
        problem = Problem(k + joints, inequalities=2 * joints)
        problem.H[:] = 1e-6 * np.eye(k + joints)
        for J, wanted, cost in rows:
            damped = wanted - (KD if J is not feet else 0.0) * (J @ v)
            problem.H += cost**2 * (J @ X).T @ (J @ X)
            problem.c -= cost**2 * (J @ X).T @ (damped - J @ x)
        problem.lb[:k] = 0.0
        torque, still = M[ROOT:] @ X, M[ROOT:] @ x + h[ROOT:]
        torque[:, :k] -= edges[:, ROOT:].T
        problem.G[:] = np.concatenate([torque, -torque])
        problem.h[:] = np.concatenate([EFFORT - still, EFFORT + still])
        answer = solver.solve(problem)
        assert answer is not None
        y = answer[0]
        v += DT * (X @ y + x)
        q = pin.integrate(model, q, DT * v)
    vertical = (y[:k].reshape(2, -1)).sum(axis=1)
    print(f"left and right foot carry {vertical[0]:.0f} and {vertical[1]:.0f} N")
    print(f"weight {9.81 * pin.computeTotalMass(model):.0f} N")
    missing = 1e3 * np.linalg.norm(com.error(configuration))
    print(f"the centre of mass is {missing:.1f} mm from its target")
    print(f"greatest torque {np.abs(torque @ y + still).max():.0f} N m")


if __name__ == "__main__":
    main()
