"""Errors for what goes wrong inside MuJoCo."""

import math
from types import TracebackType

import mujoco
import numpy as np

from wbc_suite import logs
from wbc_suite.compiling import as_argument
from wbc_suite.control.loop.state_checks import (
    FASTEST,
    LARGEST,
    check_after,
    check_before,
    checked_state,
)
from wbc_suite.errors import PhysicsError

log = logs.logger(__name__)

_NAMES = [
    name.removeprefix("mjWARN_")
    for name, value in mujoco.mjtWarning.__members__.items()
    if value != mujoco.mjtWarning.mjNWARNING
]


class PhysicsWatch:
    """Turns MuJoCo's warnings, and numbers that it cannot take, into errors.

    `with watch:` around calls of MuJoCo raises a `PhysicsError` before them, or after
    them, that names the array or the warning. The warnings' own texts go to `logging`,
    unless the process has its own handler, not to a file in the working folder.

    Attributes:
        state: The checked arrays, for the control loop.
    """

    def __init__(self, data: mujoco.MjData) -> None:
        self._data = data
        self._arrays = {
            "qpos (BADQPOS)": data.qpos,
            "qvel (BADQVEL)": data.qvel,
            "qfrc_applied": data.qfrc_applied,
            "xfrc_applied": data.xfrc_applied.ravel(),
        }
        self.state = checked_state(data)
        self._argument = as_argument(self.state)
        if mujoco.get_mju_user_warning() is None:
            # Never reset: threads would replace each other's handler.
            mujoco.set_mju_user_warning(log.warning)

    def __enter__(self) -> None:
        if not self.is_usable() or not math.isfinite(self._data.time):
            self._raise_numbers()

    def is_usable(self) -> bool:
        """Note the warnings so far; return whether MuJoCo accepts all numbers."""
        return check_before(self._argument)

    def is_sound(self) -> bool:
        """Return whether there is no new warning, and all numbers are usable."""
        return check_after(self._argument)

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if error is not None and not isinstance(error, np.linalg.LinAlgError):
            return
        self.check(error)
        if error is not None:
            raise PhysicsError(
                f"A controller failed at {self._time}: {error}. Reset."
            ) from error

    def check(self, cause: BaseException | None = None) -> None:
        """Raise a `PhysicsError` if the state is not usable, or MuJoCo warned."""
        if self.is_sound() and math.isfinite(self._data.time):
            return
        # Numbers are mostly bad, and a controller mostly fails, where MuJoCo warned.
        self._raise_warnings(cause)
        self._raise_numbers()

    def _raise_warnings(self, cause: BaseException | None) -> None:
        new = self.state.warnings != self.state.warnings_before
        raised = np.flatnonzero(new).tolist()
        if raised:
            raise PhysicsError(
                f"MuJoCo reported {', '.join(_NAMES[k] for k in raised)} at "
                f"{self._time} (index {int(self._data.warning.lastinfo[raised[0]])}). "
                "The state is no longer reliable: reset."
            ) from cause

    def _raise_numbers(self) -> None:
        for name, values in (*self._arrays.items(), ("time", self._data.time)):
            most = FASTEST if name.startswith("qvel") else LARGEST
            if not np.all(np.abs(values) <= most):
                finite = np.isfinite(values).all()
                what = f"Beyond {most:g}" if finite else "Not finite"
                raise PhysicsError(
                    f"{what}: {name} at {self._time}. Reset, and check what was "
                    "written into the simulation."
                )

    @property
    def _time(self) -> str:
        return f"t = {self._data.time:.3f} s"


def check_model(model: mujoco.MjModel) -> None:
    """Raise a `PhysicsError` for numbers that no compiled model has."""
    if not 0.0 < model.opt.timestep < math.inf:
        raise PhysicsError(f"The time step is {model.opt.timestep:g} s, not above 0.")
    for name in ("geom_size", "site_size", "body_mass", "body_inertia"):
        values = getattr(model, name)
        if not np.all(values >= 0.0):  # not so for NaN
            row = int(np.argwhere(~(values >= 0.0))[0, 0])
            part = name.partition("_")[0]
            owner = getattr(model, part)(row).name or f"number {row}"
            raise PhysicsError(f"{name} of {part} '{owner}' is {values[row]}, below 0.")
