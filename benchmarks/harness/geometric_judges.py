"""Judges of a state by vertices, distances and what physics does next.

They share no code with the predicates of success. A judge yields margins: a statement
holds surely from 1 on, surely not below -1, and is not decided between.
"""

import math
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import mujoco
import numpy as np
from scipy.spatial import ConvexHull, QhullError

from wbc_suite.envs import RobotEnv
from wbc_suite.typing import Matrix, Vector

ANGLES = np.linspace(0.0, 2 * np.pi, 16, endpoint=False)
NEAR = 0.004  # m, up to which distances are measured
WAYS = 9.81 * np.array([(0, 0, -1), (0, 0, 1), (1, 0, 0), (-1, 0, 0), (0, 1, 0)])
"""Directions of gravity in which a hand must hold what it clamps."""


class World:
    """A scene whose robots stand still, as solid as rock.

    Attributes:
        robot: Geoms of robots.
        at: Places of robots' joints in `qpos`.
    """

    def __init__(self, env: RobotEnv) -> None:
        self.env, self.task = env, env.benchmark
        self.model, self.data = env.simulation.model, env.simulation.data
        self.placed: Callable[[str], bool] = lambda name: False
        self._shapes: dict[tuple[int, bytes], Matrix] = {}
        model = self.model
        names = [model.body(k).name for k in range(model.nbody)]
        own = np.array([name.startswith("robot") for name in names])
        self.robot = np.flatnonzero(own[model.geom_bodyid] & (model.geom_contype > 0))
        self._collide_with_things_only()
        self._dofs = np.flatnonzero(own[model.dof_bodyid])
        joints = np.flatnonzero(own[model.jnt_bodyid])
        sizes = {0: 7, 1: 4}
        self.at = np.concatenate(
            [
                np.arange(model.jnt_qposadr[j], model.jnt_qposadr[j] + sizes.get(k, 1))
                for j, k in zip(joints, model.jnt_type[joints].tolist(), strict=True)
            ]
        )

    def _collide_with_things_only(self) -> None:
        """Leave out contacts of robots with themselves and furniture, and motors."""
        model, bit = self.model, 1 << 20
        model.geom_contype[self.robot], model.geom_conaffinity[self.robot] = bit, 0
        for name in self.task.states:
            model.geom_conaffinity[self.geoms(name)] |= bit
        off = mujoco.mjtDisableBit
        for flag in (off.mjDSBL_EQUALITY, off.mjDSBL_LIMIT, off.mjDSBL_ACTUATION):
            model.opt.disableflags |= flag
        model.opt.disableflags |= off.mjDSBL_FRICTIONLOSS

    def geoms(self, name: str) -> list[int]:
        """Return the solid geoms of a thing's body."""
        model, body = self.model, self.model.body(name).id
        own = (model.geom_bodyid == body) & (model.geom_contype > 0)
        return np.flatnonzero(own).tolist()

    def points(self, geoms: Iterable[int]) -> Matrix:
        """Return vertices of geoms in the world, shape (n, 3), m."""
        found = []
        for geom in geoms:
            R = self.data.geom_xmat[geom].reshape(3, 3)
            key = geom, self.model.geom_size[geom].tobytes()
            if key not in self._shapes:
                self._shapes[key] = _vertices(self.model, geom)
            found.append(self._shapes[key] @ R.T + self.data.geom_xpos[geom])
        return np.vstack(found)

    def gap(self, name: str, others: Iterable[int]) -> float:
        """Return the distance of a thing to geoms, at most `NEAR`, m."""
        mine, least = self.geoms(name), NEAR
        others = np.asarray(list(others))
        bounds = self.model.geom_rbound
        for geom in mine:
            away = self.data.geom_xpos[others] - self.data.geom_xpos[geom]
            reach = bounds[others] + bounds[geom] + NEAR
            near = (np.linalg.norm(away, axis=1) < reach) | (bounds[others] == 0.0)
            for other in others[near].tolist():
                gap = mujoco.mj_geomDistance(
                    self.model, self.data, geom, other, NEAR, None
                )
                least = min(least, gap)
        return least

    def run(self, steps: int) -> None:
        """Let physics go on around robots that do not move."""
        model, data, at, dofs = self.model, self.data, self.at, self._dofs
        still = data.qpos[at].copy()
        data.qvel[dofs] = 0.0
        for _ in range(steps):
            mujoco.mj_step(model, data)
            data.qpos[at], data.qvel[dofs] = still, 0.0
        mujoco.mj_forward(model, data)

    def after(
        self, seconds: float, look: Callable[[], Any], gravity: Any = WAYS[0]
    ) -> Any:
        """Return what is seen after some time; the state is as before then."""
        data, kind = self.data, mujoco.mjtState.mjSTATE_INTEGRATION
        kept = np.empty(mujoco.mj_stateSize(self.model, kind))
        mujoco.mj_getState(self.model, data, kept, kind)
        self.model.opt.gravity[:] = gravity
        self.run(round(seconds / self.model.opt.timestep))
        seen = look()
        self.model.opt.gravity[:] = WAYS[0]
        mujoco.mj_setState(self.model, data, kept, kind)
        mujoco.mj_forward(self.model, data)
        return seen

    def moved(self, name: str, seconds: float = 0.3, gravity: Any = WAYS[0]) -> float:
        """Return how far a thing moves in some time, m."""
        geoms = self.geoms(name)
        before = self.points(geoms)
        after = self.after(seconds, lambda: self.points(geoms), gravity)
        return float(np.linalg.norm(after - before, axis=1).max())

    def speed(self, name: str) -> tuple[float, float]:
        """Return the speeds of a free thing, m/s and rad/s."""
        v = self.data.joint(f"{name}_joint").qvel
        return float(np.linalg.norm(v[:3])), float(np.linalg.norm(v[3:]))

    def deepest(self) -> float:
        """Return the deepest overlap of anything but robots with themselves, m."""
        data, robot = self.data, np.zeros(self.model.ngeom, dtype=bool)
        robot[self.robot] = True
        pairs = data.contact.geom[: data.ncon]
        other = ~robot[pairs].all(axis=1)
        return -float(min(data.contact.dist[: data.ncon][other], default=0.0))

    def released(self, name: str) -> float:
        """Return the margin of no robot touching a thing."""
        return (self.gap(name, self.robot) - 2e-4) / 2e-4

    def still(self, name: str) -> Iterator[float]:
        """Yield the margins of a thing that is, and stays, where it is."""
        v, w = self.speed(name)
        yield (0.02 - v) / 0.01
        yield (0.2 - w) / 0.1
        moved = (0.003 - self.moved(name)) / 0.002
        tips = moved < -1.0 and self.stays_placed(name)
        yield -0.5 if tips else moved

    def stays_placed(self, name: str) -> bool:
        """Whether what comes to rest after tipping is where it belongs, all the same.

        What stands on an edge tips as slowly as one likes, so that no bound of its
        speed keeps it from moving later.
        """
        return self.after(1.5, lambda: self.placed(name))

    def clamped(self, name: str, hands: Iterable[Any]) -> Iterator[float]:
        """Yield the margins of hands that hold a thing whichever way it is pulled.

        Fingers do not follow here, so that what is held creeps: 0.2 s are looked at, in
        which what falls moves by 20 cm.
        """
        for hand in hands:
            own = [g for g in self.robot.tolist() if hand.owns(g)]
            yield (2e-4 - self.gap(name, own)) / 2e-4
        for way in WAYS:
            yield (0.035 - self.moved(name, 0.2, way)) / 0.025


