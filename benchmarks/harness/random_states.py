"""Random states of benchmarks: things at goals, tipped, leaned, stacked, in hands."""

import math
from abc import ABC, abstractmethod
from typing import Any

import mujoco
import numpy as np

from harness.rigid_world import World
from wbc_suite.typing import Matrix, Vector

STEPS, SHARES = (2, 20, 60, 200), (0.3, 0.3, 0.3, 0.1)
POSES = 6  # of hands, for each scene
DEEP = 1e-3  # m, overlap from which a state does not count
SQUEEZE = 0.03  # of the way of fingers, beyond the first touch of two of them
IN_HANDS = ("Lift", "LocoLift", "TwoArmLift", "TwoArmHandover")
QUARTER = math.sqrt(0.5)
TURNS = [(1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0)]
TURNS += [(QUARTER, s * QUARTER, 0.0, 0.0) for s in (1, -1)]
TURNS += [(QUARTER, 0.0, s * QUARTER, 0.0) for s in (1, -1)]
DOWN = np.diag([1.0, -1.0, -1.0])
"""Axes of a hand that looks down."""


class States(ABC):
    """Draws states of one benchmark; one scene has several.

    Attributes:
        free: Names of the things that are put somewhere.
        pose: Number of the robots' pose.
    """

    def __init__(self, world: World, rng: np.random.Generator) -> None:
        self.world, self.rng, self.task = world, rng, world.task
        self.model, self.data = world.model, world.data
        self._poses, self.pose = list[Vector](), 0
        self.free: list[str] = []

    def begin(self) -> None:
        """Draw a scene, and poses of its robots."""
        self.world.begin(int(self.rng.integers(1_000_000)))
        states = self.task.states
        names = [name for name in states if states[name].is_free]
        self.free = list(getattr(getattr(self.task, "sorting", None), "active", names))
        moving = self.world.moving.data
        home = moving.qpos.copy()
        self._poses = [home]
        for _ in range(POSES):
            moving.qpos[:] = home
            if self.reach():
                self._poses.append(moving.qpos.copy())

    def reach(self) -> bool:
        """Bring the hands somewhere; return whether that is another pose."""
        return False

    def take_pose(self) -> None:
        """Give the robots one of their poses, whose number is `pose`."""
        moving = self.world.moving
        self.pose = int(self.rng.integers(len(self._poses)))
        moving.data.qpos[:] = self._poses[self.pose]
        mujoco.mj_kinematics(moving.model, moving.data)
        self.world.pose()

    def put_in(self, name: str, hand: Any) -> None:
        """Put a thing between fingers, at one of its grasps."""
        rng, state = self.rng, self.task.states[name]
        R = self.data.site_xmat[hand.site].reshape(3, 3)
        R = R @ rotation(rng.normal(0.0, rng.choice([0.03, 0.3]), 3))
        R = R @ matrix(TURNS[int(rng.integers(len(TURNS)))])
        sites, at = self.task.grasps.get(name, ()), np.zeros(3)
        if sites and rng.random() < 0.8:
            site = sites[int(rng.integers(len(sites)))].pose
            base = self.data.site_xmat[hand.site].reshape(3, 3)
            R = base @ rotation(rng.normal(0.0, 0.05, 3)) @ site.rotation.T
            at = site.translation
        state.move(hand.position - R @ at + rng.normal(0.0, 0.004, 3), quat_of(R))

    @abstractmethod
    def draw(self) -> bool:
        """Draw a state; return whether nothing overlaps in it."""


class Doors(States):
    """Angles of a door and its lever."""

    def draw(self) -> bool:
        """Draw angles."""
        panel, lever = (
            self.data.joint(f"door_{n}_joint").qpos for n in ("panel", "handle")
        )
        panel[0], lever[0] = self.rng.uniform(-0.05, 0.6), self.rng.uniform(0.0, 1.5)
        mujoco.mj_forward(self.model, self.data)
        return True


