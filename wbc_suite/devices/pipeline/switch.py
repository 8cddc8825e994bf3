"""Which limb a device moves: names of inputs to names of slices."""

from collections.abc import Sequence

from wbc_suite.devices.limbs import robot_of, side_of

__all__ = ["Switch"]


class Switch:
    """Finds the limb that an input is for, and goes on to the next on request.

    An input `hand` is for the hand that is switched to; `right` and `left` are for the
    hands of that hand's robot, or what else it has there; any other name is the
    slice's own.

    Args:
        names: Names of all limbs, in the order of the action.
        hands: Those that `hand` goes through.
    """

    def __init__(self, names: Sequence[str], hands: Sequence[str]) -> None:
        self._names, self._hands = tuple(names), tuple(hands or names)
        self._active = 0

    @property
    def active(self) -> str:
        """The limb that `hand` means now; empty when there is none."""
        return self._hands[self._active] if self._hands else ""

    def next(self) -> str:
        """Go on to the next hand, and to the first after the last."""
        self._active = (self._active + 1) % len(self._hands)
        return self.active

    def find(self, name: str) -> str | None:
        """Return the limb that an input is for, or None."""
        if name in self._names:
            return name
        if name == "hand":
            return self.active or None
        prefix = robot_of(self.active)
        if prefix + name in self._names:
            return prefix + name
        near = (n for n in (*self._hands, *self._names) if robot_of(n) == prefix)
        return next((n for n in near if side_of(n) == name), None)
