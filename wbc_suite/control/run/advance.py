"""The control loop: n physics steps with all laws in one call."""

from wbc_suite.compiling import compiled_nogil
from wbc_suite.control.ground.mujoco_functions import (
    mj_comPos,
    mj_kinematics,
    mj_step1,
    mj_step2,
)
from wbc_suite.control.run.data import LoopData
from wbc_suite.control.run.kernel_table import LoopKernels
from wbc_suite.control.run.motor_commands import write_commands
from wbc_suite.control.run.state_checks import check_after, check_before


@compiled_nogil
def advance(loop: LoopData, kernels: LoopKernels, steps: int) -> int:
    """Advance physics under all laws, without the interpreter's lock.

    Poses of bodies and sites are updated at the end: a step of MuJoCo leaves them one
    step behind the joints.

    Returns:
        Number of steps that were made, fewer where a tick or a QP needs Python, or a
        controller that computes commands failed.
        -1 if numbers were or are not usable, or MuJoCo warned. Where they are not to
        begin with, there is no step.
    """
    if not check_before(loop.checked):
        return -1
    model, data, done = loop.model, loop.data, 0
    while done < steps:
        mj_step1(model, data)
        kernels.read_sensors(loop)
        if not (kernels.run_ticks(loop) and kernels.run_hands(loop)):
            break
        if not write_commands(loop, kernels):
            break
        kernels.pass_commands(loop)
        if not kernels.override():
            break
        mj_step2(model, data)
        done += 1
    mj_kinematics(model, data)
    mj_comPos(model, data)
    return done if check_after(loop.checked) else -1
