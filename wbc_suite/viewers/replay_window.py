"""Recorded episodes in MuJoCo's own window."""

import time
from collections.abc import Callable
from typing import Any

import mujoco

from wbc_suite.devices.mjgui import open_window
from wbc_suite.envs import RobotEnv
from wbc_suite.viewers.episode_player import EpisodePlayer

PERIOD = 1.0 / 60.0  # s, between frames
KEYS: dict[int, Callable[[EpisodePlayer], None]] = {
    32: EpisodePlayer.toggle,  # space
    262: lambda player: player.step_frames(1),  # right
    263: lambda player: player.step_frames(-1),  # left
    264: lambda player: player.skip(1),  # down
    265: lambda player: player.skip(-1),  # up
}
"""Commands by GLFW key code."""


def show_in_window(
    player: EpisodePlayer, env: RobotEnv, launch: Callable[..., Any] | None = None
) -> None:
    """Play episodes until the window is closed.

    Space pauses and resumes; left and right step by a state, up and down by an episode.
    `launch` opens a window, MuJoCo's passive viewer by default.

    Raises:
        DeviceError: If there is no display.
    """
    model, data = env.simulation.model, env.simulation.data

    def press(key: int) -> None:
        if key in KEYS:
            KEYS[key](player)

    player.advance()
    with (launch or _window)(model, data, press) as window:
        while window.is_running():
            due = time.monotonic() + PERIOD
            with window.lock():
                status = player.advance()
                if status.clip is not None:
                    env.show_state(status.clip.states[status.frame])
            window.sync()
            time.sleep(max(0.0, due - time.monotonic()))


def _window(
    model: mujoco.MjModel, data: mujoco.MjData, press: Callable[[int], None]
) -> Any:
    return open_window(
        model, data, key_callback=press, show_left_ui=False, show_right_ui=False
    )
