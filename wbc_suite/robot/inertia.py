"""Inertia of links: tensors, and checks that a rigid body can have them."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Literal

import numpy as np
import pinocchio as pin

from wbc_suite.robot.shape_geometry import bounds_of
from wbc_suite.typing import Matrix, Vector

if TYPE_CHECKING:
    from wbc_suite.robot.elements import Link

INERTIA_SLACK = 1e-6
"""Relative slack of the triangle inequality; vendors round their tensors."""
GYRATION_RANGE = (0.08, 1.1)
"""Plausible radius of gyration over half the diagonal of the link's shapes."""
SMALLEST_MASS = 1e-10  # smallest accepted mass in kg; MuJoCo refuses masses below 1e-15
SMALLEST_MOMENT = 1e-14  # principal moments below count as not positive, kg m^2
COM_SLACK = 0.10
"""Part of the bounding box by which the centre of mass may lie outside it."""
MIN_GYRATION = 1e-3  # smallest radius of gyration in m of a corrected inertia


def inertia_matrix(inertia: tuple[float, ...]) -> Matrix:
    """Return the symmetric (3, 3) matrix of `xx yy zz xy xz yz`."""
    xx, yy, zz, xy, xz, yz = inertia
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def inertia_of(link: "Link") -> pin.Inertia:
    """Return the inertia of a link in its axes."""
    return pin.Inertia(link.mass, np.asarray(link.com), inertia_matrix(link.inertia))


def inertia_fields(tensor: Matrix) -> tuple[float, ...]:
    """Return `xx yy zz xy xz yz` of a symmetric matrix, shape (3, 3)."""
    rows, columns = (0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)
    return tuple(tensor[rows, columns].tolist())


def unphysical(link: "Link") -> str | None:
    """Return why no rigid body has a link's inertia; None if one can have it."""
    if 0.0 < link.mass < SMALLEST_MASS:
        return f"the mass {link.mass:.3g} kg is below {SMALLEST_MASS:g} kg"
    if not any(link.inertia) and (link.joint is None or link.mass == 0.0):
        return None  # a point mass is fixed to a body that has a tensor
    moments: Vector = np.linalg.eigvalsh(inertia_matrix(link.inertia))
    if moments[0] <= SMALLEST_MOMENT:
        return (
            f"the inertia {list(link.inertia)} is not positive definite (principal "
            f"moments {_numbers(moments)})"
        )
    if moments[2] > (moments[0] + moments[1]) * (1 + INERTIA_SLACK):
        return (
            f"the principal moments {_numbers(moments)} violate the triangle "
            "inequality of rigid bodies"
        )
    return None


def nearest_physical(link: "Link") -> "Link":
    """Return the link with the nearest inertia that a rigid body can have.

    An inertia I is physical when the second moments of mass S = tr(I)/2 - I are
    positive: their eigenvalues are raised to those of a body of 1 mm at least.

    Source: Wensing, Kim, Slotine (2018), "Linear matrix inequalities for physically
    consistent inertial parameter identification", RA-L 3(1).
    """
    inertia = inertia_matrix(link.inertia)
    moments, axes = np.linalg.eigh(np.trace(inertia) / 2 * np.eye(3) - inertia)
    mass = max(link.mass, SMALLEST_MASS) if link.mass > 0.0 else 0.0
    raised = np.maximum(moments, max(mass * MIN_GYRATION**2, SMALLEST_MOMENT))
    second = (axes * raised) @ axes.T
    fields = inertia_fields(np.trace(second) * np.eye(3) - second)
    return link.model_copy(update={"mass": mass, "inertia": fields})


def implausible(link: "Link") -> Iterator[tuple[Literal["com", "inertia"], str]]:
    """Yield where centre of mass or inertia do not match the link's shapes."""
    shapes = [*link.visual, *link.collision]
    if not shapes or link.mass == 0.0:
        return
    low, high = bounds_of(shapes)
    slack = COM_SLACK * (high - low) + 0.005
    com = np.asarray(link.com)
    outside = float(np.max(np.maximum(low - slack - com, com - high - slack)))
    if outside > 0.0:
        yield (
            "com",
            f"the centre of mass {_numbers(com)} lies {outside * 1000:.0f} mm outside "
            f"the link's shapes, which extend from {_numbers(low)} to {_numbers(high)}",
        )
    half_diagonal = float(np.linalg.norm(high - low)) / 2
    trace = float(np.trace(inertia_matrix(link.inertia)))
    gyration = np.sqrt(trace / 2 / link.mass)
    lowest, highest = GYRATION_RANGE
    if not lowest <= gyration / half_diagonal <= highest:
        yield (
            "inertia",
            f"a radius of gyration of {gyration:.3g} m does not match shapes with a "
            f"half diagonal of {half_diagonal:.3g} m",
        )


def _numbers(values: Vector) -> str:
    return "[" + ", ".join(f"{v:.4g}" for v in values) + "]"
