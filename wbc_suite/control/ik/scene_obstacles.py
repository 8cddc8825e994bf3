"""What of a scene a robot may run into, measured by the simulator."""

from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

import mujoco
import numpy as np

from wbc_suite.compiling import as_argument, compiled, compiled_inline, inner, struct
from wbc_suite.control.ground.mujoco_functions import geom_distance
from wbc_suite.control.ik.commanded_scene import (
    CommandedArrays,
    CommandedScene,
    joint_bodies,
    place_commanded,
)
from wbc_suite.control.ik.config import WholeBodyIKConfig
from wbc_suite.control.state import RobotState
from wbc_suite.kinematics import Configuration
from wbc_suite.qp import LinkPair, ObstacleLimit
from wbc_suite.qp.self_collision_rows import insert_nearest
from wbc_suite.robot import RobotDescription
from wbc_suite.typing import CompiledRecords, Indices, Matrix, Vector

INFLUENCE = 0.5
"""m; pairs further apart are left out: at 4 m/s^2 a hand stops from 2 m/s in it."""

ROWS_OF_BODY = 4
"""Rows of one body and obstacle at most, so that fingers leave some for elbows."""

TOUCHING = 1e-4
"""m; nearer pairs keep their last normal: points are known to 1e-6 m."""

SLIDING = 0.3
"""m/s; what slides faster is kept off. MuJoCo's contact of friction mu throws off what
slides at mu times its speed: 1.1 m/s on a table turned a wrist at 5.5 rad/s at once."""

SLIDING_TIME = 0.02
"""s; distance that is kept over the speed beyond `SLIDING`."""

PLANAR = 3
"""Last joint of a planar root."""


@struct
class SceneArrays(NamedTuple):
    """p pairs of geoms, of which the k nearest are measured; views of the simulation.

    Attributes:
        commanded: The scene with the commanded robot.
        obstacle: Geom of each pair that does not move, shape (p,).
        geom: Geom of each pair that the robot moves.
        body: Body whose frame is that of the joint which moves it.
        centre: Centre of each geom's box in its frame, m, shape (ngeom, 3).
        half: Half its sides.
        root: Body with the root of each pair's robot geom, shape (p,).
        own: Body of that geom.
        cvel: Velocities of bodies at the centre of mass of their tree, angular first.
        centre_of_mass: That centre, by body of the root, m, shape (nbody, 3).
        bound: Lower bound of the distance of the nearest pairs, m, shape (k,).
        normal: Last normal of each pair, shape (p, 3).
        segment: Nearest points of a pair, of obstacle and robot, m, shape (6,).
        correction: Pose of measured in commanded axes, [R p], shape (12,).
        planes: `PLANE` records of the obstacle limit, shape (k,).
    """

    commanded: CommandedArrays
    xpos: Matrix
    xmat: Matrix
    geom_xpos: Matrix
    geom_xmat: Matrix
    geom_rbound: Vector
    obstacle: Indices
    geom: Indices
    body: Indices
    centre: Matrix
    half: Matrix
    root: Indices
    own: Indices
    cvel: Matrix
    centre_of_mass: Matrix
    bound: Vector
    normal: Matrix
    segment: Vector
    correction: Vector
    planes: CompiledRecords


