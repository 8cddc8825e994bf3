"""Policies, and many episodes of them with their statistics."""

from wbc_suite.evaluation.policies import POLICIES, Policy, make_policy
from wbc_suite.evaluation.rollouts import Case, plan_rollouts, run_rollouts
from wbc_suite.evaluation.statistics import Summary, episodes_of, summarise

__all__ = [
    "POLICIES",
    "Case",
    "Policy",
    "Summary",
    "episodes_of",
    "make_policy",
    "plan_rollouts",
    "run_rollouts",
    "summarise",
]
