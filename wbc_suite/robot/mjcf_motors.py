"""Carry compiled MuJoCo actuators into efforts and our actuators."""

import logging
from typing import Any

import mujoco
import numpy as np

__all__ = ["read_motors"]

LOG = logging.getLogger(__name__)


def read_motors(
    m: mujoco.MjModel, joints: dict[int, str]
) -> tuple[dict[int, float], list[dict[str, Any]]]:
    """Return the largest effort by joint id, and the fields of special actuators.

    With gain g, bias b0 + b1 l + b2 dl/dt and gear r, the effort at a joint q = l / r
    is r (g u + b0 + b1 r q + b2 r dq/dt): a servo of stiffness -b1 r^2 and damping
    -b2 r^2, or a motor when b1 = b2 = 0.
    """
    efforts: dict[int, float] = {}
    others: list[dict[str, Any]] = []
    driven = {int(j) for j in m.actuator_trnid[:, 0]}
    for a in range(m.nactuator):
        joint = int(m.actuator_trnid[a, 0])
        name = m.actuator(a).name or f"number {a}"
        if m.actuator_trntype[a] != mujoco.mjtTrn.mjTRN_JOINT or joint not in joints:
            LOG.warning("The actuator '%s' drives no single joint; left out.", name)
            continue
        if joint not in driven:
            LOG.warning("The actuator '%s' is a second one; left out.", name)
            continue
        driven.remove(joint)
        effort = _effort(m, a)
        if effort is not None:
            efforts[joint] = effort
        fields = _kind(m, a)
        if fields["kind"] != "motor" or effort is None:
            others.append({"joint": joints[joint], **fields})
    return efforts, others


def _effort(m: mujoco.MjModel, a: int) -> float | None:
    """Return the largest effort at the joint: the force limit, or that of a motor."""
    gear = abs(float(m.actuator_gear[a, 0]))
    joint = int(m.actuator_trnid[a, 0])
    bounds: list[float] = []
    if m.actuator_forcelimited[a]:
        bounds.append(gear * float(np.abs(m.actuator_forcerange[a]).max()))
    control = int(m.actuator_ctrladr[a])
    if m.actuator_ctrllimited[control] and _kind(m, a)["kind"] == "motor":
        gain = abs(float(m.actuator_gainprm[a, 0]))
        bounds.append(gear * gain * float(np.abs(m.actuator_ctrlrange[control]).max()))
    if m.jnt_actfrclimited[joint]:
        bounds.append(float(np.abs(m.jnt_actfrcrange[joint]).max()))
    return min(bounds, default=None)


def _kind(m: mujoco.MjModel, a: int) -> dict[str, Any]:
    gear = float(m.actuator_gear[a, 0])
    _, stiffness, damping = (float(b) for b in m.actuator_biasprm[a, :3])
    if m.actuator_biastype[a] != mujoco.mjtBias.mjBIAS_AFFINE:
        return {"kind": "motor"}
    kd = max(0.0, -damping * gear**2)
    if stiffness < 0.0:
        return {"kind": "position", "kp": -stiffness * gear**2, "kd": kd}
    return {"kind": "velocity", "kd": kd}
