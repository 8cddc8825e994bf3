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
from wbc_suite.qp import ComTask, Problem, make_solver

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


def motion(
    configuration: Configuration, v: np.ndarray, edges: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Return X and x of `a = X y + x`, and R and r of `tau = R y + r`."""
    model, q, k = configuration.model, configuration.q, len(edges)
    data = model.createData()
    M = np.triu(pin.crba(model, data, q))
    M += np.triu(M, 1).T
    h = pin.nonLinearEffects(model, data, q, v)
    X, x = np.zeros((model.nv, k + model.nv - ROOT)), np.zeros(model.nv)
    X[ROOT:, k:] = np.eye(model.nv - ROOT)
    known = np.column_stack([edges.T[:ROOT], -M[:ROOT, ROOT:], -h[:ROOT]])
    solved = np.linalg.solve(M[:ROOT, :ROOT], known)
    X[:ROOT], x[:ROOT] = solved[:, :-1], solved[:, -1]
    R = M[ROOT:] @ X
    R[:, :k] -= edges[:, ROOT:].T
    return X, x, R, M[ROOT:] @ x + h[ROOT:]


def main() -> None:
    """Shift the centre of mass to the left, and print what the feet carry."""
    model = pin.buildSampleModelHumanoid()
    rest, v = pin.neutral(model), np.zeros(model.nv)
    configuration = Configuration(model, rest)
    com = ComTask(target=configuration.com + np.array([0.0, 0.02, 0.0]))
    com.bind(configuration)
    solver, moved = make_solver("daqp"), np.eye(model.nv)[ROOT:]
    greatest, load = 0.0, np.zeros(2)
    for _ in range(200):
        feet, edges = contacts(configuration)
        X, x, R, r = motion(configuration, v, edges)
        J, posture = com.jacobian(configuration), configuration.difference(rest)
        rows = [  # Jacobian, wanted acceleration, cost
            (feet, -2.0 * KD * feet @ v, 100.0),
            (J, KP * com.error(configuration) - KD * J @ v, 10.0),
            (moved, (KP * posture - KD * v)[ROOT:], 1.0),
        ]
        problem = Problem(X.shape[1], inequalities=2 * len(r))
        problem.H[:] = 1e-6 * np.eye(problem.nv)
        for J, wanted, cost in rows:
            problem.H += cost**2 * (J @ X).T @ (J @ X)
            problem.c -= cost**2 * (J @ X).T @ (wanted - J @ x)
        problem.lb[: len(edges)] = 0.0
        problem.G[:] = np.concatenate([R, -R])
        problem.h[:] = np.concatenate([EFFORT - r, EFFORT + r])
        found = solver.solve(problem)
        assert found is not None
        y = found[0]
        v += DT * (X @ y + x)
        configuration.update(configuration.integrate(DT * v))
        load = y[: len(edges)].reshape(2, -1).sum(axis=1)
        greatest = max(greatest, np.abs(R @ y + r).max())
    missing = 1e3 * np.linalg.norm(com.error(configuration))
    print(f"left and right foot carry {load[0]:.0f} and {load[1]:.0f} N")
    print(f"the centre of mass is {missing:.1f} mm from its target")
    print(f"motors gave {greatest:.0f} N m at most")


if __name__ == "__main__":
    main()
