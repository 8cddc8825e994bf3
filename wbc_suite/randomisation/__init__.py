"""Domain randomisation: scenes that look and behave otherwise in every episode."""

from wbc_suite.randomisation.randomisation import Randomisation

__all__ = ["Randomisation"]
