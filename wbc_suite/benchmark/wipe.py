"""Wipe: wipe a stroke of dirt off a table."""

import math
from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray
from pydantic import NonNegativeFloat, PositiveFloat, PositiveInt

from wbc_suite.benchmark.object_benchmark import (
    ObjectBenchmark,
    ObjectBenchmarkConfig,
    add_table_cameras,
    load_config,
)
from wbc_suite.control import RobotState
from wbc_suite.robot.component import Channel
from wbc_suite.scene import TableConfig, add_table
from wbc_suite.scene.objects import Thing
from wbc_suite.sensing.hands import pairs_in_contact
from wbc_suite.sensing.reading import Reading, offset, site_position, user_values
from wbc_suite.tomlfile import FrozenModel
from wbc_suite.typing import Matrix, Vector

__all__ = ["Wipe", "WipeConfig"]

MARK = "mark"


class StrokeConfig(FrozenModel):
    """The stroke of dirt.

    Attributes:
        marks: How many marks it consists of.
        step: From each mark to the next, m.
        width: Of the stroke, m.
        coverage: Which part of the table, along each side, it stays in.
        bend: Standard deviation of its turn from each mark to the next, rad.
        color: Of the dirt.
    """

    marks: PositiveInt
    step: PositiveFloat
    width: PositiveFloat
    coverage: PositiveFloat
    bend: NonNegativeFloat
    color: tuple[Channel, Channel, Channel, Channel]


class RewardConfig(FrozenModel):
    """Numbers of the reward, before it is divided; see `Wipe.progress`."""

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
        table: The table.
        stroke: What is to be wiped off.
        margin: Marks that are so near to what presses are wiped, m.
        reward: Numbers of the reward.
    """

    table: TableConfig
    stroke: StrokeConfig
    margin: NonNegativeFloat
    reward: RewardConfig


class Wipe(ObjectBenchmark):
    """All marks of a random stroke are to be wiped off, by pressing on them.

    What wipes is the area that the hands press on: the convex hull of the points where
    they touch the table. A pad that lies flat wipes its whole face, one that is tilted
    its edge, and a finger next to nothing.

    Source of geometry and reward: the benchmark of this name in robosuite 1.5, see
    `Lift`. Its shaped reward leaves [0, 1]; here it is cut to that.

    Args:
        path: `tasks/wipe.toml`, or a file of the same form.

    Attributes:
        marks: Where the marks are, x y z in the world, shape (n, 3), m.
        force: With which the hands press on the table, N, in the last step.
        collided: Whether another part of a robot touched the table in the last step.
    """

    needs_gripper = False
    gripper: str | None = "WipingGripper"

    def __init__(self, path: Path) -> None:
        self.config = load_config(WipeConfig, path)
        super().__init__(self.config)
        count = self.config.stroke.marks
        self.marks: Matrix = np.zeros((count, 3))
        self._fresh, self.force, self.collided, self._seen = 0, 0.0, False, b""

    def furnish(self, spec: mujoco.MjSpec) -> None:
        """Add table, dirt and cameras."""
        table, stroke = self.config.table, self.config.stroke
        add_table(spec, table)
        spec.nuserdata += stroke.marks + FIGURES
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

    def things(self) -> Sequence[Thing]:
        """Return nothing: dirt is only drawn."""
        return []

    def bind(
        self, model: mujoco.MjModel, data: mujoco.MjData, robots: Sequence[RobotState]
    ) -> None:
        """Look up marks, table and what can touch it."""
        super().bind(model, data, robots)
        self._table: int = model.geom("table").id
        self._wiping = robots[0].prefix
        first = model.geom(f"{MARK}0").id
        self._geoms = slice(first, first + len(self.marks))
        model.geom_sameframe[self._geoms] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE
        self._wrench = np.zeros(6)
        self._first = model.nuserdata - FIGURES
        self._figures: Vector = data.userdata[self._first :]
        self._notes: Vector = data.userdata[self._first - len(self.marks) : self._first]

    @property
    def wiped(self) -> NDArray[np.bool_]:
        """Which marks are wiped off, shape (n,). A part of the simulation's state."""
        return self._notes > 0.0

    def reset(self, rng: np.random.Generator) -> None:
        """Draw a stroke."""
        x, y, z = self.config.table.center
        self.marks[:, :2] = np.array([x, y]) + self._stroke(rng)
        self.marks[:, 2] = z
        self._notes[:] = self._figures[PRESSES] = 0.0
        self._fresh, self.force, self.collided, self._seen = 0, 0.0, False, b""
        self.model.geom_pos[self._geoms] = self.marks
        self._look()

    def _stroke(self, rng: np.random.Generator) -> Matrix:
        """Return a walk that turns back where it would leave its part of the table."""
        stroke, table = self.config.stroke, self.config.table
        ends = np.asarray(table.size[:2]) / 2 * stroke.coverage
        at = rng.uniform(-ends, ends)
        heading = rng.uniform(-np.pi, np.pi)
        walk = np.empty((stroke.marks, 2))
        for k in range(stroke.marks):
            walk[k] = at
            heading += rng.normal(0.0, stroke.bend)
            way = stroke.step * np.array([np.cos(heading), np.sin(heading)])
            out = np.abs(at + way) > ends
            way[out] *= -1.0
            heading = float(np.arctan2(way[1], way[0]))
            at = at + way
        return walk

    def watch(self) -> None:
        """Wipe off what the hands press on now."""
        points, self.force, self.collided = self._touches()
        self._fresh = 0
        presses = self.force >= self.config.reward.least_force
        self._figures[PRESSES] = presses
        if not presses:
            return
        near = _distances(np.array(points), self.marks[:, :2]) <= self.config.margin
        fresh = near & ~self.wiped
        self._fresh = int(fresh.sum())
        self._notes[fresh] = 1.0
        self._look()

    def _touches(self) -> tuple[list[Vector], float, bool]:
        """Return where hands touch the table, (2,) each, their force, a collision."""
        points: list[Vector] = []
        force, collided = 0.0, False
        for i, (a, b) in enumerate(pairs_in_contact(self.data)):
            if self._table not in (a, b):
                continue
            other = b if a == self._table else a
            if any(hand.owns(other) for hand in self.hands):
                mujoco.mj_contactForce(self.model, self.data, i, self._wrench)
                force += abs(self._wrench.item(0))
                points.append(self.data.contact.pos[i, :2])
            else:
                collided = True
        return points, force, collided

    def observables(self) -> dict[str, Reading]:
        """Return how much is done, and where the rest is.

        Keys are those of this field's datasets: the part that is wiped, the rest's
        centroid and its radius about that, m, and the way there from each hand.
        """
        centroid = self._figure(CENTROID, 3)
        readings = {
            "proportion_wiped": self._figure(PORTION),
            "wipe_radius": self._figure(RADIUS),
            "wipe_centroid": centroid,
        }
        for side, hand in self.sided_hands():
            way = offset(centroid, site_position(hand.site))
            readings[f"{side}gripper_to_wipe_centroid"] = way
        return readings

    def felt(self) -> dict[str, dict[str, Reading]]:
        """Return whether the robot presses on the table, 1 or 0: `robot0_contact`."""
        return {self._wiping: {f"{self._wiping}contact": self._figure(PRESSES)}}

    def _figure(self, place: int, size: int = 1) -> Reading:
        start = self._first + place
        return user_values(range(start, start + size))

    def _look(self) -> None:
        """Measure the marks that are left and draw only these, where some are new.

        With none left, the centroid is that of all. Most steps wipe nothing, and ask
        for these numbers several times; so they are noted beside the marks.
        """
        notes = self._notes.tobytes()
        if notes == self._seen:
            return
        self._seen, wiped = notes, self.wiped
        done = bool(wiped.all())
        rest = self.marks if done else self.marks[~wiped]
        centroid = rest.mean(axis=0)
        away = np.linalg.norm(rest - centroid, axis=1)
        self._figures[PORTION] = wiped.mean()
        self._figures[RADIUS] = 0.0 if done else away.max()
        self._figures[:3] = centroid
        alpha = np.where(wiped, 0.0, self.config.stroke.color[3])
        self.model.geom_rgba[self._geoms, 3] = alpha

    @property
    def centroid(self) -> Vector:
        """Middle of the marks that are left, m. A view."""
        self._look()
        return self._figures[:3]

    @property
    def portion(self) -> float:
        """How much is wiped off, from 0 to 1."""
        self._look()
        return self._figures.item(PORTION)

    @property
    def radius(self) -> float:
        """How far the marks that are left are from their middle at most, m."""
        self._look()
        return self._figures.item(RADIUS)

    def success(self) -> bool:
        """Whether all marks are wiped off."""
        return self.portion == 1.0

    def progress(self) -> float:
        """Return the shaped reward.

        With n marks wiped in this step, d the distance of the nearest hand to the
        centroid of the rest, f the force of the hands on the table, and horizon H:

            (mark n + reach (1 - tanh(reach_scale d)) + contact [touches]
             + contact + press f                       if least_force < f <= most_force
             - excess f                                if f > most_force
             - collision [another part touches the table])
            * H / (mark marks + H (contact + complete))

        cut to [0, 1].
        """
        numbers, force = self.config.reward, self.force
        distance = self.distance(self.centroid)
        reward = numbers.mark * self._fresh
        reward += numbers.reach * (1.0 - math.tanh(numbers.reach_scale * distance))
        reward += numbers.contact * (force > 0.0)
        if force > numbers.most_force:
            reward -= numbers.excess * force
        elif force > numbers.least_force:
            reward += numbers.contact + numbers.press * force
        reward -= numbers.collision * self.collided
        most = numbers.mark * len(self.marks)
        most += self.horizon * (numbers.contact + numbers.complete)
        return float(reward * self.horizon / most)


