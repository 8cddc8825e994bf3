"""Checks whether a task was done, by other means than the benchmark's own success.

They check geometry and what happens next in the simulation. `after_step` watches an
episode; `fault` is asked at the first success, returns what is wrong or None, and may
change the simulation.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import Any

import mujoco
import numpy as np

from wbc_suite.benchmark import (
    Door,
    Lift,
    NutAssembly,
    PickPlace,
    Stack,
    ToolHang,
    TwoArmHandover,
    TwoArmLift,
    TwoArmPegInHole,
    TwoArmTransport,
    Wipe,
)
from wbc_suite.benchmark.two_arm_handover import HAMMER
from wbc_suite.benchmark.two_arm_lift import POT
from wbc_suite.benchmark.two_arm_transport import GOALS
from wbc_suite.envs import RobotEnv
from wbc_suite.experts import ExpertScene
from wbc_suite.experts.skills import UP, shifted

SLACK = 0.01  # m, between where a thing must lie and where it does
SLOW = 0.05  # m/s, of things at rest
MORE = 6  # half seconds in which groceries may come to rest
RISE, RISES = 0.06, 14  # m, and actions, by which hands raise what they hold


class Check(ABC):
    """Watches an episode; `env` was reset."""

    def __init__(self, env: RobotEnv) -> None:
        self.env, self.benchmark = env, env.benchmark
        self.data, self.model = env.simulation.data, env.simulation.model
        self.cell: ExpertScene[Any] = ExpertScene(
            env, env.benchmark, np.random.default_rng()
        )

    def after_step(self) -> str | None:
        """Look at the state after an action; return what was feigned, or None."""
        return None

    @abstractmethod
    def fault(self) -> str | None:
        """Return why the task is not done, or None."""

    def wait(self, seconds: float, forces: dict[int, Any] | None = None) -> None:
        """Let physics go on without robots, with forces on bodies, N."""
        model, data = self.model, self.data
        names = [model.body(int(body)).name for body in model.geom_bodyid]
        robots = [k for k, name in enumerate(names) if name.startswith("robot")]
        kept = model.geom_contype.copy(), model.geom_conaffinity.copy()
        model.geom_contype[robots] = model.geom_conaffinity[robots] = 0
        data.xfrc_applied[:] = 0.0
        for body, force in (forces or {}).items():
            data.xfrc_applied[body, :3] = force
        data.ctrl[:] = 0.0
        for _ in range(round(seconds / model.opt.timestep)):
            mujoco.mj_step(model, data)
        model.geom_contype[:], model.geom_conaffinity[:] = kept
        data.xfrc_applied[:] = 0.0

    def moving(self, names: Iterable[str]) -> str | None:
        """Return what does not lie still."""
        for name in names:
            if self.cell.speed(name) > SLOW:
                return f"{name} does not lie still"
        return None

    def bottom(self, name: str) -> float:
        """Return the height of the lowest point of a thing, m."""
        state = self.cell.object(name)
        w, x, y, z = self.data.xquat[state.body].tolist()
        return state.position.item(2) - state.extent((w, x, y, z)).bottom

    def carried(self, name: str, arms: Iterable[int], height: float) -> str | None:
        """Raise hands that go on to close; return what is wrong with their hold."""
        moved = [self.cell.arms[k] for k in arms]
        thing, self.data.xfrc_applied[:] = self.cell.object(name), 0.0
        before = [self.cell.pose(name).actInv(arm.pose).translation for arm in moved]
        goals = [shifted(arm.pose, RISE * UP) for arm in moved]
        for _ in range(RISES):
            for arm, goal in zip(moved, goals, strict=True):
                arm.aim(goal, speed=0.25)
                arm.close()
            self.env.advance(self.cell.action())
        for arm, was in zip(moved, before, strict=True):
            now = self.cell.pose(name).actInv(arm.pose).translation
            if np.linalg.norm(now - was) > 0.03:
                return f"{name} does not come along with the hand"
        if thing.position[2] < height:
            return f"{name} is not in the air"
        return None


class LiftCheck(Check):
    """A hand must carry the cube."""

    def fault(self) -> str | None:
        """Raise the nearest hand."""
        table = self.benchmark.config.table.center[2]
        at = self.cell.object("cube").position
        far = [np.linalg.norm(arm.pose.translation - at) for arm in self.cell.arms]
        return self.carried("cube", [int(np.argmin(far))], table + 0.04)


class StackCheck(Check):
    """Without robots the small cube must lie on the large one."""

    def fault(self) -> str | None:
        """Wait, then measure the distance of the middles."""
        self.wait(1.0)
        config = self.benchmark.config
        a, b = (self.cell.object(name).position for name in ("cubeA", "cubeB"))
        x, y, z = (a - b).tolist()
        if abs(z - config.cube_a.half_size - config.cube_b.half_size) > 0.003:
            return "cubeA does not lie on cubeB"
        if math.hypot(x, y) > math.sqrt(2.0) * config.cube_b.half_size:
            return "cubeA is beside cubeB"
        return self.moving(["cubeA", "cubeB"])


class PickPlaceCheck(Check):
    """Without robots things must come to rest on the floor of their quadrants."""

    def fault(self) -> str | None:
        """Wait until things are at rest, then look where they lie.

        A carton on its edge starts to tip as slowly as one likes, so that no bound of
        its speed at a success keeps it from moving a second later; where it ends says
        whether it was brought to its place.
        """
        config, names = self.benchmark.config, self.benchmark.sorting.active
        self.wait(1.0)
        for _ in range(MORE):
            if self.moving(names) is None:
                break
            self.wait(0.5)
        length, width, _ = config.target.size
        for name in names:
            at, goal = self.cell.object(name).position, self.benchmark.goal(name)
            x, y = (at[:2] - goal).tolist()
            if abs(x) > length / 4 or abs(y) > width / 4:
                return f"{name} is not in its quadrant"
            if abs(self.bottom(name) - config.target.center[2]) > SLACK:
                return f"{name} is not on the floor of the bin"
        return self.moving(names)


class NutCheck(Check):
    """Without robots nuts cannot be pulled away from their pegs."""

    def fault(self) -> str | None:
        """Pull each nut to four sides."""
        self.wait(1.0)
        for name in self.benchmark.sorting.active:
            thing, goal = self.cell.object(name), self.benchmark.goal(name)
            for turn in range(4):
                angle = turn * math.pi / 2
                pull = 2.0 * np.array([math.cos(angle), math.sin(angle), 0.0])
                self.wait(0.15, {thing.body: pull})
                if np.linalg.norm(thing.position[:2] - goal) > 0.035:
                    return f"{name} can be pulled away from its peg"
        return None


class ToolHangCheck(Check):
    """Without robots the frame stands, and the wrench hangs although it is pushed."""

    def fault(self) -> str | None:
        """Wait, then push the wrench to both sides of the frame's arm."""
        self.wait(1.0)
        side = 0.3 * self.cell.object("frame").rotation[:, 1]
        for push in (side, -side):
            self.wait(0.2, {self.cell.object("tool").body: push})
        self.wait(1.0)
        tip, floor = self.cell.point("frame_tip"), self.cell.point("base_floor")
        if np.linalg.norm(tip - floor) > 0.055:
            return "the frame has left its socket"
        if self.bottom("tool") < self.benchmark.config.table.center[2] + 0.003:
            return "the wrench has fallen"
        return None


