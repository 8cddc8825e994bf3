"""Random histories of rigid robots on their feet: they stand, slide, tip or are lifted.

A look follows five steps of physics and stands for a control period, so that a robot
which has stood for a second costs 100 steps. What a judge has to know of each look is
measured from poses alone, see `Look`.
"""

import math
from abc import abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass

import mujoco
import numpy as np

from harness.geometric_judges import Look, inside
from harness.random_states import DEEP, States, quat_of, rotation
from harness.rigid_world import World
from wbc_suite.typing import Matrix, Vector

STEPS, PERIOD = 5, 0.05  # physics steps of a look, and the time that it stands for, s
NEAR = 0.02  # m, up to which heights are measured
TOUCH = 2e-5  # m, overlap or gap from which contact is decided
RESTS = {"speed": 0.005, "turn": 0.01}  # m/s and rad/s, likewise


@dataclass
class Motion:
    """Positions and rotations of a body before and after a physics step."""

    before: tuple[Vector, Matrix]
    after: tuple[Vector, Matrix]
    dt: float

    @property
    def speed(self) -> float:
        """Speed, m/s."""
        return float(np.linalg.norm(self.after[0] - self.before[0])) / self.dt

    @property
    def turn(self) -> float:
        """Angular speed, rad/s."""
        cosine = 0.5 * (np.trace(self.before[1].T @ self.after[1]) - 1.0)
        sine = self.before[1].T @ self.after[1]
        axis = 0.5 * np.array(
            [sine[2, 1] - sine[1, 2], sine[0, 2] - sine[2, 0], sine[1, 0] - sine[0, 1]]
        )
        return math.atan2(float(np.linalg.norm(axis)), float(cosine)) / self.dt


