"""Scenes whose robots are rigid bodies: cheap worlds to try states of benchmarks in.

A second model of the same scene has the robots' joints, and poses them. The simulated
one has none of them: links are as solid as rock, and a step costs as much as that of
the things alone. Robots stand on the floor by a free joint where a benchmark asks.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from wbc_suite.benchmark import load_benchmark
from wbc_suite.control import RobotState
from wbc_suite.envs.building import StartPosture, compose, place_robots
from wbc_suite.envs.config import parse_env_config
from wbc_suite.robot import RobotDescription
from wbc_suite.scene import compile_scene, robot_prefix
from wbc_suite.typing import Matrix, Vector

ANGLES = np.linspace(0.0, 2 * np.pi, 16, endpoint=False)
NEAR = 0.004  # m, up to which distances are measured
GRAVITY = 9.81 * np.array([0.0, 0.0, -1.0])
OWN = "robot"  # beginning of the names of robots' bodies and joints


class World:
    """A benchmark's scene with rigid robots.

    Args:
        name: Of the benchmark.
        robots: Names of the robots.
        free: Whether robots have a free joint to the world, and fall.

    Attributes:
        task: The benchmark in the model with rigid robots.
        moving: The robots with their joints.
        robot: Solid geoms of robots.
        placed: Whether a thing is where it belongs.
        robots: Descriptions of the robots.
        roots: Bodies of robots with a free joint.
        history: What was seen of robots on their feet, look by look.
        left: Number of marks of Wipe that were left before its robot wiped.
    """

    def __init__(self, name: str, robots: Sequence[str], *, free: bool = False) -> None:
        self.task: Any = load_benchmark(name)
        config = parse_env_config({"robots": list(robots or self.task.robots)})
        placed = place_robots(self.task, config)
        self.moving = MovingRobots(load_benchmark(name), placed, config)
        spec = compose(self.task, placed, config)
        _without_joints(spec, len(placed), free=free)
        self.model = compile_scene(spec)
        self.data = mujoco.MjData(self.model)
        states: Any = [
            SimpleNamespace(
                model=self.model, data=self.data, robot=robot, prefix=robot_prefix(i)
            )
            for i, robot in enumerate(placed)
        ]
        self.task.bind(self.model, self.data, states)
        self.placed: Callable[[str], bool] = lambda name: False
        self.robots, self.left = placed, 0
        self.history: list[Any] = []
        self._shapes: dict[tuple[int, bytes], Matrix] = {}
        own, parents = self.moving.bodies, self.model.body_parentid
        self.roots = own[parents[own] == 0] if free else own[:0]
        self._links = np.setdiff1d(own, self.roots)
        solid = self.model.geom_contype > 0
        self.robot = np.flatnonzero(np.isin(self.model.geom_bodyid, own) & solid)

    def begin(self, seed: int) -> None:
        """Draw robots' postures, and sizes and places of things, from a seed."""
        mujoco.mj_resetData(self.model, self.data)
        self.moving.begin(seed)
        self.pose()
        self.task.reset(np.random.default_rng(seed))
        mujoco.mj_forward(self.model, self.data)

    def pose(self) -> None:
        """Give the rigid robots the posture of the moving ones."""
        position, quat = self.moving.relative_poses(self._links)
        self.model.body_pos[self._links] = position
        self.model.body_quat[self._links] = quat
        for root in self.roots.tolist():
            first = self.model.jnt_qposadr[self.model.body_jntadr[root]]
            self.data.qpos[first : first + 3] = self.moving.data.xpos[root]
            self.data.qpos[first + 3 : first + 7] = self.moving.data.xquat[root]

    def close(self, hand: int, names: Iterable[str], squeeze: float) -> bool:
        """Close a hand until two of its links touch a thing; return whether they do.

        `squeeze` is how far they go on then, as a share of the way.
        """
        for name in self.task.states:
            if self.task.states[name].is_free:
                to = self.moving.data.joint(f"{name}_joint")
                to.qpos[:] = self.data.joint(f"{name}_joint").qpos
        geoms = {g for name in names for g in self.task.states[name].geoms}
        grasped = self.moving.close(hand, geoms, squeeze)
        self.pose()
        mujoco.mj_fwdPosition(self.model, self.data)
        return grasped

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
                self._shapes[key] = vertices(self.model, geom)
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
        """Let physics go on."""
        mujoco.mj_step(self.model, self.data, steps)
        mujoco.mj_forward(self.model, self.data)

    def after(self, seconds: float, look: Callable[[], Any]) -> Any:
        """Return what is seen after some time; the state is as before then."""
        data, kind = self.data, mujoco.mjtState.mjSTATE_INTEGRATION
        kept = np.empty(mujoco.mj_stateSize(self.model, kind))
        mujoco.mj_getState(self.model, data, kept, kind)
        self.run(round(seconds / self.model.opt.timestep))
        seen = look()
        mujoco.mj_setState(self.model, data, kept, kind)
        mujoco.mj_forward(self.model, data)
        return seen

    def moved(self, name: str, seconds: float = 0.3) -> float:
        """Return how far a thing moves in some time, m."""
        geoms = self.geoms(name)
        before = self.points(geoms)
        after = self.after(seconds, lambda: self.points(geoms))
        return float(np.linalg.norm(after - before, axis=1).max())

    def pulled(self, name: str, way: Vector, hand: Any) -> float:
        """Return how far a thing's point in a hand moves from there in 0.2 s, m.

        It is pulled as if gravity had the direction `way` for it alone, m/s^2.
        """
        data, body = self.data, self.model.body(name).id
        R = data.xmat[body].reshape(3, 3)
        point = R.T @ (hand.position - data.xpos[body])
        force = data.xfrc_applied[body, :3].copy()
        pull = self.model.body_subtreemass[body] * (way - GRAVITY)
        data.xfrc_applied[body, :3] = pull

        def away() -> float:
            now = data.xmat[body].reshape(3, 3) @ point + data.xpos[body]
            return float(np.linalg.norm(now - data.site_xpos[hand.site]))

        moved = self.after(0.2, away)
        data.xfrc_applied[body, :3] = force
        mujoco.mj_forward(self.model, data)
        return moved

    @contextmanager
    def without(self, geoms: Sequence[int]) -> Iterator[None]:
        """Let geoms touch nothing for a while."""
        model = self.model
        kept = model.geom_contype.copy(), model.geom_conaffinity.copy()
        model.geom_contype[geoms] = model.geom_conaffinity[geoms] = 0
        yield
        model.geom_contype[:], model.geom_conaffinity[:] = kept
        mujoco.mj_forward(model, self.data)

    def speed(self, name: str) -> tuple[float, float]:
        """Return the speeds of a free thing, m/s and rad/s."""
        v = self.data.joint(f"{name}_joint").qvel
        return float(np.linalg.norm(v[:3])), float(np.linalg.norm(v[3:]))

    def deepest(self) -> float:
        """Return the deepest overlap, m."""
        return -float(min(self.data.contact.dist[: self.data.ncon], default=0.0))


