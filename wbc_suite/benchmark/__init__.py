"""Benchmarks: scenes with a goal. Their numbers live in `tasks/*.toml`."""

from wbc_suite.benchmark.base import (
    Benchmark,
    benchmark_names,
    load_benchmark,
    register_benchmark,
)
from wbc_suite.benchmark.lift import Lift

__all__ = [
    "Benchmark",
    "Lift",
    "benchmark_names",
    "load_benchmark",
    "register_benchmark",
]

register_benchmark("Lift", Lift)
