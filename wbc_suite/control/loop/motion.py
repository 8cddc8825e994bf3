"""How targets of joints and points of bodies move, in compiled code."""

from wbc_suite.compiling import inlined
from wbc_suite.control.loop.physics import Physics
from wbc_suite.control.loop.table import CompiledRecords
from wbc_suite.typing import Matrix, Vector

__all__ = ["carries", "multiply", "point_column", "point_motion", "rotate"]
__all__ += ["target_of"]


@inlined
def target_of(
    law: CompiledRecords, drive: CompiledRecords
) -> tuple[float, float, float]:
    """Return position, velocity and acceleration of a drive's target now."""
    s = min(law.since, law.duration)
    v, a, j = drive.velocity, drive.acceleration, drive.jerk
    position = drive.position + s * (v + s * (0.5 * a + s / 6.0 * j))
    if law.since > law.duration:
        return position, 0.0, 0.0
    return position, v + s * (a + 0.5 * s * j), a + s * j


@inlined
def multiply(A: Matrix, B: Matrix, out: Matrix) -> None:
    """Write A B, shapes (3, 3)."""
    for i in range(3):
        for j in range(3):
            out[i, j] = A[i, 0] * B[0, j] + A[i, 1] * B[1, j] + A[i, 2] * B[2, j]


@inlined
def rotate(R: Matrix, x: Vector, out: Vector) -> None:
    """Write R x, shape (3,)."""
    for i in range(3):
        out[i] = R[i, 0] * x[0] + R[i, 1] * x[1] + R[i, 2] * x[2]


@inlined
def point_column(physics: Physics, dof: int, root: int, p: Vector, out: Vector) -> None:
    """Write a column of the Jacobian of point p, linear then angular, world axes."""
    c = physics.cdof[dof]
    x = p[0] - physics.subtree_com[root, 0]
    y = p[1] - physics.subtree_com[root, 1]
    z = p[2] - physics.subtree_com[root, 2]
    out[0] = c[3] + c[1] * z - c[2] * y
    out[1] = c[4] + c[2] * x - c[0] * z
    out[2] = c[5] + c[0] * y - c[1] * x
    out[3], out[4], out[5] = c[0], c[1], c[2]


@inlined
def point_motion(
    physics: Physics, body: int, p: Vector, velocity: Vector, drift: Vector
) -> None:
    """Write velocity, and acceleration without joint accelerations, of a point.

    Linear then angular, world axes, of the point of a body that is at p now. The
    second is J' v; see `mj_jacDot`.
    """
    root = physics.body_rootid[body]
    x = p[0] - physics.subtree_com[root, 0]
    y = p[1] - physics.subtree_com[root, 1]
    z = p[2] - physics.subtree_com[root, 2]
    c = physics.cvel[body]
    velocity[0] = c[3] + c[1] * z - c[2] * y
    velocity[1] = c[4] + c[2] * x - c[0] * z
    velocity[2] = c[5] + c[0] * y - c[1] * x
    velocity[3], velocity[4], velocity[5] = c[0], c[1], c[2]
    for i in range(6):
        drift[i] = 0.0
    dof = physics.body_last_dof[body]
    while dof >= 0:
        d, c, v = physics.cdof_dot[dof], physics.cdof[dof], physics.qvel[dof]
        drift[0] += v * (
            d[3] + d[1] * z - d[2] * y + c[1] * velocity[2] - c[2] * velocity[1]
        )
        drift[1] += v * (
            d[4] + d[2] * x - d[0] * z + c[2] * velocity[0] - c[0] * velocity[2]
        )
        drift[2] += v * (
            d[5] + d[0] * y - d[1] * x + c[0] * velocity[1] - c[1] * velocity[0]
        )
        drift[3] += v * d[0]
        drift[4] += v * d[1]
        drift[5] += v * d[2]
        dof = physics.dof_parentid[dof]


@inlined
def carries(physics: Physics, dof: int, body: int) -> bool:
    """Tell whether a degree of freedom moves a body."""
    k = physics.body_last_dof[body]
    while k > dof:
        k = physics.dof_parentid[k]
    return k == dof
