"""The clutch: it couples an input pose to a target pose while it is engaged."""

import pinocchio as pin


class Clutch:
    """Repeat the motion of an input with a target.

    Engaging latches both poses; the target does not move then, however far apart they
    are. Afterwards the target repeats the input's motion in world axes, with positions
    scaled by s:

        p_target = p_target0 + s (p_input - p_input0)
        R_target = R_input R_input0^T R_target0

    With the first line the target moves straight if the input does, which a composition
    of rigid motions would not ensure.
    """

    def __init__(self, target: pin.SE3, scale: float = 1.0) -> None:
        self._target = target.copy()
        self._scale = scale
        self._latch: tuple[pin.SE3, pin.SE3] | None = None
        self._input = target.copy()

    @property
    def engaged(self) -> bool:
        """Whether the input drives the target."""
        return self._latch is not None

    @property
    def target(self) -> pin.SE3:
        """Pose of the target in the world (a copy)."""
        return self._target.copy()

    def engage(self, T_input: pin.SE3) -> None:
        """Couple the input to the target, which does not move."""
        self._latch = (T_input.copy(), self._target.copy())
        self._input = T_input.copy()

    def move(self, T_input: pin.SE3) -> None:
        """Follow the input; no effect while released."""
        if self._latch is None:
            return
        self._input = T_input.copy()
        T_input0, T_target0 = self._latch
        moved = T_input.translation - T_input0.translation
        turned = T_input.rotation @ T_input0.rotation.T
        self._target = pin.SE3(
            turned @ T_target0.rotation, T_target0.translation + self._scale * moved
        )

    def release(self) -> None:
        """Release the input; the target stays."""
        self._latch = None

    def place(self, T_target: pin.SE3) -> None:
        """Set the target and release the input."""
        self._latch = None
        self._target = T_target.copy()

    def slip(self, T_target: pin.SE3) -> None:
        """Set the target and stay engaged, latched at the new target."""
        self._target = T_target.copy()
        if self._latch is not None:
            self._latch = (self._input, self._target)
