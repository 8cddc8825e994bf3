"""What goes wrong inside MuJoCo, said as errors."""

import logging
import math
from types import TracebackType

import mujoco
import numpy as np

from wbc_suite.control.loop import (
    LARGEST,
    SoundField,
    begins_sound,
    bind_sound,
    ends_sound,
)
from wbc_suite.errors import PhysicsError
from wbc_suite.typing import Indices

__all__ = ["PhysicsWatch"]

log = logging.getLogger(__name__)

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

    Args:
        data: What is watched.

    Attributes:
        sound: Where the numbers are, for compiled code; see `bind_sound`.
    """

    def __init__(self, data: mujoco.MjData) -> None:
        self._data = data
        self._arrays = {
            "qpos (BADQPOS)": data.qpos,
            "qvel (BADQVEL)": data.qvel,
            "qfrc_applied": data.qfrc_applied,
            "xfrc_applied": data.xfrc_applied.ravel(),
        }
        self._table = bind_sound(data)
        self._warnings = self._table[SoundField.WARNINGS]
        self._before = self._table[SoundField.BEFORE]
        self.sound: Indices = self._table.table
        if mujoco.get_mju_user_warning() is None:
            # Once and for good: threads would take it from each other.
            mujoco.set_mju_user_warning(log.warning)

    def __enter__(self) -> None:
        if not begins_sound(self.sound) or not math.isfinite(self._data.time):
            self._tell_numbers()

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
        """Raise what is wrong now, or came up since the beginning.

        Raises:
            PhysicsError: See above.
        """
        if ends_sound(self.sound) and math.isfinite(self._data.time):
            return
        # Numbers are mostly bad, and a controller mostly fails, where MuJoCo warned.
        self._tell_warnings(cause)
        self._tell_numbers()

    def _tell_warnings(self, cause: BaseException | None) -> None:
        raised = np.flatnonzero(self._warnings != self._before).tolist()
        if not raised:
            return
        raise PhysicsError(
            f"MuJoCo reported {', '.join(_NAMES[k] for k in raised)} at {self._time} "
            f"(index {int(self._data.warning.lastinfo[raised[0]])}). The state is no "
            "longer to be trusted: reset."
        ) from cause

    def _tell_numbers(self) -> None:
        for name, values in (*self._arrays.items(), ("time", self._data.time)):
            if not np.all(np.abs(values) <= LARGEST):
                finite = np.isfinite(values).all()
                what = f"Beyond {LARGEST:g}" if finite else "Not finite"
                raise PhysicsError(
                    f"{what}: {name} at {self._time}. Reset, and look at what was "
                    "written into the simulation."
                )

    @property
    def _time(self) -> str:
        return f"t = {self._data.time:.3f} s"