class OnFeet(States):
    """Histories of a robot on its feet; a subclass says what it should do."""

    def __init__(self, world: World, rng: np.random.Generator) -> None:
        super().__init__(world, rng)
        model, (robot,) = self.model, world.robots
        links = sorted({f.link for f in robot.frames if f.role == "foot"})
        bodies = [model.body(f"robot0_{link}").id for link in links]
        of = model.geom_bodyid
        self._feet = [[g for g in world.robot.tolist() if of[g] == b] for b in bodies]
        feet = {geom for foot in self._feet for geom in foot}
        self._others = [g for g in world.robot.tolist() if g not in feet]
        (self.root,) = world.roots.tolist()
        self._q = int(model.jnt_qposadr[model.body_jntadr[self.root]])
        self._v = int(model.jnt_dofadr[model.body_jntadr[self.root]])

    def reach(self) -> bool:
        """Bend the legs a little, so that soles are not in one plane."""
        moving = self.world.moving
        legs = np.flatnonzero(moving.legs)
        joints = moving.model.dof_jntid[legs]
        hinges = moving.model.jnt_qposadr[joints[moving.model.jnt_type[joints] == 3]]
        bend = self.rng.choice([0.0, 1e-4, 0.003])
        moving.data.qpos[hinges] += self.rng.normal(0.0, bend, len(hinges))
        mujoco.mj_kinematics(moving.model, moving.data)
        return True

    def draw(self) -> bool:
        """Place the robot, and follow it for a second or more."""
        rng, data = self.rng, self.data
        self.take_pose()
        data.qvel[:], data.userdata[:], data.xfrc_applied[:] = 0.0, 0.0, 0.0
        self.world.history, self._now = [], self.begins()
        self.stand()
        self.place()
        if self.world.deepest() > 3 * DEEP:
            return False
        looks = int(rng.choice([12, 20, 22, 26, 30], p=[0.1, 0.3, 0.3, 0.2, 0.1]))
        event = int(rng.integers(looks)) if rng.random() < 0.3 else -1
        for k in range(looks):
            if k == event:
                self.disturb()
            self.look()
        return self.world.deepest() < DEEP

    def begins(self) -> float:
        """Return the time before the first look, s."""
        return 5.0

    def stand(self) -> None:
        """Lower the robot until its lowest sole touches the floor; tip it, perhaps."""
        rng, pose = self.rng, self.data.qpos[self._q : self._q + 7]
        if rng.random() < 0.3:
            self._turn(rng.normal(0.0, rng.choice([0.002, 0.05, 0.4]), 3))
        mujoco.mj_kinematics(self.model, self.data)
        low = min(map(self._low, self.world.robot.tolist()))
        pose[2] -= low + rng.choice([1e-4, 1e-4, 1e-4, -0.005])
        velocity = self.data.qvel[self._v : self._v + 6]
        velocity[:] = rng.normal(0.0, rng.choice([0.0, 0.0, 0.05, 0.2]), 6)
        mujoco.mj_forward(self.model, self.data)

    def place(self) -> None:
        """Place what the task is about."""

    def disturb(self) -> None:
        """Push, lift or tip the robot."""
        rng, q, v = self.rng, self._q, self._v
        match int(rng.integers(4)):
            case 0:
                kick = rng.normal(0.0, rng.choice([0.05, 0.3, 2.0]), 6)
                self.data.qvel[v : v + 6] += kick
            case 1:
                self.data.qpos[q + 2] += rng.choice([0.001, 0.01, 0.05, 0.3])
            case 2:
                self._turn(rng.normal(0.0, rng.choice([0.02, 0.3, 1.0]), 3))
            case _:
                self.data.qpos[q : q + 2] += rng.normal(0.0, 0.1, 2)

    def _turn(self, by: Vector) -> None:
        quat = self.data.qpos[self._q + 3 : self._q + 7]
        R = np.empty(9)
        mujoco.mju_quat2Mat(R, quat)
        quat[:] = quat_of(rotation(by) @ R.reshape(3, 3))

    def look(self) -> None:
        """Let physics go on, let the benchmark look, and note what a judge needs."""
        model, data = self.model, self.data
        bodies = [self.root, *(self.model.body(n).id for n in self.followed())]
        mujoco.mj_step(model, data, STEPS - 1)
        mujoco.mj_kinematics(model, data)
        before = [self._pose(body) for body in bodies]
        mujoco.mj_step(model, data)
        self._now += PERIOD
        data.time = self._now
        mujoco.mj_forward(model, data)
        dt = model.opt.timestep
        moves = [
            Motion(old, self._pose(body), dt)
            for old, body in zip(before, bodies, strict=True)
        ]
        self.task.after_step()
        trunk, limits = moves[0], self.task.config.standing
        height = self.world.robots[0].root.pos[2]
        tilt = math.acos(np.clip(trunk.after[1][2, 2], -1.0, 1.0))
        sunk = height - trunk.after[0][2]
        upright = min((limits.tilt - tilt) / 0.01, (limits.sink - sunk) / 0.003)
        margins = list(self.margins(moves))
        self.world.history.append(Look(upright=upright, margin=min(margins)))

    def followed(self) -> Iterable[str]:
        """Return names of the things whose motion matters."""
        return ()

    @abstractmethod
    def margins(self, moves: list[Motion]) -> Iterable[float]:
        """Return margins of the condition that must hold for a while.

        `moves` are those of the trunk and of what is followed.
        """

    def _pose(self, body: int) -> tuple[Vector, Matrix]:
        R = self.data.xmat[body].reshape(3, 3).copy()
        return self.data.xpos[body].copy(), R

    def stands(self) -> float:
        """Return the margin of standing on all feet and nothing else."""
        feet = max((self.lowest(foot) for foot in self._feet), default=1.0)
        return min(-feet, self.lowest(self._others)) / TOUCH

    def rests(self, trunk: Motion) -> float:
        """Return the margin of a trunk at rest."""
        limits = self.task.config.standing
        slow = (limits.speed - trunk.speed) / RESTS["speed"]
        return min(slow, (limits.turn - trunk.turn) / RESTS["turn"], self.stands())

    def lowest(self, geoms: Iterable[int]) -> float:
        """Return the height of the lowest point of geoms, m."""
        geoms = np.fromiter(geoms, dtype=np.int64)
        least = self.data.geom_xpos[geoms, 2] - self.model.geom_rbound[geoms]
        near = geoms[least < NEAR].tolist()
        return min((self._low(geom) for geom in near), default=NEAR)

    def _low(self, geom: int) -> float:
        data, kinds = self.data, mujoco.mjtGeom
        size, z = self.model.geom_size[geom], data.geom_xpos.item(geom, 2)
        up = data.geom_xmat[geom, 6:9]
        match self.model.geom_type[geom]:
            case kinds.mjGEOM_SPHERE:
                return z - size[0]
            case kinds.mjGEOM_CAPSULE:
                return z - abs(up[2]) * size[1] - size[0]
            case kinds.mjGEOM_CYLINDER:
                return z - abs(up[2]) * size[1] - size[0] * math.hypot(*up[:2])
            case kinds.mjGEOM_ELLIPSOID:
                return z - float(np.linalg.norm(size * up))
            case kinds.mjGEOM_BOX:
                return z - float(size @ np.abs(up))
            case _:
                return float(self.world.points([geom])[:, 2].min())

    def way_to(self, at: Vector, heading: float) -> tuple[float, float]:
        """Return the distance of the trunk from a place, m, and from a heading, rad."""
        x, y, *_ = self.data.qpos[self._q : self._q + 7]
        R = self.data.xmat[self.root].reshape(3, 3)
        turn = heading - math.atan2(R[1, 0], R[0, 0])
        return math.dist((x, y), at[:2]), abs(math.remainder(turn, math.tau))

    def near(self, allowed: tuple[float, float]) -> tuple[Vector, float]:
        """Draw a place and a heading, about as far from the trunk as is allowed."""
        rng, (x, y) = self.rng, self.data.qpos[self._q : self._q + 2]
        far = allowed[0] * rng.choice([0.0, 0.3, 0.5, 0.8, 0.9, 1.1, 3.0])
        turn = allowed[1] * rng.choice([0.0, 0.3, -0.5, 0.8, -0.9, 1.1, 10.0])
        way, R = rng.uniform(-3.1, 3.1), self.data.xmat[self.root].reshape(3, 3)
        heading = math.atan2(R[1, 0], R[0, 0]) + turn
        return np.array([x + far * math.cos(way), y + far * math.sin(way)]), heading


