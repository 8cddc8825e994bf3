"""Long trials: many steps, resets and environments; each reports what went wrong.

Every trial is a function of plain arguments that returns a `Found`, so that it can run
in a process of its own.
"""

import gc
import itertools
import time
import weakref
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import wbc_suite
from harness.memory import resident
from wbc_suite.catalogue import Catalogue
from wbc_suite.envs.env import RobotEnv
from wbc_suite.timing import Block, time_block, times

__all__ = [
    "Case",
    "Found",
    "act",
    "alone",
    "keep_many",
    "make_and_close",
    "over_raw",
    "place",
    "reset_often",
    "robots_of",
    "start",
]

ARMS_OF_TWO = "TwoArm"
ACTION = 0.1
"""Random actions beside the one that holds, of what is timed."""
SETTLED = 10
"""Actions after which things are to be at rest: half a second at 20 Hz."""


@dataclass(frozen=True, kw_only=True)
class Case:
    """A benchmark, who acts in it, and with which controller."""

    benchmark: str
    robots: tuple[str, ...] = ()
    way: str = "default"
    controller: str | None = None

    @property
    def name(self) -> str:
        """Its parts as a path."""
        robots = "+".join(dict.fromkeys(self.robots))
        way = "" if self.way in ("default", "single-robot") else self.way
        parts = (self.benchmark, robots, way, self.controller)
        return "/".join(filter(None, parts))

    @property
    def has_two_arms(self) -> bool:
        """Whether the benchmark is for two arms, whoever acts in it."""
        return self.benchmark.startswith(ARMS_OF_TWO)

    def make(self, **more: Any) -> RobotEnv:
        """Make the environment."""
        if self.robots:
            more |= {"robots": list(self.robots)}
        more |= {"env_configuration": self.way}
        if self.controller is not None:
            more |= {"controller_configs": self.controller}
        env = wbc_suite.make(self.benchmark, **more).unwrapped
        assert isinstance(env, RobotEnv), "`make` made it"
        return env


@dataclass(kw_only=True)
class Found:
    """What a trial found.

    Attributes:
        times: CPU times of what it repeats, us.
        faults: How often each thing went wrong; empty is good.
        figures: What else it measured, by name and unit.
    """

    times: list[float] = field(default_factory=list)
    faults: Counter[str] = field(default_factory=Counter)
    figures: dict[str, float] = field(default_factory=dict)


def robots_of(benchmark: str) -> Sequence[tuple[tuple[str, ...], str]]:
    """Return the robots that can do something in a benchmark, and how they stand."""
    names = [wbc_suite.load_robot(p).name for p in Catalogue().files("robots")]
    hands = {name: len(wbc_suite.load_robot(name).hands) for name in names}
    if not benchmark.startswith(ARMS_OF_TWO):
        return [((name,), "default") for name in names if hands[name]]
    found: list[tuple[tuple[str, ...], str]] = [
        ((name,), "single-robot") for name in names if hands[name] == 2
    ]
    single = [name for name in names if hands[name] == 1]
    ways = ("opposed", "parallel")
    return found + [((name, name), way) for name in single for way in ways]


def act(case: Case, *, steps: int, seed: int) -> Found:
    """Take random actions, and look at all that comes back."""
    env = case.make(reward_shaping=True)
    env.reset(seed=seed)
    env.action_space.seed(seed)
    found = Found()
    for _ in range(steps):
        action = env.action_space.sample()
        start = time.thread_time_ns()
        seen, reward, _, truncated, info = env.step(action)
        found.times.append((time.thread_time_ns() - start) / 1e3)
        found.faults.update(_wrong(env, seen, reward, info))
        if truncated or "physics_error" in info:
            env.reset()
    env.close()
    return found


def _wrong(env: RobotEnv, seen: dict, reward: float, info: dict) -> list[str]:
    """Say in words what is wrong with a step."""
    faults = []
    if "physics_error" in info:
        faults.append(f"physics: {info['physics_error']}")
    elif env.simulation.data.warning.number.any():
        faults.append("a warning of MuJoCo")
    for key, space in env.observation_space.items():
        if not np.isfinite(seen[key]).all():
            faults.append(f"{key} is not finite")
        elif not space.contains(seen[key]):
            faults.append(f"{key} is outside its space")
    if seen.keys() != env.observation_space.keys():
        faults.append("keys are not those of the space")
    if not 0.0 <= reward <= 1.0:
        faults.append("shaped reward outside [0, 1]")
    sparse = env.benchmark.reward(shaped=False)
    if sparse != float(info["success"]) and "physics_error" not in info:
        faults.append("sparse reward is not success")
    return faults


def over_raw(case: Case, *, blocks: int, steps: int = 24) -> Found:
    """Time steps, and raw physics from the same states, in turns."""
    env = case.make(horizon=10**9)
    rng, whole = np.random.default_rng(0), Block()
    substeps = round(1.0 / (env.config.control_freq * env.simulation.timestep))
    for k in range(blocks + 1):
        env.reset(seed=k)
        hold = env.hold_action
        block = time_block(
            env.step,
            list(hold + rng.uniform(-ACTION, ACTION, (steps, hold.size))),
            model=env.simulation.model,
            data=env.simulation.data,
            substeps=substeps,
        )
        if k:  # the first one warms up
            whole.extend(block)
    resets = times(10 * blocks, env.reset)
    env.close()
    raw, step = float(np.median(whole.raw)), float(np.median(whole.step))
    figures = {"raw_us": raw, "over_raw": step / raw}
    figures["reset_ms"] = float(np.median(resets)) / 1e3
    return Found(times=whole.step, figures=figures)


