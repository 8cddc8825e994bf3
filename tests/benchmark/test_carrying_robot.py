"""GR1 really carries the pot: its hands lift it by the handles from below."""

import math

import numpy as np
import pinocchio as pin
import pytest
from feet import make

HANDS = {"right": (0, 1.0), "left": (1, -1.0)}  # handle, sign of inwards
FASTEST = np.array([0.3, 0.2, 0.25])  # m/s, m/s, rad/s
UNDER = (-0.03, 0.03, -0.075)  # of a hand from its handle: forward, inwards, up; m


class Carrier:
    def __init__(self, env):
        self.env, self.seen = env, env.reset(seed=0)[0]
        self.info = {}

    def step(self, **parts):
        action = self.env.action_layout.pack(parts, base=self.env.hold_action)
        self.seen, *_, self.info = self.env.step(action)

    def turn(self):
        return pin.utils.rotate("z", -self.env.benchmark.standing.heading)

    def walk(self, x, y, heading):
        """Walk to a place, then stand for a second."""
        for _ in range(300):
            x0, y0, _ = self.seen["robot0_base_pos"]
            left = self.turn() @ [x - x0, y - y0, 0.0]
            yaw = math.remainder(
                heading - self.env.benchmark.standing.heading, math.tau
            )
            if max(math.hypot(*left[:2]), abs(yaw)) < 0.07:
                break
            self.step(walk=np.clip([*left[:2], yaw], -FASTEST, FASTEST))
        for _ in range(20):
            self.step()

    def shift(self, steps, ways):
        """Move the goals of the hands, m in the robot's heading for each action."""
        for _ in range(steps):
            goals = {}
            for hand in HANDS:
                part = self.env.action_layout[f"{hand}_hand"]
                goal = self.env.hold_action[part.start : part.stop].copy()
                goal[:3] += ways(hand)
                goals[f"{hand}_hand"] = goal
            self.step(**goals)

    def reach(self, offset):
        """Move the hands to a place relative to the handles."""

        def way(hand):
            handle, inwards = HANDS[hand]
            left = self.turn() @ self.seen[f"{hand}_gripper_to_handle{handle}"]
            left = left + np.array([1.0, inwards, 1.0]) * offset
            return left * min(0.3, 0.02 / np.linalg.norm(left))

        self.shift(20, way)


@pytest.mark.slow
def test_a_pot_is_carried_to_the_other_table():
    env = make("Carry", "GR1FreeBody")
    carrier = Carrier(env)
    carrier.step(left_gripper=np.full(6, -1.0), right_gripper=np.full(6, -1.0))
    x, y, _ = carrier.seen["pot_pos"]
    carrier.walk(x - 0.42, y, 0.0)
    for offset in ((-0.03, -0.09, 0.02), (-0.03, -0.09, -0.075), UNDER):
        carrier.reach(offset)
    carrier.shift(14, lambda hand: np.array([0.0, 0.0, 0.01]))
    assert env.benchmark.hands_at_pot() == 2
    assert env.benchmark.supports() == set()
    carrier.walk(-0.95, 0.0, 0.0)
    carrier.walk(-0.9, 0.0, math.pi / 2)
    carrier.walk(-0.9, 1.34, math.pi / 2)
    assert not carrier.info["success"]
    for _ in range(40):
        carrier.shift(1, lambda hand: np.array([0.0, 0.0, -0.005]))
        if env.benchmark.hands_at_pot() == 0:
            break
    carrier.shift(6, lambda hand: np.array([0.0, 0.0, -0.004]))
    carrier.walk(-0.9, 1.0, math.pi / 2)
    carrier.walk(-0.9, 1.0, math.pi / 2)
    assert env.benchmark.carried
    assert carrier.info["success"]
