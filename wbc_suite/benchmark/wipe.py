"""Wipe: wipe a stroke of dirt off a table."""

import math
from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, NonNegativeFloat, PositiveFloat

from wbc_suite.benchmark.base import Source, load_config
from wbc_suite.benchmark.object_benchmark import ObjectBenchmark, ObjectBenchmarkConfig
from wbc_suite.benchmark.predicates import hull_distances
from wbc_suite.config_files import FrozenModel
from wbc_suite.control import RobotState
from wbc_suite.errors import ConfigError
from wbc_suite.robot.elements import Channel
from wbc_suite.scene import TableConfig, add_table, add_table_cameras
from wbc_suite.scene.objects import SceneObject
from wbc_suite.sensing.hands import pairs_in_contact
from wbc_suite.sensing.reading import Reading, offset, site_position, user_values
from wbc_suite.typing import Matrix, Vector

MARK = "mark"
CENTROID, PORTION, RADIUS, PRESSES, MEASURES = 0, 3, 4, 5, 6
"""Places of the measured values in user data, after the marks; their number."""
THICK = 0.0004
"""Half height of a mark, m: visible from above only."""


class StrokeConfig(FrozenModel):
    """The stroke of dirt.

    Attributes:
        marks: Number of marks.
        step: Distance of consecutive marks, m.
        width: m.
        coverage: Share of each side of the table in which it stays.
        bend: Standard deviation of its turn from each mark to the next, rad.
    """

    marks: int = Field(gt=0, le=1000)
    step: PositiveFloat
    width: PositiveFloat
    coverage: PositiveFloat
    bend: NonNegativeFloat
    color: tuple[Channel, Channel, Channel, Channel]


class RewardConfig(FrozenModel):
    """Numbers of the reward before normalisation; see `Wipe.progress`."""

    mark: NonNegativeFloat
    complete: NonNegativeFloat
    reach: NonNegativeFloat
    reach_scale: PositiveFloat
    contact: NonNegativeFloat
    press: NonNegativeFloat
    excess: NonNegativeFloat
    collision: NonNegativeFloat
    least_force: PositiveFloat
    most_force: PositiveFloat


class WipeConfig(ObjectBenchmarkConfig):
    """`tasks/wipe.toml`.

    Attributes:
        margin: Marks so near to the contact area are wiped, m.
    """

    table: TableConfig
    stroke: StrokeConfig
    margin: NonNegativeFloat
    reward: RewardConfig


