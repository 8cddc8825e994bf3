"""The expert of Lift."""

from wbc_suite.benchmark.lift import CUBE, Lift
from wbc_suite.experts.scene import ExpertScene, Steps
from wbc_suite.experts.skills import pick


def lift(scene: ExpertScene[Lift]) -> Steps[None]:
    """Grasp the cube and raise it."""
    yield from pick(scene, CUBE, raised=0.12)
