"""An expert for `WalkTo`: walk to a mark by proportional control, and stand there."""

import argparse
import math

import numpy as np

import wbc_suite

FAR = 0.6  # m; from here on the robot looks where it walks
THERE = 0.05  # m, rad; a robot that is so near stands still
FASTEST = np.array([0.5, 0.3, 0.5])  # m/s, m/s, rad/s


def walk_command(forward: float, left: float, turn: float) -> np.ndarray:
    """Return speeds (m/s, m/s, rad/s) from the way that is left, in its heading."""
    if max(math.hypot(forward, left), abs(turn)) < THERE:
        return np.zeros(3)
    ahead = math.atan2(left, forward)
    if math.hypot(forward, left) > FAR:
        turn = ahead
        if abs(ahead) > 0.5:
            return np.clip([0.0, 0.0, turn], -FASTEST, FASTEST)
    return np.clip([forward, left, turn], -FASTEST, FASTEST)


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", nargs="+", default=["Spot", "GR1FreeBody"])
    parser.add_argument("--episodes", type=int, default=3)
    options = parser.parse_args()
    for robot in options.robots:
        env = wbc_suite.make(
            "WalkTo",
            robots=robot,
            controller_configs="WHOLE_BODY_ID",
            terminate_on_success=True,
        )
        successes = 0
        for seed in range(options.episodes):
            observation, info = env.reset(seed=seed)
            over = False
            while not over:
                command = walk_command(*observation["robot_to_goal"])
                action = env.action_layout.pack({"walk": command}, base=env.hold_action)
                observation, _, terminated, truncated, info = env.step(action)
                over = terminated or truncated
            successes += info["success"]
            if not info["success"]:
                missing = observation["robot_to_goal"].round(2)
                print(f"seed {seed}: {info.get('failure', f'{missing} are missing')}")
        print(f"{robot}: {successes} of {options.episodes} episodes succeed")
        env.close()


if __name__ == "__main__":
    main()
