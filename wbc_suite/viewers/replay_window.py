"""Recorded episodes in MuJoCo's own window."""

import time
from collections.abc import Callable
from typing import Any

import mujoco

from wbc_suite.envs import RobotEnv
from wbc_suite.envs.states import write_physics
from wbc_suite.errors import DeviceError
from wbc_suite.viewers.tape import Tape

__all__ = ["KEYS", "show_in_window"]

PERIOD = 1.0 / 60.0  # s, between pictures
KEYS: dict[int, Callable[[Tape], None]] = {
    32: Tape.toggle,  # space
    262: lambda tape: tape.nudge(1),  # right
    263: lambda tape: tape.nudge(-1),  # left
    264: lambda tape: tape.skip(1),  # down
    265: lambda tape: tape.skip(-1),  # up
}
"""What GLFW's keys do."""


def show_in_window(
    tape: Tape, env: RobotEnv, launch: Callable[..., Any] | None = None
) -> None:
    """Play a tape until the window is closed.

    Space pauses and goes on; left and right go by one step, up and down by an episode.

    Args:
        tape: Its clips are of `env`.
        env: Environment that is shown.
        launch: Opens a window; MuJoCo's passive viewer.

    Raises:
        DeviceError: If there is no screen.
    """
    model, data = env.simulation.model, env.simulation.data

    def press(key: int) -> None:
        if key in KEYS:
            KEYS[key](tape)

    tape.turn()
    with (launch or _window)(model, data, press) as window:
        while window.is_running():
            due = time.monotonic() + PERIOD
            with window.lock():
                status = tape.turn()
                if status.clip is not None:
                    write_physics(model, data, status.clip.states[status.frame])
                    mujoco.mj_forward(model, data)
            window.sync()
            time.sleep(max(0.0, due - time.monotonic()))


def _window(
    model: mujoco.MjModel, data: mujoco.MjData, press: Callable[[int], None]
) -> Any:
    from mujoco import viewer

    try:
        return viewer.launch_passive(
            model, data, key_callback=press, show_left_ui=False, show_right_ui=False
        )
    except Exception as error:  # the window library has errors of many kinds
        raise DeviceError(
            f"MuJoCo's window does not open: {error}. It needs a screen; on macOS run "
            "with mjpython. `--show browser` needs neither."
        ) from error
