"""What two-arm benchmarks share: how two robots stand, and which arm is which.

It is a level between `ObjectBenchmark` and the benchmarks, since two robots are
arranged alike in all of them.
"""

import math
from collections.abc import Sequence
from typing import Any

from pydantic import PositiveFloat, field_validator

from wbc_suite.benchmark.object_benchmark import ObjectBenchmark, ObjectBenchmarkConfig
from wbc_suite.errors import ConfigError
from wbc_suite.robot import RobotDescription
from wbc_suite.scene import place_robot
from wbc_suite.sensing.reading import Reading, offset, site_position
from wbc_suite.typing import Vector

__all__ = ["TwoArmBenchmark", "TwoArmConfig"]


class TwoArmConfig(ObjectBenchmarkConfig):
    """What the file of every two-arm benchmark holds.

    Attributes:
        opposed: How far each of two robots that face one another stands from the
            middle, m; `default` is for all others. `places` are for one robot, and for
            two side by side.
        apart: How far two robots side by side stand to the sides of their places, m.
    """

    opposed: dict[str, PositiveFloat]
    apart: PositiveFloat

    @field_validator("opposed")
    @classmethod
    def _has_a_default_distance(cls, opposed: dict[str, Any]) -> dict[str, Any]:
        if "default" not in opposed:
            raise ValueError("a distance named 'default' is needed")
        return opposed


class TwoArmBenchmark(ObjectBenchmark):
    """A benchmark for two arms, of two robots or of one.

    Arm 0 is the first robot's or the right one, and starts towards -y; arm 1 is the
    second robot's or the left one.
    """

    robots: Sequence[str] = ("Panda", "Panda")

    def __init__(self, config: TwoArmConfig) -> None:
        super().__init__(config)
        self._opposed, self._apart = config.opposed, config.apart

    def arrange(
        self, robots: Sequence[RobotDescription], configuration: str
    ) -> tuple[RobotDescription, ...]:
        """Return two robots opposed or in parallel, or one with two arms at its place.

        Opposed ones stand on the y axis and look along it at one another; the others
        look along +x.
        """
        if sum(len(robot.hands) for robot in robots) != 2 or len(robots) > 2:
            names = ", ".join(f"{r.name} with {len(r.hands)}" for r in robots)
            raise ConfigError(
                f"{self.name} needs two arms: robots=['Panda', 'Panda'], or one robot "
                f"with two, such as 'Baxter'; not {names}."
            )
        alone = len(robots) == 1
        if configuration == "default":
            configuration = "single-robot" if alone else "opposed"
        if alone != (configuration == "single-robot"):
            raise ConfigError(
                f"{self.name}: {len(robots)} robot(s) cannot stand '{configuration}'; "
                "two stand 'opposed' or 'parallel', one is a 'single-robot'."
            )
        if alone:
            return (self.place(robots[0], 0),)
        stand = self._face_the_other if configuration == "opposed" else self._beside
        return stand(robots[0], -1), stand(robots[1], 1)

    def _face_the_other(self, robot: RobotDescription, side: int) -> RobotDescription:
        distance = self._opposed.get(robot.name, self._opposed["default"])
        return place_robot(robot, (0.0, side * distance), -side * math.pi / 2)

    def _beside(self, robot: RobotDescription, side: int) -> RobotDescription:
        x, y = self._places.get(robot.name, self._places["default"])
        return place_robot(robot, (x, y + side * self._apart), 0.0)

    def arm_to(self, arm: int, point: Reading) -> Reading:
        """Read the way from an arm's hand to a point."""
        return offset(point, site_position(self.hands[arm].site))

    def reach(self, arm: int, point: Vector) -> float:
        """Return how far an arm's hand is from a point, m."""
        return math.dist(self.hands[arm].position.tolist(), point.tolist())