def judged(margins: Iterator[float]) -> tuple[bool | None, list[float]]:
    """Return what margins say together, None if they do not decide, and they."""
    seen: list[float] = []
    for margin in margins:
        seen.append(round(float(margin), 2))
        if margin < -1.0:
            return False, seen
    return (True if min(seen) > 1.0 else None), seen


def inside(hull: Matrix, point: Vector) -> float:
    """Return how far a point is inside the convex hull of others in a plane, m."""
    try:
        return -float((ConvexHull(hull).equations @ [*point, 1.0]).max())
    except QhullError:
        return -math.inf


def around(points: Matrix, axis: Vector, at: Vector) -> float:
    """Return the widest angle about an axis in which there are no points, rad."""
    first = np.cross(axis, [1.0, 0.0, 0.0] if abs(axis[0]) < 0.9 else [0.0, 1.0, 0.0])
    first /= np.linalg.norm(first)
    second, away = np.cross(axis, first), points - at
    angles = np.sort(np.arctan2(away @ second, away @ first))
    return float(np.diff([*angles, angles[0] + 2 * math.pi]).max())


def stack(world: World) -> Iterator[float]:
    """A lies on B, and nothing else bears it."""
    a, b = (world.points(world.geoms(name)) for name in ("cubeA", "cubeB"))
    yield (0.003 - abs(a[:, 2].min() - b[:, 2].max())) / 0.0015
    middle = world.data.body("cubeA").xipos[:2]
    yield inside(b[b[:, 2] > b[:, 2].max() - 0.004][:, :2], middle) / 0.002
    for name in ("cubeA", "cubeB"):
        yield world.released(name)
    for name in ("cubeA", "cubeB"):
        yield from world.still(name)


