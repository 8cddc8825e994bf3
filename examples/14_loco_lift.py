"""An expert for `LocoLift`: walk to the table, grasp the cube, lift it.

Goals of hands are in the heading of the robot: arms are carried along as it walks. Spot
closes its jaw about the cube, GR1 presses it between the fingers of both hands.
"""

import argparse
import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

import wbc_suite
from wbc_suite.envs import RobotEnv

FAR, THERE = 0.6, 0.06  # m, rad; of the trunk from its place
FASTEST = np.array([0.4, 0.2, 0.4])  # m/s, m/s, rad/s
SETTLE, CLOSE, RAISE, PATIENCE = 20, 20, 15, 100  # actions
STEP, GAIN, NEAR = 0.02, 0.3, 0.012  # m, -, m; of hands
UP = 0.01  # m in each action


@dataclass(frozen=True, kw_only=True)
class Grasp:
    """How a robot grasps; m and rad, in its heading; the left hand mirrors the right.

    Attributes:
        stand: Place of the cube relative to the trunk, when the robot stands.
        pitch: Turn of the hands downwards from their start.
        waypoints: Places of the right hand relative to the cube, up to the grasp.
        opening: Position of the gripper before the grasp.
        closing: Position of the gripper at the grasp.
        inwards: Way of the hands towards each other at the grasp.
    """

    stand: tuple[float, float]
    pitch: float
    waypoints: tuple[tuple[float, float, float], ...]
    opening: float = -1.0
    closing: float = 1.0
    inwards: float = 0.0


GRASPS = {
    "SpotWithArm": Grasp(
        stand=(0.70, 0.0),
        pitch=0.97,
        waypoints=((-0.015, 0.0, 0.15), (-0.015, 0.0, 0.035)),
        opening=0.0,
    ),
    "GR1FreeBody": Grasp(
        stand=(0.38, 0.0),
        pitch=0.9,
        waypoints=((-0.014, -0.12, 0.15), (-0.014, -0.09, 0.06), (-0.014, -0.04, 0.06)),
        closing=-1.0,
        inwards=0.04,
    ),
}


class Expert:
    """Walks, reaches, grasps and lifts, each when the one before is done."""

    def __init__(self, env: RobotEnv, grasp: Grasp) -> None:
        self.env, self.grasp = env, grasp
        self.hands = list(env.robots[0].hands)  # the right one first
        hold, down = env.hold_action, pin.utils.rotate("y", grasp.pitch)
        self.turned = {
            hand: pin.log3(down @ pin.exp3(self.part(hold, hand)[3:]))
            for hand in self.hands
        }
        self.stage, self.since, self.stood = 0, 0, 0

    def part(self, action: np.ndarray, hand: str) -> np.ndarray:
        """Return the goal of a hand in an action: position, rotation vector."""
        part = self.env.action_layout[f"{hand}_hand"]
        return action[part.start : part.stop]

    def fingers(self, hand: str, position: float) -> np.ndarray:
        """Return one position for all entries of a gripper."""
        part = self.env.action_layout[f"{hand}_gripper"]
        return np.full(part.stop - part.start, position)

    def act(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        """Return the next action."""
        x, y, z, w = seen["robot0_base_quat"]
        yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        parts = {
            f"{hand}_gripper": self.fingers(hand, self.grasp.opening)
            for hand in self.hands
        }
        if self.stood < SETTLE:
            parts["walk"] = self.walk(seen["robot_to_cube"], yaw)
            self.stood = 0 if parts["walk"].any() else self.stood + 1
        else:
            parts |= self.manipulate(seen, pin.utils.rotate("z", -yaw))
        return self.env.action_layout.pack(parts, base=self.env.hold_action)

    def walk(self, cube: np.ndarray, yaw: float) -> np.ndarray:
        """Return speeds towards the place before the cube, facing the table."""
        stand = pin.utils.rotate("z", -yaw) @ [*self.grasp.stand, 0.0]
        forward, left = cube - stand[:2]
        distance = math.hypot(forward, left)
        if max(distance, abs(yaw)) < THERE:
            return np.zeros(3)
        turn = math.atan2(left, forward) if distance > FAR else -yaw
        return np.clip([forward, left, turn], -FASTEST, FASTEST)

    def manipulate(self, seen: dict[str, np.ndarray], turn: np.ndarray) -> dict:
        """Return the parts of the action that move hands and grippers."""
        grasp, parts, left = self.grasp, {}, []
        reaching = self.stage < len(grasp.waypoints)
        closing = self.stage == len(grasp.waypoints)
        for hand in self.hands:
            mirror = np.array([1.0, -1.0 if hand == "left" else 1.0, 1.0])
            goal = self.part(self.env.hold_action, hand)[:3]
            if reaching:
                name = f"{hand}_" if len(self.hands) > 1 else ""
                way = turn @ seen[f"{name}gripper_to_cube_pos"]
                way += mirror * grasp.waypoints[self.stage]
                left.append(np.linalg.norm(way))
                way *= min(GAIN, STEP / max(left[-1], 1e-9))
            elif closing:
                way = mirror * [0.0, grasp.inwards / CLOSE, 0.0]
            else:
                way = np.array([0.0, 0.0, UP if self.since < RAISE else 0.0])
            parts[f"{hand}_hand"] = np.concatenate([goal + way, self.turned[hand]])
            if not reaching:
                parts[f"{hand}_gripper"] = self.fingers(hand, grasp.closing)
        self.since += 1
        arrived = max(left, default=0.0) < NEAR or self.since > PATIENCE
        if (reaching and arrived) or (closing and self.since >= CLOSE):
            self.stage, self.since = self.stage + 1, 0
        return parts


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", nargs="+", default=["SpotWithArm", "GR1FreeBody"])
    parser.add_argument("--episodes", type=int, default=2)
    options = parser.parse_args()
    for robot in options.robots:
        env = wbc_suite.make(
            "LocoLift",
            robots=robot,
            controller_configs="WHOLE_BODY_ID",
            terminate_on_success=True,
        )
        successes = 0
        for seed in range(options.episodes):
            observation, info = env.reset(seed=seed)
            expert, over = Expert(env, GRASPS[robot]), False
            while not over:
                action = expert.act(observation)
                observation, _, terminated, truncated, info = env.step(action)
                over = terminated or truncated
            successes += info["success"]
            if not info["success"]:
                print(f"seed {seed}: {info.get('failure', 'the cube is not held up')}")
        print(f"{robot}: {successes} of {options.episodes} episodes succeed")
        env.close()


if __name__ == "__main__":
    main()
