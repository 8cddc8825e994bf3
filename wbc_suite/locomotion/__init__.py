"""Gait planners: which feet stand, where the others land, how the body accelerates.

They use neither MuJoCo nor a QP, and can be called alone.
"""

from wbc_suite.locomotion.gait import (
    Gait,
    GaitConfig,
    Measured,
    Plan,
    TrotConfig,
    WalkConfig,
    begin_gait,
    make_gait,
    make_measured,
    make_plan,
)
from wbc_suite.locomotion.trot import plan_trot
from wbc_suite.locomotion.walk import plan_walk

__all__ = [
    "Gait",
    "GaitConfig",
    "Measured",
    "Plan",
    "TrotConfig",
    "WalkConfig",
    "begin_gait",
    "make_gait",
    "make_measured",
    "make_plan",
    "plan_trot",
    "plan_walk",
]
