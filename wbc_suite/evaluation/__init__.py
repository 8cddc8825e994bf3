"""Policies, many episodes of them, and statistics that can be cited."""

from wbc_suite.evaluation.comparison import Comparison, compare
from wbc_suite.evaluation.perturbations import (
    PERTURBATIONS,
    Perturbation,
    register_perturbation,
)
from wbc_suite.evaluation.policies import (
    POLICIES,
    Policy,
    check_policy,
    make_policy,
    register_policy,
    replicate,
)
from wbc_suite.evaluation.policy_socket import PolicyServer
from wbc_suite.evaluation.results import episodes_of
from wbc_suite.evaluation.rollouts import (
    Case,
    ErrorKind,
    PolicyError,
    episode_seed,
    episode_seeds,
    plan_rollouts,
    run_rollouts,
)
from wbc_suite.evaluation.statistics import (
    Summary,
    interquartile_mean,
    probability_of_improvement,
    stratified_bootstrap,
    success_interval,
    summarise,
)

__all__ = [
    "PERTURBATIONS",
    "POLICIES",
    "Case",
    "Comparison",
    "ErrorKind",
    "Perturbation",
    "Policy",
    "PolicyError",
    "PolicyServer",
    "Summary",
    "check_policy",
    "compare",
    "episode_seed",
    "episode_seeds",
    "episodes_of",
    "interquartile_mean",
    "make_policy",
    "plan_rollouts",
    "probability_of_improvement",
    "register_perturbation",
    "register_policy",
    "replicate",
    "run_rollouts",
    "stratified_bootstrap",
    "success_interval",
    "summarise",
]
