"""Wrong input to an environment: refused actions, and bad numbers in physics."""

from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np

from harness.trials import Case, Found
from wbc_suite.control.part.registry import PART_CONTROLLERS
from wbc_suite.envs.env import RobotEnv
from wbc_suite.errors import ActionError
from wbc_suite.typing import Vector

__all__ = ["controlled", "inject", "refuse"]

SEED = 7
BETWEEN = 20
"""Bad actions from one good one to the next."""
ARRAYS = ("qpos", "qvel", "qfrc_applied", "xfrc_applied")
COMPOSITES = {
    "BASIC": ("SpotWithArm",),
    "WHOLE_BODY_IK": ("GR1",),
    "WHOLE_BODY_MINK_IK": ("Tiago",),
    "HYBRID_MOBILE_BASE": ("PandaOmron",),
}
OF_ARMS = ("OSC", "IK", "JOINT")
"""What the names of controllers of arms begin with."""


def controlled(benchmark: str) -> list[Case]:
    """Return a case for each controller, with a robot that it is for."""
    parts = [name for name in PART_CONTROLLERS if name.startswith(OF_ARMS)]
    kinds = COMPOSITES | {name: ("Panda",) for name in parts}
    return [
        Case(benchmark=benchmark, robots=robots, controller=name)
        for name, robots in kinds.items()
    ]


def refuse(case: Case, *, actions: int) -> Found:
    """Try bad actions between good ones; the future must be that without them."""
    env, twin = case.make(), case.make()
    rng, found = np.random.default_rng(SEED), Found()
    env.reset(seed=SEED)
    twin.reset(seed=SEED)
    for k in range(actions):
        found.faults.update(_try(env, rng))
        if k % BETWEEN == 0 or k == actions - 1:
            good = rng.uniform(env.action_space.low, env.action_space.high)
            seen, theirs = env.step(good)[0], twin.step(good)[0]
            same = all(np.array_equal(seen[key], theirs[key]) for key in seen)
            same = same and np.array_equal(env.physics_state, twin.physics_state)
            found.faults["another future after bad actions"] += not same
    env.close()
    twin.close()
    found.faults = +found.faults
    return found


def _try(env: RobotEnv, rng: np.random.Generator) -> list[str]:
    """Take one bad action; say what is wrong with the answer."""
    before = env.physics_state.tobytes()
    action, told = _bad(env.hold_action, rng)
    try:
        env.step(action)
    except ActionError as error:
        text = str(error)
        faults = [f"does not tell {t!r}: {text}" for t in told if t not in text]
    else:
        faults = ["took a bad action"]
    if env.physics_state.tobytes() != before:
        faults.append("a refused action changed the state")
    return faults


def _bad(hold: Vector, rng: np.random.Generator) -> tuple[Any, list[str]]:
    """Return a bad action, and what the error must name."""
    kind, place = rng.integers(8), int(rng.integers(hold.size))
    if kind < 4:
        value = (np.nan, np.inf, -np.inf)[rng.integers(3)]
        hold[place] = value
        wrapped: Callable[[Vector], Any] = (
            np.copy,
            list,
            np.float32,
            np.ndarray.tolist,
        )[kind]
        return wrapped(hold), [str(place), str(value)]
    others: tuple[Any, ...] = (
        rng.normal(size=hold.size + 1 + place),
        hold[:-1],
        rng.normal(size=(1 + place, hold.size)),
        (None, "up", 0.5, {}, [[]], hold + 1j, hold.astype(str))[place % 7],
    )
    return others[kind - 4], []


def inject(case: Case, *, count: int) -> Found:
    """Write NaN or 1e12 into the simulation; the same step must tell it."""
    env, rng, found = case.make(), np.random.default_rng(SEED), Counter[str]()
    for k in range(count):
        env.reset(seed=k)
        for _ in range(rng.integers(0, 4)):
            env.step(env.hold_action)
        data = env.simulation.data
        name, value = ARRAYS[rng.integers(4)], (np.nan, 1e12)[rng.integers(2)]
        values = getattr(data, name).reshape(-1)
        values[rng.integers(values.size)] = value
        time = data.time
        seen, reward, terminated, _, info = env.step(env.hold_action)
        told = terminated and reward == 0.0 and "physics_error" in info
        found[f"{value} in {name} is not told"] += not told
        found["time runs back"] += data.time < time
        found[
            "observations outside of their space"
        ] += not env.observation_space.contains(seen)
        data.xfrc_applied[:] = 0.0
        data.qfrc_applied[:] = 0.0
    env.close()
    return Found(faults=+found)
