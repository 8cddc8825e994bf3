"""An expert for `LocoLift`: walk to the table, grasp the cube, lift it.

It sees the cube relative to the trunk and to the hand. Goals of hands are in the heading
of the robot, so the arm is carried along while the robot walks.
"""

import argparse
import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

import wbc_suite
from wbc_suite.envs import RobotEnv


@dataclass(frozen=True, kw_only=True)
class Manner:
    """How one robot grasps; lengths in m, axes of its heading.

    Attributes:
        cube: Where the cube is relative to the trunk before it is grasped.
        pitch: Rotation of the hand downwards from its start, rad.
        waypoints: Places of the hand relative to the cube on the way to the grasp.
        open: Positions of the gripper.
        closed: Likewise.
    """

    cube: tuple[float, float]
    pitch: float
    waypoints: tuple[tuple[float, float, float], ...]
    open: float | tuple[float, ...] = -1.0
    closed: float | tuple[float, ...] = 1.0


MANNERS = {
    "SpotWithArm": Manner(
        cube=(0.70, 0.0),
        pitch=0.97,
        waypoints=((-0.015, 0.0, 0.15), (-0.015, 0.0, 0.035)),
        open=0.0,
    ),
    "GR1FreeBody": Manner(
        cube=(0.38, -0.15),
        pitch=0.5,
        waypoints=((-0.03, -0.08, 0.15), (0.0, -0.06, 0.03), (0.0, -0.02, 0.02)),
    ),
}
THERE, SLOWLY = 0.03, np.array([0.4, 0.2, 0.4])  # m, rad; m/s, m/s, rad/s
STEP, NEAR = 0.02, 0.012  # m; of the hand's goal in one action; reached


class Expert:
    """Walks, reaches, grasps and lifts."""

    def __init__(self, env: RobotEnv, robot: str) -> None:
        self.env, self.manner = env, MANNERS[robot]
        self.side = "" if robot == "SpotWithArm" else "right_"
        self.stage, self.waited = 0, 0
        hold = env.hold_action
        part = env.action_layout["right_hand"]
        start = pin.exp3(hold[part.start + 3 : part.stop])
        turned = pin.utils.rotate("y", self.manner.pitch) @ start
        self.rotation = pin.log3(turned)
        self.lifted = np.zeros(3)

    def act(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        """Return the next action."""
        x, y, z, w = seen["robot0_base_quat"]
        yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        turn = pin.utils.rotate("z", -yaw)
        command = self.walk(seen["robot_to_cube"], turn, yaw)
        parts = {"walk": command, "right_gripper": self.manner.open}
        if not command.any() or self.stage:
            self.waited += 1
            parts["walk"] = np.zeros(3)
            if self.stage or self.waited > 20:
                parts |= self.reach(seen, turn)
        else:
            self.waited = 0
        return self.env.action_layout.pack(parts, base=self.env.hold_action)

    def walk(self, cube: np.ndarray, turn: np.ndarray, yaw: float) -> np.ndarray:
        """Return speeds towards the place before the cube, facing the table."""
        forward, left = cube - (turn @ [*self.manner.cube, 0.0])[:2]
        if max(math.hypot(forward, left), abs(yaw)) < THERE:
            return np.zeros(3)
        ahead = math.atan2(left, forward)
        wanted = ahead if math.hypot(forward, left) > 0.6 else -yaw
        return np.clip([forward, left, wanted], -SLOWLY, SLOWLY)

    def reach(self, seen: dict[str, np.ndarray], turn: np.ndarray) -> dict:
        """Return the parts of the action that move the hand."""
        manner, grasp = self.manner, len(self.manner.waypoints)
        self.stage = max(self.stage, 1)
        to_cube = turn @ seen[f"{self.side}gripper_to_cube_pos"]
        layout, hold = self.env.action_layout, self.env.hold_action
        part = layout["right_hand"]
        goal = hold[part.start : part.start + 3]
        if self.stage <= grasp:
            way = to_cube + manner.waypoints[self.stage - 1]
            if np.linalg.norm(way) < NEAR or self.waited > 100:
                self.stage, self.waited = self.stage + 1, 0
        elif self.stage == grasp + 1:
            way = to_cube + manner.waypoints[-1]
            way *= 0.0
            if self.waited > 20:
                self.stage, self.waited = grasp + 2, 0
        else:
            way = np.array([0.0, 0.0, 0.01 if self.waited < 15 else 0.0])
        size = max(float(np.linalg.norm(way)), 1e-9)
        goal = goal + (0.3 if self.stage <= grasp else 1.0) * way * min(1.0, STEP / (0.3 * size))
        return {
            "right_hand": np.concatenate([goal, self.rotation]),
            "right_gripper": manner.open if self.stage <= grasp else manner.closed,
        }
