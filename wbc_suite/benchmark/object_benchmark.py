"""What benchmarks with objects share: placing, looking, grasping, rewards."""

import logging
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, TypeVar

import mujoco
import numpy as np
from pydantic import PositiveInt, field_validator

from wbc_suite.control import RobotState
from wbc_suite.errors import ConfigError, PlacementError
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.shapes import Real, Vector3
from wbc_suite.scene import add_camera, place_robot
from wbc_suite.scene.objects import Thing, ThingState
from wbc_suite.scene.placement import Placed, Sampler
from wbc_suite.sensing.hands import hands_of, pairs_in_contact
from wbc_suite.sensing.reading import (
    Reading,
    body_position,
    body_quat,
    chosen,
    constant,
    offset,
    seen_position,
    seen_quat,
    site_position,
)
from wbc_suite.tomlfile import FrozenModel, parse_model, read_toml
from wbc_suite.typing import Vector

__all__ = [
    "ObjectBenchmark",
    "ObjectBenchmarkConfig",
    "add_table_cameras",
    "load_config",
]

log = logging.getLogger(__name__)


C = TypeVar("C", bound="ObjectBenchmarkConfig")


class ObjectBenchmarkConfig(FrozenModel):
    """What every file in `tasks/` holds.

    Attributes:
        format: Version of this form.
        name: Name of the benchmark.
        title: What it is, in a few words.
        horizon: Actions in an episode.
        places: Where each robot stands, m; `default` is for all others.
    """

    format: Literal[1]
    name: str
    title: str
    horizon: PositiveInt
    places: dict[str, tuple[Real, Real]]

    @field_validator("places")
    @classmethod
    def _has_a_default(cls, places: dict[str, Any]) -> dict[str, Any]:
        if "default" not in places:
            raise ValueError("a place named 'default' is needed")
        return places


def load_config(model: type[C], path: Path) -> C:
    """Read a benchmark's file; one that `extends` another says only what differs.

    Raises:
        ConfigError: If it is wrong, or extends a file outside its folder.
    """
    data = read_toml(path)
    base = data.pop("extends", None)
    if base is not None:
        name = str(base)
        if name != Path(name).name:
            raise ConfigError(
                f"{path}: key 'extends' = {name!r}: name a file of the same folder, "
                "without folder and ending."
            )
        try:
            data = read_toml(path.with_name(f"{name}.toml")) | data
        except ConfigError as error:
            raise ConfigError(f"{path}: key 'extends' = {name!r}: {error}") from error
    return parse_model(model, data, source=str(path))


