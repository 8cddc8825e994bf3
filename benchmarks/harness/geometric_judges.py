"""Judges of a state by vertices, distances and what physics does next.

They share no code with the predicates of success. A judge yields margins: a statement
holds surely from 1 on, surely not below -1, and is not decided between.
"""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from harness.rigid_world import World
from wbc_suite.typing import Matrix, Vector

WAYS = 9.81 * np.array([(0, 0, -1), (0, 0, 1), (1, 0, 0), (-1, 0, 0), (0, 1, 0)])
"""Directions of gravity in which a hand must hold what it clamps."""


def released(world: World, name: str) -> float:
    """Return the margin of no robot touching a thing."""
    return (world.gap(name, world.robot) - 2e-4) / 2e-4


def still(world: World, name: str) -> Iterator[float]:
    """Yield the margins of a thing that is, and stays, where it is."""
    v, w = world.speed(name)
    yield (0.02 - v) / 0.01
    yield (0.2 - w) / 0.1
    moved = (0.003 - world.moved(name)) / 0.002
    tips = moved < -1.0 and stays_placed(world, name)
    yield -0.5 if tips else moved


def stays_placed(world: World, name: str) -> bool:
    """Whether what comes to rest after tipping is where it belongs, all the same.

    What stands on an edge tips as slowly as one likes, so that no bound of its speed
    keeps it from moving later.
    """
    return world.after(1.5, lambda: world.placed(name))


def clamped(world: World, name: str, hands: Iterable[Any]) -> Iterator[float]:
    """Yield the margins of hands that hold a thing whichever way it is pulled.

    Fingers do not follow here, so that what is held creeps: 0.2 s are looked at, in
    which what falls moves by 20 cm. Nor do they press: 40 um of overlap, about
    the weight of a cube, are a clamp; less may be a cage.
    """
    hands = list(hands)
    for hand in hands:
        own = [g for g in world.robot.tolist() if hand.owns(g)]
        yield (-world.gap(name, own) - 2e-5) / 2e-5
    for way in WAYS:
        yield (0.035 - world.pulled(name, way, hands[0])) / 0.025


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
        yield released(world, name)
    for name in ("cubeA", "cubeB"):
        yield from still(world, name)


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
        yield released(world, name)
        yield from still(world, name)


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
        yield released(world, name)
        yield from still(world, name)


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
        yield released(world, name)
    for name in ("tool", "frame"):
        yield from still(world, name)


def transport(world: World) -> Iterator[float]:
    """Payload and trash lie in their bins."""
    config = world.task.config.bin
    for name, where in (("payload", "target_bin"), ("trash", "trash_bin")):
        floor = np.add(world.data.body(where).xpos, (0.0, 0.0, config.wall))
        yield from _down(world, name, floor, config.size)
        yield released(world, name)
        yield from still(world, name)


def lift(world: World) -> Iterator[float]:
    """A hand holds the cube in the air."""
    config = world.task.config
    high = world.data.body("cube").xpos[2] - config.table.center[2]
    yield (high - config.reward.lift_height) / 0.001
    yield from in_one_hand(world)


def in_one_hand(world: World) -> Iterator[float]:
    """A hand holds the cube; with the help of another one it is not decided.

    Nor are cubes between two links at edges: rigid fingers hold what is lost within 0.1
    s by those that give way (tests/benchmark/test_lift.py).
    """
    near = min(world.task.hands, key=lambda h: math.dist(h.position, _cube(world)))
    yield from clamped(world, "cube", [near])
    yield max(_opposition(world, near), -0.5)
    others = [h for h in world.task.hands if h is not near]
    own = [g for g in world.robot.tolist() if any(h.owns(g) for h in others)]
    yield max((world.gap("cube", own) - 2e-4) / 2e-4, 0.0) if own else 2.0


def _opposition(world: World, hand: Any) -> float:
    """Return the margin of two links that touch the cube from opposite sides."""
    contact, (cube,) = world.data.contact, world.geoms("cube")
    sides: dict[int, list[Vector]] = {}
    for (a, b), frame in zip(contact.geom.tolist(), contact.frame, strict=True):
        other = b if a == cube else a
        if cube in (a, b) and hand.owns(other):
            side = frame[:3] if b == cube else -frame[:3]
            sides.setdefault(int(world.model.geom_bodyid[other]), []).append(side)
    if len(sides) != 2:
        return 2.0
    first, second = (np.array(normals) for normals in sides.values())
    widest = math.degrees(math.acos(np.clip((first @ second.T).min(), -1.0, 1.0)))
    return (widest - 162.0) / 2.0


