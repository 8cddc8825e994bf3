"""Episodes of policies in environments, as work items of an executor."""

import hashlib
import json
import multiprocessing
import re
import shutil
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict, dataclass
from enum import StrEnum
from functools import lru_cache
from pathlib import Path
from types import FrameType
from typing import Any

import gymnasium
import numpy as np

from wbc_suite.envs import RobotEnv, make
from wbc_suite.errors import ConfigError, WbcError, shortened
from wbc_suite.evaluation.perturbations import PERTURBATIONS, Perturbation
from wbc_suite.evaluation.policies import Policy, make_policy
from wbc_suite.executors import WorkItem
from wbc_suite.recording.dataset import parts_folder
from wbc_suite.typing import Vector
from wbc_suite.wrappers import DataCollection

SEED_BITS = 53  # so that every reader of JSON keeps a seed


@dataclass(frozen=True, kw_only=True, slots=True)
class Case:
    """An environment and the policy that acts in it.

    Benchmark and controller are names or files. `arguments` are further ones of
    `wbc_suite.make`, plain JSON data, sorted. `action_time` and `episode_time` are the
    most wall time of the policy for an action (the first may compile), and of an
    episode, s; 0 for no limit. `perturb` is one of `PERTURBATIONS`, "" for none.
    """

    benchmark: str
    robots: tuple[str, ...]
    controller: str | None = None
    policy: str = "random"
    perturb: str = ""
    record: bool = False
    action_time: float = 60.0
    episode_time: float = 3600.0
    arguments: tuple[tuple[str, str | int | float | bool], ...] = ()

    @property
    def title(self) -> str:
        """The case in one line."""
        parts = (self.benchmark, "+".join(self.robots), self.controller, self.policy)
        perturbed = f"with another {self.perturb}" if self.perturb else ""
        return " ".join(p for p in (*parts, perturbed) if p)


def episode_seed(base: int, benchmark: str, episode: int) -> int:
    """Return the seed of an episode; it depends on nothing else.

    So another benchmark, or more episodes, change no scene. `benchmark` is a name or a
    file, of which the stem counts; case is ignored.
    """
    name = Path(benchmark).stem.casefold()
    digest = hashlib.sha256(f"{base}/{name}/{episode}".encode()).digest()
    return int.from_bytes(digest[:8], "big") >> (64 - SEED_BITS)


def episode_seeds(benchmark: str, count: int, *, base: int = 0) -> list[int]:
    """Return the seeds of the first episodes of a benchmark."""
    return [episode_seed(base, benchmark, k) for k in range(count)]


def plan_rollouts(
    cases: Iterable[Case], *, seeds: Sequence[int], chunk: int
) -> list[WorkItem]:
    """Split the episodes of all cases into items of `chunk` seeds each.

    An item depends on its own case and seeds only, so that results are found again
    when other cases are added. Raises ConfigError if there are no seeds.
    """
    if len(seeds) == 0 or chunk < 1:
        raise ConfigError(
            f"At least one seed and a chunk of at least 1 are needed, "
            f"not {len(seeds)} and {chunk}."
        )
    items = []
    for case in cases:
        title = re.sub(r"[^A-Za-z0-9]+", "-", case.title).strip("-")[:90]
        payload = payload_of(case)
        for start in range(0, len(seeds), chunk):
            mine = {"seeds": list(seeds[start : start + chunk])}
            label = f"{title}-{start:06d}"
            items.append(WorkItem.with_digest(label, payload | mine))
    return items


def payload_of(case: Case) -> dict[str, Any]:
    """Return a case as JSON data."""
    return asdict(case) | {"arguments": dict(case.arguments)}


def run_rollouts(item: WorkItem, folder: Path) -> dict[str, Any]:
    """Run an item; return `episodes`, one dictionary per episode.

    An episode counts as a success if the benchmark is solved at any step (`succeeded`),
    or at the last step (`success`). A physics error ends it as a failure. So does an
    error of the policy, whose kind and text are in `error`; other episodes go on.
    Recordings go to `episodes` in the folder, one file per item.
    """
    payload = item.payload
    in_worker = multiprocessing.parent_process() is not None
    env = inner = _kept(_key(payload)) if in_worker else make_case(payload)
    if payload["record"]:
        path = folder / "episodes" / f"{item.name}.hdf5"
        path.unlink(missing_ok=True)  # a killed worker may have left a part
        shutil.rmtree(parts_folder(path), ignore_errors=True)
        env = DataCollection(inner, path)
    try:
        episodes = [_attempt(env, inner, seed, payload) for seed in payload["seeds"]]
    finally:
        env.close()
    return {"episodes": episodes}


@lru_cache(maxsize=1)
def _kept(key: str) -> RobotEnv:
    """Make the environment of a case, once for all items that a worker runs."""
    return make_case(json.loads(key))


def _key(payload: Mapping[str, Any]) -> str:
    return json.dumps({key: payload[key] for key in payload if key != "seeds"})


def prepare_rollouts(item: WorkItem) -> None:
    """Make the environment of an item and play an episode, which compiles kernels.

    Workers that are forked then have all of it: some kernels are compiled when they are
    first needed, such as at the first saturation. Errors are left to the item itself.
    """
    _kept.cache_clear()
    with suppress(WbcError):
        env = _kept(_key(item.payload))
        _attempt(env, env, item.payload["seeds"][0], item.payload)


