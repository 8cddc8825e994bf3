"""Reports of a robot on its feet: its balance, its falls, and its hands."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from typing import Any, Literal

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.control.contact.arrays import WholeBodyDynamics
from wbc_suite.control.contact.qp_rows import SUPPORT_MARGINS
from wbc_suite.control.ik.report import contacts_of
from wbc_suite.control.law.law import Law
from wbc_suite.control.reasons import InMotion, LazyReasons, Reason
from wbc_suite.control.state import RobotState
from wbc_suite.control.walking.config import WholeBodyIDConfig
from wbc_suite.qp import ActiveLimit, LimitKind, OutOfReach
from wbc_suite.typing import Indices, Vector

STANDSTILL = 0.05
"""m/s or rad/s; a hand slower than that stands."""

AT_LIMIT = 0.02
"""rad or m; a joint so near to a limit of its position is at it."""

AT_TORQUE = 0.995
"""Part of a motor's torque from which it is at its limit."""


SUPPORT = ActiveLimit(LimitKind.BALANCE, "edge of support", "lower", False, "m", 0.0)
"""The capture point is near the edge of the feet."""


class FallCause(StrEnum):
    """What told a fall."""

    TILT = "tilt"
    HEIGHT = "height"


@dataclass(frozen=True, slots=True)
class Fall:
    """A fall: when, and how the trunk was when it was noticed.

    Attributes:
        time: Time since the reset, s.
        cause: What told it.
        tilt: Tilt of the trunk, rad.
        drop: Height that the trunk had lost, m.
    """

    time: float
    cause: FallCause
    tilt: float
    drop: float

    def __str__(self) -> str:
        """Return a sentence."""
        if self.cause is FallCause.TILT:
            found = f"its trunk was tilted by {np.degrees(self.tilt):.0f} degrees"
        else:
            found = f"its trunk was {self.drop:.2f} m too low"
        return f"It fell {self.time:.2f} s after the reset: {found}."


def fall_of(dynamics: WholeBodyDynamics) -> Fall | None:
    """Return the first fall since the reset."""
    state = dynamics.state[0]
    if state["fell"] < 0.0:
        return None
    cause = FallCause.TILT if state["fell_by_tilt"] else FallCause.HEIGHT
    return Fall(float(state["fell"]), cause, float(state["tilt"]), float(state["drop"]))


