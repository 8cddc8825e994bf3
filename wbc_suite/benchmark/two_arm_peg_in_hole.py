"""TwoArmPegInHole: put the peg on one wrist through the plate on the other."""

import math
from collections.abc import Sequence
from dataclasses import replace

import mujoco
import numpy as np
from pydantic import Field, PositiveFloat, model_validator

from wbc_suite.benchmark.arrangement import Opposed
from wbc_suite.benchmark.base import Source, load_config
from wbc_suite.benchmark.object_benchmark import ObjectBenchmark, ObjectBenchmarkConfig
from wbc_suite.benchmark.predicates import crossing
from wbc_suite.config_files import FrozenModel
from wbc_suite.errors import ConfigError
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.elements import Rgba
from wbc_suite.robot.shapes import Real, Size, SizeInterval, Vector3
from wbc_suite.scene import add_table_cameras, fix_to_frame, robot_prefix
from wbc_suite.scene.objects import Part, SceneObject, cylinder, plate_with_hole
from wbc_suite.sensing.reading import (
    Reading,
    body_position,
    body_quat,
    computed,
    offset,
)

PEG, PLATE = "peg", "plate"
ACROSS = (math.sqrt(0.5), -math.sqrt(0.5), 0.0, 0.0)
"""Turns a plate's normal to the hand's y axis."""


class PegConfig(FrozenModel):
    """The peg; sizes in m, the radius drawn uniformly at each reset."""

    radius: SizeInterval
    half_length: Size
    mass: float = Field(gt=0.0, le=1e3)
    color: Rgba


class PlateConfig(FrozenModel):
    """The plate; sizes in m, mass in kg."""

    half_size: Size
    hole: Size
    half_thickness: Size
    mass: float = Field(gt=0.0, le=1e3)
    stem: Size
    color: Rgba

    @model_validator(mode="after")
    def _has_a_rim(self) -> "PlateConfig":
        if self.hole > 0.9 * self.half_size:
            raise ValueError("the hole must be at most nine tenths of the plate")
        return self


class RewardConfig(FrozenModel):
    """Bounds of success.

    Attributes:
        depth: Least and greatest distance of the hole's plane from the peg's middle,
            along the peg, m.
        cosine: Least cosine of the angle between the peg and the plate's normal.
    """

    depth: tuple[Real, Real]
    cosine: float = Field(ge=0.0, le=1.0)


class TwoArmPegInHoleConfig(ObjectBenchmarkConfig):
    """`tasks/two_arm_peg_in_hole.toml`."""

    opposed: Opposed
    apart: PositiveFloat
    center: Vector3
    peg: PegConfig
    plate: PlateConfig
    reward: RewardConfig


