"""Benchmarks: scenes with a goal. Their numbers live in `tasks/*.toml`."""

from wbc_suite.benchmark.base import (
    BENCHMARKS,
    Benchmark,
    load_benchmark,
    register_benchmark,
)
from wbc_suite.benchmark.carry import Carry
from wbc_suite.benchmark.door import Door
from wbc_suite.benchmark.lift import Lift
from wbc_suite.benchmark.loco_lift import LocoLift
from wbc_suite.benchmark.nut_assembly import NutAssembly
from wbc_suite.benchmark.object_benchmark import ObjectBenchmark, ObjectBenchmarkConfig
from wbc_suite.benchmark.pick_place import PickPlace
from wbc_suite.benchmark.reach import Reach
from wbc_suite.benchmark.reward_terms import REWARD_TERMS, register_reward_term
from wbc_suite.benchmark.stack import Stack
from wbc_suite.benchmark.stand import Stand
from wbc_suite.benchmark.tool_hang import ToolHang
from wbc_suite.benchmark.two_arm_handover import TwoArmHandover
from wbc_suite.benchmark.two_arm_lift import TwoArmLift
from wbc_suite.benchmark.two_arm_peg_in_hole import TwoArmPegInHole
from wbc_suite.benchmark.two_arm_transport import TwoArmTransport
from wbc_suite.benchmark.walk_to import WalkTo
from wbc_suite.benchmark.wipe import Wipe

__all__ = [
    "BENCHMARKS",
    "REWARD_TERMS",
    "Benchmark",
    "Carry",
    "Door",
    "Lift",
    "LocoLift",
    "NutAssembly",
    "ObjectBenchmark",
    "ObjectBenchmarkConfig",
    "PickPlace",
    "Reach",
    "Stack",
    "Stand",
    "ToolHang",
    "TwoArmHandover",
    "TwoArmLift",
    "TwoArmPegInHole",
    "TwoArmTransport",
    "WalkTo",
    "Wipe",
    "load_benchmark",
    "register_benchmark",
    "register_reward_term",
]

_VARIANTS = {
    NutAssembly: ("Single", "Square", "Round"),
    PickPlace: ("Single", "Milk", "Bread", "Cereal", "Can"),
}
for _build in (
    *(Carry, Door, Lift, LocoLift, NutAssembly, PickPlace, Reach, Stack, Stand),
    *(ToolHang, TwoArmHandover, TwoArmLift, TwoArmPegInHole, TwoArmTransport),
    *(WalkTo, Wipe),
):
    for _variant in ("", *_VARIANTS.get(_build, ())):
        register_benchmark(_build.__name__ + _variant, _build)