class TransportCheck(Check):
    """Without robots things must lie in their bins."""

    def fault(self) -> str | None:
        """Wait, then look where things lie."""
        self.wait(1.0)
        length, width, _ = self.benchmark.config.bin.size
        for name, where in GOALS.items():
            bin_ = self.cell.object(where).position
            x, y, _ = (self.cell.object(name).position - bin_).tolist()
            low = self.bottom(name) - bin_[2] - self.benchmark.config.bin.wall
            if max(abs(x) / length, abs(y) / width) > 0.5 or abs(low) > SLACK:
                return f"{name} does not lie in the {where}"
        return self.moving(GOALS)


class TwoArmLiftCheck(Check):
    """Both hands must carry the pot."""

    def fault(self) -> str | None:
        """Raise both hands."""
        half, table = self.benchmark.config.pot.half_size[2], self.benchmark.config
        found = self.carried(POT, (0, 1), table.table.center[2] + half + 0.1)
        level = self.cell.object(POT).rotation[2, 2] > math.cos(0.55)
        return found if found or level else "the pot is tilted"


class HandoverCheck(Check):
    """Arm 1 alone must carry what arm 0 alone has carried before."""

    def __init__(self, env: RobotEnv) -> None:
        super().__init__(env)
        self.given = self.taken = 0

    def after_step(self) -> str | None:
        """Note who touches the hammer in the air."""
        geoms = self.cell.object(HAMMER).geoms
        first, second = (
            any(
                (a in geoms and hand.owns(b)) or (b in geoms and hand.owns(a))
                for a, b in self.data.contact.geom.tolist()
            )
            for hand in self.benchmark.hands
        )
        over = self.cell.point(f"{HAMMER}_handle")[2]
        raised = over > self.benchmark.config.table.center[2] + 0.05
        self.given += raised and first and not second and not self.taken
        self.taken += raised and first and second

    def fault(self) -> str | None:
        """Raise the hand of arm 1."""
        if not self.given:
            return "arm 0 has not carried the hammer"
        table = self.benchmark.config.table.center[2]
        return self.carried(HAMMER, [1], table + 0.05)


