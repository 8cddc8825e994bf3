"""Retargeting by fingertips: synergies that put a robot's tips where the user's are.

Vectors from the roots of the fingers to their tips, and from the tip of the thumb to
those of the other fingers, are compared in axes of the palm, scaled by the length of
the finger:

    min_a  sum_f w_f |t_f(a) - s_f u_f|^2 + sum_f w(d_f) |p_f(a) - g(d_f) e_f|^2
           + w_p |a - a_curl|^2,    -1 <= a <= 1

`t`, `p` are the robot's vectors for synergies `a`; `u`, `d e` the user's; `g` is zero
where the user's tips touch, so that the robot's close as well; `a_curl` is the result
of `retarget`. Source: Handa et al. (2020), "DexPilot", ICRA, whose vectors, distances
and weights that grow with closeness these are.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pinocchio as pin

from wbc_suite.devices.action_ports import side_of
from wbc_suite.devices.pipeline.retarget import FINGERS, retarget
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.elements import Synergy
from wbc_suite.typing import Matrix, Vector

TOUCH = 0.02  # m; tips of a tracked hand, inside the fingers, that touch each other
PINCH_BEGINS = 0.06  # m; distance of tips below which it counts
FINGER_WEIGHT, THUMB_WEIGHT = 1.0, 0.3  # of squared errors in m^2
PINCH_WEIGHT = 60.0  # of touching tips
PRIOR = 0.004  # m; an error in position that counts as a synergy's whole half range
DAMPING = 0.003  # m; of the steps
FIRST_STEPS, STEPS = 40, 2  # after a start, and for each input
OTHERS = ("index", "middle", "ring", "pinky")


class FingertipRetargeting:
    """Compute synergies of one robot's hand from the joints of the user's hand.

    Args:
        robot: Robot with the hand.
        gripper: Name of its gripper; it has frames of the role `tip`, named after the
            thumb and at least two fingers.
        side: `right` or `left`, of the user's hand as well.

    Raises:
        LookupError: If it has none.
    """

    def __init__(self, robot: RobotDescription, gripper: str, *, side: str) -> None:
        synergies = robot.synergies[gripper]
        self._labels = tuple(s.name for s in synergies)
        self._model, self._middle, self._span = _hand_model(robot, synergies)
        self._data = self._model.createData()
        self._frames = _tips(robot, self._model)
        self._left = side == "left"
        self._others = tuple(f for f in OTHERS if f in self._frames)
        if "thumb" not in self._frames or len(self._others) < 2:
            raise LookupError(f"'{gripper}' has no tips of a thumb and two fingers.")
        self._update(-np.ones(len(synergies)))
        self._roots, self._lengths = self._measure()
        self._axes = self._palm_axes()
        self.reset()

    def reset(self) -> None:
        """Start again from the flexion of the fingers."""
        self._last: Vector | None = None

    def tips(self, values: Vector) -> dict[str, Vector]:
        """Return the robot's fingertips for values of the synergies, m, by finger."""
        self._update(values)
        return {
            f: self._data.oMf[k].translation.copy() for f, k in self._frames.items()
        }

    def __call__(self, joints: Matrix) -> Vector:
        """Return the synergies, -1 open .. 1 closed, for a hand of shape (25, 3), m."""
        prior = np.clip(retarget(joints, self._labels, by_pinch=False), -1.0, 1.0)
        targets, weights = self._targets(joints)
        values, steps = self._last, STEPS
        if values is None:
            values, steps = prior, FIRST_STEPS
        for _ in range(steps):
            values = self._step(values, prior, targets, weights)
        self._last = values
        return values.copy()

    def _step(
        self, values: Vector, prior: Vector, targets: Matrix, weights: Vector
    ) -> Vector:
        """Return values after one damped Gauss-Newton step, within their range."""
        vectors, jacobian = self._vectors(values)
        root = np.sqrt(weights)[:, None]
        error = (root * (targets - vectors)).ravel()
        J = (root[:, :, None] * jacobian).reshape(len(error), -1)
        H = J.T @ J + (PRIOR**2 + DAMPING**2) * np.eye(len(values))
        gradient = J.T @ error + PRIOR**2 * (prior - values)
        fixed = ((values >= 1.0) & (gradient > 0)) | ((values <= -1.0) & (gradient < 0))
        H[fixed, :] = H[:, fixed] = 0.0
        H[fixed, fixed] = 1.0
        return np.clip(values + np.linalg.solve(H, np.where(fixed, 0, gradient)), -1, 1)

    def _targets(self, joints: Matrix) -> tuple[Matrix, Vector]:
        """Return the vectors that the robot's shall have, in palm axes, and weights."""
        R = self._users_axes(joints)
        vectors, weights = [], []
        for finger in ("thumb", *self._others):
            chain = joints[list(FINGERS[finger])[finger != "thumb" :]]
            length = float(np.linalg.norm(np.diff(chain, axis=0), axis=1).sum())
            scale = self._lengths[finger] / max(length, 1e-6)
            vectors.append(scale * (R.T @ (chain[-1] - chain[0])))
            weights.append(THUMB_WEIGHT if finger == "thumb" else FINGER_WEIGHT)
        for finger in self._others:
            apart = joints[FINGERS[finger][-1]] - joints[FINGERS["thumb"][-1]]
            distance = float(np.linalg.norm(apart))
            closeness = np.clip(
                (PINCH_BEGINS - distance) / (PINCH_BEGINS - TOUCH), 0.0, 1.0
            )
            stretch = PINCH_BEGINS / (PINCH_BEGINS - TOUCH) * max(distance - TOUCH, 0.0)
            vectors.append(stretch / max(distance, 1e-9) * (R.T @ apart))
            weights.append(PINCH_WEIGHT * closeness**2)
        return np.array(vectors), np.array(weights)

    def _users_axes(self, joints: Matrix) -> Matrix:
        """Return the palm's axes: to the fingers, to the thumb's side, and dorsal."""
        along = joints[[6, 11, 16, 21]].mean(axis=0) - joints[0]
        return _axes(along, joints[6] - joints[21], flip=self._left)

    def _palm_axes(self) -> Matrix:
        """Return the same axes of the robot's open hand."""
        tips = {f: self._data.oMf[self._frames[f]].translation for f in self._others}
        along = np.mean([tips[f] - self._roots[f] for f in self._others], axis=0)
        across = self._roots[self._others[0]] - self._roots[self._others[-1]]
        return _axes(along, across, flip=self._left)

    def _update(self, values: Vector) -> None:
        pin.computeJointJacobians(
            self._model, self._data, self._middle + self._span @ values
        )
        pin.updateFramePlacements(self._model, self._data)

    def _vectors(self, values: Vector) -> tuple[Matrix, np.ndarray]:
        """Return the robot's vectors, shape (m, 3), and Jacobian, (m, 3, synergies)."""
        self._update(values)
        R = self._axes
        tips, jacobians = {}, {}
        for finger, frame in self._frames.items():
            tips[finger] = R.T @ self._data.oMf[frame].translation
            J = pin.getFrameJacobian(
                self._model, self._data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
            )
            jacobians[finger] = R.T @ J[:3] @ self._span
        own = [(tips[f] - R.T @ self._roots[f], jacobians[f])
               for f in ("thumb", *self._others)]  # fmt: skip
        pinches = [(tips[f] - tips["thumb"], jacobians[f] - jacobians["thumb"])
                   for f in self._others]  # fmt: skip
        both = own + pinches
        return np.array([v for v, _ in both]), np.array([J for _, J in both])

    def _measure(self) -> tuple[dict[str, Vector], dict[str, float]]:
        """Return root, m, and length of each finger of the open hand, m."""
        roots, lengths = {}, {}
        for finger, frame in self._frames.items():
            joint, places = self._model.frames[frame].parentJoint, []
            while joint > 0:
                places.append(self._data.oMi[joint].translation.copy())
                joint = self._model.parents[joint]
            roots[finger] = places[-1]
            chain = np.array([self._data.oMf[frame].translation, *places])
            lengths[finger] = float(
                np.linalg.norm(np.diff(chain, axis=0), axis=1).sum()
            )
        return roots, lengths


