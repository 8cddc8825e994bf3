"""One episode run in many ways, which must all end in bit-identical states."""

import copy
import hashlib
import multiprocessing
import multiprocessing.connection
import pickle
from collections import Counter
from collections.abc import Callable

import numpy as np

from harness.trials import Case, Found
from wbc_suite.envs.env import RobotEnv

__all__ = ["differ", "digest"]

SEED = 11


def digest(
    env: RobotEnv, steps: int, *, between: Callable[[], object] = lambda: None
) -> str:
    """Return a digest of all states and observations of an episode, but pictures."""
    env.reset(seed=SEED)
    rng, found = np.random.default_rng(SEED), hashlib.sha256()
    low, high = env.action_space.low, env.action_space.high
    for _ in range(steps):
        between()
        seen, reward, *_ = env.step(0.3 * rng.uniform(low, high))
        found.update(env.physics_state.tobytes())
        found.update(np.float64(reward).tobytes())
        for key in sorted(seen):
            if not key.endswith("_image"):
                found.update(np.ascontiguousarray(seen[key]).tobytes())
    return found.hexdigest()


def anew(case: Case, steps: int, pictures: bool = False) -> str:
    """Return the digest of an environment made for it."""
    sized = {"camera_heights": 32, "camera_widths": 32} if pictures else {}
    env = case.make(reward_shaping=True, use_camera_obs=pictures, **sized)
    try:
        return digest(env, steps)
    finally:
        env.close()


def differ(case: Case, *, steps: int) -> Found:
    """Compare ways of taking one episode; pictures are drawn for a tenth of it."""
    env = case.make(reward_shaping=True)
    first, short = digest(env, steps), digest(env, steps // 10)
    ways = {
        "again": lambda: digest(env, steps),
        "with the global generator disturbed": lambda: digest(
            env, steps, between=_disturb
        ),
        "after 100 resets": lambda: digest(_after_resets(env), steps),
        "of a deep copy": lambda: digest(copy.deepcopy(env), steps),
        "of a pickle": lambda: digest(pickle.loads(pickle.dumps(env)), steps),
        "in a spawned process": lambda: _elsewhere("spawn", case, steps),
        "in a forked process": lambda: _elsewhere("fork", case, steps),
    }
    found = Found()
    for name, way in ways.items():
        found.faults[f"another episode {name}"] += way() != first
    found.faults["another end after going back"] += not _going_back(env, steps)
    found.faults["another episode with pictures"] += (
        anew(case, steps // 10, True) != short
    )
    env.close()
    found.faults = Counter(+found.faults)
    return found


def _disturb() -> None:
    np.random.seed(1)  # noqa: NPY002 - what other code may do
    np.random.uniform()  # noqa: NPY002


def _after_resets(env: RobotEnv) -> RobotEnv:
    for seed in range(100):
        env.reset(seed=seed)
    return env


def _elsewhere(method: str, case: Case, steps: int) -> str:
    """Return the digest that a worker finds."""
    context = multiprocessing.get_context(method)
    receiver, sender = context.Pipe(duplex=False)
    worker = context.Process(target=_send, args=(sender, case, steps))
    worker.start()
    sender.close()
    found = receiver.recv()
    worker.join()
    return found


def _send(
    sender: "multiprocessing.connection.Connection", case: Case, steps: int
) -> None:
    sender.send(anew(case, steps))


def _going_back(env: RobotEnv, steps: int) -> bool:
    """Take an episode, go back to its half, and take the rest again."""
    env.reset(seed=SEED)
    env.action_space.seed(SEED)
    actions = [env.action_space.sample() for _ in range(steps)]
    for action in actions[: steps // 2]:
        env.step(action)
    state, ends = env.get_state(), []
    for _ in range(2):
        for action in actions[steps // 2 :]:
            env.step(action)
        ends.append(env.physics_state.tobytes())
        env.set_state(state)
    return ends[0] == ends[1]
