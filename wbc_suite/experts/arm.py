"""One arm that an expert moves: the pose of its hand, its goal and its gripper."""

import math
from collections.abc import Sequence
from functools import cache, partial

import numpy as np
import pinocchio as pin

from wbc_suite.control import ActionLayout, RobotState
from wbc_suite.control.action import ActionSlice
from wbc_suite.devices.action_ports import LimbPort
from wbc_suite.experts.finger_reach import closing_postures, finger_reach
from wbc_suite.experts.look_ahead import LookAhead, Prediction
from wbc_suite.sensing.hands import Hand
from wbc_suite.typing import Vector

SPEED, TURN = 0.6, 3.0  # m/s, rad/s of goals
LEAD = 0.08  # m; a goal waits for a hand that lags farther behind
CORRECTION, LARGEST_CORRECTION = (
    0.3,
    0.02,
)  # share of a resting error; greatest correction, m
MOST_TURN = 0.15  # rad, likewise
SETTLED = 0.03  # m; errors are resting errors below it


class Arm:
    """Moves the goal of one hand on straight lines, and its gripper.

    Poses are those of the frame of a grasp, `pinch` or `wrap`, or else the `tcp`, in
    the world. The same calls serve any controller whose action has the hand's pose.

    Attributes:
        hand: The hand, with its contacts.
        grasp: The present kind of grasp.
        home: Pose of the hand at the start.
        finger_reach: Returns how far fingers reach beyond the frame of a grasp, m.
        closing: Returns the joints of the gripper from open to closed for a grasp.
        coupled: Whether other arms of the scene share joints with it.
    """

    def __init__(
        self,
        port: LimbPort,
        hand: Hand,
        state: RobotState,
        *,
        layout: ActionLayout,
        several: bool,
        joints: Sequence[str],
    ) -> None:
        self.hand, self.state, self.name = hand, state, port.name
        self._port, self._joints = port, tuple(joints)
        self._slice = layout[port.name]
        gripper = f"{hand.name}_gripper"
        name = state.prefix + gripper if several else gripper
        self._gripper: ActionSlice | None = layout[name] if name in layout else None  # noqa: SIM401
        self._synergies = state.robot.synergies.get(gripper, ())
        driven = [joint for synergy in self._synergies for joint in synergy.open]
        self._fingers = state.joint_addresses(tuple(driven))[0]
        self.grasp = "pinch"
        self._look_ahead = cache(self._make_look_ahead)
        self._offset = cache(self._measure_offset)
        self.finger_reach = cache(self._measure_fingers)
        self.closing = cache(partial(closing_postures, state, self._synergies))
        self._closing = 0
        self.home = self._goal = self._target = self.pose
        self._home = state.q.copy()
        self._speed, self._turn, self._exact = SPEED, TURN, True
        self._correction, self._turn_correction = np.zeros(3), np.zeros(3)
        self._moves, self._grips = False, False
        self.coupled = False

    @property
    def goal(self) -> pin.SE3 | None:
        """Present goal of the frame of the grasp; None before the hand is moved."""
        return self._goal if self._moves else None

    @property
    def pose(self) -> pin.SE3:
        """Measured pose T_wh of the frame of the present grasp."""
        return self._port.measure() * self._offset(self.grasp)

    def look_ahead(
        self,
        poses: Sequence[pin.SE3],
        grasp: str | None = None,
        *,
        after: Prediction | None = None,
        most: float = math.inf,
    ) -> Prediction:
        """Look along a chain of poses of a grasp's frame, by default the present.

        See `LookAhead.along`.
        """
        chain = [(pose,) for pose in poses]
        return self._look_ahead(grasp or self.grasp).along(chain, after, most=most)

    def shares_joints(self, other: "Arm") -> bool:
        """Whether a joint moves the hands of both arms."""
        return self.state is other.state and not {*self._joints}.isdisjoint(
            other._joints
        )

    def look_ahead_beside(
        self, other: "Arm", grasps: tuple[str, str], poses: Sequence[Sequence[pin.SE3]]
    ) -> Prediction:
        """Look along a chain of poses of this hand and of another of the robot."""
        joints = tuple(dict.fromkeys((*self._joints, *other._joints)))
        frames = self._frame(grasps[0]), other._frame(grasps[1])
        return LookAhead(self.state, joints, *frames).along(poses)

    def keep_base(self) -> None:
        """Look ahead without the joints of a base, which stays where it was driven."""
        root = self.state.robot.root_joint_names
        self._joints = tuple(joint for joint in self._joints if joint not in root)
        self._look_ahead.cache_clear()

    def sweep(self, q: Vector, period: float) -> Sequence[pin.SE3]:
        """Return poses on the way to joints as a prediction has them.

        See `LookAhead.sweep`.
        """
        return [*self._look_ahead(self.grasp).sweep(q, period)]

    @property
    def home_joints(self) -> Vector:
        """Joints at the start, as a prediction has them."""
        return self._look_ahead(self.grasp).own(self._home)

    def configuration(self, q: Vector) -> Vector:
        """Return the robot's configuration with joints as a prediction has them."""
        return self._look_ahead(self.grasp).full(q)

    @property
    def fingers(self) -> Vector:
        """Positions of the joints that the gripper drives, rad or m."""
        return self.state.data.qpos[self._fingers]

    def aim(
        self,
        target: pin.SE3,
        *,
        speed: float = SPEED,
        turn: float = TURN,
        exact: bool = True,
    ) -> None:
        """Move on a straight line to a pose, at speeds in m/s and rad/s.

        A resting error is corrected if it must be `exact`; not so for a hand that
        presses on something.
        """
        if not self._moves:
            self._goal = self.pose
        self._moves, self._target = True, target
        self._speed, self._turn, self._exact = speed, turn, exact

    def stop(self) -> None:
        """Stay where the hand is."""
        self._goal = self._target = self.pose
        self._correction, self._turn_correction = np.zeros(3), np.zeros(3)

    def open(self, grasp: str | None = None) -> None:
        """Open the gripper for a kind of grasp, the present one by default."""
        self._choose(grasp or self.grasp)
        self._closing, self._grips = 0, True

    def close(self) -> None:
        """Close the gripper."""
        self._closing, self._grips = 1, True

    def error(self) -> tuple[float, float]:
        """Return the distance of the hand from its target, m, and the angle, rad."""
        pose = self.pose
        turn = pin.log3(pose.rotation.T @ self._target.rotation)
        shift = self._target.translation - pose.translation
        return float(np.linalg.norm(shift)), float(np.linalg.norm(turn))

    def read(self, action: Vector) -> tuple[pin.SE3, bool]:
        """Return the goal that an action gives the hand, and whether it closes."""
        target = self._port.decode(action[self._slice.start : self._slice.stop])
        closes = False
        if self._gripper is not None:
            ends = [s.grasps.get(self.grasp, (-1.0, 1.0)) for s in self._synergies]
            values = action[self._gripper.start : self._gripper.stop]
            middles = np.mean(ends, axis=1)
            closes = bool(np.mean(values - middles) > 0.0)
        return target * self._offset(self.grasp), closes

    def write(self, action: Vector, period: float) -> None:
        """Write the arm's values for the next control period, s, into an action."""
        if self._moves:
            self._advance(period)
            goal = self._goal.copy()
            goal.translation = goal.translation + self._correction
            goal.rotation = pin.exp3(self._turn_correction) @ goal.rotation
            target = goal * self._offset(self.grasp).inverse()
            action[self._slice.start : self._slice.stop] = self._port.encode(target)
        if self._grips and self._gripper is not None:
            ends = [s.grasps.get(self.grasp, (-1.0, 1.0)) for s in self._synergies]
            values = [pair[self._closing] for pair in ends]
            action[self._gripper.start : self._gripper.stop] = values

    def _advance(self, period: float) -> None:
        """Move the goal towards the target, and correct a resting error."""
        goal, target, pose = self._goal, self._target, self.pose
        behind = goal.translation - pose.translation
        shift = target.translation - goal.translation
        turn = pin.log3(target.rotation @ goal.rotation.T)
        far = max(
            float(np.linalg.norm(shift)) / self._speed,
            float(np.linalg.norm(turn)) / self._turn,
        )
        if np.linalg.norm(behind) < LEAD:
            share = min(1.0, period / max(far, 1e-9))
            goal = pin.SE3(
                pin.exp3(share * turn) @ goal.rotation,
                goal.translation + share * shift,
            )
        self._goal = goal
        if far <= period:
            error = target.translation - pose.translation
            self._correct(error, pin.log3(target.rotation @ pose.rotation.T))

    def _correct(self, shift: Vector, turn: Vector) -> None:
        """Correct a resting error, m and rad in world axes."""
        if not self._exact:
            self._correction[:] = 0.0
        elif np.linalg.norm(shift) < SETTLED:
            self._correction = shortened(
                self._correction + CORRECTION * shift, LARGEST_CORRECTION
            )
        if np.linalg.norm(turn) < MOST_TURN:
            turn = self._turn_correction + CORRECTION * turn
            self._turn_correction = shortened(turn, MOST_TURN)

    def _choose(self, grasp: str) -> None:
        """Go on with the frame of another kind of grasp."""
        if grasp != self.grasp:
            self.grasp = grasp
            self._goal = self._target = self.pose

    def _frame(self, grasp: str) -> str:
        """Return the name of the frame of a grasp."""
        named = f"{self.hand.name}_{grasp}"
        known = {frame.name for frame in self.state.robot.frames}
        return named if named in known else self.hand.frame

    def _measure_offset(self, grasp: str) -> pin.SE3:
        """Return the pose of a grasp's frame in the frame that the action moves."""
        site = self.state.data.site(self.state.prefix + self._frame(grasp))
        pose = pin.SE3(site.xmat.reshape(3, 3).copy(), site.xpos.copy())
        return self._port.measure().actInv(pose)

    def _measure_fingers(self, grasp: str) -> float:
        frame = self._frame(grasp)
        return finger_reach(self.state, self.hand, self._synergies, grasp, frame)

    def _make_look_ahead(self, grasp: str) -> LookAhead:
        return LookAhead(self.state, self._joints, self._frame(grasp))


def shortened(v: Vector, most: float) -> Vector:
    """Return a vector shortened to a greatest length."""
    return v * min(1.0, most / max(float(np.linalg.norm(v)), 1e-12))