class Wipe(ObjectBenchmark):
    """All marks of a random stroke are to be wiped off, by pressing on them.

    Each hand wipes the convex hull of its contact points with the table. A pad that
    lies flat wipes its whole face, a tilted one its edge, a finger next to nothing.
    Which marks are wiped is kept in `data.userdata`.

    Source of geometry and reward: robosuite 1.5, see `Lift`. Its shaped reward leaves
    [0, 1]; here r > 0 becomes r / (1 + r), and twenty marks are worth more than one.

    Attributes:
        marks: Positions of the marks in the world, shape (n, 3), m.
        force: Force of the hands on the table in the last step, N.
        collided: Whether another part of a robot touched the table in the last step.
    """

    needs_gripper = False
    gripper: str | None = "WipingGripper"

    def __init__(self, path: Source) -> None:
        self.config = load_config(WipeConfig, path)
        super().__init__(self.config)
        self.marks: Matrix = np.zeros((self.config.stroke.marks, 3))
        self._newly_wiped, self.force, self.collided = 0, 0.0, False

    def furnish(self, spec: mujoco.MjSpec) -> None:
        """Add table, dirt and cameras."""
        table, stroke = self.config.table, self.config.stroke
        add_table(spec, table)
        spec.nuserdata += stroke.marks + MEASURES
        spec.add_material(name="dirt", specular=0.0, shininess=0.0)
        body = spec.worldbody.add_body(name="dirt")
        for i in range(stroke.marks):
            body.add_geom(
                name=f"{MARK}{i}",
                type=mujoco.mjtGeom.mjGEOM_CYLINDER,
                size=(stroke.width / 2, THICK, 0.0),
                rgba=stroke.color,
                material="dirt",
                contype=0,
                conaffinity=0,
                group=2,
                mass=0.0,
            )
        add_table_cameras(spec, table.center)

    def objects(self) -> Sequence[SceneObject]:
        """Return no objects: dirt is visual only."""
        return []

    def bind(
        self, model: mujoco.MjModel, data: mujoco.MjData, robots: Sequence[RobotState]
    ) -> None:
        """Look up the marks, their user data, and the table."""
        super().bind(model, data, robots)
        surface = self.config.table.geom or "table"
        if surface not in (model.geom(i).name for i in range(model.ngeom)):
            raise ConfigError(f"{self.name}: name a geom as `surface`, not a site.")
        self._table: int = model.geom(surface).id
        self._first_prefix = robots[0].prefix
        first = model.geom(f"{MARK}0").id
        self._geoms = slice(first, first + len(self.marks))
        model.geom_sameframe[self._geoms] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE
        self._wrench = np.zeros(6)
        self._first = model.nuserdata - MEASURES
        self._measures: Vector = data.userdata[self._first :]
        self._wiped: Vector = data.userdata[self._first - len(self.marks) : self._first]

    @property
    def wiped(self) -> NDArray[np.bool_]:
        """Which marks are wiped off, shape (n,)."""
        return self._wiped > 0.0

    def reset(self, rng: np.random.Generator) -> None:
        """Draw a stroke."""
        x, y, z = self.config.table.center
        self.marks[:, :2] = np.array([x, y]) + self._stroke(rng)
        self.marks[:, 2] = z
        self.model.geom_pos[self._geoms] = self.marks
        self._measures[PRESSES] = 0.0
        self._newly_wiped, self.force, self.collided = 0, 0.0, False
        self.wipe(np.zeros(len(self.marks), dtype=np.bool_))

    def _stroke(self, rng: np.random.Generator) -> Matrix:
        """Return a random walk that turns back at the edges of its area."""
        stroke, table = self.config.stroke, self.config.table
        ends = np.asarray(table.size[:2]) / 2 * stroke.coverage
        at = rng.uniform(-ends, ends)
        heading = rng.uniform(-np.pi, np.pi)
        walk = np.empty((stroke.marks, 2))
        for k in range(stroke.marks):
            walk[k] = at
            heading += rng.normal(0.0, stroke.bend)
            step = stroke.step * np.array([np.cos(heading), np.sin(heading)])
            step[np.abs(at + step) > ends] *= -1.0
            heading = float(np.arctan2(step[1], step[0]))
            at = at + step
        return walk

    def after_step(self) -> None:
        """Wipe off the marks that the hands press on now."""
        faces, self.force, self.collided = self._contacts()
        self._newly_wiped = 0
        presses = self.force >= self.config.reward.least_force
        self._measures[PRESSES] = presses
        if not presses:
            return
        at, margin = self.marks[:, :2], self.config.margin
        near = np.any([hull_distances(face, at) <= margin for face in faces], axis=0)
        before = self.wiped
        self._newly_wiped = int((near & ~before).sum())
        if self._newly_wiped:
            self.wipe(near | before)

    def resume(self) -> None:
        """Draw the marks that are left in a saved state."""
        self.wipe(self.wiped)

    def _contacts(self) -> tuple[list[Matrix], float, bool]:
        """Return each hand's contact points with the table, force and collision.

        Points have shape (n, 2), n > 0.
        """
        points: list[list[Vector]] = [[] for _ in self.hands]
        force, collided = 0.0, False
        for i, (a, b) in enumerate(pairs_in_contact(self.data)):
            if self._table not in (a, b):
                continue
            owners = [k for k, h in enumerate(self.hands) if h.owns(a) or h.owns(b)]
            for owner in owners:
                mujoco.mj_contactForce(self.model, self.data, i, self._wrench)
                force += abs(self._wrench.item(0))
                points[owner].append(self.data.contact.pos[i, :2])
            if not owners and not self.scene.robot_geoms.isdisjoint((a, b)):
                collided = True
        return [np.array(face) for face in points if face], force, collided

    def wipe(self, wiped: ArrayLike) -> None:
        """Set which marks are wiped off, shape (n,); measure and draw the others."""
        self._wiped[:] = wiped
        left = self.marks[~self.wiped]
        self._measures[:3] = (left if len(left) else self.marks).mean(axis=0)
        self._measures[PORTION] = self.wiped.mean()
        distances = np.linalg.norm(left - self.centroid, axis=1)
        self._measures[RADIUS] = distances.max(initial=0.0)
        alpha = np.where(self.wiped, 0.0, self.config.stroke.color[3])
        self.model.geom_rgba[self._geoms, 3] = alpha

    def observables(self) -> dict[str, Reading]:
        """Return the wiped portion, and centroid and radius of the marks left.

        Keys are those of existing datasets; offsets from the hands are added.
        """
        centroid = self._measure(CENTROID, 3)
        readings = {
            "proportion_wiped": self._measure(PORTION),
            "wipe_radius": self._measure(RADIUS),
            "wipe_centroid": centroid,
        }
        for side, hand in self.sided_hands():
            to_centroid = offset(centroid, site_position(hand.site))
            readings[f"{side}gripper_to_wipe_centroid"] = to_centroid
        return readings

    def robot_observables(self) -> dict[str, dict[str, Reading]]:
        """Return whether the robot presses on the table, 1 or 0: `robot0_contact`."""
        prefix = self._first_prefix
        return {prefix: {f"{prefix}contact": self._measure(PRESSES)}}

    def _measure(self, place: int, size: int = 1) -> Reading:
        start = self._first + place
        return user_values(range(start, start + size))

    @property
    def centroid(self) -> Vector:
        """Centroid of the marks left, or of all if none is left, m. A view."""
        return self._measures[:3]

    @property
    def portion(self) -> float:
        """Share of the marks that are wiped off."""
        return self._measures.item(PORTION)

    def success(self) -> bool:
        """Whether all marks are wiped off."""
        return self.portion == 1.0

    def progress(self) -> float:
        """Return the shaped reward.

        With n marks wiped in this step, d the distance of the nearest hand to the
        centroid of the others, f the force of the hands on the table, and horizon H:

            (mark n + reach (1 - tanh(reach_scale d)) + contact [touches]
             + contact + press f                       if least_force < f <= most_force
             - excess f                                if f > most_force
             - collision [another part touches the table])
            * H / (mark marks + H (contact + complete))

        r below 0 gives 0, others r / (1 + r).
        """
        numbers, force = self.config.reward, self.force
        distance = self.distance(self.centroid)
        reward = numbers.mark * self._newly_wiped
        reward += numbers.reach * (1.0 - math.tanh(numbers.reach_scale * distance))
        reward += numbers.contact * (force > 0.0)
        if force > numbers.most_force:
            reward -= numbers.excess * force
        elif force > numbers.least_force:
            reward += numbers.contact + numbers.press * force
        reward -= numbers.collision * self.collided
        most = numbers.mark * len(self.marks)
        most += self.horizon * (numbers.contact + numbers.complete)
        reward = max(float(reward * self.horizon / most), 0.0)
        return reward / (1.0 + reward)
