"""WalkTo: walk to a marked place, and stand there with a given heading."""

import math
from collections.abc import Sequence

import mujoco
import numpy as np
from pydantic import NonNegativeFloat, PositiveFloat

from wbc_suite.benchmark.base import Source, load_config
from wbc_suite.benchmark.object_benchmark import ObjectBenchmark, ObjectBenchmarkConfig
from wbc_suite.benchmark.reward_terms import SharesOfOne
from wbc_suite.benchmark.standing import (
    Standing,
    StandingConfig,
    add_floor_cameras,
    arrange_on_feet,
    wrapped,
)
from wbc_suite.config_files import FrozenModel
from wbc_suite.control import RobotState
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.elements import Channel
from wbc_suite.robot.shapes import Interval, Size, SizeInterval
from wbc_suite.scene.objects import Part, SceneObject
from wbc_suite.sensing.reading import Reading, body_position, body_quat, computed

GOAL = "goal"
THICK = 0.002
"""Half height of the mark, m: visible from above only."""


class GoalConfig(FrozenModel):
    """The place to walk to, drawn at each reset.

    Attributes:
        distance: From the start, m.
        bearing: Of the place from the robot's heading at the start, rad.
        heading: To be taken there, relative to that at the start, rad.
        near: Greatest distance of the trunk that counts as there, m.
        facing: Greatest difference of the heading, rad.
        radius: Of the mark, m.
        color: Of the mark.
    """

    distance: SizeInterval
    bearing: Interval
    heading: Interval
    near: PositiveFloat
    facing: PositiveFloat
    radius: Size
    color: tuple[Channel, Channel, Channel, Channel]


class RewardConfig(SharesOfOne):
    """Numbers of the reward; see `WalkTo.progress`."""

    shares = ("place", "heading", "rest")

    place: NonNegativeFloat
    heading: NonNegativeFloat
    rest: NonNegativeFloat
    place_scale: PositiveFloat
    speed_scale: PositiveFloat


class WalkToConfig(ObjectBenchmarkConfig):
    """`tasks/walk_to.toml`."""

    standing: StandingConfig
    goal: GoalConfig
    reward: RewardConfig


class WalkTo(ObjectBenchmark):
    """The robot is to walk to a mark on the floor and stand still as its arrow points.

    Args:
        path: `tasks/walk_to.toml`, or a file of the same form.
    """

    robots: Sequence[str] = ("Spot",)
    needs_gripper = False

    def __init__(self, path: Source) -> None:
        self.config = load_config(WalkToConfig, path)
        super().__init__(self.config)
        self.standing = Standing(self.config.standing)

    def arrange(
        self, robots: Sequence[RobotDescription], configuration: str
    ) -> tuple[RobotDescription, ...]:
        """Return the robot; see `arrange_on_feet`."""
        return arrange_on_feet(self.name, robots, configuration, self.config.places)

    def furnish(self, spec: mujoco.MjSpec) -> None:
        """Add cameras."""
        self.standing.reserve(spec)
        add_floor_cameras(spec)

    def objects(self) -> Sequence[SceneObject]:
        """Return the mark: a disc with an arrow, without collisions."""
        goal = self.config.goal
        return [mark(GOAL, radius=goal.radius, color=goal.color)]

    def bind(
        self, model: mujoco.MjModel, data: mujoco.MjData, robots: Sequence[RobotState]
    ) -> None:
        """Look up the robot and the mark."""
        super().bind(model, data, robots)
        self.standing.bind(model, data, robots[0])

    def reset(self, rng: np.random.Generator) -> None:
        """Draw place and heading."""
        goal, (x, y) = self.config.goal, self.standing.state.robot.root.pos[:2]
        distance = rng.uniform(*goal.distance)
        bearing, self.heading = rng.uniform(*goal.bearing), rng.uniform(*goal.heading)
        x, y = x + distance * math.cos(bearing), y + distance * math.sin(bearing)
        turn = (math.cos(self.heading / 2), 0.0, 0.0, math.sin(self.heading / 2))
        self.states[GOAL].move((x, y, THICK), turn)

    def observables(self) -> dict[str, Reading]:
        """Return the pose of the mark, and what is left of the way to it.

        `robot_to_goal` is the way forward and left, m, and the turn, rad, in the
        heading of the robot.
        """
        body = self.states[GOAL].body
        return {
            "goal_pos": body_position(body),
            "goal_quat": body_quat(body),
            "robot_to_goal": computed(3, self.way_left),
        }

    def way_left(self) -> tuple[float, float, float]:
        """Return the way to the mark: forward and left, m, and the turn, rad."""
        x, y, _ = self.states[GOAL].position.tolist()
        R = self.states[GOAL].rotation
        heading = math.atan2(R.item(1, 0), R.item(0, 0))
        return *self.standing.offset_to(x, y), wrapped(heading - self.standing.heading)

    def after_step(self) -> None:
        """Note a fall, and how long the robot has rested at the mark."""
        forward, left, turn = self.way_left()
        near = math.hypot(forward, left) < self.config.goal.near
        facing = abs(turn) < self.config.goal.facing
        self.standing.observe(near and facing and self.standing.rests)

    def success(self) -> bool:
        """Whether the robot has rested on its feet at the mark, as it points."""
        return self.standing.held

    def failure(self) -> str | None:
        """Return how the robot has fallen, or None."""
        return self.standing.fall()

    def progress(self) -> float:
        """Return the shaped reward.

        With d the distance of the trunk from the mark, e the difference of the headings
        and v the speed of the trunk, it is

            (1 - tanh(place_scale d))
            (place + heading (1 + cos e) / 2 + rest (1 - tanh(speed_scale v)))
        """
        numbers = self.config.reward
        forward, left, turn = self.way_left()
        near = 1.0 - math.tanh(numbers.place_scale * math.hypot(forward, left))
        facing = 0.5 * (1.0 + math.cos(turn))
        still = 1.0 - math.tanh(numbers.speed_scale * self.standing.speed)
        return near * (numbers.place + numbers.heading * facing + numbers.rest * still)


def mark(
    name: str, *, radius: float, color: tuple[float, float, float, float]
) -> SceneObject:
    """Make a disc on the floor with an arrow along its x axis, without collisions."""
    white = (1.0, 1.0, 1.0, 1.0)
    wide, long = 0.1 * radius, 0.35 * radius
    barb = long / math.sqrt(2.0)
    tip = 0.75 * radius
    parts = [
        Part(kind="cylinder", size=(radius, THICK), color=color, solid=False),
        Part(
            kind="box",
            size=(tip - wide, wide, THICK),
            pos=(-wide, 0.0, THICK),
            color=white,
            solid=False,
        ),
    ]
    for side in (1.0, -1.0):
        angle = side * 0.375 * math.pi  # half of three eighths of a turn
        parts.append(
            Part(
                kind="box",
                size=(long, wide, THICK),
                pos=(tip - barb, side * barb, THICK),
                quat=(math.cos(angle), 0.0, 0.0, math.sin(angle)),
                color=white,
                solid=False,
            )
        )
    return SceneObject(name=name, parts=tuple(parts)).fixed((0.0, 0.0, THICK))
