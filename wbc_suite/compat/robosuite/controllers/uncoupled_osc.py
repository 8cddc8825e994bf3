"""robosuite's law in operational space: position and orientation apart.

With F and T the accelerations that the errors of position and orientation ask for, and
Lp, Lo, L the inertias at the site for linear motion, for rotation and for both,

    tau = J^T [Lp F; Lo T] + N^T M a0 + h,     N = I - M^-1 J^T L J.

Each motion has the inertia of the hand that is free in the other one, so that they
disturb each other: 0.05 m sideways turn a Panda's hand by some degrees. Without
`uncouple_pos_ori` the wrench is L [F; T]. Neither makes up for `J' v` or for passive
forces of the joints.
"""

from typing import Any, Literal

import numpy as np

from wbc_suite.compat.robosuite.controllers.variable_impedance import (
    GainsFirstController,
)
from wbc_suite.compiling import compiled, inner
from wbc_suite.control.ground.physics import Physics
from wbc_suite.control.ground.records import Drives, LawRecord
from wbc_suite.control.ground.rigid_body import point_velocity_and_drift
from wbc_suite.control.law.law import law_kind, register_law
from wbc_suite.control.law.osc import OscLaw, write_hand_task
from wbc_suite.control.part.impedance import Gains
from wbc_suite.control.part.osc_controller import OscConfig, OscController
from wbc_suite.control.part.registry import register_part_controller
from wbc_suite.linear_algebra import cholesky, dot, solve_lower, solve_upper

UNCOUPLED = {"OSC_POSE": "UNCOUPLED_OSC_POSE", "OSC_POSITION": "UNCOUPLED_OSC_POSITION"}
"""Types of this law for those of robosuite's configs."""

TINY = 1e-12
"""Least independent mobility, relative to the largest; see `cholesky`."""


@compiled
def uncoupled_osc_law(physics: Physics, law: LawRecord, drives: Drives) -> None:
    """Write the joint accelerations of the law with `uncouple_pos_ori`."""
    _write_accelerations(physics, law, drives, 3)


@compiled
def coupled_osc_law(physics: Physics, law: LawRecord, drives: Drives) -> None:
    """Write the joint accelerations of the law without `uncouple_pos_ori`."""
    _write_accelerations(physics, law, drives, 6)


@inner
def _write_accelerations(
    physics: Physics, law: LawRecord, drives: Drives, size: int
) -> None:
    """Write the joint accelerations M^-1 (tau - h); blocks of the wrench have a size.

    With `M = C C^T` and `Y = J C^-T` they are `a0 + C^-T Y^T (w - L J a0)`, where w is
    `[Lp F; Lo T]` and L the inverse of `Y Y^T`, as Lp and Lo are of its blocks.
    """
    n, work = law.last - law.first, physics.osc
    J, C, posture, z = work.J, work.C, work.posture, work.z
    write_hand_task(physics, law, drives)
    body, p = int(physics.site_bodyid[law.site]), physics.site_xpos[law.site]
    drift = np.empty(6)
    point_velocity_and_drift(physics, body, p, work.column, drift)
    for i in range(6):
        work.wanted[i] += drift[i]
    null = np.empty(6)
    for i in range(6):
        null[i] = dot(J[i], posture, n)
        solve_lower(C, J[i], n)
    wrench = np.empty(6)
    for first in range(0, 6, size):
        _times_inertia(J, n, first, size, work.wanted[first:], wrench[first:])
    pull = np.empty(6)
    _times_inertia(J, n, 0, 6, null, pull)
    passive = np.empty(n)
    for j in range(n):
        z[j] = 0.0
        for i in range(6):
            z[j] += J[i, j] * (wrench[i] - pull[i])
        passive[j] = physics.qfrc_passive[work.dofs[j]]
    solve_lower(C, passive, n)
    for j in range(n):
        z[j] += passive[j]  # the loop cancels passive forces; robosuite does not
    solve_upper(C, z, n)
    for j in range(n):
        physics.acceleration[work.dofs[j]] = posture[j] + z[j]


@inner
def _times_inertia(
    Y: Any, n: int, first: int, size: int, given: Any, result: Any
) -> None:
    """Write `(Y Y^T)^-1 given` for some rows of Y."""
    mobility = np.empty((size, size))
    for i in range(size):
        result[i] = given[i]
        for k in range(size):
            mobility[i, k] = dot(Y[first + i], Y[first + k], n)
    cholesky(mobility, size, TINY)
    solve_lower(mobility, result, size)
    solve_upper(mobility, result, size)


class UncoupledOscConfig(OscConfig):
    """Config of the law; joints' torques are clipped one by one, as robosuite does."""

    type: Literal["UNCOUPLED_OSC_POSE", "UNCOUPLED_OSC_POSITION"] = "UNCOUPLED_OSC_POSE"  # pyright: ignore[reportIncompatibleVariableOverride] - types of its own
    saturation: Literal["clip", "qp"] = "clip"
    uncouple_pos_ori: bool = True
    damping_ratio_limits: tuple[Gains, Gains] = (0.0, 100.0)

    @property
    def size(self) -> int:
        """How many values of the action move the goal."""
        return 6 if self.type == "UNCOUPLED_OSC_POSE" else 3


class UncoupledOscController(GainsFirstController, OscController):
    """`OscController` with the uncoupled law and robosuite's order of the action."""

    def _make_law(self, joints: tuple[str, ...], site: str) -> OscLaw:
        law = super()._make_law(joints, site)
        uncoupled = getattr(self.config, "uncouple_pos_ori", True)
        law.record["kind"] = law_kind("UNCOUPLED_OSC" if uncoupled else "COUPLED_OSC")
        law.record["keep_direction"] = 0.0
        drives = law.drives
        drives["position_min"], drives["position_max"] = -np.inf, np.inf
        drives["velocity_max"] = np.inf
        return law


register_law("UNCOUPLED_OSC", uncoupled_osc_law)
register_law("COUPLED_OSC", coupled_osc_law)
for _name in UNCOUPLED.values():
    register_part_controller(_name, UncoupledOscController, UncoupledOscConfig)