class MovingRobots:
    """The same scene, in which the robots have their joints; not simulated.

    Attributes:
        bodies: Of robots, parents before children.
        hands: The hands of all robots.
    """

    def __init__(
        self, task: Any, robots: tuple[RobotDescription, ...], config: Any
    ) -> None:
        self.task = task
        self.model = compile_scene(compose(task, robots, config))
        self.data = mujoco.MjData(self.model)
        states = [
            RobotState(self.model, self.data, robot, prefix=robot_prefix(i))
            for i, robot in enumerate(robots)
        ]
        task.bind(self.model, self.data, states)
        self.hands = task.hands if hasattr(task, "hands") else []
        self._postures = [StartPosture(state, config.noise) for state in states]
        names = [self.model.body(k).name for k in range(self.model.nbody)]
        self.bodies = np.flatnonzero([name.startswith(OWN) for name in names])
        self._fingers = [
            _fingers(state, side) for state in states for side in state.robot.hands
        ]

    def begin(self, seed: int) -> None:
        """Draw postures and sizes of things from a seed."""
        mujoco.mj_resetData(self.model, self.data)
        for posture in self._postures:
            posture.write(np.random.default_rng(seed))
        mujoco.mj_forward(self.model, self.data)
        self.task.reset(np.random.default_rng(seed))
        mujoco.mj_forward(self.model, self.data)

    def relative_poses(self, bodies: Vector) -> tuple[Matrix, Matrix]:
        """Return poses of bodies relative to their parents: position, quaternion."""
        data, parents = self.data, self.model.body_parentid[bodies]
        R = data.xmat[parents].reshape(-1, 3, 3)
        away = data.xpos[bodies] - data.xpos[parents]
        a, b = data.xquat[parents], data.xquat[bodies]
        w, v = a[:, :1], -a[:, 1:]  # of the inverse
        scalar = w[:, 0] * b[:, 0] - np.sum(v * b[:, 1:], axis=1)
        vector = w * b[:, 1:] + b[:, :1] * v + np.cross(v, b[:, 1:])
        return np.einsum("kij,ki->kj", R, away), np.column_stack([scalar, vector])

    def close(self, hand: int, geoms: set[int], squeeze: float) -> bool:
        """Close a hand, each finger until it touches geoms, then by a share more."""
        model, data = self.model, self.data
        fingers, done = self._fingers[hand], set[str]()
        ways = {joint: end - start for joint, start, end, _ in fingers}

        def touching() -> set[str]:
            pairs = data.contact.geom.tolist()
            met = {a for a, b in pairs if b in geoms}
            met |= {b for a, b in pairs if a in geoms}
            hit = {int(model.geom_bodyid[g]) for g in met}
            return {joint for joint, _, _, moved in fingers if moved & hit}

        for joint, start, _, _ in fingers:
            data.joint(joint).qpos[0] = start
        for _ in range(50):
            mujoco.mj_fwdPosition(model, data)
            done |= touching()
            free = ways.keys() - done
            if not free:
                break
            for joint in free:
                data.joint(joint).qpos[0] += 0.02 * ways[joint]
        for joint in done:
            data.joint(joint).qpos[0] += squeeze * ways[joint]
        mujoco.mj_fwdPosition(model, data)
        return self.hands[hand].grasps(geoms)

    def bring(self, hand: int, point: Vector, R_goal: Matrix) -> None:
        """Bring a hand near to a pose by damped least squares."""
        model, data, site = self.model, self.data, self.hands[hand].site
        root = model.body_rootid[model.site_bodyid[site]]
        mine = (model.body_rootid[model.dof_bodyid] == root) & np.isin(
            model.jnt_type[model.dof_jntid], (2, 3)
        )
        mine &= ~self.legs
        dofs = np.flatnonzero(mine)
        address = model.jnt_qposadr[model.dof_jntid[dofs]]
        low, high = model.jnt_range[model.dof_jntid[dofs]].T
        free = ~model.jnt_limited[model.dof_jntid[dofs]].astype(bool)
        low, high = np.where(free, -np.inf, low), np.where(free, np.inf, high)
        J = np.zeros((6, model.nv))
        quat, error = np.empty(4), np.empty(6)
        for _ in range(25):
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            mujoco.mj_jacSite(model, data, J[:3], J[3:], site)
            R = R_goal @ data.site_xmat[site].reshape(3, 3).T
            mujoco.mju_mat2Quat(quat, np.ascontiguousarray(R).ravel())
            mujoco.mju_quat2Vel(error[3:], quat, 1.0)
            error[:3] = point - data.site_xpos[site]
            own = J[:, dofs]
            step = own.T @ np.linalg.solve(own @ own.T + 3e-3 * np.eye(6), error)
            data.qpos[address] = np.clip(data.qpos[address] + step, low, high)
        mujoco.mj_kinematics(model, data)

    @cached_property
    def legs(self) -> NDArray[np.bool_]:
        """Which degrees of freedom carry a foot."""
        model, legs = self.model, np.zeros(self.model.nv, dtype=bool)
        standing = getattr(self.task, "standing", None)
        if standing is None:
            return legs
        for foot in standing._feet:
            body = int(model.geom_bodyid[next(iter(foot))])
            while body:
                first, count = model.body_dofadr[body], model.body_dofnum[body]
                legs[first : first + count] = True
                body = int(model.body_parentid[body])
        return legs