class StandStates(OnFeet):
    """At the end of an episode of Stand."""

    def begins(self) -> float:
        """Return a time such that the last second is part of most histories."""
        return self.task.config.duration - PERIOD * float(self.rng.choice([19, 20, 25]))

    def place(self) -> None:
        """Draw where the robot stood at the start."""
        config = self.task.config
        self._at, self._heading = self.near((config.near, config.facing))
        self.task._start[:] = *self._at, self._heading

    def margins(self, moves: list[Motion]) -> Iterable[float]:
        """Yield time, way back and rest."""
        config = self.task.config
        far, turn = self.way_to(self._at, self._heading)
        left = config.duration - config.standing.hold
        yield (self._now - left + 0.02) / 0.01
        yield (config.near - far) / 0.002
        yield (config.facing - turn) / 0.005
        yield self.rests(moves[0])


class WalkToStates(OnFeet):
    """At the mark."""

    def place(self) -> None:
        """Draw the mark."""
        goal = self.task.config.goal
        self._at, self._heading = self.near((goal.near, goal.facing))
        turn = math.cos(self._heading / 2), 0.0, 0.0, math.sin(self._heading / 2)
        self.task.states["goal"].move((*self._at, 0.002), turn)
        mujoco.mj_forward(self.model, self.data)

    def margins(self, moves: list[Motion]) -> Iterable[float]:
        """Yield way left and rest."""
        goal = self.task.config.goal
        far, turn = self.way_to(self._at, self._heading)
        yield (goal.near - far) / 0.002
        yield (goal.facing - turn) / 0.005
        yield self.rests(moves[0])


class ReachStates(OnFeet):
    """Hands at targets."""

    def place(self) -> None:
        """Draw targets near the hands."""
        rng, near = self.rng, self.task.config.target.near
        for hand, target in zip(self.task.hands, self.task.targets, strict=True):
            way = rng.normal(size=3)
            way *= near * rng.choice([0.1, 0.5, 0.85, 1.15]) / np.linalg.norm(way)
            target.move(hand.position + way)
        mujoco.mj_forward(self.model, self.data)

    def margins(self, moves: list[Motion]) -> Iterable[float]:
        """Yield distances and rest."""
        for hand in self.task.hands:
            body = int(self.model.site_bodyid[hand.site])
            R = self.data.xmat[body].reshape(3, 3)
            at = self.data.xpos[body] + R @ self.model.site_pos[hand.site]
            goal = self.data.body(f"target_{hand.name}").xpos
            yield (self.task.config.target.near - math.dist(at, goal)) / 5e-4
        yield self.rests(moves[0])


