"""Shapes of links for drawing and collision.

Lengths are in metres, poses in the link frame, quaternions w x y z. Boxes have half
sizes, as in MJCF. A hull is the convex hull of spheres, a loft a surface over rings.
"""

import hashlib
import itertools
import math
from collections.abc import Callable
from functools import lru_cache, partial
from typing import Annotated, Any, Literal, TypeAlias, TypeVar, cast

import numpy as np
from pydantic import AfterValidator, Field, InstanceOf, model_validator

from wbc_suite.config_files import FrozenModel
from wbc_suite.typing import Indices, Matrix

S = TypeVar("S")
T = TypeVar("T")

Real: TypeAlias = Annotated[float, Field(ge=-1e4, le=1e4)]
"""A length in m, an angle in rad or the like: larger values are input errors."""
Size: TypeAlias = Annotated[float, Field(ge=1e-6, le=1e4)]
"""A positive length in m; engines do not draw less than a micrometre."""
Vector3: TypeAlias = tuple[Real, Real, Real]


def _ordered(ends: tuple[float, float]) -> tuple[float, float]:
    if ends[0] > ends[1]:
        raise ValueError(f"the lower end must come first, {ends[0]:g} > {ends[1]:g}")
    return ends


Interval: TypeAlias = Annotated[tuple[Real, Real], AfterValidator(_ordered)]
SizeInterval: TypeAlias = Annotated[tuple[Size, Size], AfterValidator(_ordered)]


ROUNDING = 1e-14
"""Lengths this close to 1 are not normalised, so that exported files stay equal."""


def _unit(
    values: tuple[float, ...], *, what: str, tolerance: float
) -> tuple[float, ...]:
    """Normalise a vector of nearly length 1."""
    norm = math.hypot(*values)
    if abs(norm - 1.0) > tolerance:
        raise ValueError(f"{what} must have length 1, this one has {norm:.9g}")
    return values if abs(norm - 1.0) < ROUNDING else tuple(v / norm for v in values)


Axis: TypeAlias = Annotated[
    Vector3, AfterValidator(partial(_unit, what="an axis", tolerance=1e-3))
]
Quaternion: TypeAlias = Annotated[
    tuple[Real, Real, Real, Real],
    AfterValidator(partial(_unit, what="a quaternion w x y z", tolerance=1e-6)),
]
"""Unit quaternion w x y z; normalised on reading (rounded files are off by 1e-10)."""

Color: TypeAlias = str | tuple[float, float, float] | tuple[float, float, float, float]
"""A name in `[materials]`, or red green blue (alpha) from 0 to 1."""

Rgba: TypeAlias = tuple[float, float, float, float]


def quaternion_from_rpy(rpy: Vector3) -> tuple[float, float, float, float]:
    """Convert fixed-axis roll, pitch, yaw (radians, as in URDF) to w x y z."""
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(a / 2), math.sin(a / 2)) for a in rpy)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def _convert_rpy(data: Any) -> Any:
    """Replace the key `rpy` of a table by `quat`."""
    fields = as_table(data)
    if "rpy" not in fields:
        return data
    if "quat" in fields:
        raise ValueError("give either 'quat' or 'rpy', not both")
    match fields.pop("rpy"):
        case [float() | int() as r, float() | int() as p, float() | int() as y]:
            return fields | {"quat": quaternion_from_rpy((r, p, y))}
        case _:
            raise ValueError("'rpy' needs three angles in radians")


class Posed(FrozenModel):
    """An item with a pose; files may have `rpy` (radians) instead of `quat`."""

    pos: Vector3 = (0.0, 0.0, 0.0)
    quat: Quaternion = (1.0, 0.0, 0.0, 0.0)

    _rpy = model_validator(mode="before")(_convert_rpy)


def as_table(data: Any) -> dict[str, Any]:
    """Return a copy of a table of plain data; empty for any other value."""
    return dict(cast("dict[str, Any]", data)) if isinstance(data, dict) else {}


class ShapeFields(FrozenModel):
    """Fields of every shape: pose, colour and contact parameters.

    Attributes:
        friction: Sliding, torsional and rolling friction; MuJoCo's default when absent.
        condim: Contact dimension.
        solref: Time constant in s and damping ratio of the contact.
        margin: Distance in m at which contacts become active.
        priority: Of two shapes in contact the greater one's friction counts.
    """

    pos: Vector3 = (0.0, 0.0, 0.0)
    quat: Quaternion = (1.0, 0.0, 0.0, 0.0)
    color: Color = "grey"
    friction: Vector3 | None = None
    condim: Literal[1, 3, 4, 6] | None = None
    solref: tuple[Real, Real] | None = None
    margin: Real | None = None
    priority: Literal[0, 1] | None = None

    _rpy = model_validator(mode="before")(_convert_rpy)


