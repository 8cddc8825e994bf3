"""The control step of robots that stand on feet.

It has an entry of its own, so that compiling the loop of robots without feet does not
take as long again.
"""

from wbc_suite.compiling import compiled, compiled_inner
from wbc_suite.control.loop.balance import balance_law
from wbc_suite.control.loop.kernels import ask, write_forces
from wbc_suite.control.loop.observer import inertia_times_acceleration
from wbc_suite.control.loop.physics import Physics, physics_of
from wbc_suite.control.loop.stance import stance_law, take_contact_forces
from wbc_suite.control.loop.table import CompiledRecords, LawKind
from wbc_suite.typing import Indices

__all__ = ["command_standing", "control_standing"]

_STANCE, _BALANCE = int(LawKind.STANCE), int(LawKind.BALANCE)


@compiled
def control_standing(
    timestep: float, table: Indices, laws: CompiledRecords, drives: CompiledRecords
) -> None:
    """Do what `command_standing` does, for one step."""
    command_standing(physics_of(table, timestep), laws, drives)


@compiled_inner
def command_standing(
    physics: Physics, laws: CompiledRecords, drives: CompiledRecords
) -> None:
    """Do what `command` does; roots and legs follow when all that feet carry has."""
    ask(physics, laws, drives)
    for k in range(laws.shape[0]):
        if laws[k].kind == _STANCE:
            stance_law(physics, laws[k], drives)
        elif laws[k].kind == _BALANCE:
            balance_law(physics, laws[k], drives)
    inertia_times_acceleration(physics)
    take_contact_forces(physics, laws, drives)
    write_forces(physics, laws, drives)