def _cube(world: World) -> Vector:
    return world.data.body("cube").xpos


def two_arm_lift(world: World) -> Iterator[float]:
    """Both hands hold the pot, upright, in the air."""
    config, pot = world.task.config, world.data.body("pot")
    bottom = pot.xpos - config.pot.half_size[2] * pot.xmat.reshape(3, 3)[:, 2]
    high = bottom[2] - config.table.center[2]
    yield (high - config.reward.lift_height) / 0.001
    yield (pot.xmat[8] - math.cos(config.reward.tilt)) / 0.01
    yield from clamped(world, "pot", world.task.hands)
    for hand in world.task.hands:
        others = [g for g in world.robot.tolist() if not hand.owns(g)]
        with world.without(others):  # each clamps it, the other one does not do it all
            for way in 0.3 * WAYS:
                yield (0.03 - world.pulled("pot", way, hand)) / 0.02


def handover(world: World) -> Iterator[float]:
    """The second hand alone holds the handle in the air; it was given to it."""
    task, (first, second) = world.task, world.task.hands
    yield 2.0 if task.data.userdata[0] else -2.0
    high = world.data.site("hammer_handle").xpos[2] - task.config.table.center[2]
    yield (high - task.config.reward.lift_height) / 0.001
    own = [g for g in world.robot.tolist() if first.owns(g)]
    yield (world.gap("hammer", own) - 2e-4) / 2e-4
    yield from clamped(world, "hammer", [second])


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


LOOKS = 20
"""Looks, each after a control period, in which a robot must do what it should."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Look:
    """What was seen at one moment of a robot on its feet.

    Attributes:
        upright: Margin of a robot that has not fallen.
        margin: Margin of what must hold for `LOOKS` looks.
    """

    upright: float
    margin: float


def on_feet(world: World) -> Iterator[float]:
    """The robot has not fallen, and has long done what it should."""
    seen = world.history
    yield min(look.upright for look in seen)
    yield 2.0 if len(seen) >= LOOKS else -2.0
    yield min(look.margin for look in seen[-LOOKS:])


def loco_lift(world: World) -> Iterator[float]:
    """The robot has long held the cube in a hand, standing."""
    yield from on_feet(world)
    yield from in_one_hand(world)


def wipe(world: World) -> Iterator[float]:
    """The hands press on the table, and all marks that were left lie below one of them.

    A hand covers the convex hull of what is below the table's top. The force is that
    of the constraints on the robot's root.
    """
    task, data = world.task, world.data
    hands = [[g for g in world.robot.tolist() if h.owns(g)] for h in task.hands]
    (root,) = world.roots.tolist()
    first = int(world.model.jnt_dofadr[world.model.body_jntadr[root]])
    force = data.qfrc_constraint.item(first + 2)
    yield (force - task.config.reward.least_force) / 0.05
    top, margin = task.config.table.center[2], task.config.margin
    marks = task.marks[: world.left, :2]
    covered = np.full((2, world.left), -np.inf)
    for own in hands:
        for k, height in enumerate((top - 1e-4, top + 1e-4)):
            below = np.vstack([_section(world.points([g]), height) for g in own])
            covered[k] = np.maximum(covered[k], [_within(below, m) for m in marks])
    surely, maybe = covered.min(axis=1) + margin
    yield min(surely, 0.006) / 0.003 if surely > 0.0 else min(maybe / 0.003, 0.5)


def _section(points: Matrix, height: float) -> Matrix:
    """Return what a convex hull covers of a plane, and of what is below, (n, 2)."""
    low, high = points[points[:, 2] < height], points[points[:, 2] >= height]
    if not len(low) or not len(high):
        return low[:, :2]
    a, b = low[:, None], high[None]
    share = (height - a[..., 2]) / (b[..., 2] - a[..., 2])
    cut = a[..., :2] + share[..., None] * (b[..., :2] - a[..., :2])
    return np.vstack([low[:, :2], cut.reshape(-1, 2)])


def _within(hull: Matrix, point: Vector) -> float:
    """Return how far a point is inside a convex hull, m; a line has no inside."""
    if not len(hull):
        return -math.inf
    around = np.array([[1.0, 0], [0, 1], [-1, 0], [0, -1], [1, 1], [-1, -1]]) * 1e-5
    thick = (hull[:, None] + around).reshape(-1, 2)
    return inside(thick, point)


JUDGES: dict[str, Callable[[World], Iterator[float]]] = {
    **dict.fromkeys(("Stand", "WalkTo", "Reach", "Carry"), on_feet),
    "LocoLift": loco_lift,
    "Wipe": wipe,
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