CENTROID, PORTION, RADIUS, PRESSES, FIGURES = 0, 3, 4, 5, 6
"""Places of what is measured, behind the marks' notes, and how many there are."""
THICK = 0.0004
"""Half of a mark's height, m: seen from above, and nowhere else."""


def _distances(hull: Matrix, points: Matrix) -> Vector:
    """Return how far points are from the convex hull of others, in a plane.

    Args:
        hull: Points that span the hull, shape (k, 2), k >= 1.
        points: Shape (n, 2).

    Returns:
        Distances, shape (n,); 0 inside.
    """
    outside = np.full(len(points), np.inf)
    signs: list[tuple[Vector, Vector]] = []
    for i in range(len(hull)):
        for k in range(i + 1, len(hull)):
            edge = hull[k] - hull[i]
            along = points - hull[i]
            t = np.clip(along @ edge / max(float(edge @ edge), 1e-18), 0.0, 1.0)
            gap = np.linalg.norm(along - t[:, None] * edge, axis=1)
            outside = np.minimum(outside, gap)
            normal = np.array([-edge[1], edge[0]])
            side = (hull - hull[i]) @ normal
            signs.append((along @ normal, side))
    if len(hull) == 1:
        return np.linalg.norm(points - hull[0], axis=1)
    inside = np.ones(len(points), dtype=bool)
    flat = all(np.ptp(side) < 1e-12 for _, side in signs)
    for value, side in signs:
        if side.min() > -1e-12:
            inside &= value >= 0.0
        elif side.max() < 1e-12:
            inside &= value <= 0.0
    return outside if flat else np.where(inside, 0.0, outside)
