"""What drives a robot without people: by name, and by anybody's own function."""

from wbc_suite.policies.choice import POLICIES, make_policy
from wbc_suite.policies.policy import Policy

__all__ = ["POLICIES", "Policy", "make_policy"]
