"""The clutch: it couples an input pose to a target pose, and lets go again."""

import pinocchio as pin

__all__ = ["Clutch"]


class Clutch:
    """Carry the motion of an input over to a target, from where each one stands.

    Engaging latches both poses, so that the target moves by nothing at that moment,
    however far apart the two are. From then on the target repeats the input's motion
    in world axes, positions times a scale s:

        p_target = p_target0 + s (p_input - p_input0)
        R_target = R_input R_input0^T R_target0

    The first line keeps a hand moving straight when the input moves straight, which
    composing the two poses as rigid motions would not do.
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
        """Couple the input to the target; the target itself does not move."""
        self._latch = (T_input.copy(), self._target.copy())
        self._input = T_input.copy()

    def move(self, T_input: pin.SE3) -> None:
        """Follow the input; without effect while released."""
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
        """Let go; the target stays where it is."""
        self._latch = None

    def place(self, T_target: pin.SE3) -> None:
        """Put the target somewhere else and let go of the input."""
        self._latch = None
        self._target = T_target.copy()

    def slip(self, T_target: pin.SE3) -> None:
        """Put the target somewhere else and stay engaged, latched from there."""
        self._target = T_target.copy()
        if self._latch is not None:
            self._latch = (self._input, self._target)
