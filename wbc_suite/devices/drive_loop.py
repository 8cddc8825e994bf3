"""A loop that drives an environment with a device."""

import time
from collections.abc import Callable
from typing import Any

from wbc_suite.devices.device import Device
from wbc_suite.devices.pipeline import Pipeline
from wbc_suite.devices.state import DeviceState

StepCallback = Callable[[DeviceState, dict[str, Any]], None]


def drive(
    env: Any,
    device: Device,
    pipeline: Pipeline,
    *,
    seed: int = 0,
    steps: int | None = None,
    real_time: bool = True,
    on_step: StepCallback | None = None,
) -> dict[str, Any]:
    """Step an environment with a device, until its button `quit` is pressed.

    Args:
        env: Environment; the buttons `reset` and `pause` reset and pause it.
        device: The device, which is started and stopped here.
        pipeline: Pipeline from the device's states to actions.
        seed: Seed of every reset.
        steps: Maximum number of steps.
        real_time: Whether to step at the control frequency.
        on_step: Called after each step with the device's state and the step's info.

    Returns:
        The info of the last step.
    """
    period = 1.0 / env.unwrapped.config.control_freq
    info: dict[str, Any] = {}
    pressed, paused, taken = frozenset[str](), False, 0

    def restart() -> None:
        env.reset(seed=seed)
        pipeline.reset()

    restart()
    try:
        device.start()
        due = time.perf_counter()
        while steps is None or taken < steps:
            state = device.read()
            new, pressed = state.buttons - pressed, state.buttons
            if "quit" in new:
                break
            paused ^= "pause" in new
            if "reset" in new:
                restart()
            if paused:
                pipeline.hold(state)
            else:
                *_, done, _, info = env.step(pipeline.update(state))
                taken += 1
                if on_step is not None:
                    on_step(state, info)
                if done:
                    restart()
            if real_time:
                due = max(due + period, time.perf_counter())
                time.sleep(max(0.0, due - time.perf_counter()))
    finally:
        device.stop()
    return info
