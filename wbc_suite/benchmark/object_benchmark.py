"""Base of benchmarks with objects: placement, observations, grasps, rewards."""

import math
import re
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, ClassVar, Literal

import mujoco
import numpy as np
from pydantic import Field, PositiveInt, field_validator

from wbc_suite import logs
from wbc_suite.benchmark.arrangement import (
    Places,
    TwoArmPlaces,
    arrange_one,
    arrange_two_arms,
)
from wbc_suite.benchmark.falls import fall_of
from wbc_suite.benchmark.predicates import GRIP_ANGLE, Predicates
from wbc_suite.benchmark.reward_terms import TermConfig
from wbc_suite.config_files import FrozenModel
from wbc_suite.control import RobotState
from wbc_suite.errors import ConfigError, PlacementError
from wbc_suite.robot import RobotDescription
from wbc_suite.scene import ArenaConfig, Push
from wbc_suite.scene.mjcf_arena import PREFIX
from wbc_suite.scene.objects import ObjectState, SceneObject
from wbc_suite.scene.placement import Placed, Sampler
from wbc_suite.sensing.hands import hands_of
from wbc_suite.sensing.reading import (
    Reading,
    body_position,
    body_quat,
    offset,
    relative_position,
    relative_quat,
    site_position,
)
from wbc_suite.typing import Vector

log = logs.logger(__name__)

TRIES = 50
"""Placements that are drawn if a robot touches the objects of the first."""
PRESSED = 1e-3  # depth from which an object is in the arena, and not on it, m
PARKED = (8.0, 8.0)  # place of objects that are not used in an episode, m
CAPITAL = r"(?<=[a-z])(?=[A-Z])"  # where a new word begins in a name
BELOW_ONE = float(np.nextafter(1.0, 0.0))


class ObjectBenchmarkConfig(FrozenModel):
    """Contents of every file in `tasks/`.

    Attributes:
        format: Version of the file format.
        title: The task in a few words.
        instructions: Sentences that tell a policy what to do; `{things}` are the things
            of the episode, `{their}` is "its" or "their", and `{s}` the plural's s.
        paraphrases: Others with the same meaning, which recordings never use.
        horizon: Actions in an episode, at 20 actions a second.
        places: Position of each robot, m.
        one_table: Whether `table`, if there is one, is the only table.
        arena: The scene around it; None for an empty floor.
        placement: A sampler of start poses in place of the benchmark's own, a table of
            `make_sampler`.
        terms: What the shaped reward adds to the benchmark's own, see `reward_terms`.
    """

    one_table: ClassVar[bool] = True

    format: Literal[1]
    name: str
    title: str
    instructions: tuple[str, ...] = ()
    paraphrases: tuple[str, ...] = ()
    horizon: PositiveInt
    places: Places
    arena: ArenaConfig | None = None
    placement: dict[str, Any] | None = None
    terms: tuple[TermConfig, ...] = Field(default=(), alias="term")

    @field_validator("instructions", "paraphrases")
    @classmethod
    def _can_be_filled_in(cls, given: tuple[str, ...]) -> tuple[str, ...]:
        for words in given:
            try:
                in_words(words, ("Cube",))
            except (LookupError, ValueError) as error:
                raise ValueError(
                    f"'{words}' may have {{things}}, {{their}} and {{s}} in braces"
                ) from error
        return given