def _down(world: World, name: str, middle: Any, size: Any) -> Iterator[float]:
    """Yield the margins of a thing on a floor, between walls."""
    x, y, _ = np.abs(world.data.body(name).xpos - middle)
    yield (size[0] / 2 - x) / 0.002
    yield (size[1] / 2 - y) / 0.002
    low = world.points(world.geoms(name))[:, 2].min() - middle[2]
    yield (0.0095 - abs(low)) / 0.0025


def _withdrawn(world: World, point: Vector) -> float:
    """Return the margin of hands that are away from a point."""
    far = math.atanh(1.0 - world.task.config.stages.withdrawn)
    far /= world.task.config.stages.reach_scale
    away = [np.linalg.norm(hand.position - point) for hand in world.task.hands]
    return (min(away, default=1.0) - far) / 0.002


def pick_place(world: World) -> Iterator[float]:
    """Groceries lie on the floor of their quadrants."""
    task, target = world.task, world.task.config.target

    def down(name: str) -> Iterator[float]:
        floor = *task.goal(name), target.center[2]
        return _down(world, name, floor, np.array(target.size[:2]) / 2)

    world.placed = lambda name: judged(down(name))[0] is not False
    for name in task.sorting.active:
        yield from down(name)
        yield _withdrawn(world, world.data.body(name).xpos)
        yield world.released(name)
        yield from world.still(name)


def nuts(world: World) -> Iterator[float]:
    """Walls of nuts are on all sides of their pegs, and near to the table."""
    task, up = world.task, np.array([0.0, 0.0, 1.0])
    top = task.config.table.center[2]
    for name in task.sorting.active:
        points = world.points(world.geoms(name))
        axis = np.array([*task.goal(name), top])
        yield (2.4 - around(points, up, axis)) / 0.3
        yield (top + 0.045 - points[:, 2].max()) / 0.02
        yield (world.data.body(name).xmat[8] ** 2 - math.cos(0.35) ** 2) / 0.05
        yield _withdrawn(world, world.data.site(f"{name}_handle").xpos)
        yield world.released(name)
        yield from world.still(name)


def tool_hang(world: World) -> Iterator[float]:
    """The frame is in its socket, and holes of the wrench are around its arm."""
    data, top = world.data, world.task.config.table.center[2]
    tip = data.site("frame_tip").xpos - data.site("base_floor").xpos
    yield (0.011 - np.abs(tip[:2]).max()) / 0.001
    yield (world.task.config.inserted.depth - abs(tip[2])) / 0.004
    wrench = world.points(world.geoms("tool"))
    yield (wrench[:, 2].min() - top - 0.004) / 0.003
    start, end = data.site("frame_corner").xpos, data.site("frame_bend").xpos
    holes = [data.site(f"tool_hole{k}").xpos for k in (1, 2)]
    axis = (end - start) / np.linalg.norm(end - start)
    widest = []
    for hole in holes:
        along = float((hole - start) @ axis) / float(np.linalg.norm(end - start))
        ring = wrench[np.linalg.norm(wrench - hole, axis=1) < 0.03]
        free = around(ring, axis, start) if len(ring) and 0 < along < 1 else math.tau
        widest.append(free)
    yield (2.6 - min(widest)) / 0.3
    low = min(hole[2] for hole in holes) - top - world.task.config.clear
    yield low / 0.002
    yield (world.gap("tool", world.geoms("base")) - 2e-4) / 2e-4
    for name in ("frame", "tool"):
        yield world.released(name)
    for name in ("tool", "frame"):
        yield from world.still(name)


def transport(world: World) -> Iterator[float]:
    """Payload and trash lie in their bins."""
    config = world.task.config.bin
    for name, where in (("payload", "target_bin"), ("trash", "trash_bin")):
        floor = np.add(world.data.body(where).xpos, (0.0, 0.0, config.wall))
        yield from _down(world, name, floor, config.size)
        yield world.released(name)
        yield from world.still(name)


def lift(world: World) -> Iterator[float]:
    """A hand holds the cube in the air."""
    config = world.task.config
    high = world.data.body("cube").xpos[2] - config.table.center[2]
    yield (high - config.reward.lift_height) / 0.001
    near = min(world.task.hands, key=lambda h: math.dist(h.position, _cube(world)))
    yield from world.clamped("cube", [near])


def _cube(world: World) -> Vector:
    return world.data.body("cube").xpos