class Pegs(States):
    """Pegs near holes."""

    def draw(self) -> bool:
        """Put the peg near the hole, in the axes of the plate, whatever carries it."""
        rng, data = self.rng, self.data
        mujoco.mj_kinematics(self.model, data)
        plate = data.body("plate")
        tilt = rng.normal(0.0, rng.choice([0.05, 0.4, 2.0]), 3)
        R = plate.xmat.reshape(3, 3) @ rotation(tilt)
        aside = np.array([0.0, 0.0, rng.uniform(-0.2, 0.2)])
        aside[:2] = rng.normal(0.0, rng.choice([0.01, 0.05]), 2)
        at = plate.xpos + plate.xmat.reshape(3, 3) @ aside
        body = self.model.body("peg").id
        parent = data.body(int(self.model.body_parentid[body]))
        P = parent.xmat.reshape(3, 3)
        self.task.states["peg"].move(P.T @ (at - parent.xpos), quat_of(P.T @ R))
        mujoco.mj_forward(self.model, data)
        return self.world.gap("peg", self.world.geoms("plate")) > -DEEP


class Things(States):
    """Things that lie, stand, lean, or are between fingers that close."""

    def draw(self) -> bool:
        """Put the things somewhere, and let physics go on for a while."""
        rng, data = self.rng, self.data
        self.take_pose()
        data.qvel[:] = 0.0
        self._put_things()
        if data.userdata.size:
            data.userdata[0] = rng.random() < 0.8
        mujoco.mj_forward(self.model, data)
        if self.world.deepest() > 3 * DEEP:
            return False
        self.world.run(int(rng.choice(STEPS, p=SHARES)))
        return self.world.deepest() < DEEP

    def _put_things(self) -> None:
        """Put each thing somewhere, and close hands on those that are in them."""
        rng = self.rng
        for name in self.free:  # away
            self.task.states[name].move((0.0, 0.0, 30.0 + len(name)))
        held, kinds = False, rng.permutation(self.free).tolist()
        for name in kinds:
            for _ in range(8):
                mujoco.mj_kinematics(self.model, self.data)
                if self.task.hands and rng.random() < self._share():
                    held = True
                    hand = self.task.hands[int(rng.integers(len(self.task.hands)))]
                    self.put_in(name, hand)
                else:
                    self._put_on(name)
                mujoco.mj_fwdPosition(self.model, self.data)
                if self.world.deepest() < 3 * DEEP:
                    break
        for hand in range(len(self.task.hands)):
            if rng.random() < (0.8 if held else 0.2):
                self.world.close(hand, self.free, rng.uniform(0.0, SQUEEZE))

    def _share(self) -> float:
        return 0.8 if type(self.task).__name__ in IN_HANDS else 0.1

    def _put_on(self, name: str) -> None:
        """Put a thing on a goal, the table or another thing, and tip it perhaps."""
        rng, state = self.rng, self.task.states[name]
        goals, rest = self._goals(name)
        x, y, z = goals[int(rng.integers(len(goals)))]
        right = rng.random() < 0.5  # as it should be
        turn = 1.0 if right else rng.random()
        quat = np.array(rest, dtype=float)
        if turn < 0.3:
            quat = np.array(TURNS[int(rng.integers(len(TURNS)))])
        elif turn < 0.5:
            quat = rng.normal(size=4)
        R = matrix(quat / np.linalg.norm(quat))
        if rng.random() < 0.7:
            R = rotation(np.array([0.0, 0.0, rng.uniform(-3.1, 3.1)])) @ R
        if not right:
            R = rotation(rng.normal(0.0, rng.choice([0.0, 0.0, 0.02, 0.3]), 3)) @ R
        quat = quat_of(R)
        state.move((0.0, 0.0, 50.0), quat)
        mujoco.mj_kinematics(self.model, self.data)
        points = self.world.points(self.world.geoms(name)) - state.position
        if not right and rng.random() < 0.3:  # beside, its side next to the goal
            way = rng.uniform(-3.1, 3.1)
            far = points[:, :2] @ [math.cos(way), math.sin(way)]
            x, y = x + far.max() * math.cos(way), y + far.max() * math.sin(way)
        spread = 0.002 if right else rng.choice([0.0, 0.002, 0.01, 0.03])
        at = np.array([x, y, z]) + rng.normal(0.0, spread, 3) * [1.0, 1.0, 0.0]
        over = rng.choice([-1e-4, -1e-4, 5e-4, 0.01])
        state.move((at[0], at[1], at[2] - points[:, 2].min() + over), quat)

    def _goals(self, name: str) -> tuple[list[Vector], Any]:
        """Return points to put a thing on, and how it lies there."""
        task, data, rest = self.task, self.data, (1.0, 0.0, 0.0, 0.0)
        goals: list[Any] = []
        config = task.config
        ground = getattr(config, "target", None) or config.table
        height = ground.center[2]
        if hasattr(task, "sorting"):
            goals = 4 * [(*task.goal(name), height)]
            goals += [(*task.goal(n), height) for n in task.sorting.active]
        kind = type(task).__name__
        if kind == "TwoArmTransport":
            goals = [
                np.add(data.body(b).xpos, (0.0, 0.0, config.bin.wall))
                for b in ("target_bin", "trash_bin")
            ]
            goals = 4 * [goals[name == "trash"]] + goals
            rest = (0.5, 0.5, 0.5, 0.5) if name == "payload" else rest
        if kind == "ToolHang":
            if name == "frame":
                tip = data.site("base_floor").xpos
                goals = 6 * [tip]
            else:
                goals = 4 * [data.site("frame_hook").xpos, data.site("frame_bend").xpos]
        others = [n for n in task.states if n != name]
        for other in others:
            points = self.world.points(self.world.geoms(other))
            if points[:, 2].max() > height - 0.1:
                top = np.array([*data.body(other).xpos[:2], points[:, 2].max()])
                goals += 3 * [top]
                goals.append(np.array([*data.body(other).xpos[:2], height]))
        where = np.array([*ground.center[:2], height])
        goals.append(where + self.rng.uniform(-0.15, 0.15, 3) * [1.0, 1.0, 0.0])
        return goals, rest

    def reach(self) -> bool:
        """Bring the hands, fingers down, near to goals."""
        rng, moving = self.rng, self.world.moving
        goals = [g for n in self.free for g in self._goals(n)[0]]
        for hand in range(len(moving.hands)):
            goal = goals[int(rng.integers(len(goals)))]
            up = [0.0, 0.0, rng.choice([0.02, 0.05, 0.1, 0.2])]
            if self._share() > 0.5:
                up[2] = rng.uniform(0.06, 0.3)
            turn = rotation(np.array([0.0, 0.0, rng.uniform(-1.5, 1.5)]))
            moving.bring(hand, goal + rng.normal(0.0, 0.02, 3) + up, turn @ DOWN)
        return True


