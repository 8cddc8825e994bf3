"""Read equalities and tendons of a compiled MuJoCo model as fields of a description."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import mujoco
import numpy as np

from wbc_suite.robot.poses import pose_at
from wbc_suite.typing import Vector

EQ, WRAP, OBJ = mujoco.mjtEq, mujoco.mjtWrap, mujoco.mjtObj
LISTED = {EQ.mjEQ_CONNECT: 0, EQ.mjEQ_WELD: 3}
"""Equalities of two bodies, and where the position begins in their data."""


def zero_of(m: mujoco.MjModel, j: int) -> float:
    """Return the joint value at which the body poses are defined (`ref`)."""
    return float(m.qpos0[m.jnt_qposadr[j]])


def read_followers(m: mujoco.MjModel) -> Iterator[tuple[int, tuple[int, float, float]]]:
    """Yield joint, leader, ratio, offset: q - q0 = c0 + c1 (p - p0)."""
    for e in range(m.neq):
        if _is_linear(m, e) and m.eq_active0[e]:
            own, leader = int(m.eq_obj1id[e]), int(m.eq_obj2id[e])
            shift, ratio = (float(c) for c in m.eq_data[e, :2])
            offset = shift + zero_of(m, own) - ratio * zero_of(m, leader)
            yield own, (leader, ratio, offset)


def _is_linear(m: mujoco.MjModel, e: int) -> bool:
    linear = m.eq_type[e] == EQ.mjEQ_JOINT and not m.eq_data[e, 2:5].any()
    return bool(linear and m.eq_obj2id[e] >= 0)


def read_connects(
    m: mujoco.MjModel, bodies: Mapping[int, str], offsets: Mapping[int, Vector]
) -> Iterator[dict[str, Any]]:
    """Yield the connects and welds of bodies, whose links have their origin moved."""
    for e in range(m.neq):
        first, second = int(m.eq_obj1id[e]), int(m.eq_obj2id[e])
        of_bodies = m.eq_objtype[e] == OBJ.mjOBJ_BODY and int(m.eq_type[e]) in LISTED
        if not of_bodies or not {first, second} <= bodies.keys():
            continue
        names = {"link": bodies[first], "other": bodies[second]}
        if m.eq_type[e] == EQ.mjEQ_CONNECT:
            yield names | {"anchor": (m.eq_data[e, :3] + offsets[first]).tolist()}
        else:
            quat = m.eq_data[e, 6:10]
            pose = pose_at(m.eq_data[e, 3:6], quat)
            place = pose.act(-offsets[second]) + offsets[first]
            yield names | {"anchor": place.tolist(), "quat": quat.tolist()}


def read_tendons(
    m: mujoco.MjModel,
    joints: Mapping[int, str],
    sites: Mapping[int, str],
    name: Callable[[str], str],
) -> Iterator[dict[str, Any]]:
    """Yield the tendons over joints or sites; `name` gives unique names."""
    held = {
        int(m.eq_obj1id[e]): float(m.eq_data[e, 0])
        for e in range(m.neq)
        if _holds_tendon(m, e) and m.eq_active0[e]
    }
    for t in range(m.ntendon):
        path = _path(m, t, joints, sites)
        if path is None:
            continue
        fields: dict[str, Any] = {
            "name": name(m.tendon(t).name or f"tendon{t}"),
            "path": path,
            "stiffness": float(np.ravel(m.tendon_stiffness[t])[0]),
            "damping": float(np.ravel(m.tendon_damping[t])[0]),
            "frictionloss": float(m.tendon_frictionloss[t]),
        }
        if m.tendon_limited[t]:
            fields["range"] = m.tendon_range[t].tolist()
        if fields["stiffness"] > 0.0:
            fields["springlength"] = m.tendon_lengthspring[t].tolist()
        if t in held:
            fields["held"] = held[t]
        yield fields


def _holds_tendon(m: mujoco.MjModel, e: int) -> bool:
    return bool(m.eq_type[e] == EQ.mjEQ_TENDON and m.eq_obj2id[e] < 0)


def _path(
    m: mujoco.MjModel, t: int, joints: Mapping[int, str], sites: Mapping[int, str]
) -> list[dict[str, Any]] | None:
    """Return the steps of a tendon; None if it is wrapped or leaves the robot."""
    start, count = int(m.tendon_adr[t]), int(m.tendon_num[t])
    steps: list[dict[str, Any]] = []
    for w in range(start, start + count):
        kind, item = m.wrap_type[w], int(m.wrap_objid[w])
        if kind == WRAP.mjWRAP_JOINT and item in joints:
            steps.append({"joint": joints[item], "coef": float(m.wrap_prm[w])})
        elif kind == WRAP.mjWRAP_SITE and item in sites:
            steps.append({"frame": sites[item]})
        else:
            return None
    return steps


def not_represented(
    m: mujoco.MjModel, joints: Mapping[int, str], sites: Mapping[int, str]
) -> Iterator[str]:
    """Yield what changes the dynamics and is left out."""
    if m.nflex:
        yield "flexible parts (flex)"
    yield from _joint_faults(m)
    for t in range(m.ntendon):
        if _path(m, t, joints, sites) is None:
            yield f"tendon '{m.tendon(t).name or t}', which wraps or leaves the robot"
    for e in range(m.neq):
        name = f"equality '{m.equality(e).name or e}'"
        if m.eq_type[e] == EQ.mjEQ_JOINT and not _is_linear(m, e):
            yield f"{name}, which is not linear in another joint"
        elif m.eq_type[e] == EQ.mjEQ_TENDON and not _holds_tendon(m, e):
            yield f"{name}, which couples two tendons"
        elif int(m.eq_type[e]) in LISTED and m.eq_objtype[e] != OBJ.mjOBJ_BODY:
            yield f"{name}, which is between sites"


def _joint_faults(m: mujoco.MjModel) -> Iterator[str]:
    for j in range(m.njnt):
        if np.ravel(m.jnt_stiffness[j])[1:].any():
            yield f"the nonlinear part of the spring of joint '{m.joint(j).name or j}'"
        if np.ravel(m.dof_damping[m.jnt_dofadr[j]])[0] < 0.0:
            yield f"the negative damping of joint '{m.joint(j).name or j}'"
