"""Falls of robots on their feet, in benchmarks of objects."""

import math
from collections.abc import Iterable

from wbc_suite.control import RobotState

TILT = 1.0  # rad, of the trunk
SUNK = 0.5  # share of the height of the trunk
LOW = 0.05  # m; below, a first link is between wheels, and cannot lose half of it


def fall_of(robots: Iterable[RobotState]) -> str | None:
    """Return which robot with a free root has fallen now, and how; None if none has.

    It has when its trunk is tilted by more than 1 rad, or has lost half of its height.
    """
    for state in robots:
        if state.robot.root.kind != "free":
            continue
        pose, height = state.root_pose, state.robot.root.pos[2]
        tilt = math.acos(min(max(pose.rotation.item(2, 2), -1.0), 1.0))
        sunk = 1.0 - pose.translation.item(2) / height if height > LOW else 0.0
        if tilt > TILT or sunk > SUNK:
            return (
                f"{state.robot.name} fell: its trunk is tilted by "
                f"{math.degrees(tilt):.0f} degrees, and {100 * sunk:.0f} % lower than "
                "it stands."
            )
    return None