class LocoLiftStates(OnFeet):
    """A cube in a hand, between fingers or on them."""

    def reach(self) -> bool:
        """Bring a hand up before the trunk, turned anyhow."""
        super().reach()
        rng, moving = self.rng, self.world.moving
        x, y, _ = moving.data.xpos[self.root]
        hand = int(rng.integers(len(moving.hands)))
        at = np.array([x + rng.uniform(0.4, 0.7), y, rng.uniform(0.86, 1.1)])
        at[1] += rng.uniform(-0.2, 0.2)
        R = moving.data.site_xmat[moving.hands[hand].site].reshape(3, 3)
        turn = rotation(rng.normal(0.0, 0.7, 3)) @ R
        moving.bring(hand, at, turn)
        return True

    def place(self) -> None:
        """Put the cube into the highest hand, and close it, perhaps."""
        hands = self.task.hands
        hand = int(np.argmax([h.position[2] for h in hands]))
        self.hand = hands[hand]
        self.put_in("cube", self.hand)
        if self.rng.random() < 0.85:
            self.world.close(hand, ["cube"], self.rng.uniform(0.0, 0.03))
        mujoco.mj_forward(self.model, self.data)

    def followed(self) -> Iterable[str]:
        """Return the cube."""
        return ("cube",)

    def margins(self, moves: list[Motion]) -> Iterable[float]:
        """Yield height and speed of the cube, its distance to the hand; standing."""
        config, (_, cube) = self.task.config, moves
        high = cube.after[0][2] - config.table.center[2]
        yield (high - config.reward.lift_height) / 0.001
        yield (config.reward.speed - cube.speed) / 0.005
        yield self.stands()
        yield max((1.0 - cube.turn) / 0.3, -0.5)
        own = [g for g in self.world.robot.tolist() if self.hand.owns(g)]
        yield (2e-4 - self.world.gap("cube", own)) / 2e-4


