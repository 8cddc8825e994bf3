"""The compiled control loop: n physics steps with all laws in one call."""

from typing import Any

from wbc_suite.compiling import compiled_inline, compiled_nogil
from wbc_suite.control.composite.tick import Ticks
from wbc_suite.control.dynamics.state_source import (
    Sources,
    pass_commands,
    read_all_sensors,
    use_all_feet,
)
from wbc_suite.control.loop.inverse_dynamics import WholeBodies, write_commands
from wbc_suite.control.loop.kernels import LoopKernels
from wbc_suite.control.loop.mujoco_functions import (
    mj_comPos,
    mj_kinematics,
    mj_step1,
    mj_step2,
)
from wbc_suite.control.loop.physics import Physics
from wbc_suite.control.loop.records import CompiledRecords
from wbc_suite.control.loop.state_checks import (
    CheckedState,
    check_after,
    check_before,
)


@compiled_nogil
def advance(
    model: Any,
    data: Any,
    believed: Any,
    physics: Physics,
    state: CheckedState,
    laws: CompiledRecords,
    drives: CompiledRecords,
    kernels: LoopKernels,
    bodies: WholeBodies,
    ticks: Ticks,
    sources: Sources,
    steps: int,
) -> int:
    """Advance physics under all laws, without the interpreter's lock.

    Poses of bodies and sites are updated at the end: a step of MuJoCo leaves them one
    step behind the joints.

    Args:
        model: Address of the model; the model itself in plain Python.
        data: Address of its data; the data in plain Python.
        believed: Address of the state that laws read; see `state_source`.
        physics: Views of its arrays; of `data` where there are no sensors.
        state: What is checked before the first and after the last step.
        laws: `LAW` records.
        drives: `DRIVE` records.
        kernels: What the laws need.
        bodies: Robots on their feet.
        ticks: Whole-body ticks that run here.
        sources: Sensors of robots.
        steps: Number of physics steps.

    Returns:
        Number of steps that were made, fewer where a tick or a QP needs Python.
        -1 if numbers were or are not usable, or MuJoCo warned. Where they are not to
        begin with, there is no step.
    """
    if not check_before(state):
        return -1
    done = 0
    while done < steps and _run_ticks(physics, laws, drives, kernels, ticks):
        mj_step1(model, data)
        if sources is not None:
            read_all_sensors(sources)
            mj_kinematics(model, believed)
            use_all_feet(sources)
            mj_step1(model, believed)
        if not write_commands(physics, laws, drives, kernels, bodies):
            break
        pass_commands(physics, sources)
        mj_step2(model, data)
        _count_down(ticks)
        done += 1
    mj_kinematics(model, data)
    mj_comPos(model, data)
    return done if check_after(state) else -1


@compiled_inline
def _run_ticks(
    physics: Physics,
    laws: CompiledRecords,
    drives: CompiledRecords,
    kernels: LoopKernels,
    ticks: Ticks,
) -> bool:
    """Run the ticks that are due; return whether all of them are done."""
    if ticks is not None:
        for tick in ticks:
            if tick.state[0].countdown <= 0:
                qpos, qvel = physics.qpos, physics.qvel
                if not kernels.run_tick(tick, qpos, qvel, laws, drives):
                    return False
    return True


@compiled_inline
def _count_down(ticks: Ticks) -> None:
    """Count the physics steps until the next ticks."""
    if ticks is not None:
        for tick in ticks:
            tick.state[0].countdown -= 1