def fingertip_retargetings(env: Any) -> dict[str, FingertipRetargeting]:
    """Return the retargeting of each gripper that has fingertips, by action slice."""
    states: Any = getattr(env.unwrapped.simulation, "robots", ())
    found = {}
    for index, state in enumerate(states):
        prefix = f"robot{index}_" if len(states) > 1 else ""
        for gripper in state.robot.synergies:
            try:
                found[prefix + gripper] = FingertipRetargeting(
                    state.robot, gripper, side=side_of(gripper)
                )
            except LookupError:  # a gripper of another kind
                continue
    return found


def _axes(along: Vector, across: Vector, *, flip: bool) -> Matrix:
    """Return axes along the fingers, to the thumb's side, and away from the palm."""
    x = along / max(float(np.linalg.norm(along)), 1e-9)
    y = across - (across @ x) * x
    y = y / max(float(np.linalg.norm(y)), 1e-9)
    z = np.cross(x, y)
    return np.column_stack([x, y, -z if flip else z])


def _hand_model(
    robot: RobotDescription, synergies: tuple[Synergy, ...]
) -> tuple[Any, Vector, Matrix]:
    """Return the hand alone, and its joints as middle + span @ synergies."""
    leaders = {joint for synergy in synergies for joint in synergy.open}
    mimics = {
        link.joint.name: link.joint.mimic
        for link in robot.links
        if link.joint and link.joint.mimic and link.joint.mimic.joint in leaders
    }
    whole: Any = robot.to_pinocchio()
    own = leaders | set(mimics)
    locked = [k for k in range(1, whole.njoints) if whole.names[k] not in own]
    hand = pin.buildReducedModel(whole, locked, pin.neutral(whole))
    middle, span = np.zeros(hand.nq), np.zeros((hand.nq, len(synergies)))
    where = {name: hand.idx_qs[k] for k, name in enumerate(hand.names)}
    for k, synergy in enumerate(synergies):
        for joint, first in synergy.open.items():
            middle[where[joint]] = 0.5 * (first + synergy.closed[joint])
            span[where[joint], k] = 0.5 * (synergy.closed[joint] - first)
    for name, mimic in mimics.items():
        leader = where[mimic.joint]
        middle[where[name]] = mimic.offset + mimic.ratio * middle[leader]
        span[where[name]] = mimic.ratio * span[leader]
    return hand, middle, span


def _tips(robot: RobotDescription, hand: Any) -> Mapping[str, int]:
    """Return the frames of fingertips that the hand's joints move, by finger."""
    tips = {}
    for frame in robot.frames:
        finger = next((f for f in FINGERS if f in frame.name.split("_")), None)
        if frame.role == "tip" and finger is not None:
            index = hand.getFrameId(frame.name)
            if hand.frames[index].parentJoint > 0:
                tips[finger] = index
    return tips