class BalanceReport:
    """Reads balance and hands out of the law and the simulation.

    Args:
        config: Names of feet and hands.
        dynamics: What the law reads and writes.
        law: The law.
        moves: Which joints move each hand, shape (hands, joints).
        links: Body of each foot.
    """

    def __init__(
        self,
        config: WholeBodyIDConfig,
        dynamics: WholeBodyDynamics,
        *,
        law: Law,
        moves: Indices,
        links: Sequence[int],
    ) -> None:
        self._config, self._dynamics = config, dynamics
        self._law, self._moves, self._links = law, moves, links

    def info(self, state: RobotState) -> dict[str, Any]:
        """Return `{"balance": ..., "ik": ...}`; no balance without feet."""
        own, hands = self._dynamics, self._hands(state)
        reached = all(hand["reached"] for hand in hands.values())
        ik = {"reached": reached, "frames": hands}
        if not self._config.feet:
            return {"ik": ik}
        feet = [foot.frame for foot in self._config.feet]
        names = [frame.name for frame in self._config.frames]
        loads = dict(zip(names, own.load[:, :3].copy(), strict=True))
        loads |= dict(zip(feet, self._contact_forces(state), strict=True))
        stance = zip(feet, own.plan.load, strict=True)
        balance = {
            "stance": [foot for foot, load in stance if load > 0.0],
            "margin": float(own.plan.margin[0]),
            "loads": loads,
            "footstep": own.plan.footstep.copy(),
            "walking": bool(own.gait.state["mode"][0]),
            "unsolved": int(own.state["unsolved"][0]),
            "fell": fall_of(own),
        }
        return {"balance": balance, "ik": ik}

    def _contact_forces(self, state: RobotState) -> list[Vector]:
        """Return the force of contacts on each foot, world axes, N, shape (3,)."""
        forces: list[Vector] = [np.zeros(3) for _ in self._links]
        wrench, data, model = np.zeros(6), state.data, state.model
        for i in range(data.ncon):
            contact = data.contact[i]
            for side, geom in enumerate(contact.geom):
                link = int(model.geom_bodyid[geom])
                if link in self._links:
                    mujoco.mj_contactForce(model, data, i, wrench)
                    force = contact.frame.reshape(3, 3).T @ wrench[:3]
                    sign = 1.0 if side == 1 else -1.0  # forces act on the second
                    forces[self._links.index(link)] += sign * force
        return forces

    def _hands(self, state: RobotState) -> dict[str, dict[str, Any]]:
        """Return `reached`, errors and reasons of each hand."""
        reports, (linear, angular) = {}, self._config.tolerance
        for k, frame in enumerate(self._config.frames):
            goal, site = self.hand_goal(k), int(self._dynamics.hand[k])
            R = state.data.site_xmat[site].reshape(3, 3)
            position = float(
                np.linalg.norm(goal.translation - state.data.site_xpos[site])
            )
            angle = float(np.linalg.norm(pin.log3(goal.rotation @ R.T)))
            reached = position <= linear and angle <= angular
            reports[frame.name] = {
                "reached": reached,
                "position_error": position,
                "orientation_error": angle,
                "reasons": [] if reached else LazyReasons(self._reasons(k, state)),
            }
        return reports

    def hand_goal(self, k: int) -> pin.SE3:
        """Return the goal of a hand in the world."""
        own = self._dynamics
        given = own.goal[k].reshape(3, 4)
        goal = pin.SE3(given[:, :3].copy(), given[:, 3].copy())
        if self._config.input_ref_frame != "base":
            return goal
        gait, com = own.gait.state[0], own.terms.com
        origin = np.array([*com[:2], gait["ground"] + gait["height"]])
        return pin.SE3(pin.utils.rotate("z", float(gait["yaw"])), origin) * goal

    def _reasons(self, k: int, state: RobotState) -> partial[list[Reason]]:
        """Return a function that gives the reasons of this moment, now or later."""
        own, data = self._dynamics, state.data
        qpos, tau = data.qpos[own.qpos].copy(), data.ctrl[self._law.drives["ctrl"]]
        site, twist = int(own.hand[k]), np.zeros(6)
        mujoco.mj_objectVelocity(
            state.model, data, mujoco.mjtObj.mjOBJ_SITE, site, twist, 0
        )
        moving = own.travel[k, 0] < own.travel[k, 1] or bool(
            np.abs(twist).max() > STANDSTILL
        )
        feet = [
            state.model.body(i).name.removeprefix(state.prefix) for i in self._links
        ]
        found: list[Reason] = [*contacts_of(state, except_links=feet)]
        if own.plan.margin[0] < SUPPORT_MARGINS[0]:
            found.append(SUPPORT)
        return partial(self._explain, k, qpos, tau, moving, found)

    def _explain(
        self, k: int, qpos: Vector, tau: Vector, moving: bool, found: list[Reason]
    ) -> list[Reason]:
        low, high, _, least, most = self._dynamics.limits
        found = [*found]
        for j in map(int, np.flatnonzero(self._moves[k])):
            if tau[j] >= AT_TORQUE * most[j] or tau[j] <= AT_TORQUE * least[j]:
                found.append(self._limit(j, LimitKind.EFFORT, tau[j] > 0.0))
        for j in map(int, np.flatnonzero(self._moves[k])):
            if qpos[j] > high[j] - AT_LIMIT or qpos[j] < low[j] + AT_LIMIT:
                upper = qpos[j] > 0.5 * (low[j] + high[j])
                found.append(self._limit(j, LimitKind.POSITION, bool(upper)))
        if moving:
            return [*found, InMotion()]
        return found or [OutOfReach()]

    def _limit(self, j: int, kind: LimitKind, is_upper: bool) -> ActiveLimit:
        side: Literal["lower", "upper"] = "upper" if is_upper else "lower"
        unit = "N m" if kind is LimitKind.EFFORT else "rad"
        return ActiveLimit(kind, self._law.joints[j], side, True, unit, 0.0)
