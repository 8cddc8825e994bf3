"""Gait planners: which feet stand, where the others land, how the body accelerates.

`BaseEstimate` is a filter for the base's state from an IMU and standing feet.

They use neither MuJoCo nor a QP, and can be called alone.
"""

from wbc_suite.locomotion.base_estimator import (
    BaseEstimate,
    EstimatorNoise,
    begin_estimate,
    correct,
    make_base_estimate,
    propagate,
)
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
from wbc_suite.locomotion.gait_registry import GAITS, register_gait
from wbc_suite.locomotion.trot import plan_trot
from wbc_suite.locomotion.walk import plan_walk

__all__ = [
    "GAITS",
    "BaseEstimate",
    "EstimatorNoise",
    "Gait",
    "GaitConfig",
    "Measured",
    "Plan",
    "TrotConfig",
    "WalkConfig",
    "begin_estimate",
    "begin_gait",
    "correct",
    "make_base_estimate",
    "make_gait",
    "make_measured",
    "make_plan",
    "plan_trot",
    "plan_walk",
    "propagate",
    "register_gait",
]
