"""Many episodes of many environments, counted: success, return, speed."""

from wbc_suite.rollout.plan import Case, plan
from wbc_suite.rollout.summary import Summary, episodes_of, summarise
from wbc_suite.rollout.work import roll_out

__all__ = [
    "Case",
    "Summary",
    "episodes_of",
    "plan",
    "roll_out",
    "summarise",
]