class TwoArmPegInHole(ObjectBenchmark):
    """The peg on the wrist of arm 0 is to go through the plate on that of arm 1.

    Source of geometry and reward: robosuite 1.5, see `Lift`. Unlike there, the peg's
    axis must pass through the hole, and its tip must have come out on the other side:
    bounds of distance alone hold 5 cm beside the hole too, with the tip on the plate.
    """

    robots: Sequence[str] = ("Panda", "Panda")
    gripper: str | None = "none"
    needs_gripper = False

    def __init__(self, path: Source) -> None:
        self.config = load_config(TwoArmPegInHoleConfig, path)
        super().__init__(self.config)

    def arrange(
        self, robots: Sequence[RobotDescription], configuration: str
    ) -> tuple[RobotDescription, ...]:
        """Return the robots at their places; they must have no grippers."""
        gripping = dict.fromkeys(robot.name for robot in robots if robot.synergies)
        if gripping:
            raise ConfigError(
                f"{self.name} fixes peg and plate to the wrists: leave "
                "gripper_types at 'default', and describe robots without grippers; "
                f"{' and '.join(gripping)} have one."
            )
        return super().arrange(robots, configuration)

    def furnish(self, spec: mujoco.MjSpec) -> None:
        """Add cameras."""
        add_table_cameras(spec, self.config.center, before=1.0)

    def objects(self) -> Sequence[SceneObject]:
        """Return the peg, of middle radius, and the plate."""
        return [self._peg(float(np.mean(self.config.peg.radius))), self._plate()]

    def build(self, spec: mujoco.MjSpec) -> None:
        """Add cameras; the objects are fixed to the robots."""
        self.furnish(spec)

    def equip(self, spec: mujoco.MjSpec, robots: Sequence[RobotDescription]) -> None:
        """Fix peg and plate to the wrists, before the hands' frames."""
        attached = iter(self.objects())
        for i, robot in enumerate(robots):
            for frame in robot.hands.values():
                fix_to_frame(spec, next(attached), robot_prefix(i) + frame)

    def reset(self, rng: np.random.Generator) -> None:
        """Draw the peg's radius."""
        radius = rng.uniform(*self.config.peg.radius)
        self.states[PEG].reshape(self._peg(radius))

    def _peg(self, radius: float) -> SceneObject:
        """Return a peg along z with its lower end at the wrist."""
        numbers = self.config.peg
        half, color = numbers.half_length, numbers.color
        rod = cylinder(PEG, radius, half, color=color, material="wood")
        return rod.with_mass(numbers.mass).fixed((0.0, 0.0, half))

    def _plate(self) -> SceneObject:
        """Return a plate on a stem, parallel to z."""
        numbers = self.config.plate
        sizes = numbers.model_dump(exclude={"mass", "stem"})
        plate = plate_with_hole(PLATE, **sizes)
        half = numbers.stem / 2
        stem = Part(
            kind="box",
            size=(0.02, half, 0.8 * numbers.half_thickness),
            pos=(0.0, numbers.half_size + half, 0.0),
            color=(0.16, 0.16, 0.18, 1.0),
        )
        whole = replace(plate, parts=(*plate.parts, stem)).with_mass(numbers.mass)
        return whole.fixed((0.0, 0.0, numbers.stem + numbers.half_size), ACROSS)

    def alignment(self) -> tuple[float, float, float]:
        """Return depth t and distance d of the peg in the hole, m, and their cosine.

        With p the peg's middle, v its axis away from the wrist, h the hole's middle and
        n the plate's normal: t = (h - p) . v, d = |(h - p) - t v|, cosine = |n . v|.
        """
        peg, plate = self.states[PEG], self.states[PLATE]
        axis, to_hole = peg.rotation[:, 2], plate.position - peg.position
        depth = float(to_hole @ axis)
        distance = float(np.linalg.norm(to_hole - depth * axis))
        return depth, distance, min(abs(float(plate.rotation[:, 2] @ axis)), 1.0)

    def observables(self) -> dict[str, Reading]:
        """Return poses of hole and peg, and their alignment."""
        readings, peg = self.world_poses_of({"hole": PLATE}), self.states[PEG].body
        return readings | {
            "peg_to_hole": offset(readings["hole_pos"], body_position(peg)),
            "peg_quat": body_quat(peg),
            "angle": computed(1, lambda: self.alignment()[2]),
            "t": computed(1, lambda: self.alignment()[0]),
            "d": computed(1, lambda: self.alignment()[1]),
        }

    def crossing(self) -> tuple[float, float, float]:
        """Return where the peg's axis crosses the plane of the plate, m.

        x and y are from the hole's middle, in the axes of the plate; the third value is
        the distance from the peg's middle along the peg. All are infinite for a peg
        parallel to the plate.
        """
        peg, plate = self.states[PEG], self.states[PLATE]
        start, end = peg.position, peg.position + peg.rotation[:, 2]
        return crossing(start, end, plate.position, plate.rotation)

    def success(self) -> bool:
        """Whether the peg goes through the hole, nearly along the plate's normal."""
        x, y, depth = self.crossing()
        numbers = self.config.reward
        low, high = numbers.depth
        through = max(abs(x), abs(y)) < self.config.plate.hole and low <= depth <= high
        return through and self.alignment()[2] > numbers.cosine

    def progress(self) -> float:
        """Return the shaped reward.

        With r the distance of the middles of peg and hole, and t, d, cosine of
        `alignment`:

            ((1 - tanh(r)) + (1 - tanh(d)) + (1 - tanh(|t|)) + cosine) / 5
        """
        depth, distance, cosine = self.alignment()
        between = math.hypot(depth, distance)
        near = sum(1.0 - math.tanh(x) for x in (between, distance, abs(depth)))
        return (near + cosine) / 5.0
