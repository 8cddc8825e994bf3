"""Contact forces that keep a robot with a free root on its feet under other laws."""

from collections.abc import Sequence

import mujoco
import numpy as np

from wbc_suite.control.contact.arrays import (
    Foot,
    Limits,
    QpStage,
    Tracked,
    WholeBodyDynamics,
    make_dynamics,
    memory_of,
    still_motion,
)
from wbc_suite.control.contact.qp_fallback import QpFallback
from wbc_suite.control.contact.state_source import StateSourceConfig
from wbc_suite.control.ground.records import LawKind
from wbc_suite.control.law.law import Law
from wbc_suite.control.memory import Parts
from wbc_suite.control.state import RobotState
from wbc_suite.locomotion.gait import TrotConfig, make_gait
from wbc_suite.qp.solution import Fallback
from wbc_suite.typing import Records

FRICTION = 0.6
"""Coefficient; below that of rubber on most floors, 0.8 to 1."""

COM_STIFFNESS, TRUNK_STIFFNESS = 60.0, 150.0
"""1/s^2, on soles; well above g / h = 12 of the inverted pendulum."""

POSITION_WEIGHT, TRUNK_WEIGHT = 10.0, 2.0
"""Weights of the accelerations of centre of mass or root, and of the attitude."""

ARM_WEIGHT, LEG_WEIGHT = 0.3, 0.02
"""Weights of the joints' accelerations: legs follow from feet and root."""


class Standing:
    """Keeps feet at rest and tracks root and centre of mass by the QP of WHOLE_BODY_ID.

    The other laws of the robot ask for accelerations of joints. The QP finds contact
    forces and accelerations near to them, within friction, soles and torque limits; the
    loop turns them into torques. Robots on soles track the centre of mass and give up
    the attitude first; robots on points track the pose of their root.

    Args:
        state: The robot in the simulation.
        joints: All joints with a motor that follows accelerations.
        feet: Feet on the ground.
        stiffness: Of a root on points, 1/s^2.
        motion: The motion to track; None stays where the robot is at a reset.

    Attributes:
        dynamics: What the law reads and writes.
        sensors: The state of the robot comes from the simulation.
        fallback: What the last QP took whose active set was not found.
    """

    def __init__(
        self,
        state: RobotState,
        joints: Sequence[str],
        *,
        feet: Sequence[Foot],
        stiffness: float,
        motion: Tracked | None = None,
    ) -> None:
        self.sensors, self.fallback = StateSourceConfig(), Fallback.NONE
        self._stays = motion is None
        on_soles = all(foot.sole is not None for foot in feet)
        self.dynamics = _make_dynamics(state, joints, feet, motion)
        own = self.dynamics.state
        own["tracks"] = 1
        if on_soles:
            own["stiffness"] = COM_STIFFNESS, TRUNK_STIFFNESS
            own["com_weight"], own["root_weight"] = POSITION_WEIGHT, (0.0, TRUNK_WEIGHT)
        else:
            own["stiffness"] = stiffness
            own["root_weight"] = POSITION_WEIGHT, TRUNK_WEIGHT
        self._qp = QpFallback(self.dynamics.qp)

    @property
    def memory(self) -> Parts:
        """What outlives a tick; views."""
        motion = self.dynamics.tracked
        own = motion.start, motion.joints, motion.since
        return *memory_of(self.dynamics), *(own if self._stays else ())

    def reset(self, state: RobotState) -> None:
        """Forget the last step; stay where the robot is, if there is no motion."""
        own, qpos, qvel = self.dynamics, state.data.qpos, state.data.qvel
        own.state["ticks"] = own.state["unsolved"] = own.state["stage"] = 0
        own.state["fell"], own.qp.side[:], own.terms.a[:] = -1.0, 0, 0.0
        own.last_velocity[:] = qvel[own.dofs]
        if self._stays:
            own.tracked.start[:7] = state.q[:7]
            own.tracked.joints[0] = qpos[own.qpos]
            own.tracked.since[:] = 0.0

    def finish_tick(self) -> None:
        """Solve the QP if the loop has stated it and not found its active set."""
        record = self.dynamics.state[0]
        if record["stage"] == QpStage.UNSOLVED:
            self.fallback = self._qp.solve(self.dynamics.qp)
            record["stage"] = QpStage.SOLVED


def _make_dynamics(
    state: RobotState,
    joints: Sequence[str],
    feet: Sequence[Foot],
    motion: Tracked | None,
) -> WholeBodyDynamics:
    """Return the arrays of a robot without hands and steps."""
    model, n = state.model, len(joints)
    drives = Law(LawKind.DYNAMICS, state, joints).drives
    links = [int(model.site_bodyid[foot.site]) for foot in feet]
    legs = set[int]().union(*(chain(model, link) for link in links))
    is_leg = np.array([dof in legs for dof in drives["dof"]])
    root, none = model.joint(f"{state.prefix}root"), np.zeros(0, dtype=np.int64)
    first = int(root.dofadr[0])
    dynamics = make_dynamics(
        feet=feet,
        gait=make_gait(TrotConfig(), np.zeros((len(feet), 4))),
        qpos=drives["qpos"],
        dofs=np.concatenate([np.arange(first, first + 6), drives["dof"]]),
        nv=model.nv,
        hands=none,
        is_arm=np.zeros((0, n), dtype=np.int64),
        hand_weight=np.zeros((0, 2)),
        goal=np.zeros((0, 12)),
        upright=none,
        upright_weight=np.zeros(0),
        posture_weight=np.where(is_leg, LEG_WEIGHT, ARM_WEIGHT),
        follows=np.ones(n, dtype=np.int64),
        limits=limits_of(drives),
        tracked=motion or still_motion(np.zeros(7), np.zeros(n)),
    )
    own = dynamics.state
    own["root_qpos"], own["root_dof"] = root.qposadr[0], first
    own["body"], own["dt"] = root.bodyid[0], model.opt.timestep
    own["friction"], own["trust"] = FRICTION, 1.0
    return dynamics


def limits_of(drives: Records) -> Limits:
    """Return the limits of driven joints."""
    return Limits(
        low=drives["position_min"],
        high=drives["position_max"],
        velocity=drives["velocity_max"],
        torque_low=drives["command_min"],
        torque_high=drives["command_max"],
    )


def make_foot(
    state: RobotState,
    frame: str,
    sole: tuple[float, float, float, float] | None = None,
    *,
    height: float = 0.0,
    radius: float = 0.0,
    rolls: bool = False,
) -> Foot:
    """Return a foot in the simulation.

    Args:
        state: The robot.
        frame: Frame of the foot.
        sole: Heel, toes, right, left in its axes, m; None for a ball.
        height: Of the frame over the sole, m.
        radius: Of the ball, m.
        rolls: Whether a sole may turn about its x axis.
    """
    site = int(state.model.site(state.prefix + frame).id)
    if sole is None:
        return Foot(site=site, middle=np.array([0.0, 0.0, -radius]))
    heel, toes, right, left = sole
    x, y = 0.5 * (heel + toes), 0.5 * (right + left)
    edges = (heel - x, toes - x, right - y, left - y)
    middle = np.array([x, y, -height])
    return Foot(site=site, middle=middle, sole=edges, rolls=rolls)


def chain(model: mujoco.MjModel, link: int) -> set[int]:
    """Return the degrees of freedom that move a body."""
    dofs: set[int] = set()
    while link > 0:
        first = int(model.body_dofadr[link])
        dofs.update(range(first, first + int(model.body_dofnum[link])))
        link = int(model.body_parentid[link])
    return dofs