class ObjectBenchmark(ABC):
    """A scene with things, which robots stand before and reach for.

    A benchmark says what the room holds (`furnish`), which things there are (`things`),
    where they start (`sampler`), when it is solved (`success`) and how far it has come
    (`progress`). Everything else is here.

    Attributes:
        sampler: Draws where things start; may be replaced by one of your own.
        states: The things in the simulation, by name, after `bind`.
        hands: The robots' hands, after `bind`.
    """

    robots: Sequence[str] = ("Panda",)
    gripper: str | None = None
    needs_gripper = True

    def __init__(self, config: ObjectBenchmarkConfig) -> None:
        self.name, self.horizon = config.name, config.horizon
        self._places = config.places
        self.sampler: Sampler | None = None

    @abstractmethod
    def furnish(self, spec: mujoco.MjSpec) -> None:
        """Add furniture and cameras to an empty arena."""

    @abstractmethod
    def things(self) -> Sequence[Thing]:
        """Return the things; a fixed one stands still in an episode."""

    @abstractmethod
    def success(self) -> bool:
        """Whether the benchmark is solved now."""

    @abstractmethod
    def progress(self) -> float:
        """Return the shaped reward of a state that is no success, from 0 to 1."""

    def arrange(
        self, robots: Sequence[RobotDescription], configuration: str
    ) -> tuple[RobotDescription, ...]:
        """Return the robot, of which there is one, at its place."""
        if len(robots) != 1:
            raise ConfigError(
                f"{self.name} has a place for 1 robot(s), not {len(robots)}."
            )
        if configuration not in ("default", "single-robot"):
            raise ConfigError(
                f"{self.name}: one robot cannot stand '{configuration}'; leave "
                "env_configuration at 'default'."
            )
        return (self.place(robots[0], 0),)

    def place(self, robot: RobotDescription, index: int) -> RobotDescription:
        """Return the robot standing where the benchmark's file says, facing +x."""
        spot = self._places.get(robot.name, self._places["default"])
        return place_robot(robot, spot, 0.0)

    def build(self, spec: mujoco.MjSpec) -> None:
        """Add furniture, things and cameras."""
        self.furnish(spec)
        for thing in self.things():
            thing.add_to(spec)

    def equip(  # noqa: B027 - most benchmarks have nothing to add
        self, spec: mujoco.MjSpec, robots: Sequence[RobotDescription]
    ) -> None:
        """Add what is fixed to the robots: nothing."""

    def bind(
        self, model: mujoco.MjModel, data: mujoco.MjData, robots: Sequence[RobotState]
    ) -> None:
        """Look up the things and the hands; say so where nothing can grip."""
        if self.needs_gripper and not any(s.robot.synergies for s in robots):
            log.warning(
                "%s: %s has no gripper, so nothing can be picked up.",
                self.name,
                ", ".join(state.robot.name for state in robots),
            )
        self.model, self.data = model, data
        self._sites: dict[str, Vector] = {}
        prefixes = tuple(state.prefix for state in robots)
        bodies = [model.body(int(b)).name for b in model.geom_bodyid]
        self._robot_geoms = frozenset(
            g for g, body in enumerate(bodies) if prefixes and body.startswith(prefixes)
        )
        self.hands = [hand for state in robots for hand in hands_of(state)]
        self.states = {t.name: ThingState(model, data, t.name) for t in self.things()}

    def reset(self, rng: np.random.Generator) -> None:
        """Place the things; sizes and poses are written into model and data."""
        if self.sampler is not None:
            self.place_things(rng, self.sampler)

    def place_things(self, rng: np.random.Generator, sampler: Sampler) -> None:
        """Put things where a sampler says and no robot touches them.

        Raises:
            PlacementError: If there is no such place; says what to relax.
        """
        placements: Mapping[str, Placed] = {}
        for _ in range(TRIES):
            placements = sampler.sample(rng, self.states, {})
            for name, placed in placements.items():
                self.states[name].move(placed.position, placed.quat)
            if not self._robot_touches(placements):
                return
        raise PlacementError(
            f"{self.name}: wherever {', '.join(placements)} were put, in {TRIES} tries "
            "a robot touched them. Move the robot away, or enlarge the region."
        )

    def _robot_touches(self, names: Iterable[str]) -> bool:
        """Whether a robot as it stands now touches one of some free things."""
        free = [self.states[n].geoms for n in names if self.states[n].is_free]
        placed = frozenset[int]().union(*free)
        mujoco.mj_fwdPosition(self.model, self.data)
        return any(
            (a in placed and b in self._robot_geoms)
            or (b in placed and a in self._robot_geoms)
            for a, b in pairs_in_contact(self.data)
        )

    def park(self, names: Iterable[str]) -> None:
        """Stand things that have no part in this episode far away on the floor."""
        for k, name in enumerate(names):
            bottom = self.states[name].extent().bottom
            self.states[name].move((PARKED[0], PARKED[1] + k, bottom))

    def watch(self) -> None:  # noqa: B027 - most benchmarks have no memory
        """Note what happened in a control period: nothing."""

    def observables(self) -> dict[str, Reading]:
        """Return every thing's pose (quaternion x y z w), and its way from each hand.

        The keys are those of this field's datasets: `{thing}_pos`, `{thing}_quat`,
        `gripper_to_{thing}_pos`; with several hands their names come before.
        """
        return self.poses_of(self.states)

    def felt(self) -> dict[str, dict[str, Reading]]:
        """Return nothing that robots feel beside their own joints."""
        return {}

    def poses_of(self, names: Iterable[str], to: str = "") -> dict[str, Reading]:
        """Return poses of things by key, and their ways from each hand.

        Args:
            names: The things.
            to: What the ways' keys end in: `_pos`, where datasets have it.
        """
        readings: dict[str, Reading] = {}
        for name in names:
            readings[f"{name}_pos"] = body_position(self.states[name].body)
            readings[f"{name}_quat"] = body_quat(self.states[name].body)
        for name in names:
            for side, hand in self.sided_hands():
                way = offset(readings[f"{name}_pos"], site_position(hand.site))
                readings[f"{side}gripper_to_{name}{to}"] = way
        return readings

    def hand_poses_of(self, names: Mapping[str, str]) -> dict[str, Reading]:
        """Return things' poses in the world, and as seen by the hands.

        Keys are `{label}_pos`, `{label}_quat`, and those with `_to_robot0_eef` within,
        as this field's datasets have them; quaternions are x y z w.

        Args:
            names: Name of each thing, by its label in keys.
        """
        bodies = {label: self.states[name].body for label, name in names.items()}
        readings: dict[str, Reading] = {}
        for label, body in bodies.items():
            readings[f"{label}_pos"] = body_position(body)
            readings[f"{label}_quat"] = body_quat(body)
        for label, body in bodies.items():
            for side, hand in self.sided_hands():
                key = f"{label}_to_robot0_{side}eef"
                readings[f"{key}_pos"] = seen_position(body, hand.site)
                readings[f"{key}_quat"] = seen_quat(body, hand.site)
        return readings

    def picked_poses(
        self, names: Sequence[str], number: Callable[[], int]
    ) -> dict[str, Reading]:
        """Return what `hand_poses_of` does of the one thing that an episode has.

        Args:
            names: The things that it may be.
            number: Says which of them it is, as `obj_id`.
        """
        each = [self.hand_poses_of({"obj": name}) for name in names]
        each = [poses | {"obj_id": constant(k)} for k, poses in enumerate(each)]
        return {key: chosen([poses[key] for poses in each], number) for key in each[0]}

    def sided_hands(self) -> list[tuple[str, Any]]:
        """Return the hands, with a prefix for keys where there are several."""
        several = len(self.hands) > 1
        return [(f"{h.name}_" if several else "", h) for h in self.hands]

    def reward(self, *, shaped: bool, success: bool | None = None) -> float:
        """Return 1 on success; else 0, or if shaped `progress`, in [0, 1)."""
        if self.success() if success is None else success:
            return 1.0
        return min(max(self.progress(), 0.0), BELOW_ONE) if shaped else 0.0

    def distance(self, point: Iterable[float]) -> float:
        """Return how far the nearest hand is from a point, m."""
        point = [float(p) for p in point]
        return min(
            (math.dist(hand.position.tolist(), point) for hand in self.hands),
            default=math.inf,  # a robot without hands reaches nothing
        )

    def site(self, name: str) -> Vector:
        """Position of a site in the world, m. A view."""
        found = self._sites.get(name)
        if found is None:
            found = self.data.site_xpos[self.model.site(name).id]
            self._sites[name] = found
        return found

    def grasped(self, name: str) -> bool:
        """Whether two links of one gripper touch a thing."""
        geoms = self.states[name].geoms
        return any(hand.grasps(geoms) for hand in self.hands)

    def touching(self, first: str, second: str) -> bool:
        """Whether two things touch."""
        a, b = self.states[first].geoms, self.states[second].geoms
        return any(
            (x in a and y in b) or (x in b and y in a)
            for x, y in pairs_in_contact(self.data)
        )


TRIES = 50
"""Placements that are drawn where a robot is in the way of the first."""
PARKED = (8.0, 8.0)
"""Where what has no part in an episode stands, m."""
BELOW_ONE = float(np.nextafter(1.0, 0.0))


def add_table_cameras(
    spec: mujoco.MjSpec, center: Vector3, *, side: float = -1.0, before: float = 0.75
) -> None:
    """Add the cameras of table-top benchmarks, by the names that datasets have.

    Args:
        spec: The scene.
        center: Middle of the table's upper face, m.
        side: Where `sideview` stands: at -y or +y.
        before: How far `agentview` stands before the table's middle, m.
    """
    x, y, z = center
    middle = (x - 0.15, y, z + 0.25)
    add_camera(spec, "frontview", (x + 1.9, y, z + 0.75), middle)
    add_camera(spec, "agentview", (x + before, y, z + 0.75), (x - 0.1, y, z + 0.1))
    add_camera(spec, "sideview", (x - 0.1, y + 1.9 * side, z + 0.65), middle)
    add_camera(spec, "birdview", (x - 0.2, y, z + 2.2), (x - 0.2, y, z))