class Pots(Things):
    """A pot in the air with both hands at its handles, in one hand or elsewhere."""

    def begin(self) -> None:
        """Draw a scene, and where the pot is for each pose of the robots."""
        self._pots: list[tuple[Vector, Matrix]] = []
        super().begin()

    def reach(self) -> bool:
        """Bring each hand to a grasp of its own handle."""
        rng, moving, config = self.rng, self.world.moving, self.task.config
        at = np.add(config.table.center, (*rng.normal(0.0, 0.03, 2), 0.0))
        at[2] += config.pot.half_size[2] + rng.uniform(0.08, 0.25)
        tilt = rng.normal(0.0, rng.choice([0.0, 0.1, 0.4]), 3)
        R = rotation(tilt) @ rotation(np.array([0.0, 0.0, np.pi]))
        for hand, side in enumerate((1.0, -1.0)):
            sites = [
                site.pose
                for site in self.task.grasps["pot"]
                if side * site.pose.translation[1] > 0.0
            ]
            site = sites[int(rng.integers(len(sites)))]
            moving.bring(hand, at + R @ site.translation, R @ site.rotation)
        self._pots.append((at, R))
        return True

    def put_in(self, name: str, hand: Any) -> None:
        """Put the pot between both hands, or into one."""
        if self.pose == 0 or self.rng.random() < 0.2:
            super().put_in(name, hand)
            return
        at, R = self._pots[self.pose - 1]
        off = self.rng.normal(0.0, self.rng.choice([0.001, 0.004]), 3)
        self.task.states[name].move(at + off, quat_of(R))