class Box(ShapeFields):
    """A box with half sizes; `radius` rounds its edges within these sizes."""

    shape: Literal["box"]
    size: tuple[Size, Size, Size]
    radius: float = Field(default=0.0, ge=0.0)

    @model_validator(mode="after")
    def _radius_fits(self) -> "Box":
        if self.radius > min(self.size):
            raise ValueError(
                f"radius {self.radius} exceeds the smallest half size {min(self.size)}"
            )
        return self


class Sphere(ShapeFields):
    """A sphere."""

    shape: Literal["sphere"]
    radius: Size


class Ellipsoid(ShapeFields):
    """An ellipsoid with half axes."""

    shape: Literal["ellipsoid"]
    size: tuple[Size, Size, Size]


def _check_length(shape: Any) -> Any:
    if math.dist(shape.start, shape.end) < 1e-6:
        raise ValueError("'from' and 'to' are the same point: use a sphere")
    return shape


class Capsule(ShapeFields):
    """A cylinder along a segment, with half spheres around its end points."""

    shape: Literal["capsule"]
    start: Vector3 = Field(alias="from")
    end: Vector3 = Field(alias="to")
    radius: Size

    _length = model_validator(mode="after")(_check_length)


class Cylinder(ShapeFields):
    """A cylinder along a segment; `radius_to` makes it a cone (visuals only)."""

    shape: Literal["cylinder"]
    start: Vector3 = Field(alias="from")
    end: Vector3 = Field(alias="to")
    radius: Size
    radius_to: Size | None = None

    _length = model_validator(mode="after")(_check_length)


class Hull(ShapeFields):
    """The convex hull of spheres `[x, y, z, radius]`."""

    shape: Literal["hull"]
    spheres: tuple[
        tuple[Real, Real, Real, Annotated[float, Field(ge=0.0, le=1e4)]], ...
    ] = Field(min_length=1, max_length=64)

    @model_validator(mode="after")
    def _has_volume(self) -> "Hull":
        if max(s[3] for s in self.spheres) <= 0.0 and len(self.spheres) < 4:
            raise ValueError("a hull needs a positive radius or at least four points")
        return self


class Loft(ShapeFields):
    """A surface over rings along one axis (visuals only; may be non-convex).

    Rows of `sections` are `[position, centre_u, centre_v, half_u, half_v]`; u and v are
    the two other axes in the order x, y, z. The exponent is that of a superellipse: 2
    ellipse, 4 squircle, 8 nearly box. `smooth` interpolates by a curve instead of
    lines.
    """

    shape: Literal["loft"]
    axis: Literal["x", "y", "z"] = "z"
    sections: tuple[tuple[Real, Real, Real, Real, Real], ...] = Field(
        min_length=2, max_length=64
    )
    exponent: float = Field(default=2.0, ge=1.0, le=20.0)
    smooth: bool = True

    @model_validator(mode="after")
    def _positions_rise(self) -> "Loft":
        positions = [s[0] for s in self.sections]
        if any(b - a < 1e-6 for a, b in itertools.pairwise(positions)):
            raise ValueError("the positions of rings must increase")
        if any(s[3] < 1e-6 or s[4] < 1e-6 for s in self.sections):
            raise ValueError("half sizes of rings must be positive")
        return self


class Surface:
    """Triangles of one colour, in m; equal to others of the same content.

    Attributes:
        vertices: Their corners, shape (n, 3).
        faces: Indices of three corners, shape (m, 3), counter-clockwise from outside.
        color: Red green blue alpha from 0 to 1; None if none is stated.
        digest: What tells their content from others.
    """

    def __init__(
        self, vertices: Matrix, faces: Indices, color: Rgba | None = None
    ) -> None:
        self.vertices = np.ascontiguousarray(vertices, np.float32)
        self.faces = np.ascontiguousarray(faces, np.int32)
        self.color = color
        content = hashlib.sha256(self.vertices.tobytes())
        content.update(self.faces.tobytes())
        content.update(repr(color).encode())
        self.digest = content.hexdigest()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Surface) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)


class SkinMesh(ShapeFields):
    """A mesh that is drawn instead of a link's visual shapes.

    Attributes:
        file: The mesh file, or the model file with it, an absolute path.
        scale: Factors of the file's axes.
        surface: The triangles to draw; by default all those of the file.
    """

    shape: Literal["skin"]
    file: str
    scale: Vector3 = (1.0, 1.0, 1.0)
    surface: InstanceOf[Surface] | None = None


Shape: TypeAlias = Annotated[
    Box | Sphere | Capsule | Cylinder | Ellipsoid | Hull | Loft,
    Field(discriminator="shape"),
]
Drawn: TypeAlias = Annotated[
    Box | Sphere | Capsule | Cylinder | Ellipsoid | Hull | Loft | SkinMesh,
    Field(discriminator="shape"),
]
"""What a picture shows of a link."""


def cached_by_shape(compute: Callable[[S], T]) -> Callable[[S], T]:
    """Cache the results of a function of a shape; equal shapes share one result."""
    # Frozen models are hashable, which pyright does not see.
    return lru_cache(maxsize=4096)(compute)  # pyright: ignore[reportReturnType]
