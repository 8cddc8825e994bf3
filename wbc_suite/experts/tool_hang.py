"""The expert of ToolHang."""

import math
from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from wbc_suite.benchmark.tool_hang import FRAME, STAND, TOOL, ToolHang
from wbc_suite.experts.arm import Arm
from wbc_suite.experts.scene import ExpertScene, Steps
from wbc_suite.experts.skills import (
    UP,
    at_height,
    carry,
    move,
    move_in_joints,
    pick,
    release,
    shifted,
)
from wbc_suite.typing import Vector

YAWS = tuple(k * math.pi / 8 for k in range(16))
OVER = 0.40  # m above the table, clear of a standing frame
RAISED = 0.15  # m, of the wrench before it is turned
ABOVE = 0.02  # m, of the rod's tip over the socket
WAY = (
    (0.0, 0.15, 0.3),
    (0.0, 0.05, 0.3),
    (0.0, 0.012, 0.3),
    (-0.002, 0.0055, 0.65),
    (-0.005, 0.002, 0.9),
    (-0.012, 0.0, 1.2),
)
"""Way of a hole over the hook: from its bend outward and upward, m, and the angle of
the hole's axis to the upward direction, rad. Between any two points the wrench stays
2.6 mm clear of the hook."""


def tool_hang(scene: ExpertScene[ToolHang]) -> Steps[None]:
    """Put the frame into its stand, then a hole of the wrench over its hook."""
    for _ in range(3):
        if not scene.benchmark.is_inserted():
            yield from _insert(scene)
        elif scene.benchmark.success():
            return
        else:
            yield from _hang(scene)


def _over(scene: ExpertScene[ToolHang]) -> float:
    return scene.benchmark.config.table.center[2] + OVER


def _insert(scene: ExpertScene[ToolHang]) -> Steps[None]:
    """Stand the frame up in its socket."""
    arm = scene.arms[0]
    floor, socket = scene.point(f"{STAND}_floor"), scene.point(f"{STAND}_socket")
    length = scene.point(f"{FRAME}_corner") - scene.point(f"{FRAME}_tip")
    half = float(np.linalg.norm(length)) / 2
    stands = [pin.SE3(pin.exp3(yaw * UP), floor + half * UP) for yaw in YAWS]
    costs = _costs_of_hanging(scene, arm, stands)
    rise = socket[2] - floor[2] + ABOVE
    plans = [(shifted(pose, rise * UP), pose) for pose in stands]
    choice = yield from pick(scene, FRAME, then=plans, costs=costs, raised=0.25)
    if choice is None:
        return
    above, inside = choice.then
    yield from carry(scene, arm, FRAME, above, tolerance=0.003, turn_tolerance=0.03)
    yield from carry(scene, arm, FRAME, inside, tolerance=0.006, speed=0.12)
    yield from release(arm, back=0.12)
    yield from move(arm, at_height(arm.pose, _over(scene)), tolerance=0.03, most=40)
    yield from move_in_joints(scene, arm, arm.home_joints, tolerance=0.05, most=40)


def _hang(scene: ExpertScene[ToolHang]) -> Steps[None]:
    """Bring a hole of the wrench over the hook, and let go."""
    frame = scene.pose(FRAME)
    plans = [_way(scene, frame, end) for end in (1.0, -1.0)]
    choice = yield from pick(scene, TOOL, then=plans, raised=RAISED, over=_over(scene))
    if choice is None:
        return
    arm, end = choice.arm, 1.0 if choice.then == plans[0] else -1.0
    over = choice.prediction.q[-len(WAY)]
    yield from move_in_joints(scene, arm, over, tolerance=0.03, turn_tolerance=0.2)
    for k in range(len(WAY)):
        goal = _way(scene, scene.pose(FRAME), end)[k]
        yield from carry(
            scene, arm, TOOL, goal, tolerance=0.0025, speed=0.12, turn=0.3, most=60
        )
    yield from release(arm, back=0.15)
    yield from move(arm, shifted(arm.pose, 0.1 * UP), tolerance=0.05, most=30)


def _way(
    scene: ExpertScene[ToolHang], frame: pin.SE3, end: float
) -> tuple[pin.SE3, ...]:
    """Return the way of the wrench by which the hole at one end gets over the hook."""
    to_bend, to_hole = _geometry(scene)
    out, up = frame.rotation[:, 0], frame.rotation[:, 2]
    face = 1.0 if scene.object(TOOL).rotation[2, 2] > -0.5 else -1.0
    poses = []
    for outward, upward, angle in WAY:
        normal = math.sin(angle) * out + math.cos(angle) * up
        along = math.cos(angle) * out - math.sin(angle) * up
        x, z = -end * along, face * normal
        R = np.column_stack([x, np.cross(z, x), z])
        hole = frame * to_bend + outward * out + upward * up
        poses.append(pin.SE3(R, hole - end * to_hole * x))
    return tuple(poses)


def _geometry(scene: ExpertScene[ToolHang]) -> tuple[Vector, float]:
    """Return the hook's bend in the frame, and the distance of a hole, m."""
    bend = scene.pose(FRAME).actInv(pin.SE3(np.eye(3), scene.point(f"{FRAME}_bend")))
    holes = scene.point(f"{TOOL}_hole1") - scene.point(f"{TOOL}_hole2")
    return bend.translation, float(np.linalg.norm(holes)) / 2


def _costs_of_hanging(
    scene: ExpertScene[ToolHang], arm: Arm, frames: Sequence[pin.SE3]
) -> list[float]:
    """Return the cost of picking the wrench up and hanging it on each pose of a frame.

    The least of all grasps from above, and of both ends.
    """
    tool, costs = scene.pose(TOOL), np.full(len(frames), np.inf)
    for site in scene.grasps(TOOL):
        at = tool * site.pose
        if at.rotation[2, 2] > -0.8:
            continue
        picked = arm.look_ahead([at, shifted(at, RAISED * UP)])
        for k, frame in enumerate(frames):
            for end in (1.0, -1.0):
                way = [pose * site.pose for pose in _way(scene, frame, end)]
                costs[k] = min(costs[k], arm.look_ahead(way, after=picked).cost)
    return costs.tolist()
