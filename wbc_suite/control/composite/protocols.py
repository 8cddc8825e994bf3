"""What the simulation asks of composite controllers."""

from typing import Any, Protocol, runtime_checkable

from wbc_suite.control.action import ActionLayout
from wbc_suite.control.contact.arrays import WholeBodyDynamics
from wbc_suite.control.contact.state_source import StateSourceConfig
from wbc_suite.control.ik.compiled_tick import WholeBodyArrays
from wbc_suite.control.law.law import Law
from wbc_suite.control.memory import Parts
from wbc_suite.control.part.ik_tick import HandIk
from wbc_suite.control.state import RobotState
from wbc_suite.typing import Vector


class CompositeController(Protocol):
    """Drives all actuators of one robot.

    The order of calls is `reset`, then `set_goal` once per action, then `prepare`
    before the first physics step and whenever its answer has expired. The laws act
    between `mj_step1` and `mj_step2` of every step, in the compiled loop.
    """

    layout: ActionLayout
    laws: tuple[Law, ...]

    @property
    def hold_action(self) -> Vector:
        """The action that keeps the present goals."""
        ...

    def info(self, state: RobotState) -> dict[str, Any]:
        """Return entries of the environment's `info`, by key."""
        ...

    def reset(self, state: RobotState) -> None:
        """Start from the robot's state; goals hold it there."""

    def set_goal(self, action: Vector, period: float = 0.05) -> None:
        """Take an action that `layout` has checked; the next comes in `period` s."""

    def prepare(self, state: RobotState) -> int:
        """Update the laws; return for how many physics steps that is enough."""
        ...


@runtime_checkable
class SteppedController(CompositeController, Protocol):
    """A composite controller that computes commands in Python at every physics step.

    Its laws act first; `compute` overrides their commands.
    """

    def compute(self, state: RobotState) -> Vector:
        """Return one command per actuator, in the order of `state.actuators`.

        Called after `mj_step1`. A command is a torque, or a setpoint where the actuator
        is a servo.
        """
        ...


@runtime_checkable
class ResumableController(CompositeController, Protocol):
    """A composite controller whose references saved states hold.

    Others start from the robot's state where a saved state is restored.
    """

    @property
    def memory(self) -> Parts:
        """Its arrays that outlive a tick, but those of its laws; views."""
        ...

    def resume(self, state: RobotState) -> None:
        """Go on from values that were written into `memory`, after a reset."""


@runtime_checkable
class TickedController(CompositeController, Protocol):
    """A composite controller whose ticks the control loop can run."""

    def loop_ticks(self) -> tuple[WholeBodyArrays | HandIk, ...]:
        """Return the ticks; none where Python computes each.

        Called once the laws are in the loop's table. With a whole-body tick `prepare`
        is not called.
        """
        ...

    def finish_tick(self) -> None:
        """Finish a tick that the loop has begun, if there is one."""


@runtime_checkable
class BodySolver(Protocol):
    """Finds contact forces and accelerations of a robot on its feet by one QP.

    Kernels read and write `dynamics`, see `solve_whole_body`; `sensors` says where the
    state of the robot comes from.
    """

    dynamics: WholeBodyDynamics
    sensors: StateSourceConfig

    def finish_tick(self) -> None:
        """Solve the QP if the loop has stated it and not found its active set."""


def solver_of_body(controller: CompositeController) -> BodySolver | None:
    """Return what finds the contact forces of a controller's robot, if it has feet.

    The controller itself, or its attribute `standing`.
    """
    if isinstance(controller, BodySolver):
        return controller
    standing = getattr(controller, "standing", None)
    return standing if isinstance(standing, BodySolver) else None
