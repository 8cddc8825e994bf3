"""The expert of ToolHang."""

import math

import numpy as np
import pinocchio as pin

from wbc_suite.benchmark.tool_hang import FRAME, STAND, TOOL, ToolHang
from wbc_suite.experts.arm import Arm
from wbc_suite.experts.skills import UP, carry, move, pick, release, shifted, travel
from wbc_suite.experts.workcell import Steps, Workcell
from wbc_suite.typing import Vector

YAWS = tuple(k * math.pi / 8 for k in range(16))
OVER = 0.40  # m above the table, clear of a standing frame
ABOVE = 0.02  # m, of the rod's tip over the socket
WAY = ((0.0, 0.05, 0.4), (0.0, 0.012, 0.4), (-0.006, 0.003, 0.9), (-0.014, -0.006, 1.3))
"""Way of a hole over the hook: from its bend outward and upward, m, and the angle of
the hole's axis to the upward direction, rad."""


def tool_hang(cell: Workcell[ToolHang]) -> Steps[None]:
    """Put the frame into its stand, then a hole of the wrench over its hook."""
    for _ in range(3):
        if not cell.benchmark.is_inserted():
            yield from _insert(cell)
        elif cell.benchmark.success():
            return
        else:
            yield from _hang(cell)


def _over(cell: Workcell[ToolHang]) -> float:
    return cell.benchmark.config.table.center[2] + OVER


def _insert(cell: Workcell[ToolHang]) -> Steps[None]:
    """Stand the frame up in its socket."""
    arm = cell.arms[0]
    floor, socket = cell.point(f"{STAND}_floor"), cell.point(f"{STAND}_socket")
    length = cell.point(f"{FRAME}_corner") - cell.point(f"{FRAME}_tip")
    half = float(np.linalg.norm(length)) / 2
    stands = [pin.SE3(pin.exp3(yaw * UP), floor + half * UP) for yaw in YAWS]
    costs = [_cost_of_hanging(cell, arm, pose) for pose in stands]
    rise = socket[2] - floor[2] + ABOVE
    plans = [(shifted(pose, rise * UP), pose) for pose in stands]
    choice = yield from pick(cell, FRAME, then=plans, costs=costs, raised=0.25)
    if choice is None:
        return
    above, inside = choice.then
    yield from carry(cell, arm, FRAME, above, tolerance=0.003, turn_tolerance=0.03)
    yield from carry(cell, arm, FRAME, inside, tolerance=0.006, speed=0.12)
    yield from release(arm, back=0.12)
    yield from travel(arm, arm.home, height=_over(cell), tolerance=0.05, most=40)


def _hang(cell: Workcell[ToolHang]) -> Steps[None]:
    """Bring a hole of the wrench over the hook, and let go."""
    frame = cell.pose(FRAME)
    plans = [_way(cell, frame, end) for end in (1.0, -1.0)]
    choice = yield from pick(cell, TOOL, then=plans, raised=0.15, over=_over(cell))
    if choice is None:
        return
    arm, end = choice.arm, 1.0 if choice.then == plans[0] else -1.0
    first = _way(cell, cell.pose(FRAME), end)[0]
    over = pin.SE3(first.rotation, first.translation + 0.1 * UP)
    yield from carry(cell, arm, TOOL, over, tolerance=0.03, turn_tolerance=0.2)
    for k in range(len(WAY)):
        goal = _way(cell, cell.pose(FRAME), end)[k]
        yield from carry(
            cell, arm, TOOL, goal, tolerance=0.004, speed=0.12, turn=0.8, most=60
        )
    yield from release(arm, back=0.15)
    yield from move(arm, shifted(arm.pose, 0.1 * UP), tolerance=0.05, most=30)


def _way(cell: Workcell[ToolHang], frame: pin.SE3, end: float) -> tuple[pin.SE3, ...]:
    """Return the way of the wrench by which the hole at one end gets over the hook."""
    to_bend, to_hole = _geometry(cell)
    out, up = frame.rotation[:, 0], frame.rotation[:, 2]
    face = 1.0 if cell.object(TOOL).rotation[2, 2] > -0.5 else -1.0
    poses = []
    for outward, upward, angle in WAY:
        normal = math.sin(angle) * out + math.cos(angle) * up
        along = math.cos(angle) * out - math.sin(angle) * up
        x, z = -end * along, face * normal
        R = np.column_stack([x, np.cross(z, x), z])
        hole = frame * to_bend + outward * out + upward * up
        poses.append(pin.SE3(R, hole - end * to_hole * x))
    return tuple(poses)


def _geometry(cell: Workcell[ToolHang]) -> tuple[Vector, float]:
    """Return the hook's bend in the frame, and the distance of a hole, m."""
    bend = cell.pose(FRAME).actInv(pin.SE3(np.eye(3), cell.point(f"{FRAME}_bend")))
    holes = cell.point(f"{TOOL}_hole1") - cell.point(f"{TOOL}_hole2")
    return bend.translation, float(np.linalg.norm(holes)) / 2


def _cost_of_hanging(cell: Workcell[ToolHang], arm: Arm, frame: pin.SE3) -> float:
    """Return the cost of hanging the wrench on a frame that stands at a pose."""
    costs = [math.inf]
    for site in cell.grasps(TOOL):
        if cell.pose(TOOL).rotation @ site.approach @ UP > -0.8:
            continue
        for end in (1.0, -1.0):
            way = [pose * site.pose for pose in _way(cell, frame, end)]
            costs.append(arm.look_ahead(way).cost)
    return min(costs)
