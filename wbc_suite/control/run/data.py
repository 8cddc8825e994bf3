"""What the control loop reads and writes: one argument of all its functions."""

from typing import Any, NamedTuple

import mujoco
import numpy as np

from wbc_suite.compiling import as_argument, struct
from wbc_suite.control.contact.arrays import WholeBodyDynamics
from wbc_suite.control.contact.arrays import for_plain_python as body_for_plain_python
from wbc_suite.control.contact.state_source import (
    StateSource,
    source_for_plain_python,
)
from wbc_suite.control.ground.mujoco_functions import addresses
from wbc_suite.control.ground.physics import Physics, bind_physics
from wbc_suite.control.ground.records import Drives, Laws
from wbc_suite.control.ik.compiled_tick import WholeBodyArrays
from wbc_suite.control.part.ik_tick import HandIk
from wbc_suite.control.run.state_checks import CheckedState, checked_state
from wbc_suite.typing import Indices


@struct
class LoopData(NamedTuple):
    """A simulation with its control laws.

    Attributes:
        model: Address of the model; the model itself in plain Python.
        data: Address of its data; the data in plain Python.
        believed: Address of the state that laws read, see `state_source`; that of
            `data` where there are no sensors.
        physics: Views of the arrays of the believed state.
        checked: What is checked before the first and after the last step.
        laws: `LawRecord`s.
        drives: `Drive`s.
        resumes: 1 while a step waits for a QP that Python solves, shape (1,).
        bodies: Robots on their feet.
        ticks: Whole-body ticks that run in the loop.
        hands: Inverse kinematics of parts.
        sources: Sensors of robots.
    """

    model: Any
    data: Any
    believed: Any
    physics: Physics
    checked: CheckedState
    laws: Laws
    drives: Drives
    resumes: Indices
    bodies: tuple[WholeBodyDynamics, ...] = ()
    ticks: tuple[WholeBodyArrays, ...] = ()
    hands: tuple[HandIk, ...] = ()
    sources: tuple[StateSource, ...] = ()


def for_kernels(loop: LoopData) -> LoopData:
    """Return the same data as the argument of compiled functions."""
    model, data = addresses(loop.model, loop.data)
    _, believed = addresses(loop.model, loop.believed)
    return as_argument(loop._replace(model=model, data=data, believed=believed))


def for_plain_python(loop: LoopData) -> LoopData:
    """Return the same data, whose planners are plain Python."""
    return loop._replace(
        bodies=tuple(map(body_for_plain_python, loop.bodies)),
        sources=tuple(map(source_for_plain_python, loop.sources)),
    )


def loop_data(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    laws: Any,
    drives: Any,
    *,
    believed: mujoco.MjData | None = None,
) -> LoopData:
    """Return the data of a loop for plain Python; laws and drives are records."""
    believed = data if believed is None else believed
    return LoopData(
        model=model,
        data=data,
        believed=believed,
        physics=bind_physics(model, believed),
        checked=checked_state(model, data),
        laws=laws,
        drives=drives,
        resumes=np.zeros(1, dtype=np.int64),
    )
