"""Compute a posture to start work from: hands in front, far from limits."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from wbc_suite.robot.adopt.posed_robot import PosedRobot
from wbc_suite.robot.description import RobotDescription
from wbc_suite.typing import Indices, Matrix, Vector

DRAWS, STEPS = 300, 200
"""Random postures of an arm, and random steps from the best one."""
TRIED = 40  # best postures that are checked for contacts
PLACE = (0.55, 0.0, -0.15)
"""Where a hand is best, from the first joint of its arm, as part of its length."""
ABOVE = 0.25  # its least height over the root, likewise
FORWARD, MARGIN = 0.5, 0.2
"""Costs of the distance from there, and of joint limits."""
FLOOR = 0.05  # m; least height of a hand over the root
PARALLEL = 0.9  # least cosine between two axes that are each other's mirror images
ENDLESS = np.pi  # rad; range of a joint without one


class _Arm(NamedTuple):
    """Joints from the root on, places in q and v, limits, and the hand's frame."""

    joints: tuple[str, ...]
    frame: int
    q: Indices
    v: Indices
    low: Vector
    high: Vector


def working_arms(robot: RobotDescription) -> dict[str, float]:
    """Return positions of the joints of arms, by name; rad or m.

    Random postures of each arm are compared. With the Jacobian J of the hand, its
    linear part divided by the arm's length L, the hand's place p in front of the first
    joint, and joints u from -1 to 1 in their ranges, the best has the greatest

        sigma_min(J) - 0.5 |p_hand - p| / L - 0.2 sum(u^8)

    no contacts beyond those of `ready`, in which other joints stay, and its motors can
    hold it. A left arm is the mirror image of the right one where their joints allow
    it. An arm without such a posture has no entry.
    """
    search = _Search(robot)
    found: dict[str, float] = {}
    earlier: list[_Arm] = []
    for frame in robot.hands.values():
        arm = search.arm(frame)
        if arm is None:
            continue
        for values in search.candidates(arm, earlier):
            if search.is_clear(arm, values):
                search.q[arm.q] = values
                rounded = values.round(4).clip(arm.low, arm.high)
                found |= dict(zip(arm.joints, rounded.tolist(), strict=True))
                earlier.append(arm)
                break
    return found