class SceneObstacles:
    """Writes the nearest points of a robot and its scene into an obstacle limit.

    Obstacles are all geoms without a joint that can touch the robot. Nearest points are
    those of the commanded robot, with its fingers where they are, of exact shapes.

    Args:
        state: The robot in its scene.
        robot: The reduced robot.
        config: Its controller's config.
        configuration: The commanded configuration.
        correction: See `SceneArrays`; a view.

    Attributes:
        commanded: The scene with the commanded robot.
        limit: The limit; without pairs where there is nothing to touch.
        argument: The argument of kernels that stands for the scene.
    """

    def __init__(
        self,
        state: RobotState,
        robot: RobotDescription,
        config: WholeBodyIKConfig,
        configuration: Configuration,
        correction: Vector,
    ) -> None:
        self.commanded = CommandedScene(state, configuration)
        model, data = state.model, self.commanded.data
        pairs: list[tuple[int, int, str]] = []
        if config.limits.obstacles:
            pairs += _pairs(state, robot, config, configuration)
        self._pairs = np.array([x[:2] for x in pairs], dtype=np.int64).reshape(-1, 2)
        limits, hands = config.limits, _hand_links(robot)
        self.limit = ObstacleLimit(
            [LinkPair(link, _name(model, o)) for o, _, link in pairs],
            [
                -limits.press_depth if link in hands else limits.obstacle_distance
                for *_, link in pairs
            ],
            nearest=limits.collision_pairs,
        )
        self.limit.bind(configuration)
        bodies = joint_bodies(state, configuration)
        segment, rows = np.zeros(6), self.limit.dim
        own = model.geom_bodyid[self._pairs[:, 1]].astype(np.int64)
        self._arrays = SceneArrays(
            commanded=self.commanded.argument,
            xpos=data.xpos,
            xmat=data.xmat,
            geom_xpos=data.geom_xpos,
            geom_xmat=data.geom_xmat,
            geom_rbound=model.geom_rbound,
            obstacle=self._pairs[:, 0].copy(),
            geom=self._pairs[:, 1].copy(),
            body=bodies[self.limit.joints],
            centre=model.geom_aabb[:, :3].copy(),
            half=model.geom_aabb[:, 3:].copy(),
            root=model.body_rootid[own].astype(np.int64),
            own=own,
            cvel=state.data.cvel,
            centre_of_mass=state.data.subtree_com,
            bound=np.zeros(rows),
            normal=np.zeros((len(pairs), 3)),
            segment=segment,
            correction=correction,
            planes=self.limit.planes,
        )
        self.argument = as_argument(self._arrays)

    def measure(self) -> None:
        """Do what `measure_obstacles` does, in Python; places the commanded robot."""
        self.commanded.place()
        list_nearest(self.argument)
        for row, pair in enumerate(self.limit.planes["found"].tolist()):
            if pair >= 0:
                first, second = self._pairs[pair]
                distance = mujoco.mj_geomDistance(
                    self.commanded.model,
                    self.commanded.data,
                    first,
                    second,
                    INFLUENCE,
                    self._arrays.segment,
                )
                write_plane(self.argument, row, distance)


@compiled_inline
def measure_obstacles(scene: SceneArrays) -> None:
    """Write the planes between the robot and the obstacles that are nearest to it."""
    place_commanded(scene.commanded)
    list_nearest(scene)
    for row in range(scene.bound.shape[0]):
        pair = scene.planes[row].found
        if pair >= 0:
            distance = geom_distance(
                scene.commanded.model,
                scene.commanded.data,
                int(scene.obstacle[pair]),
                int(scene.geom[pair]),
                INFLUENCE,
                scene.segment,
            )
            write_plane(scene, row, distance)


@compiled
def list_nearest(scene: SceneArrays) -> None:
    """List the pairs whose boxes are nearest, and within the influence."""
    found, bound, count = scene.planes["found"], scene.bound, 0
    found[:], bound[:] = -1, np.inf
    for pair in range(scene.geom.shape[0]):
        most = min(INFLUENCE, bound[-1])
        d = _least_distance(scene, pair, most)
        if d < most:
            kept, last = _rows_of_body(scene, pair, count)
            if kept < ROWS_OF_BODY:
                insert_nearest(found, bound, count, pair, d)
                count = min(count + 1, found.shape[0])
            elif d < bound[last]:
                insert_nearest(found[: last + 1], bound[: last + 1], last, pair, d)


@inner
def _least_distance(scene: SceneArrays, pair: int, most: float) -> float:
    """Return a lower bound of the distance of a pair, m; `most` or more where greater.

    No point of the obstacle's box lies in front of the plane at its point that is
    nearest to the geom's centre; the geom reaches towards it no farther than its box.
    """
    o, g = scene.obstacle[pair], scene.geom[pair]
    R, R_geom, square = scene.geom_xmat[o], scene.geom_xmat[g], 0.0
    x_n = y_n = z_n = 0.0  # the way from the box to the centre, in the world
    for i in range(3):
        x = -scene.centre[o, i]
        for j in range(3):
            x += R[3 * j + i] * (scene.geom_xpos[g, j] - scene.geom_xpos[o, j])
        outside = np.sign(x) * max(abs(x) - scene.half[o, i], 0.0)
        square += outside * outside
        x_n += R[i] * outside
        y_n += R[3 + i] * outside
        z_n += R[6 + i] * outside
    d = np.sqrt(square)
    if d == 0.0 or d - scene.geom_rbound[g] >= most:
        return d - scene.geom_rbound[g]
    least = d
    for j in range(3):
        along = (R_geom[j] * x_n + R_geom[3 + j] * y_n + R_geom[6 + j] * z_n) / d
        least += along * scene.centre[g, j] - abs(along) * scene.half[g, j]
    return least


