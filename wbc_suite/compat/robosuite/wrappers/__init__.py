"""Wrappers of environments."""

from wbc_suite.compat.robosuite.wrappers.collecting import DataCollectionWrapper
from wbc_suite.compat.robosuite.wrappers.gym import GymWrapper
from wbc_suite.compat.robosuite.wrappers.plain import (
    DemoSamplerWrapper,
    DomainRandomizationWrapper,
    VisualizationWrapper,
    Wrapper,
)

__all__ = [
    "DataCollectionWrapper",
    "DemoSamplerWrapper",
    "DomainRandomizationWrapper",
    "GymWrapper",
    "VisualizationWrapper",
    "Wrapper",
]
