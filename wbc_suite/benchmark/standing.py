"""Robots on their own feet: whether they stand, are at rest, or have fallen."""

import math
from collections.abc import Sequence

import mujoco
import numpy as np
from pydantic import Field, PositiveFloat

from wbc_suite.benchmark.arrangement import arrange_one
from wbc_suite.benchmark.object_benchmark import Places
from wbc_suite.config_files import FrozenModel
from wbc_suite.control import RobotState
from wbc_suite.errors import ConfigError
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.shapes import Interval, SizeInterval
from wbc_suite.scene import add_camera
from wbc_suite.sensing.hands import pairs_in_contact
from wbc_suite.typing import Vector

FLOOR = "floor"
MEMORY = 4
"""Entries of user data: when a condition began to hold, s, 0 if it does not; whether
the robot fell, with which tilt and how low."""
ROUNDING = 1e-6  # s


class StandingConfig(FrozenModel):
    """Limits of standing and of rest.

    Attributes:
        tilt: Tilt of the trunk at which a robot has fallen, rad.
        sink: Height that the trunk has lost when a robot has fallen, m.
        speed: Greatest speed of the trunk at rest, m/s.
        turn: Greatest angular speed of the trunk at rest, rad/s.
        hold: Time for which the condition of success must hold, from the end of the
            first action after which it does, s.
    """

    tilt: float = Field(gt=0.0, lt=math.pi)
    sink: PositiveFloat
    speed: PositiveFloat
    turn: PositiveFloat
    hold: PositiveFloat


class StartConfig(FrozenModel):
    """Start of a robot before a table, drawn at each reset.

    Attributes:
        distance: Of the trunk from the table's edge, m.
        aside: Of the trunk from the table's middle, to the left, m.
        heading: Relative to that towards the table, rad.
    """

    distance: SizeInterval
    aside: Interval
    heading: Interval


def arrange_on_feet(
    name: str,
    robots: Sequence[RobotDescription],
    configuration: str,
    places: Places,
    *,
    hands: int = 0,
) -> tuple[RobotDescription, ...]:
    """Return the only robot at its place; it has a free root and feet.

    Args:
        name: Name of the benchmark.
        robots: One robot.
        configuration: See `arrange_one`.
        places: See `arrange_one`.
        hands: Number of hands that the robot needs.

    Raises:
        ConfigError: If it does not, or has too few hands.
    """
    for robot in robots:
        feet = sum(frame.role == "foot" for frame in robot.frames)
        if robot.root.kind != "free" or not feet:
            raise ConfigError(
                f"{name} is for robots on feet, such as 'GR1FreeBody', 'Spot' "
                f"and 'SpotWithArm'. {robot.name} has a {robot.root.kind} root and "
                f"{feet} feet."
            )
        if len(robot.hands) < hands:
            raise ConfigError(
                f"{name} needs {hands} hand(s); {robot.name} has {len(robot.hands)}."
            )
    return arrange_one(name, robots, configuration, places)


def add_floor_cameras(spec: mujoco.MjSpec) -> None:
    """Add cameras that show a robot and the floor around it."""
    middle = (0.0, 0.0, 0.5)
    add_camera(spec, "agentview", (4.5, -2.5, 3.2), middle)
    add_camera(spec, "frontview", (5.5, 0.0, 2.0), middle)
    add_camera(spec, "sideview", (0.0, -5.5, 2.0), middle)
    add_camera(spec, "birdview", (0.0, 0.0, 9.0), (0.0, 0.0, 0.0))