def _without_joints(spec: mujoco.MjSpec, robots: int, *, free: bool) -> None:
    """Leave out the joints of robots, and all that refers to them."""
    named = [*spec.sensors, *spec.actuators, *spec.tendons, *spec.keys]
    named += [item for item in spec.equalities if item.name1.startswith(OWN)]
    for item in named:
        spec.delete(item)
    for joint in list(spec.joints):
        if joint.name.startswith(OWN):
            root = joint.parent.parent == spec.worldbody
            kept = free and root and joint.type == mujoco.mjtJoint.mjJNT_FREE
            if not kept:
                spec.delete(joint)
    for body in spec.worldbody.bodies if free else ():
        if body.name.startswith(OWN) and not body.joints:
            body.add_freejoint(name=f"{body.name}_free")


def _fingers(state: Any, side: str) -> list[tuple[str, float, float, frozenset[int]]]:
    """Return joints of a gripper, open and closed, and the bodies that they move."""
    ends: dict[str, Any] = {}
    for synergy in state.robot.synergies.get(f"{side}_gripper", ()):
        ends |= {j: (q, synergy.closed.get(j, q)) for j, q in synergy.open.items()}
    for joint in state.robot.joints:
        if joint.mimic is not None and joint.mimic.joint in ends:
            leader, ratio = ends[joint.mimic.joint], joint.mimic.ratio
            ends[joint.name] = tuple(ratio * q + joint.mimic.offset for q in leader)
    model, found = state.model, []
    for name, (start, end) in ends.items():
        moved = {int(model.joint(state.prefix + name).bodyid[0])}
        for body in range(model.nbody):  # parents before children
            if int(model.body_parentid[body]) in moved:
                moved.add(body)
        found.append((state.prefix + name, start, end, frozenset(moved)))
    return found


def vertices(model: mujoco.MjModel, geom: int) -> Matrix:
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
