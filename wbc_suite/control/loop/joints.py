"""Compiled laws of joints, and of bases that drive."""

import numpy as np

from wbc_suite.compiling import compiled_inner, inlined
from wbc_suite.control.loop.motion import target_of
from wbc_suite.control.loop.physics import Physics
from wbc_suite.control.loop.table import CompiledRecords

__all__ = ["base_law", "joint_law", "velocity_law"]


@inlined
def follow(
    physics: Physics, drive: CompiledRecords, q: float, v: float, a: float
) -> None:
    """Write `a + kp (q - q_now) + kd (v - v_now)`, the correction within its limit."""
    error = q - physics.qpos[drive.qpos]
    correction = drive.kp * error + drive.kd * (v - physics.qvel[drive.dof])
    correction = min(max(correction, -drive.most), drive.most)
    physics.acceleration[drive.dof] = a + correction


@compiled_inner
def joint_law(physics: Physics, law: CompiledRecords, drives: CompiledRecords) -> None:
    """Write the accelerations of `JointLaw`."""
    for j in range(law.first, law.last):
        q, v, a = target_of(law, drives[j])
        follow(physics, drives[j], q, v, a)


@inlined
def speed_of(law: CompiledRecords, drive: CompiledRecords) -> tuple[float, float]:
    """Return speed and acceleration asked of a drive now."""
    speed = drive.velocity + min(law.since, law.duration) * drive.acceleration
    return speed, drive.acceleration if law.since <= law.duration else 0.0


@inlined
def move_on(physics: Physics, drive: CompiledRecords, v: float) -> None:
    """Move a target by one step at speed v, within its leash and the joint's range."""
    q = physics.qpos[drive.qpos]
    position = drive.position + physics.timestep * v
    position = min(max(position, q - drive.leash), q + drive.leash)
    drive.position = min(max(position, drive.lowest), drive.highest)


@compiled_inner
def velocity_law(
    physics: Physics, law: CompiledRecords, drives: CompiledRecords
) -> None:
    """Move the targets of `VelocityLaw` by one step; write its accelerations."""
    for j in range(law.first, law.last):
        v, a = speed_of(law, drives[j])
        move_on(physics, drives[j], v)
        follow(physics, drives[j], drives[j].position, v, a)


@compiled_inner
def base_law(physics: Physics, law: CompiledRecords, drives: CompiledRecords) -> None:
    """Move the target of `BaseLaw` by one step; write its accelerations."""
    x, y, yaw = drives[law.first], drives[law.first + 1], drives[law.first + 2]
    forward, forward_rate = speed_of(law, x)
    sideways, sideways_rate = speed_of(law, y)
    turn, turn_rate = speed_of(law, yaw)
    c, s = np.cos(yaw.position), np.sin(yaw.position)
    v_x, v_y = c * forward - s * sideways, s * forward + c * sideways
    a_x = c * forward_rate - s * sideways_rate - turn * v_y
    a_y = s * forward_rate + c * sideways_rate + turn * v_x
    move_on(physics, x, v_x)
    move_on(physics, y, v_y)
    move_on(physics, yaw, turn)
    follow(physics, x, x.position, v_x, a_x)
    follow(physics, y, y.position, v_y, a_y)
    follow(physics, yaw, yaw.position, turn, turn_rate)
