"""The expert of Lift."""

from wbc_suite.benchmark.lift import CUBE, Lift
from wbc_suite.experts.skills import pick
from wbc_suite.experts.workcell import Steps, Workcell


def lift(cell: Workcell[Lift]) -> Steps[None]:
    """Grasp the cube and raise it."""
    yield from pick(cell, CUBE, raised=0.12)