class _Search:
    """Postures of one robot; `q` is the present one."""

    def __init__(self, robot: RobotDescription) -> None:
        self._robot, self._posed = robot, PosedRobot(robot)
        self._model, self._data = self._posed.model, self._posed.data
        self.q = self._posed.q
        self._root = self._model.getFrameId(robot.links[0].name)
        self._efforts = {joint.name: joint.effort for joint in robot.joints}
        self._touching = self._contacts(self.q)

    def arm(self, frame: str) -> _Arm | None:
        """Return the arm that moves a hand; None if it has less than three joints."""
        model, groups = self._model, self._robot.groups
        own = {n for g, names in groups.items() if "arm" in g for n in names}
        index = model.getFrameId(frame)
        chain = model.supports[model.frames[index].parentJoint].tolist()
        joints = [j for j in chain if model.names[j] in own]
        if len(joints) < 3:
            return None
        q = np.array([model.joints[j].idx_q for j in joints])
        v = np.array([model.joints[j].idx_v for j in joints])
        low = np.maximum(model.lowerPositionLimit[q], -ENDLESS)
        high = np.minimum(model.upperPositionLimit[q], ENDLESS)
        names = tuple(model.names[j] for j in joints)
        return _Arm(names, index, q, v, low, np.maximum(high, low))

    def candidates(self, arm: _Arm, earlier: Sequence[_Arm]) -> Iterator[Vector]:
        """Yield postures of an arm, best first: mirror images, then random ones."""
        mirrored = (self._mirrored(arm, other) for other in earlier)
        yield from (values for values in mirrored if values is not None)
        rng, half = np.random.default_rng(0), (arm.high - arm.low) / 2
        drawn = rng.uniform(arm.low, arm.high, size=(DRAWS, len(arm.q)))
        drawn += rng.uniform(0.0, 0.8, size=(DRAWS, 1)) * (self.q[arm.q] - drawn)
        length = self._length(arm)
        scores = np.array([self._score(arm, values, length) for values in drawn])
        for k in np.argsort(-scores)[:TRIED]:
            values, best = drawn[k], scores[k]
            for step in rng.normal(scale=0.15, size=(STEPS, len(arm.q))):
                moved = np.clip(values + step * half, arm.low, arm.high)
                score = self._score(arm, moved, length)
                if score > best:
                    values, best = moved, score
            yield values

    def is_clear(self, arm: _Arm, values: Vector) -> bool:
        """Whether motors hold it off the floor, and only what touched before does."""
        q = self.q.copy()
        q[arm.q] = values
        weights = pin.computeGeneralizedGravity(self._model, self._data, q)[arm.v]
        efforts = [self._efforts[name] or np.inf for name in arm.joints]
        if (np.abs(weights) > efforts).any():
            return False
        height = self._height(arm, q)
        low = height < FLOOR and self._height(arm, self.q) > FLOOR
        return not low and not self._contacts(q) - self._touching

    def _height(self, arm: _Arm, q: Vector) -> float:
        pin.framesForwardKinematics(self._model, self._data, q)
        hand, root = (self._data.oMf[k].translation[2] for k in (arm.frame, self._root))
        return float(hand - root)

    def _length(self, arm: _Arm) -> float:
        """Return the length of the way along the joints to the hand, m."""
        points = self._points(arm, self.q)
        return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum()) or 1.0

    def _points(self, arm: _Arm, q: Vector) -> Matrix:
        pin.framesForwardKinematics(self._model, self._data, q)
        joints = [self._data.oMi[self._model.getJointId(name)] for name in arm.joints]
        return np.array([x.translation for x in (*joints, self._data.oMf[arm.frame])])

    def _score(self, arm: _Arm, values: Vector, length: float) -> float:
        q = self.q.copy()
        q[arm.q] = values
        J = pin.computeFrameJacobian(
            self._model, self._data, q, arm.frame, pin.LOCAL_WORLD_ALIGNED
        )[:, arm.v]
        J[:3] /= length
        points = self._points(arm, q)
        place = points[0] + length * np.array(PLACE)
        root = self._data.oMf[self._root].translation[2]
        if points[0, 2] > root:
            place[2] = max(place[2], root + ABOVE * length)
        span = np.maximum(arm.high - arm.low, 1e-9)
        u = 2.0 * (values - arm.low) / span - 1.0
        sigma = np.linalg.svd(J, compute_uv=False)[min(J.shape) - 1]
        return float(
            sigma
            - FORWARD * np.linalg.norm(points[-1] - place) / length
            - MARGIN * np.sum(u**8)
        )

    def _mirrored(self, arm: _Arm, other: _Arm) -> Vector | None:
        """Return the reflection of another arm's posture at the plane y = 0."""
        if len(arm.joints) != len(other.joints):
            return None
        pin.forwardKinematics(self._model, self._data, pin.neutral(self._model))
        signs: list[float] = []
        for name, twin in zip(arm.joints, other.joints, strict=True):
            own, image = self._axis(name), self._axis(twin)
            # An axis of rotation is a pseudovector: it is reflected, and turned.
            image *= (
                (-1, 1, -1) if self._robot.joint(name).type == "hinge" else (1, -1, 1)
            )
            cosine = float(own @ image)
            if abs(cosine) < PARALLEL:
                return None
            signs.append(float(np.sign(cosine)))
        values = np.array(signs) * self.q[other.q]
        inside = (values > arm.low - 1e-9) & (values < arm.high + 1e-9)
        return values if inside.all() else None

    def _axis(self, name: str) -> Vector:
        pose = self._data.oMi[self._model.getJointId(name)]
        return pose.rotation @ np.asarray(self._robot.joint(name).axis)

    def _contacts(self, q: Vector) -> set[frozenset[str]]:
        return self._posed.contacts(q[self._posed.places], np.inf)[0]
