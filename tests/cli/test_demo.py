"""What `wbc-suite demo` says of hands that lag."""

import numpy as np

from tests.robot.test_arms import arm_file
from wbc_suite.cli.demo import RATE, REST, _slow
from wbc_suite.robot import load_robot


def test_hands_lag_at_most_20_mm_and_those_of_few_joints_40(tmp_path):
    still = np.zeros((round(REST * RATE), 1))
    cases = (
        (5, 0.03, []),
        (5, 0.05, ["50 mm (at most 40)"]),
        (6, 0.019, []),
        (6, 0.03, ["30 mm (at most 20)"]),
    )
    for joints, median, said in cases:
        robot = load_robot(arm_file(tmp_path, joints))
        (hand,) = robot.hands.values()
        config = {"frame": [{"name": "hand", "frame": hand}]}
        errors = np.concatenate([np.full((101, 1), median), still])
        errors[:50] = 0.0  # the median counts, and no rest
        errors[75:100] = 1.0
        found = [*_slow(robot, config, ["hand"], errors)]
        assert found == [f"hand {text}" for text in said]