class CarryStates(OnFeet):
    """A pot on the first table, in the air at some hands, then on the other table."""

    def reach(self) -> bool:
        """Bring the hands to the handles of a pot before the trunk."""
        super().reach()
        rng, moving = self.rng, self.world.moving
        x, y, _ = moving.data.xpos[self.root]
        top, half = self.task.config.table.center[2], self.task.config.pot.half_size
        self._pot = np.array([0.45, 0.0, top + half[2]])
        reach = half[1] + self.task.config.pot.handle_length
        for hand in range(len(moving.hands)):
            side = 1.0 if moving.hands[hand].name == "left" else -1.0
            at = self._pot.copy()
            at += x, y + side * reach, half[2] * rng.uniform(-0.2, 0.8)
            R = moving.data.site_xmat[moving.hands[hand].site].reshape(3, 3)
            moving.bring(hand, at + rng.normal(0.0, 0.01, 3), R)
        return True

    def place(self) -> None:
        """Carry the pot, or do something that looks like it; then put it down."""
        rng, q = self.rng, self._q
        self.carried: float = 2.0
        self._alone, pose = 0, self.data.qpos[q : q + 3].copy()
        self.data.qpos[q : q + 2] = -3.0, 1.0
        z = pose[2]
        table = np.add(self.task.config.table.center, (0.0, 0.0, self._half))
        if rng.random() < 0.9:
            self._pose_pot(table, looks=2)
        for _ in range(int(rng.integers(1, 4))):
            aside = rng.choice([0.0, 0.0, 0.02, -0.02, 0.05, 0.3])
            held = np.add(self._pot, (-3.0, 1.0 + aside, 0.0))
            self._pose_pot(held, looks=int(rng.choice([2, 5, 6, 7, 8, 12])))
            if rng.random() < 0.15:
                self._pose_pot(np.array([-3.0, 3.0, self._half]), looks=1)
            if rng.random() < 0.15:
                self._pose_pot(table, looks=1)
        goal, over = np.array(self.task.config.other), rng.choice([-1e-4, -1e-4, 0.01])
        ends = np.array([0.3, 0.3]) * rng.choice([0.0, 0.5, 0.98, 1.02, 1.2])
        ends *= rng.choice([-1.0, 1.0], 2)
        at = np.add(goal, (*ends, self._half + over))
        self.data.qpos[q : q + 3] = -3.0, 1.0, z
        if rng.random() < 0.4:  # the robot behind it, its hands around
            at[0] = goal[0] - rng.choice([0.29, 0.31])
            self.data.qpos[q : q + 2] = at[0] - self._pot[0], at[1]
        tilt = rng.normal(0.0, rng.choice([0.0, 0.0, 0.05, 0.5]), 2)
        self._put(at, rotation(np.array([*tilt, rng.uniform(-0.1, 0.1)])))

    @property
    def _half(self) -> float:
        return self.task.config.pot.half_size[2] - 1e-4

    def _put(self, at: Vector, R: Matrix) -> None:
        self.task.states["pot"].move(at, quat_of(R))
        mujoco.mj_forward(self.model, self.data)

    def _pose_pot(self, at: Vector, looks: int) -> None:
        """Let the benchmark see the pot somewhere, without physics."""
        self._put(at, np.eye(3))
        touches = self._touched()
        for _ in range(looks):
            self._now += PERIOD
            self.data.time = self._now
            self.task.after_step()
            self._follow(*touches)
            self.world.history.append(Look(upright=2.0, margin=-2.0))

    def followed(self) -> Iterable[str]:
        """Return the pot."""
        return ("pot",)

    def margins(self, moves: list[Motion]) -> Iterable[float]:
        """Yield whether it was carried, and how it stands on the other table."""
        world, config, (_, pot) = self.world, self.task.config, moves
        self._follow(*self._touched())
        yield self.carried
        x, y = np.abs(pot.after[0] - config.other)[:2]
        ends = np.array(config.table.size[:2]) / 2 - config.carrying.margin
        yield (ends[0] - x) / 0.002
        yield (ends[1] - y) / 0.002
        yield (pot.after[1][2, 2] - math.cos(config.carrying.tilt)) / 0.002
        points = world.points(world.geoms("pot"))
        yield (0.0009 - abs(points[:, 2].min() - config.other[2])) / 0.0004
        low = points[points[:, 2] < points[:, 2].min() + 0.001]
        yield inside(low[:, :2], self.data.body("pot").xipos[:2]) / 0.002
        yield (world.gap("pot", world.robot) - 2e-4) / 2e-4
        yield (0.02 - pot.speed) / 0.01
        yield (0.2 - pot.turn) / 0.1
        yield self.stands()

    def _touched(self) -> tuple[list[bool | None], list[bool | None]]:
        """Return whether the pot touches both tables and the floor, and each hand."""
        names = ("table_from", "table_to", "floor")
        robot = self.world.robot.tolist()
        hands = [[g for g in robot if hand.owns(g)] for hand in self.task.hands]
        tops = [self._touches([self.model.geom(name).id]) for name in names]
        return tops, [self._touches(own) for own in hands]

    def _follow(self, tops: list[bool | None], hands: list[bool | None]) -> None:
        """Follow who carries the pot."""
        if None in (*tops, *hands):
            self.carried = 0.0 if self.carried > -1.0 else self.carried
            return
        first, other, floor = tops
        alone = not any(tops) and sum(map(bool, hands)) < len(hands)
        self._alone = self._alone + 1 if alone else 0
        if first and not other and not floor:
            self.carried = 2.0
        elif self._alone * PERIOD > self.task.config.carrying.alone + 0.02 or floor:
            self.carried = -2.0

    def _touches(self, geoms: list[int]) -> bool | None:
        """Whether the pot touches geoms; None if that is not clear."""
        gap = self.world.gap("pot", geoms)
        return None if abs(gap) < TOUCH else gap < 0.0