def place(case: Case, *, seeds: int) -> Found:
    """Reset with many seeds; tell overlaps, and speeds half a second later."""
    env, found = case.make(), Found()
    deepest, fastest = 0.0, 0.0
    for seed in range(seeds):
        start = time.thread_time_ns()
        _, info = env.reset(seed=seed)
        found.times.append((time.thread_time_ns() - start) / 1e3)
        found.faults["starts as a success"] += info["success"]
        deepest = max(deepest, _overlap(env))
        for _ in range(SETTLED):
            env.step(env.hold_action)
        fastest = max(fastest, _speed(env))
    env.close()
    found.faults = +found.faults
    found.figures = {"overlap_mm": 1e3 * deepest, "speed_mm_s": 1e3 * fastest}
    return found


def start(case: Case, *, seeds: int) -> Found:
    """Reset with many seeds; tell overlaps."""
    env, found, deepest = case.make(), Found(), 0.0
    for seed in range(seeds):
        found.times += times(1, partial(env.reset, seed=seed))
        deepest = max(deepest, _overlap(env))
    env.close()
    found.figures = {"overlap_mm": 1e3 * deepest}
    return found


def _overlap(env: RobotEnv) -> float:
    """Return how deep things overlap with anything, m."""
    things = {g for state in _things(env) for g in state.geoms}
    contact = env.simulation.data.contact
    return max(
        (
            -float(depth)
            for pair, depth in zip(contact.geom, contact.dist, strict=True)
            if things.intersection(pair.tolist())
        ),
        default=0.0,
    )


def _speed(env: RobotEnv) -> float:
    """Return the speed of the fastest free thing, m/s."""
    data = env.simulation.data
    names = [state.name for state in _things(env) if state.is_free]
    speeds = [np.linalg.norm(data.joint(f"{n}_joint").qvel[:3]) for n in names]
    return float(max(speeds, default=0.0))


def _things(env: RobotEnv) -> list[Any]:
    return list(getattr(env.benchmark, "states", {}).values())


def reset_often(case: Case, *, count: int) -> Found:
    """Reset many times; tell how memory grows."""
    env = case.make()
    for seed in range(20):
        env.reset(seed=seed)
    before = resident()
    found = Found(times=times(count, env.reset))
    found.figures = {"grown_mb": resident() - before}
    env.close()
    return found


def make_and_close(case: Case, *, cycles: int) -> Found:
    """Make, draw, step and close many times without garbage collection.

    What is left of an environment would be found by the collector afterwards, or by
    weak references that still point to something.
    """

    def cycle() -> list[weakref.ref]:
        env = case.make(render_mode="rgb_array", render_size=(64, 64))
        env.reset(seed=0)
        env.step(env.hold_action)
        env.render()
        env.close()
        return [weakref.ref(x) for x in (env, env.simulation, env.cameras)]

    for _ in range(5):
        cycle()
    gc.collect()
    gc.disable()
    try:
        before = resident(), _files(), _threads()
        found, alive = Found(), []
        for _ in range(cycles):
            found.times += times(1, lambda: alive.extend(cycle()))
        after = resident(), _files(), _threads()
        found.faults["environments that live on"] = sum(r() is not None for r in alive)
        left = _garbage()
    finally:
        gc.enable()
    found.faults = +found.faults
    names = ("grown_mb", "files", "threads")
    figures = zip(names, after, before, strict=True)
    found.figures = {name: float(a - b) for name, a, b in figures}
    found.figures["garbage"] = float(left)  # not PyOpenGL's: 8 objects a context
    return found


def _garbage() -> int:
    """Return how many objects of ours, or big ones, only the collector finds."""
    gc.set_debug(gc.DEBUG_SAVEALL)
    gc.collect()
    gc.set_debug(0)
    kinds = [type(x).__module__.partition(".")[0] for x in gc.garbage]
    gc.garbage.clear()
    return sum(kind in ("wbc_suite", "mujoco", "numpy", "pinocchio") for kind in kinds)


def keep_many(case: Case, *, count: int) -> Found:
    """Keep many environments in one process, and step all of them."""
    first = case.make()
    before, found = resident(), Found()
    envs = [case.make() for _ in range(count - 1)] + [first]
    for env in envs:
        env.reset(seed=1)
    for _, env in itertools.product(range(3), envs):
        found.times += times(1, lambda: env.step(env.hold_action))  # noqa: B023
    states = {env.physics_state.tobytes() for env in envs}
    found.faults["equal seeds, other states"] = len(states) - 1
    found.faults = +found.faults
    found.figures = {"each_mb": (resident() - before) / max(count - 1, 1)}
    return found


def alone(trial: Callable[..., Found], case: Case, numbers: dict[str, int]) -> Found:
    """Run a trial; an exception is a fault."""
    try:
        return trial(case, **numbers)
    except Exception as error:  # noqa: BLE001 - to be told beside all other trials
        return Found(faults=Counter([f"{type(error).__name__}: {error}"]))


def _files() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


def _threads() -> int:
    return len(list(Path("/proc/self/task").iterdir()))