def two_arm_lift(world: World) -> Iterator[float]:
    """Both hands hold the pot, upright, in the air."""
    config, pot = world.task.config, world.data.body("pot")
    bottom = pot.xpos - config.pot.half_size[2] * pot.xmat.reshape(3, 3)[:, 2]
    high = bottom[2] - config.table.center[2]
    yield (high - config.reward.lift_height) / 0.001
    yield (pot.xmat[8] - math.cos(config.reward.tilt)) / 0.01
    yield from world.clamped("pot", world.task.hands)


def handover(world: World) -> Iterator[float]:
    """The second hand alone holds the handle in the air; it was given to it."""
    task, (first, second) = world.task, world.task.hands
    yield 2.0 if task.data.userdata[0] else -2.0
    high = world.data.site("hammer_handle").xpos[2] - task.config.table.center[2]
    yield (high - task.config.reward.lift_height) / 0.001
    own = [g for g in world.robot.tolist() if first.owns(g)]
    yield (world.gap("hammer", own) - 2e-4) / 2e-4
    yield from world.clamped("hammer", [second])


def peg(world: World) -> Iterator[float]:
    """The peg is through the hole, beyond the plate, and not in it."""
    model, data, config = world.model, world.data, world.task.config
    (rod,), plate = world.geoms("peg"), world.geoms("plate")
    R, half = data.geom_xmat[rod].reshape(3, 3), model.geom_size[rod, 1]
    normal, middle = (
        data.body("plate").xmat.reshape(3, 3)[:, 2],
        data.body("plate").xpos,
    )
    along = float(R[:, 2] @ normal)
    yield (abs(along) - config.reward.cosine) / 0.005
    depth = float((middle - data.geom_xpos[rod]) @ normal) / along
    low, high = config.reward.depth
    yield (min(depth - low, high - depth) - 0.0) / 0.002
    yield (half - abs(depth)) / 0.002
    at = data.geom_xpos[rod] + depth * R[:, 2]
    rim = [g for g in plate if np.linalg.norm(data.geom_xpos[g] - middle) < 0.12]
    yield (2.6 - around(world.points(rim), normal, at)) / 0.3
    yield (world.gap("peg", plate) + 0.002) / 0.001


def door(world: World) -> Iterator[float]:
    """The panel is turned away from its frame."""
    panel, frame = (
        world.data.body(n).xmat.reshape(3, 3) for n in ("door_panel", "door")
    )
    angle = math.acos(np.clip(0.5 * (np.trace(frame.T @ panel) - 1.0), -1.0, 1.0))
    yield (angle - world.task.config.reward.open_angle) / 0.005
    yield 2.0 if world.data.joint("door_panel_joint").qpos[0] > 0.0 else -2.0


JUDGES: dict[str, Callable[[World], Iterator[float]]] = {
    "Door": door,
    "Lift": lift,
    "NutAssembly": nuts,
    "PickPlace": pick_place,
    "Stack": stack,
    "ToolHang": tool_hang,
    "TwoArmHandover": handover,
    "TwoArmLift": two_arm_lift,
    "TwoArmPegInHole": peg,
    "TwoArmTransport": transport,
}


def _vertices(model: mujoco.MjModel, geom: int) -> Matrix:
    """Return vertices of a geom in its own frame, m."""
    kinds, size = mujoco.mjtGeom, model.geom_size[geom]
    match model.geom_type[geom]:
        case kinds.mjGEOM_MESH:
            mesh = model.geom_dataid[geom]
            first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
            return model.mesh_vert[first : first + count].astype(np.float64)
        case kinds.mjGEOM_CYLINDER:
            x, y = size[0] * np.cos(ANGLES), size[0] * np.sin(ANGLES)
            ends = np.repeat([-size[1], size[1]], len(ANGLES))
            return np.column_stack([np.tile(x, 2), np.tile(y, 2), ends])
        case kinds.mjGEOM_CAPSULE:
            ball = _ball(np.full(3, size[0]))
            return np.vstack([np.add(ball, (0, 0, z)) for z in (-size[1], size[1])])
        case kinds.mjGEOM_SPHERE:
            return _ball(np.full(3, size[0]))
        case kinds.mjGEOM_ELLIPSOID:
            return _ball(size)
        case _:
            return size * np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T


def _ball(radii: Vector) -> Matrix:
    tilts = np.linspace(-np.pi / 2, np.pi / 2, 9)
    a, b = (grid.ravel() for grid in np.meshgrid(ANGLES, tilts))
    unit = np.column_stack([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)])
    return radii * unit