class ErrorKind(StrEnum):
    """What ended an episode in which the policy failed."""

    EXCEPTION = "exception"
    NOT_FINITE = "action not finite"
    SHAPE = "action of a wrong shape"
    ACTION_TIME = "action out of time"
    EPISODE_TIME = "episode out of time"
    ITEM = "work item failed"


class PolicyError(WbcError, RuntimeError):
    """A policy gave no valid action."""

    def __init__(self, kind: ErrorKind, text: str) -> None:
        super().__init__(text)
        self.kind = kind


def failed_episode(seed: int, kind: ErrorKind, text: str) -> dict[str, Any]:
    """Return the figures of an episode in which the policy failed."""
    return {
        "seed": seed,
        "success": False,
        "succeeded": False,
        "return": 0.0,
        "max_reward": 0.0,
        "steps": 0,
        "seconds": 0.0,
        "physics_error": None,
        "failure": None,
        "error": {"kind": kind, "text": shortened(text, 300)},
    }


def _attempt(
    env: gymnasium.Env[Any, Any], inner: RobotEnv, seed: int, payload: Mapping[str, Any]
) -> dict[str, Any]:
    """Run an episode; an error of the policy makes it a failure."""
    limits = {key: payload[key] for key in ("action_time", "episode_time")}
    try:
        return run_episode(env, inner, seed, payload["policy"], **limits)
    except PolicyError as error:
        return failed_episode(seed, error.kind, str(error))
    except WbcError:
        raise  # there is no such policy or environment: no episode can be played
    except Exception as error:  # noqa: BLE001 - a policy may raise anything
        return failed_episode(seed, ErrorKind.EXCEPTION, _text_of(error))


def make_case(payload: Mapping[str, Any], **more: Any) -> RobotEnv:
    """Make the environment of an item, with more arguments."""
    name = payload["perturb"]
    perturbation = PERTURBATIONS.find(name) if name else Perturbation(summary="nothing")
    env = make(
        payload["benchmark"],
        robots=payload["robots"],
        controller_configs=payload["controller"] or None,
        **payload["arguments"],
        **perturbation.arguments,
        **more,
    )
    perturbation.change(env)
    return env


def run_episode(
    env: gymnasium.Env[Any, Any],
    inner: RobotEnv,
    seed: int,
    name: str,
    *,
    begin: Callable[[], None] = lambda: None,
    after_step: Callable[[], None] = lambda: None,
    action_time: float = 0.0,
    episode_time: float = 0.0,
) -> dict[str, Any]:
    """Run an episode of a policy; `begin` is called after the reset.

    It ends as the environment says, or where the policy is `finished`. For the limits
    of time see `Case`.

    Raises:
        PolicyError: If the policy raises an error, or an action is not finite, has a
            wrong shape or takes too long.
    """
    observation, info = env.reset(seed=seed)
    begin()
    policy = make_policy(name, inner, seed)
    start, succeeded, over, rewards = time.perf_counter(), False, False, list[float]()
    with ExitStack() as stack:
        stack.callback(getattr(policy, "close", lambda: None))
        while not over:
            if 0.0 < episode_time < time.perf_counter() - start:
                text = f"It took more than {episode_time:g} s."
                raise PolicyError(ErrorKind.EPISODE_TIME, text)
            action = _action(policy, observation, inner, action_time)
            observation, reward, terminated, truncated, info = env.step(action)
            rewards.append(float(reward))
            succeeded = succeeded or bool(info["success"])
            over = terminated or truncated or getattr(policy, "finished", False)
            after_step()
    return {
        "seed": seed,
        "success": bool(info["success"]),
        "succeeded": succeeded,
        "return": sum(rewards),
        "max_reward": max(rewards),
        "steps": len(rewards),
        "seconds": round(time.perf_counter() - start, 4),
        "physics_error": info.get("physics_error"),
        "failure": info.get("failure"),
        "error": None,
    }


def _action(
    policy: Policy, observation: Mapping[str, Any], env: RobotEnv, seconds: float
) -> Vector:
    """Return the action of a policy, checked; raises PolicyError."""
    try:
        with time_limit(seconds):
            action = np.asarray(policy(observation), dtype=np.float64)
    except TimeLimitExceeded:
        text = f"An action took more than {seconds:g} s."
        raise PolicyError(ErrorKind.ACTION_TIME, text) from None
    except Exception as error:
        raise PolicyError(ErrorKind.EXCEPTION, _text_of(error)) from error
    wanted = env.action_space.shape
    if action.shape != wanted:
        text = f"An action has shape {action.shape}; the environment's is {wanted}."
        raise PolicyError(ErrorKind.SHAPE, text)
    if not np.isfinite(action).all():
        text = f"{np.count_nonzero(~np.isfinite(action))} of {action.size} values."
        raise PolicyError(ErrorKind.NOT_FINITE, text)
    return action


def _text_of(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"


class TimeLimitExceeded(Exception):
    """A call took longer than its limit."""


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Raise TimeLimitExceeded in a block that takes longer, s; 0 for no limit.

    The timer is a signal, which Python handles between two of its own instructions: a
    call into a library is interrupted when it returns. Other threads than the main one
    have no limit.
    """
    if seconds <= 0.0 or threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(number: int, frame: FrameType | None) -> None:
        raise TimeLimitExceeded

    previous = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, previous)