class Wiping(States):
    """Hands that press on the table, hover over it or stand on an edge; few marks left.

    The robot as a whole is moved so that its lowest hand touches. Its other parts do
    not collide.
    """

    def __init__(self, world: World, rng: np.random.Generator) -> None:
        super().__init__(world, rng)
        hands = world.task.hands
        self._hands = [g for g in world.robot.tolist() if any(h.owns(g) for h in hands)]
        others = np.setdiff1d(world.robot, self._hands)
        self.model.geom_contype[others] = self.model.geom_conaffinity[others] = 0

    def reach(self) -> bool:
        """Bring the hands over the table."""
        rng, moving, table = self.rng, self.world.moving, self.task.config.table
        for hand in range(len(moving.hands)):
            turn = rotation(np.array([0.0, 0.0, rng.uniform(-1.5, 1.5)]))
            aside = rng.uniform(-0.25, 0.25, 3) * [1.0, 1.0, 0.0]
            at = np.add(table.center, aside)
            moving.bring(hand, at, turn @ DOWN)
        return True

    def draw(self) -> bool:
        """Place the robot and the marks that are left, and let it wipe once."""
        rng, data, task, world = self.rng, self.data, self.task, self.world
        self.take_pose()
        data.qvel[:], data.xfrc_applied[:] = 0.0, 0.0
        root = int(world.roots[0])
        first = self.model.jnt_qposadr[self.model.body_jntadr[root]]
        mujoco.mj_kinematics(self.model, data)
        hand = task.hands[int(rng.integers(len(task.hands)))]
        tilt = rng.normal(0.0, rng.choice([0.0, 0.0, 0.002, 0.05, 0.4]), 3)
        tilt[2] += rng.uniform(-3.1, 3.1)
        turn = rotation(tilt) @ DOWN
        R = turn @ data.site_xmat[hand.site].reshape(3, 3).T
        data.qpos[first + 3 : first + 7] = quat_of(
            R @ matrix(data.qpos[first + 3 : first + 7].copy())
        )
        mujoco.mj_kinematics(self.model, data)
        points = world.points(self._hands)
        low = points[points[:, 2].argmin()]
        goal = np.add(task.config.table.center, rng.uniform(-0.2, 0.2, 3) * [1, 1, 0])
        goal[2] -= rng.choice([1e-4, 5e-4, 2e-3, -3e-4, -3e-3])
        data.qpos[first : first + 3] += goal - low
        self._mark(points[points[:, 2] < low[2] + 0.01] + (goal - low))
        mujoco.mj_fwdPosition(self.model, data)
        weight = 9.81 * self.model.body_subtreemass[root]
        data.xfrc_applied[root, 2] = weight * rng.choice([0.0, 0.5, 1.0, 1.1])
        data.xfrc_applied[root, 2] += rng.normal(0.0, 2.0)
        mujoco.mj_forward(self.model, data)
        task.after_step()
        return True

    def _mark(self, near: Matrix) -> None:
        """Place the marks that are left around points; all others are wiped."""
        rng, task = self.rng, self.task
        low, high = near.min(axis=0) - 0.03, near.max(axis=0) + 0.03
        if rng.random() < 0.5:  # of one hand
            one = near[int(rng.integers(len(near)))]
            low, high = np.maximum(low, one - 0.06), np.minimum(high, one + 0.06)
        left = int(rng.choice([1, 1, 1, 2, 4]))
        ends = np.asarray(task.config.table.size[:2]) / 2 - 0.01
        center = np.asarray(task.config.table.center[:2])
        at = rng.uniform(low, high, (left, 3))[:, :2]
        task.marks[:left, :2] = np.clip(at, center - ends, center + ends)
        self.world.left = left
        task.wipe(np.arange(len(task.marks)) >= left)


def matrix(quat: Any) -> Matrix:
    """Return the rotation of a quaternion w x y z."""
    R = np.empty(9)
    mujoco.mju_quat2Mat(R, np.asarray(quat, dtype=np.float64))
    return R.reshape(3, 3)


def quat_of(R: Matrix) -> Vector:
    """Return the quaternion w x y z of a rotation."""
    quat = np.empty(4)
    mujoco.mju_mat2Quat(quat, np.ascontiguousarray(R).ravel())
    return quat


def rotation(vector: Vector) -> Matrix:
    """Return the rotation about a vector by its length, rad."""
    quat, angle = np.empty(4), float(np.linalg.norm(vector))
    mujoco.mju_axisAngle2Quat(quat, vector / max(angle, 1e-12), angle)
    return matrix(quat)