class Standing:
    """Observes a robot with a free root: falls, and how long a condition holds.

    Both are kept in `data.userdata`.

    Args:
        config: The limits.

    Attributes:
        state: The robot in the simulation, after `bind`.
        trunk: Index of its first body.
    """

    def __init__(self, config: StandingConfig) -> None:
        self.config = config

    def reserve(self, spec: mujoco.MjSpec) -> None:
        """Reserve user data: a time, and whether and how the robot fell."""
        self._entry = spec.nuserdata
        spec.nuserdata += MEMORY

    def bind(
        self, model: mujoco.MjModel, data: mujoco.MjData, state: RobotState
    ) -> None:
        """Look up the robot's trunk, feet and all its shapes."""
        self.state, self._data = state, data
        root = model.joint(f"{state.prefix}root")
        self.trunk = int(root.bodyid[0])
        self._q, self._v = int(root.qposadr[0]), int(root.dofadr[0])
        self._memory: Vector = data.userdata[self._entry : self._entry + MEMORY]
        self._floor: int = model.geom(FLOOR).id
        links = {f.link for f in state.robot.frames if f.role == "foot"}
        feet = [int(model.body(state.prefix + link).id) for link in sorted(links)]
        bodies = model.geom_bodyid.tolist()
        own = {
            geom
            for geom, body in enumerate(bodies)
            if model.body_rootid[body] == model.body_rootid[self.trunk]
        }
        self._feet = [{g for g in own if bodies[g] == foot} for foot in feet]
        self._others = own.difference(*self._feet)

    def place(self, x: float, y: float, yaw: float) -> None:
        """Write where the robot stands, m, and its heading, rad, as at a reset."""
        robot = self.state.robot
        quat = np.empty(4)
        turn = np.array([math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)])
        mujoco.mju_mulQuat(quat, turn, np.array(robot.root.quat))
        self._data.qpos[self._q : self._q + 3] = x, y, robot.root.pos[2]
        self._data.qpos[self._q + 3 : self._q + 7] = quat

    def start_before(
        self, edge: tuple[float, float], start: StartConfig, rng: np.random.Generator
    ) -> None:
        """Draw and write the start before a table that lies towards +x.

        Args:
            edge: Middle of the table's edge, m.
            start: What is drawn.
            rng: Source of randomness.
        """
        x = edge[0] - rng.uniform(*start.distance)
        y = edge[1] + rng.uniform(*start.aside)
        self.place(x, y, rng.uniform(*start.heading))

    @property
    def position(self) -> Vector:
        """Position of the trunk in the world, m. A view."""
        return self._data.xpos[self.trunk]

    @property
    def heading(self) -> float:
        """Angle of the trunk's x axis about the vertical, rad."""
        R = self._data.xmat[self.trunk]
        return math.atan2(R.item(3), R.item(0))

    @property
    def tilt(self) -> float:
        """Angle between the trunk's z axis and the vertical, rad."""
        return math.acos(min(max(self._data.xmat[self.trunk].item(8), -1.0), 1.0))

    @property
    def speed(self) -> float:
        """Speed of the trunk, m/s."""
        return float(np.linalg.norm(self._data.qvel[self._v : self._v + 3]))

    @property
    def stands(self) -> bool:
        """Whether all feet touch the floor, and nothing else of the robot."""
        pairs = [pair for pair in pairs_in_contact(self._data) if self._floor in pair]
        touching = {geom for pair in pairs for geom in pair}
        on_feet = all(not touching.isdisjoint(foot) for foot in self._feet)
        return on_feet and touching.isdisjoint(self._others)

    @property
    def rests(self) -> bool:
        """Whether the robot stands with a trunk that hardly moves."""
        turn = float(np.linalg.norm(self._data.qvel[self._v + 3 : self._v + 6]))
        slow = self.speed < self.config.speed and turn < self.config.turn
        return slow and self.stands

    def observe(self, holds: bool) -> None:
        """Note a fall, and since when a condition holds."""
        sunk = self.state.robot.root.pos[2] - self.position.item(2)
        falls = self.tilt > self.config.tilt or sunk > self.config.sink
        if falls and not self._memory[1]:
            self._memory[1:] = 1.0, self.tilt, sunk
        since = self._memory.item(0) or self._data.time
        self._memory[0] = since if holds and self.stands else 0.0

    @property
    def held(self) -> bool:
        """Whether the condition has held for `hold` seconds, without a fall."""
        since, fell, *_ = self._memory.tolist()
        long = self._data.time - since >= self.config.hold - ROUNDING
        return since > 0.0 and long and not fell

    def fall(self) -> str | None:
        """Return how the robot fell in this episode, or None if it has not."""
        _, fell, tilt, sunk = self._memory.tolist()
        if not fell:
            return None
        return (
            f"{self.state.robot.name} fell: its trunk was tilted by "
            f"{math.degrees(tilt):.0f} degrees, and its height had changed by "
            f"{-100 * sunk:.0f} cm."
        )

    def offset_to(self, x: float, y: float) -> tuple[float, float]:
        """Return a point of the world relative to the trunk, m: forward and left."""
        dx, dy = x - self.position.item(0), y - self.position.item(1)
        c, s = math.cos(self.heading), math.sin(self.heading)
        return c * dx + s * dy, c * dy - s * dx


def wrapped(angle: float) -> float:
    """Return an angle between -pi and pi."""
    return math.remainder(angle, math.tau)
