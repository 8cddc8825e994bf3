"""Errors for what goes wrong inside MuJoCo."""

import functools
import math
from types import TracebackType
from typing import Any

import mujoco
import numpy as np

from wbc_suite import logs
from wbc_suite.compiling import as_argument
from wbc_suite.control.run.state_checks import (
    FASTEST,
    LARGEST,
    check_after,
    check_before,
    checked_state,
)
from wbc_suite.errors import PhysicsError
from wbc_suite.typing import Records

log = logs.logger(__name__)

LONGEST_STEP = 0.02
"""s; with a longer one servos and contacts of robots are not stable."""

SETTINGS = {
    *("kp", "kd", "observer", "speed", "parameters", "correction_max", "windup_max"),
    *("command_min", "command_max", "position_min", "position_max", "velocity_max"),
}
"""Fields of laws' records that controllers set once, and the loop only reads."""

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
        self.state = checked_state(data.model, data)
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
        check_model(self._data.model)

    @property
    def _time(self) -> str:
        return f"t = {self._data.time:.3f} s"


def check_model(model: mujoco.MjModel, timestep: float | None = None) -> None:
    """Raise a `PhysicsError` for numbers that no compiled model has.

    With a time step, s, the model's must be that one: substeps and control laws are
    made for it.
    """
    found, rule = model.opt.timestep, f"not from 0 to {LONGEST_STEP:g} s"
    if timestep is not None and found != timestep:
        rule = f"not the {timestep:g} s of `control_freq`, which sets it"
    elif 0.0 < found <= LONGEST_STEP:
        rule = ""
    if rule:
        raise PhysicsError(f"The time step is {found:g} s, {rule}.")
    for name in _options():
        value = getattr(model.opt, name)
        if not np.isfinite(value).all():
            raise PhysicsError(f"opt.{name} is {value}, not finite.")
    for name in _number_arrays():
        if not math.isfinite(getattr(model, name).sum()):
            _check_rows(model, name, np.isfinite(getattr(model, name)), "not finite")
    for name in ("geom_size", "site_size", "body_mass", "body_inertia"):
        _check_rows(model, name, getattr(model, name) >= 0.0, "below 0")
    for name in ("jnt_range", "actuator_ctrlrange", "actuator_forcerange"):
        low, high = getattr(model, name).T
        _check_rows(model, name, low <= high, "a range that ends before it begins")


def check_laws(laws: Records, drives: Records) -> None:
    """Raise a `PhysicsError` if a gain or limit of control laws is NaN."""
    for records in (laws, drives):
        for name in SETTINGS & {*(records.dtype.names or ())}:
            if np.isnan(records[name]).any():
                raise PhysicsError(
                    f"'{name}' of a control law is NaN. Check what was written into "
                    "the `law` of a part controller."
                )


def _check_rows(model: mujoco.MjModel, name: str, valid: Any, rule: str) -> None:
    """Raise a `PhysicsError` that names the first row which is not valid."""
    if valid.all():
        return
    row, part = int(np.argwhere(~valid)[0, 0]), name.partition("_")[0]
    find: Any = getattr(model, part, None)
    name_of_row = getattr(find(row), "name", "") if callable(find) else ""
    owner = name_of_row or f"number {row}"
    raise PhysicsError(
        f"{name} of {part} '{owner}' is {getattr(model, name)[row]}, {rule}."
    )


@functools.cache
def _options() -> tuple[str, ...]:
    """Return the names of physics options that are real numbers."""
    option = mujoco.MjOption()
    names = (name for name in dir(option) if not name.startswith("_"))
    return tuple(n for n in names if np.asarray(getattr(option, n)).dtype.kind == "f")


@functools.cache
def _number_arrays() -> tuple[str, ...]:
    """Return the names of a model's arrays of finite float64, but of bounding boxes."""
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    names = (name for name in dir(model) if not name.startswith(("_", "bvh", "oct")))
    pairs = ((name, getattr(model, name)) for name in names)
    return tuple(
        name
        for name, value in pairs
        if isinstance(value, np.ndarray) and value.dtype == np.float64
        if not name.endswith("range")  # which may be infinite
    )
