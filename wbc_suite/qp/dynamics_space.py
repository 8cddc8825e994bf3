"""The space of contact forces and accelerations: its columns, and rows of tasks."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from wbc_suite.kinematics import Configuration
from wbc_suite.qp.task import RowTask
from wbc_suite.typing import Matrix, Vector

CONTACT_COST = 100.0
"""Cost of the acceleration of a contact, [cost]/(m/s^2)."""

CONTACT_DAMPING = 60.0
"""1/s; how fast the velocity of a contact decays."""

_STEP = 1e-6
"""Length of the motion whose difference gives the drift, rad or m."""


@dataclass(kw_only=True)
class Contact:
    """A frame that rests on the ground, which lies across the world's z axis.

    Attributes:
        frame: Name of the frame.
        points: Points of the frame that touch the ground, in its axes, m, (k, 3).
        friction: Coefficient.
        stage: From 0, which carries nothing, to 1; loads and unloads a foot.
        max_force: Greatest normal force at stage 1, N.
    """

    frame: str
    points: Sequence[Sequence[float]] = ((0.0, 0.0, 0.0),)
    friction: float = 0.6
    stage: float = 1.0
    max_force: float = 1e4


@dataclass(kw_only=True)
class MomentumTask:
    """Brings the momentum about the centre of mass to a target.

    Attributes:
        target: Linear (kg m/s), then angular momentum (kg m^2/s), shape (6,).
        cost: [cost] per unit of its rate, linear and angular.
        gain: Rate at which the error decays, 1/s.
        level: Strict priority.
    """

    target: Vector
    cost: tuple[float, float] = (1.0, 1.0)
    gain: float = 4.0
    level: int = 0
    name: str = "momentum"


class Rows(NamedTuple):
    """Rows `W (J a - wanted)` of the cost."""

    name: str
    level: int
    J: Matrix
    wanted: Vector
    cost: Vector


class Equations(NamedTuple):
    """Equations of motion `M a + h = S^T tau + edges^T f` and `a = X y + x`."""

    M: Matrix
    h: Vector
    edges: Matrix
    X: Matrix
    x: Vector


class DynamicsSpace:
    """Maps y = (forces along the edges of contacts, accelerations of joints) to motion.

    Args:
        configuration: The robot; `drift` moves it.
        contacts: What rests on the ground.

    Attributes:
        root: Number of velocities of the root that no motor moves, 6 or 0.

    Raises:
        UnknownNameError: If the model lacks the frame of a contact.
    """

    def __init__(
        self, configuration: Configuration, contacts: Sequence[Contact]
    ) -> None:
        self.contacts = tuple(contacts)
        self._configuration = configuration
        self._model: Any = configuration.model
        self._data: Any = self._model.createData()
        joints = self._model.joints
        free = len(joints) > 1 and joints[1].shortname() == "JointModelFreeFlyer"
        self.root = 6 if free else 0
        self._frames = [configuration.frame_id(c.frame) for c in self.contacts]

    def momentum_rows(self, task: MomentumTask, q: Vector, v: Vector) -> Rows:
        """Return rows of the rate of momentum."""
        model, data = self._model, self._data
        pin.computeCentroidalMomentumTimeVariation(model, data, q, v, 0.0 * v)
        drift, momentum = data.dhg.vector.copy(), data.hg.vector.copy()
        wanted = task.gain * (np.asarray(task.target) - momentum) - drift
        J = pin.computeCentroidalMap(model, data, q).copy()
        return Rows(task.name, task.level, J, wanted, np.repeat(task.cost, 3))

    def drift(self, task: RowTask, q: Vector, v: Vector) -> Vector:
        """Return J' v: the change of J v along the motion, without acceleration."""
        speed, rates = float(np.linalg.norm(v)), list[Vector]()
        if speed < _STEP:
            return np.zeros(task.dim)
        step = _STEP / speed
        for side in (step, -step):
            self._configuration.update(pin.integrate(self._model, q, side * v))
            rates.append(task.jacobian(self._configuration) @ v)
        return (rates[0] - rates[1]) / (2.0 * step)

    def contact_rows(self, q: Vector, v: Vector) -> tuple[Matrix, list[Rows]]:
        """Return the generalised force of each edge, (edges, nv), and rows at rest."""
        model, data = self._model, self._data
        aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        pin.forwardKinematics(model, data, q, v, 0.0 * v)
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        edges, rows = [np.zeros((0, model.nv))], list[Rows]()
        for contact, frame in zip(self.contacts, self._frames, strict=True):
            J = pin.getFrameJacobian(model, data, frame, aligned)
            drift = pin.getFrameClassicalAcceleration(
                model, data, frame, aligned
            ).vector
            arms = np.asarray(contact.points) @ data.oMf[frame].rotation.T
            for arm in arms:
                J_point = J[:3] - pin.skew(arm) @ J[3:]
                edges.append(_pyramid(contact.friction) @ J_point)
            fixed = (
                6 if len(arms) > 2 else 3
            )  # fewer points leave the frame free to turn
            wanted = -drift[:fixed] - CONTACT_DAMPING * (J[:fixed] @ v)
            cost = np.full(fixed, CONTACT_COST if contact.stage > 0.0 else 0.0)
            rows.append(Rows(contact.frame, 0, J[:fixed].copy(), wanted, cost))
        return np.concatenate(edges), rows

    def equations(self, q: Vector, v: Vector, edges: Matrix) -> Equations:
        """Return the equations of motion; those of the root give its acceleration."""
        upper: Matrix = np.triu(pin.crba(self._model, self._data, q))
        M: Matrix = upper + np.triu(upper, 1).T
        h: Vector = pin.nonLinearEffects(self._model, self._data, q, v).copy()
        n, r, k = len(h), self.root, len(edges)
        X, x = np.zeros((n, k + n - r)), np.zeros(n)
        X[r:, k:] = np.eye(n - r)
        if r:
            known: Matrix = np.column_stack([edges.T[:r], -M[:r, r:], -h[:r]])
            solved: Matrix = np.linalg.solve(M[:r, :r], known)
            X[:r], x[:r] = solved[:, :-1], solved[:, -1]
        return Equations(M, h, edges, X, x)

    def forces(self, y: Vector) -> dict[str, Matrix]:
        """Return the force at each point, world axes."""
        forces, first = dict[str, Matrix](), 0
        for contact in self.contacts:
            last = first + 4 * len(contact.points)
            along = y[first:last].reshape(-1, 4)
            forces[contact.frame] = along @ _pyramid(contact.friction)
            first = last
        return forces


def _pyramid(friction: float) -> Matrix:
    """Return the edges of a friction pyramid within the cone, 1 N upwards, (4, 3)."""
    mu = friction / np.sqrt(2.0)
    return np.array([(x, y, 1.0) for x in (mu, -mu) for y in (mu, -mu)])
