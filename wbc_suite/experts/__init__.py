"""Experts: scripted policies that solve the benchmarks, with any robot that can."""

from wbc_suite.experts.multiplication import Multiplied
from wbc_suite.experts.registry import EXPERTS, expert, find_expert, register_expert
from wbc_suite.experts.scene import ExpertScene, Steps

__all__ = [
    "EXPERTS",
    "ExpertScene",
    "Multiplied",
    "Steps",
    "expert",
    "find_expert",
    "register_expert",
]
