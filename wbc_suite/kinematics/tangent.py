"""Steps between configurations: plain sums and differences where that is true."""

import pinocchio as pin

from wbc_suite.typing import Vector

__all__ = ["TangentSpace"]


class TangentSpace:
    """The `(+)` and `(-)` of a model's configurations.

    Most robots' configurations are a vector space; those with quaternions, or with
    joints that turn without end, are not, and Pinocchio knows how.

    Args:
        model: Pinocchio model.
    """

    def __init__(self, model: pin.Model) -> None:
        self._model = None if model.nq == model.nv else model

    def integrate(self, q: Vector, step: Vector) -> Vector:
        """Return `q (+) step`, shape (nq,)."""
        if self._model is None:
            return q + step
        return pin.integrate(self._model, q, step)

    def difference(self, origin: Vector, q: Vector) -> Vector:
        """Return `q (-) origin`, shape (nv,): the tangent step from there to q."""
        if self._model is None:
            return q - origin
        return pin.difference(self._model, origin, q)
