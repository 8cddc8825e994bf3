"""Lift: pick a cube up from a table."""

import logging
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import mujoco
import numpy as np
from pydantic import NonNegativeFloat, PositiveFloat, PositiveInt, field_validator

from wbc_suite.control import RobotState
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.component import Channel
from wbc_suite.robot.parts import NotNegative
from wbc_suite.robot.shapes import Real, Size
from wbc_suite.scene import TableConfig, add_box, add_camera, add_table, place_robot
from wbc_suite.scene.objects import WOOD_DENSITY
from wbc_suite.sensing.hands import hands_of
from wbc_suite.tomlfile import FrozenModel, load_model
from wbc_suite.typing import Vector

__all__ = ["Lift", "LiftConfig"]

log = logging.getLogger(__name__)


class CubeConfig(FrozenModel):
    """The cube; half sizes in m, drawn uniformly at each reset."""

    half_size: tuple[Size, Size]
    spread: tuple[NotNegative, NotNegative]
    clearance: NotNegative
    color: tuple[Channel, Channel, Channel, Channel]

    @field_validator("half_size")
    @classmethod
    def _from_small_to_large(cls, sizes: tuple[float, float]) -> tuple[float, float]:
        if sizes[0] > sizes[1]:
            raise ValueError("the smallest size comes first")
        return sizes


class RewardConfig(FrozenModel):
    """Numbers of the reward; see `Lift.reward`."""

    reach_scale: PositiveFloat
    grasp: NonNegativeFloat
    success: PositiveFloat
    lift_height: PositiveFloat


class LiftConfig(FrozenModel):
    """`tasks/lift.toml`; `places` says where each robot stands, m."""

    format: Literal[1]
    name: str
    title: str
    horizon: PositiveInt
    table: TableConfig
    cube: CubeConfig
    reward: RewardConfig
    places: dict[str, tuple[Real, Real]]

    @field_validator("places")
    @classmethod
    def _has_a_default(cls, places: dict[str, Any]) -> dict[str, Any]:
        if "default" not in places:
            raise ValueError("a place named 'default' is needed")
        return places


class Lift:
    """A cube on a table is to be lifted 4 cm.

    Source of geometry and reward: Zhu et al. (2020), "robosuite: A Modular Simulation
    Framework and Benchmark for Robot Learning", arXiv:2009.12293, and its release 1.5.

    Args:
        path: `tasks/lift.toml`, or a file of the same form.
    """

    max_robots = 1

    def __init__(self, path: Path) -> None:
        self.config = load_model(LiftConfig, path)
        self.name, self.horizon = self.config.name, self.config.horizon

    def place(self, robot: RobotDescription, index: int) -> RobotDescription:
        """Return the robot standing behind the table, facing it."""
        places = self.config.places
        return place_robot(robot, places.get(robot.name, places["default"]), 0.0)

    def build(self, spec: mujoco.MjSpec) -> None:
        """Add table, cube and cameras."""
        add_table(spec, self.config.table)
        half = float(np.mean(self.config.cube.half_size))
        add_box(spec, "cube", half_size=(half, half, half), rgba=self.config.cube.color)
        x, y, z = self.config.table.center
        middle = (x - 0.15, y, z + 0.25)
        add_camera(spec, "frontview", (x + 1.9, y, z + 0.75), middle)
        add_camera(spec, "agentview", (x + 0.75, y, z + 0.75), (x - 0.1, y, z + 0.1))
        add_camera(spec, "sideview", (x - 0.1, y - 1.9, z + 0.65), middle)
        add_camera(spec, "birdview", (x - 0.2, y, z + 2.2), (x - 0.2, y, z))

    def bind(
        self, model: mujoco.MjModel, data: mujoco.MjData, robots: Sequence[RobotState]
    ) -> None:
        """Look up the cube and the hands; say so where nothing can grip it."""
        if not any(state.robot.synergies for state in robots):
            log.warning(
                "%s: %s has no gripper, so the cube will stay where it is.",
                self.name,
                ", ".join(state.robot.name for state in robots),
            )
        self._model, self._data = model, data
        self._hands = [hand for state in robots for hand in hands_of(state)]
        self._geom = model.geom("cube").id
        self._body = model.body("cube").id
        self._q = int(model.joint("cube_joint").qposadr[0])
        self._v = int(model.joint("cube_joint").dofadr[0])

    def reset(self, rng: np.random.Generator) -> None:
        """Draw the cube's size and place, and set it just above the table."""
        cube, (x, y, z) = self.config.cube, self.config.table.center
        half = rng.uniform(*cube.half_size)
        self._resize(half)
        dx, dy = rng.uniform(-1.0, 1.0, 2) * cube.spread
        yaw = rng.uniform(-np.pi, np.pi)
        q, v = self._data.qpos, self._data.qvel
        q[self._q : self._q + 3] = x + dx, y + dy, z + half + cube.clearance
        q[self._q + 3 : self._q + 7] = np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)
        v[self._v : self._v + 6] = 0.0

    def _resize(self, half: float) -> None:
        """Write another edge length into the compiled model."""
        model, mass = self._model, WOOD_DENSITY * (2 * half) ** 3
        model.geom_size[self._geom] = half
        model.geom_aabb[self._geom, 3:] = half
        model.geom_rbound[self._geom] = half * np.sqrt(3.0)
        model.body_mass[self._body] = model.body_subtreemass[self._body] = mass
        model.body_inertia[self._body] = mass * (2 * half) ** 2 / 6.0

    def observe(self) -> dict[str, Vector]:
        """Return the cube's pose (quaternion x y z w) and its place from each hand."""
        position = self.cube_position
        quat = self._data.xquat[self._body]
        relative = {
            key: position - hand.position
            for key, hand in zip(self._relative, self._hands, strict=True)
        }
        return {
            "cube_pos": position.copy(),
            "cube_quat": quat[[1, 2, 3, 0]],
            **relative,
        }

    @property
    def _relative(self) -> list[str]:
        if len(self._hands) == 1:
            return ["gripper_to_cube_pos"]
        return [f"{hand.name}_gripper_to_cube_pos" for hand in self._hands]

    @property
    def cube_position(self) -> Vector:
        """Middle of the cube in the world, m. A view."""
        return self._data.xpos[self._body]

    def success(self) -> bool:
        """Whether the cube's middle is more than `lift_height` above the table."""
        height = self.cube_position[2] - self.config.table.center[2]
        return bool(height > self.config.reward.lift_height)

    def reward(self, *, shaped: bool) -> float:
        """Return the reward, in [0, 1].

        Sparse: 1 on success. Shaped, with d the distance of the nearest hand:

            (success                                if lifted
             else 1 - tanh(reach_scale d) + grasp [two links touch the cube])
            / success
        """
        numbers = self.config.reward
        if self.success():
            return 1.0
        if not shaped:
            return 0.0
        distance = min(
            float(np.linalg.norm(hand.position - self.cube_position))
            for hand in self._hands
        )
        reward = 1.0 - np.tanh(numbers.reach_scale * distance)
        if any(hand.grasps(self._geom) for hand in self._hands):
            reward += numbers.grasp
        return float(reward / numbers.success)