class DoorCheck(Check):
    """The lever must have been turned before the door opened."""

    def __init__(self, env: RobotEnv) -> None:
        super().__init__(env)
        self.turned, self.forced = 0.0, False

    def after_step(self) -> str | None:
        """Note how far the lever was turned, and whether the door opened before."""
        self.turned = max(self.turned, self.data.joint("door_handle_joint").qpos.item())
        hinge = self.data.joint("door_panel_joint").qpos.item()
        self.forced |= hinge > 0.05 and self.turned < 1.0

    def fault(self) -> str | None:
        """Look at what was noted."""
        return "the latch was forced" if self.forced else None


class WipeCheck(Check):
    """Each mark must be wiped by a shape of the hand that lies on it."""

    def __init__(self, env: RobotEnv) -> None:
        super().__init__(env)
        self.before = self.benchmark.wiped.copy()
        self.table = self.model.geom("table").id

    def after_step(self) -> str | None:
        """Look for marks that were wiped beside all shapes that touch the table."""
        new, self.before = self.benchmark.wiped & ~self.before, self.benchmark.wiped
        if not new.any():
            return None
        if self.benchmark.force <= 0.0:
            return "a mark was wiped without force"
        left, gap = self.benchmark.marks[new], self.benchmark.config.margin + 0.001
        for hand in self.benchmark.hands:
            for geom in range(self.model.ngeom):
                if hand.owns(geom) and self._touches(geom):
                    left = left[~self._covered(geom, left, gap)]
        return f"{len(left)} marks were wiped beside the pad" if len(left) else None

    def _touches(self, geom: int) -> bool:
        pairs = self.data.contact.geom.tolist()
        return [geom, self.table] in pairs or [self.table, geom] in pairs

    def _covered(self, geom: int, points: np.ndarray, gap: float) -> np.ndarray:
        """Return which points lie under a shape's box."""
        R = self.data.geom_xmat[geom].reshape(3, 3)
        middle, half = self.model.geom_aabb[geom].reshape(2, 3)
        local = (points - self.data.geom_xpos[geom]) @ R - middle
        down = R.T @ UP
        # the point of the vertical line that is nearest to the box's middle plane
        k = int(np.argmax(np.abs(down)))
        local = local - np.outer(local[:, k] / down[k], down)
        others = [i for i in range(3) if i != k]
        return (np.abs(local[:, others]) <= half[others] + gap).all(axis=1)

    def fault(self) -> str | None:
        """All marks were judged as they were wiped."""
        return None


class PegCheck(Check):
    """The peg's tip must have come through the hole, and not through the plate."""

    def __init__(self, env: RobotEnv) -> None:
        super().__init__(env)
        self.tip, self.through = self._tip(), False

    def _tip(self) -> np.ndarray:
        """Return the tip in the axes of the plate, m."""
        peg, plate = self.cell.pose("peg"), self.cell.pose("plate")
        end = self.benchmark.config.peg.half_length
        return plate.actInv(peg).act(np.array([0.0, 0.0, end]))

    def after_step(self) -> str | None:
        """Note where the tip crosses the plane of the plate."""
        before, self.tip = self.tip, self._tip()
        if before[2] * self.tip[2] <= 0.0:
            share = before[2] / (before[2] - self.tip[2])
            at = before + share * (self.tip - before)
            hole = self.benchmark.config.plate.hole
            self.through = bool(np.abs(at[:2]).max() < hole)

    def fault(self) -> str | None:
        """Look at the way of the tip, and for overlaps."""
        if not self.through:
            return "the peg did not come through the hole"
        overlap = -min(self.data.contact.dist.tolist(), default=0.0)
        return "the peg is inside the plate" if overlap > 0.005 else None


CHECKS: dict[type, type[Check]] = {
    Door: DoorCheck,
    Lift: LiftCheck,
    NutAssembly: NutCheck,
    PickPlace: PickPlaceCheck,
    Stack: StackCheck,
    ToolHang: ToolHangCheck,
    TwoArmHandover: HandoverCheck,
    TwoArmLift: TwoArmLiftCheck,
    TwoArmPegInHole: PegCheck,
    TwoArmTransport: TransportCheck,
    Wipe: WipeCheck,
}
