"""Friction pyramids of feet: forces along their edges, and the bounds of these.

A contact force is a sum of forces along the edges of a pyramid, none of them negative,
so that it is within the cone of friction.
"""

import numpy as np

from wbc_suite.compiling import inner
from wbc_suite.control.contact.arrays import EDGES, WholeBodyDynamics
from wbc_suite.control.ground.physics import Physics
from wbc_suite.control.ground.rigid_body import rotated, rotation
from wbc_suite.linear_algebra import copy_vector
from wbc_suite.locomotion.gait import GRAVITY

STANCE_FORCE_MIN = 4.0
"""N; normal force that a standing foot keeps."""

FOOT_LOAD_MAX = 10.0
"""Weights that a foot may carry."""


@inner
def write_edges(physics: Physics, body: WholeBodyDynamics, k: int) -> None:
    """Write the generalised forces of a foot's friction pyramids.

    `terms.J` is the Jacobian of the foot's middle. An edge is a force of which 1 N is
    normal to the ground; on a sole the normal is the sole's.
    """
    terms, state = body.terms, body.state[0]
    size = body.dofs.shape[0]
    mu = state.friction / np.sqrt(2.0)
    R = rotation(physics.site_xmat, body.site[k])
    local, wrench = np.empty(3), np.empty(6)
    for edge in range(body.first_edge[k], body.first_edge[k + 1]):
        point, side = edge // EDGES, edge % EDGES
        local[0] = mu if side < 2 else -mu
        local[1] = mu if side % 2 == 0 else -mu
        local[2] = 1.0
        r = np.zeros(3)
        if body.is_sole[k] == 1:
            d = rotated(R, local)
            for i in range(3):
                for j in range(2):
                    r[i] += R[i, j] * body.corner[point, j]
        else:
            d = local
        copy_vector(d, wrench)
        wrench[3] = r[1] * d[2] - r[2] * d[1]
        wrench[4] = r[2] * d[0] - r[0] * d[2]
        wrench[5] = r[0] * d[1] - r[1] * d[0]
        row = terms.B[edge]
        for j in range(size):
            total = 0.0
            for i in range(6):
                total += wrench[i] * terms.J[i, j]
            row[j] = total


@inner
def bound_edge_forces(body: WholeBodyDynamics) -> None:
    """Bound the forces along edges by the load that a foot may carry."""
    qp, state, plan = body.qp, body.state[0], body.plan
    for k in range(body.site.shape[0]):
        first, last = body.first_edge[k], body.first_edge[k + 1]
        weight = state.mass * GRAVITY
        load = plan.load[k]
        most = weight * (FOOT_LOAD_MAX if load >= 1.0 else 1.3 * load)
        least = min(STANCE_FORCE_MIN, 0.5 * most)
        for edge in range(first, last):
            qp.lower[edge], qp.upper[edge] = least / (last - first), most / EDGES
            if load <= 0.0:
                qp.side[edge] = 1
            elif qp.side[edge] > 0 and load >= 1.0:
                qp.side[edge] = 0