@inner
def _rows_of_body(scene: SceneArrays, pair: int, count: int) -> tuple[int, int]:
    """Return how many rows a pair's body and obstacle have, and the last of them."""
    kept, last = 0, 0
    for row in range(count):
        other = scene.planes[row].found
        same_body = scene.body[other] == scene.body[pair]
        if same_body and scene.obstacle[other] == scene.obstacle[pair]:
            kept, last = kept + 1, row
    return kept, last


@compiled
def write_plane(scene: SceneArrays, row: int, distance: float) -> None:
    """Write a row's point and plane, of a measured distance and segment, m."""
    plane, s, X = scene.planes[row], scene.segment, scene.correction
    pair = plane.found
    normal, body = scene.normal[pair], scene.body[pair]
    if abs(distance) > TOUCHING:
        for i in range(3):
            normal[i] = (s[3 + i] - s[i]) / distance
    size = normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2
    if distance >= INFLUENCE or size < 0.5:  # too far, or touching from the start
        plane.found = -1
        return
    offset = SLIDING_TIME * max(sliding_speed(scene, pair) - SLIDING, 0.0)
    for i in range(3):
        plane.point[i], plane.normal[i] = 0.0, 0.0
        at = X[4 * i + 3]
        for j in range(3):
            from_body = s[3 + j] - scene.xpos[body, j]
            plane.point[i] += scene.xmat[body, 3 * j + i] * from_body
            plane.normal[i] += X[4 * i + j] * normal[j]
            at += X[4 * i + j] * s[j]
        offset += plane.normal[i] * at
    plane.offset = offset


@inner
def sliding_speed(scene: SceneArrays, pair: int) -> float:
    """Return how fast the robot's nearest point moves along the obstacle, m/s."""
    n, v, s = scene.normal[pair], scene.cvel[scene.own[pair]], scene.segment
    centre = scene.centre_of_mass[scene.root[pair]]
    x, y, z = s[3] - centre[0], s[4] - centre[1], s[5] - centre[2]
    v_x = v[3] + v[1] * z - v[2] * y
    v_y = v[4] + v[2] * x - v[0] * z
    v_z = v[5] + v[0] * y - v[1] * x
    along = v_x * n[0] + v_y * n[1] + v_z * n[2]
    return np.sqrt(max(v_x * v_x + v_y * v_y + v_z * v_z - along * along, 0.0))


def _pairs(
    state: RobotState,
    robot: RobotDescription,
    config: WholeBodyIKConfig,
    configuration: Configuration,
) -> Iterator[tuple[int, int, str]]:
    """Yield obstacle, geom and its link.

    Legs that stand and a base that glides are not kept off planes.
    """
    model = state.model
    bodies = model.geom_bodyid.tolist()
    links = {model.body(state.prefix + link.name).id: link.name for link in robot.links}
    own = {geom: links[body] for geom, body in enumerate(bodies) if body in links}
    grounded = {link for held in config.held for link in _chain(robot, held.frame)}
    if robot.root.kind == "planar":
        grounded |= {
            link for link in links.values() if _joint(configuration, link) <= PLANAR
        }
    fixed = np.flatnonzero(model.body_weldid[bodies] == 0).tolist()
    kinds, affinity = model.geom_contype, model.geom_conaffinity
    obstacles = [geom for geom in fixed if geom not in own]
    for o, (g, link) in product(obstacles, own.items()):
        touch = kinds[o] & affinity[g] | kinds[g] & affinity[o]
        plane = model.geom_type[o] == mujoco.mjtGeom.mjGEOM_PLANE
        moves = _joint(configuration, link) > 0
        if touch and moves and not (plane and link in grounded):
            yield o, g, link


def _joint(configuration: Configuration, link: str) -> int:
    """Return the joint that moves a link, 0 for none."""
    return int(configuration.model.frames[configuration.frame_id(link)].parentJoint)


def _chain(robot: RobotDescription, frame: str) -> Iterator[str]:
    """Yield the links from a frame's to the one below the root."""
    link = robot.link(robot.link_of(frame))
    while link.parent is not None:
        yield link.name
        link = robot.link(link.parent)


def _hand_links(robot: RobotDescription) -> set[str]:
    """Return the links that carry frames of hands, and those that these carry."""
    found = {robot.link_of(frame) for frame in robot.hands.values()}
    for link in robot.links:  # parents come first
        if link.parent in found:
            found.add(link.name)
    return found


def _name(model: mujoco.MjModel, geom: int) -> str:
    """Return the name of a geom's body, or its own where that is the world."""
    body = int(model.geom_bodyid[geom])
    return model.body(body).name if body else model.geom(geom).name
