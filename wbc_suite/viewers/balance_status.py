"""State of a robot that walks, as the teleoperation page displays it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from wbc_suite.locomotion.gait import GRAVITY
from wbc_suite.typing import Matrix, Vector

LOWEST = 0.1  # m; least height of a centre of mass that a capture point is given for


@dataclass(frozen=True, slots=True, kw_only=True)
class FootStatus:
    """A foot of a robot that walks; world axes.

    Attributes:
        name: Name of its frame.
        position: Middle of its contact, m, shape (3,).
        yaw: Its heading, rad.
        sole: Edges of its sole about the middle: heel, toes, right, left, m; zero for
            a ball.
        stands: Whether it carries weight.
    """

    name: str
    position: Vector
    yaw: float
    sole: Vector
    stands: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class BalanceStatus:
    """Feet, capture point, next footstep and contact forces; world axes.

    Attributes:
        feet: The feet.
        capture_point: Where the robot would step to stop, on the ground, m, (3,).
        margin: Distance of the capture point from the edge of what the robot stands on,
            positive inside, m.
        footstep: Where the next foot lands, m, shape (3,); None while it stands.
        forces: Resultant contact force on each link, N, shape (n, 3).
        points: Where they act, m, shape (n, 3).
        weight: Weight of the robot, N.
    """

    feet: tuple[FootStatus, ...]
    capture_point: Vector
    margin: float
    footstep: Vector | None
    forces: Matrix
    points: Matrix
    weight: float


class BalanceReader:
    """Reads the balance of a robot that walks, while a client displays it.

    Attributes:
        walks: Whether the controller reports balance, as WHOLE_BODY_ID does.
        report: What it reported last, `info["balance"]`; empty before.
        fell: When and why the robot fell, as first reported; empty while it has not.
    """

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, controller: Any
    ) -> None:
        self._model, self._data = model, data
        self._controller, self._clients = controller, set[int]()
        config = getattr(controller, "config", None)
        self.walks = bool(getattr(config, "feet", ()))
        self.report: Mapping[str, Any] = {}
        self.fell = ""

    def take(self, report: Mapping[str, Any]) -> None:
        """Take the report of a step; an empty one after a reset."""
        self.report = report
        fell = report.get("fell") if report else None
        self.fell = (self.fell or str(fell or "")) if report else ""

    def watch(self, client: int, watched: bool) -> None:
        """Note whether a client displays the balance."""
        (self._clients.add if watched else self._clients.discard)(client)

    def status(self) -> BalanceStatus | None:
        """Return the balance; None if no client displays it, or none was reported."""
        if not (self._clients and self.report):
            return None
        own, report = self._controller.dynamics, self.report
        measured, state = own.measured, own.gait.state[0]
        com, ground = measured.com, float(state["ground"])
        omega = np.sqrt(GRAVITY / max(com[2] - ground, LOWEST))
        capture_point = (com + measured.com_velocity / omega)[:2]
        root = int(self._model.body_rootid[int(own.state["body"][0])])
        points, forces = contact_forces(self._model, self._data, root)
        return BalanceStatus(
            feet=self._feet(),
            capture_point=np.append(capture_point, ground),
            margin=float(report["margin"]),
            footstep=(
                np.append(report["footstep"], ground) if report["walking"] else None
            ),
            points=points,
            forces=forces,
            weight=float(self._model.body_subtreemass[root]) * GRAVITY,
        )

    def _feet(self) -> tuple[FootStatus, ...]:
        measured = self._controller.dynamics.measured
        return tuple(
            FootStatus(
                name=foot.frame,
                position=measured.foot[k].copy(),
                yaw=float(measured.foot_yaw[k]),
                sole=self._controller.dynamics.gait.sole[k].copy(),
                stands=foot.frame in self.report["stance"],
            )
            for k, foot in enumerate(self._controller.config.feet)
        )


def contact_forces(
    model: mujoco.MjModel, data: mujoco.MjData, root: int
) -> tuple[Matrix, Matrix]:
    """Return the resultant contact force on each link of a robot.

    Contacts of the robot with itself are left out. A resultant acts at the mean of its
    contact points, weighted by their normal forces.

    Args:
        model: The model.
        data: Its state after a step.
        root: The robot's root body.

    Returns:
        Points, m, and forces, N, in the world, shape (n, 3) each.
    """
    total: dict[int, Vector] = {}  # force, normal force times point, normal force
    wrench = np.zeros(6)
    for k in range(data.ncon):
        contact = data.contact[k]
        bodies = [int(model.geom_bodyid[geom]) for geom in contact.geom]
        own = [int(model.body_rootid[body]) == root for body in bodies]
        if own[0] == own[1]:
            continue
        mujoco.mj_contactForce(model, data, k, wrench)
        sign = 1.0 if own[1] else -1.0  # it acts on the second geom
        force = sign * contact.frame.reshape(3, 3).T @ wrench[:3]
        normal = float(wrench[0])
        sums = total.setdefault(bodies[int(own[1])], np.zeros(7))
        sums += np.concatenate([force, normal * contact.pos, [normal]])
    pressed = [sums for sums in total.values() if sums[6] > 0.0]
    rows = np.array(pressed).reshape(-1, 7)
    return rows[:, 3:6] / rows[:, 6:], rows[:, :3]