class ObjectBenchmark(ABC):
    """A scene with objects that robots reach for.

    A subclass defines the fixed furniture (`furnish`), the objects (`objects`), their
    start poses (`sampler`), the success and the shaped reward (`progress`).

    Attributes:
        sampler: Draws the start poses; may be replaced by a sampler of your own.
        placement: The table of a sampler that an environment puts in its place.
        terms: What the shaped reward adds to `progress`.
        arena: The scene around it; None for an empty floor.
        states: The objects and the arena's things in the simulation, by name, after
            `bind`.
        grasps: Where and how hands can hold each object, and the objects attached to
            it, by name, after `bind`.
        hands: The hands of all robots, after `bind`.
        scene: What holds between things and hands now, after `bind`.
        grip_angle: See `Predicates`.
    """

    robots: Sequence[str] = ("Panda",)
    gripper: str | None = None
    needs_gripper = True
    grip_angle = GRIP_ANGLE
    pushes: Sequence[Push] = ()
    sampler: Sampler | None

    def __init__(self, config: ObjectBenchmarkConfig) -> None:
        self.name, self.title, self.horizon = config.name, config.title, config.horizon
        self._placement, self.arena = config, config.arena
        self.placement, self.sampler = config.placement, None
        self.terms = config.terms

    @property
    def things(self) -> Sequence[str]:
        """Names of what the robots are to put somewhere in this episode."""
        return ()

    def instruction(self, number: int, *, paraphrased: bool = False) -> str:
        """Return what to do in this episode, in one of several wordings.

        Args:
            number: Of the wording, modulo how many there are.
            paraphrased: Whether it is one that recordings never use.
        """
        config = self._placement
        given = config.paraphrases if paraphrased else config.instructions
        if not given:
            return self.title
        return in_words(given[number % len(given)], self.things)

    @abstractmethod
    def furnish(self, spec: mujoco.MjSpec) -> None:
        """Add furniture and cameras to an empty arena."""

    @abstractmethod
    def objects(self) -> Sequence[SceneObject]:
        """Return the objects; fixed ones do not move during an episode."""

    @abstractmethod
    def success(self) -> bool:
        """Whether the task is solved now."""

    @abstractmethod
    def progress(self) -> float:
        """Return the shaped reward of a state without success, from 0 to 1."""

    def arrange(
        self, robots: Sequence[RobotDescription], configuration: str
    ) -> tuple[RobotDescription, ...]:
        """Return the robots at their places; two arms if the file has such places."""
        config = self._placement
        if isinstance(config, TwoArmPlaces):
            return arrange_two_arms(config, robots, configuration)
        return arrange_one(self.name, robots, configuration, config.places)

    def build(self, spec: mujoco.MjSpec) -> None:
        """Add furniture, objects and cameras."""
        self.furnish(spec)
        for item in self.objects():
            item.add_to(spec)

    def equip(  # noqa: B027 - most benchmarks have nothing to add
        self, spec: mujoco.MjSpec, robots: Sequence[RobotDescription]
    ) -> None:
        """Add objects that are fixed to the robots: none."""

    def bind(
        self, model: mujoco.MjModel, data: mujoco.MjData, robots: Sequence[RobotState]
    ) -> None:
        """Look up objects and hands; warn if no robot has a gripper."""
        if self.needs_gripper and not any(s.robot.synergies for s in robots):
            log.warning(
                "%s: %s has no gripper, so no object can be picked up.",
                self.name,
                ", ".join(state.robot.name for state in robots),
            )
        self.model, self.data, self._robots = model, data, tuple(robots)
        self._sites: dict[str, Vector] = {}
        prefixes = tuple(state.prefix for state in robots)
        bodies = [model.body(int(b)).name for b in model.geom_bodyid]
        robot_geoms = frozenset(
            g for g, body in enumerate(bodies) if prefixes and body.startswith(prefixes)
        )
        self.hands = [hand for state in robots for hand in hands_of(state)]
        things = self.objects()
        self.states = {t.name: ObjectState(model, data, t.name) for t in things}
        self._own = tuple(self.states)
        self.scene = Predicates(
            data, self.states, self.hands, robot_geoms, grip_angle=self.grip_angle
        )
        self._bind_arena()
        self.grasps = {t.name: t.grasps for thing in things for t in thing.family()}

    def _bind_arena(self) -> None:
        """Look up the arena's things and geoms."""
        self._arena_geoms = frozenset[int]()
        arena = self.arena
        if arena is None:
            return
        names = (self.model.geom(geom).name for geom in range(self.model.ngeom))
        self._arena_geoms = frozenset(
            geom for geom, name in enumerate(names) if name.startswith(PREFIX)
        )
        for name in arena.thing_names(self.model):
            if name in self.states:
                raise ConfigError(
                    f"{self.name} and {arena.file} both have '{name}'. Rename the body "
                    "in the scene."
                )
            self.states[name] = ObjectState(self.model, self.data, PREFIX + name)

    def reset(self, rng: np.random.Generator) -> None:
        """Place the objects; sizes and poses are written into model and data."""
        if self.sampler is not None:
            self.place_objects(rng, self.sampler)

    def place_objects(self, rng: np.random.Generator, sampler: Sampler) -> None:
        """Draw poses of objects until no robot touches them.

        Raises:
            PlacementError: If no such poses are found; names what to relax.
        """
        placements: Mapping[str, Placed] = {}
        for _ in range(TRIES):
            placements = sampler.sample(rng, self.states, {})
            for name, placed in placements.items():
                self.states[name].move(placed.position, placed.quat)
            if not self._is_blocked(placements):
                return
        what = "a robot" if self.arena is None else "a robot or the arena"
        raise PlacementError(
            f"{self.name}: {what} touched {', '.join(placements)} in all {TRIES} "
            "placements. Move the robot away, or enlarge the region."
        )

    def _is_blocked(self, names: Iterable[str]) -> bool:
        """Whether a free object among `names` touches a robot, or is in the arena."""
        free = [self.states[n].geoms for n in names if self.states[n].is_free]
        placed = frozenset[int]().union(*free)
        mujoco.mj_fwdPosition(self.model, self.data)
        deep = self.data.contact.geom[self.data.contact.dist < -PRESSED].tolist()
        return self.scene.in_contact(placed, self.scene.robot_geoms) or any(
            (a in placed and b in self._arena_geoms)
            or (b in placed and a in self._arena_geoms)
            for a, b in deep
        )

    def park(self, names: Iterable[str]) -> None:
        """Place objects that are not used in this episode far away on the floor."""
        for k, name in enumerate(names):
            bottom = self.states[name].extent().bottom
            self.states[name].move((PARKED[0], PARKED[1] + k, bottom))

    def after_step(self) -> None:  # noqa: B027 - most benchmarks have no memory
        """Update the benchmark's own state after a control period: there is none."""

    def failure(self) -> str | None:
        """Return which robot has fallen; else tasks can be solved until the end."""
        return fall_of(self._robots)

    def observables(self) -> dict[str, Reading]:
        """Return the pose of each object (x y z w) and its offset from each hand.

        Keys are those of existing datasets: `{object}_pos`, `{object}_quat`,
        `gripper_to_{object}`; with several hands they start with the hand's name.
        """
        return self.poses_of(self._own)

    def robot_observables(self) -> dict[str, dict[str, Reading]]:
        """Return no readings besides those of the robots themselves."""
        return {}

    def poses_of(self, names: Iterable[str], to: str = "") -> dict[str, Reading]:
        """Return poses of objects by key, and their offsets from each hand.

        `to` is the end of the offsets' keys: `_pos` where existing datasets have it.
        """
        names = tuple(names)
        readings = self.world_poses_of({name: name for name in names})
        for name in names:
            for side, hand in self.sided_hands():
                to_object = offset(readings[f"{name}_pos"], site_position(hand.site))
                readings[f"{side}gripper_to_{name}{to}"] = to_object
        return readings

    def hand_poses_of(self, names: Mapping[str, str]) -> dict[str, Reading]:
        """Return poses of objects, by label, in the world and in the hands' frames.

        Keys are those of existing datasets: `{label}_pos`, `{label}_quat`, and
        `{label}_to_robot0_eef_pos`, `_quat`; quaternions are x y z w.
        """
        readings = self.world_poses_of(names)
        for label, name in names.items():
            body = self.states[name].body
            for side, hand in self.sided_hands():
                key = f"{label}_to_robot0_{side}eef"
                readings[f"{key}_pos"] = relative_position(body, hand.site)
                readings[f"{key}_quat"] = relative_quat(body, hand.site)
        return readings

    def world_poses_of(self, names: Mapping[str, str]) -> dict[str, Reading]:
        """Return `{label}_pos` and `{label}_quat` (x y z w) of objects in the world."""
        readings: dict[str, Reading] = {}
        for label, name in names.items():
            readings[f"{label}_pos"] = body_position(self.states[name].body)
            readings[f"{label}_quat"] = body_quat(self.states[name].body)
        return readings

    def sided_hands(self) -> list[tuple[str, Any]]:
        """Return the hands with their prefix of keys, empty for a single hand."""
        several = len(self.hands) > 1
        return [(f"{h.name}_" if several else "", h) for h in self.hands]

    def reward(self, *, shaped: bool, success: bool | None = None) -> float:
        """Return 1 on success; otherwise 0, or if shaped a value in [0, 1).

        That is `progress`, and what the `terms` of the file add.
        """
        if self.success() if success is None else success:
            return 1.0
        if not shaped:
            return 0.0
        value = self.progress() + sum(term.value(self) for term in self.terms)
        return min(max(value, 0.0), BELOW_ONE)

    def offset_from_hand(self, index: int, point: Reading) -> Reading:
        """Read the offset from a hand to a point in world axes, m."""
        return offset(point, site_position(self.hands[index].site))

    def hand_distance(self, index: int, point: Vector) -> float:
        """Return the distance of one hand to a point, m."""
        return math.dist(self.hands[index].position.tolist(), point.tolist())

    def distance(self, point: Iterable[float]) -> float:
        """Return the distance of the nearest hand to a point, m."""
        point = [float(p) for p in point]
        distances = (math.dist(hand.position.tolist(), point) for hand in self.hands)
        return min(distances, default=math.inf)

    def site(self, name: str) -> Vector:
        """Position of a site in the world, m. A view."""
        if name not in self._sites:
            self._sites[name] = self.data.site_xpos[self.model.site(name).id]
        return self._sites[name]


def in_words(sentence: str, things: Sequence[str]) -> str:
    """Fill the names of things into a sentence; see `instructions`."""
    named = [f"the {re.sub(CAPITAL, ' ', name).lower()}" for name in things]
    *others, last = named or [""]
    return sentence.format(
        things=f"{', '.join(others)} and {last}" if others else last,
        their="their" if others else "its",
        s="s" if others else "",
    )
