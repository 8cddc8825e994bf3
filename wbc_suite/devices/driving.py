"""The plainest loop around a device, a pipeline and an environment."""

import time
from collections.abc import Callable
from typing import Any

from wbc_suite.devices.device import Device
from wbc_suite.devices.pipeline import Pipeline
from wbc_suite.devices.state import DeviceState

__all__ = ["drive"]

Told = Callable[[DeviceState, dict[str, Any]], None]


def drive(
    env: Any,
    device: Device,
    pipeline: Pipeline,
    *,
    seed: int = 0,
    steps: int | None = None,
    real_time: bool = True,
    tell: Told | None = None,
) -> dict[str, Any]:
    """Step an environment with what a device says, until its button `quit`.

    Args:
        env: Environment; its button is `reset`, and `pause` lets time stand still.
        device: Where states come from; it is started and stopped here.
        pipeline: What makes actions of them.
        seed: Seed of every reset.
        steps: How many steps to take at most.
        real_time: Whether to wait until a step's time has passed.
        tell: Called after each step with the device's state and the step's info.

    Returns:
        The info of the last step.
    """
    period = 1.0 / env.unwrapped.config.control_freq
    info: dict[str, Any] = {}
    pressed, paused, taken = frozenset[str](), False, 0
    env.reset(seed=seed)
    pipeline.reset()
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
                env.reset(seed=seed)
                pipeline.reset()
            if not paused:
                *_, done, _, info = env.step(pipeline.update(state))
                taken += 1
                if tell is not None:
                    tell(state, info)
                if done:
                    env.reset(seed=seed)
                    pipeline.reset()
            if real_time:
                due = max(due + period, time.perf_counter() - period)
                time.sleep(max(0.0, due - time.perf_counter()))
    finally:
        device.stop()
    return info
