"""Experts by benchmark, and the policy that runs one."""

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import numpy as np

from wbc_suite.benchmark import (
    Benchmark,
    Carry,
    Door,
    Lift,
    LocoLift,
    NutAssembly,
    ObjectBenchmark,
    PickPlace,
    Reach,
    Stack,
    Stand,
    ToolHang,
    TwoArmHandover,
    TwoArmLift,
    TwoArmPegInHole,
    TwoArmTransport,
    WalkTo,
    Wipe,
)
from wbc_suite.envs import RobotEnv
from wbc_suite.errors import UnknownNameError
from wbc_suite.experts.carry import carry
from wbc_suite.experts.door import door
from wbc_suite.experts.lift import lift
from wbc_suite.experts.loco_lift import loco_lift
from wbc_suite.experts.nut_assembly import nut_assembly
from wbc_suite.experts.on_feet import reach, stand, walk_to
from wbc_suite.experts.pick_place import pick_place
from wbc_suite.experts.scene import ExpertScene, Steps
from wbc_suite.experts.stack import stack
from wbc_suite.experts.tool_hang import tool_hang
from wbc_suite.experts.two_arm_handover import two_arm_handover
from wbc_suite.experts.two_arm_lift import two_arm_lift
from wbc_suite.experts.two_arm_peg_in_hole import two_arm_peg_in_hole
from wbc_suite.experts.two_arm_transport import two_arm_transport
from wbc_suite.experts.wipe import wipe
from wbc_suite.registry import Registry
from wbc_suite.typing import Vector

Expert: TypeAlias = Callable[[ExpertScene[Any]], Steps[None]]
"""Program of a benchmark: it moves arms by skills, one control period per `yield`."""

EXPERTS: Registry[tuple[type, Expert]] = Registry("expert")
"""Classes of benchmarks and their experts, by the name of the class."""


def register_expert(benchmark: type, expert: Expert, *, replace: bool = False) -> None:
    """Register the expert of a class of benchmarks, and of those derived from it.

    Raises:
        ConfigError: If a class of this name has an expert.
    """
    EXPERTS.register(benchmark.__name__, (benchmark, expert), replace=replace)


def find_expert(benchmark: Benchmark) -> tuple[Expert, ObjectBenchmark]:
    """Return the expert of a benchmark's class, and the benchmark.

    Raises:
        UnknownNameError: If neither its class nor one that it derives from has one.
    """
    known = dict(EXPERTS[name] for name in EXPERTS)
    kinds = type(benchmark).__mro__
    program = next((known[kind] for kind in kinds if kind in known), None)
    if program is None or not isinstance(benchmark, ObjectBenchmark):
        raise UnknownNameError("expert", benchmark.name, EXPERTS)
    return program, benchmark


def expert(
    env: RobotEnv, rng: np.random.Generator
) -> Callable[[Mapping[str, Any]], Vector]:
    """Make the policy of the benchmark's expert; the environment was reset.

    It reads the state of the simulation, not the observation. After its last step it
    holds all goals.

    Raises:
        UnknownNameError: If the benchmark has no expert.
        ConfigError: If the action has neither poses of hands nor a walk.
    """
    program, benchmark = find_expert(env.benchmark)
    scene = ExpertScene(env, benchmark, rng)
    steps = program(scene)

    def drive(observation: Mapping[str, Any]) -> Vector:
        del observation
        next(steps, None)
        return scene.action()

    return drive


register_expert(Carry, carry)
register_expert(Door, door)
register_expert(Lift, lift)
register_expert(LocoLift, loco_lift)
register_expert(NutAssembly, nut_assembly)
register_expert(PickPlace, pick_place)
register_expert(Reach, reach)
register_expert(Stack, stack)
register_expert(Stand, stand)
register_expert(ToolHang, tool_hang)
register_expert(TwoArmHandover, two_arm_handover)
register_expert(TwoArmLift, two_arm_lift)
register_expert(TwoArmPegInHole, two_arm_peg_in_hole)
register_expert(WalkTo, walk_to)
register_expert(Wipe, wipe)
register_expert(TwoArmTransport, two_arm_transport)
