"""Several environments in one process, stepped in parallel threads."""

import functools
import os
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Unpack

import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from numpy.typing import NDArray

from wbc_suite.envs.config import EnvArguments, checked_seed
from wbc_suite.envs.env import RobotEnv
from wbc_suite.errors import ActionError, ConfigError
from wbc_suite.typing import Array, Matrix

Observations = dict[str, Array]
Info = dict[str, Any]
Flags = NDArray[np.bool_]


class VectorRobotEnv(SyncVectorEnv):
    """Copies of one environment with their own states, stepped in threads.

    Physics and control laws run without Python's lock; an idle thread takes the next
    environment. Controllers that plan in Python between physics steps would wait for
    each other's lock: then one thread steps all environments. Every environment does
    exactly what it does alone, cameras included. Each has its own model, since a reset
    writes sizes of objects into it.

    Args:
        num_envs: Number of environments.
        benchmark: Name of the benchmark, such as `Lift`.
        threads: Number of threads; by default that of the processors, or one if
            controllers plan in Python. Pictures are drawn in the calling thread.
        autoreset_mode: When an environment whose episode is over begins the next:
            `NextStep` in the next step, whose action is ignored; `SameStep` at once,
            with `final_obs` and `final_info`; `Disabled` by `reset`.
        arguments: Arguments of every environment, and errors: see `RobotEnv`.
    """

    metadata = {**RobotEnv.metadata, "autoreset_mode": AutoresetMode.NEXT_STEP}
    closed = True  # until it is made: Gymnasium closes what is not

    def __init__(
        self,
        num_envs: int = 1,
        benchmark: str = "Lift",
        *,
        threads: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        **arguments: Unpack[EnvArguments],
    ) -> None:
        _check_count("num_envs", num_envs)
        _check_count("threads", 1 if threads is None else threads)
        make = functools.partial(RobotEnv, benchmark, **arguments)
        self.envs: list[RobotEnv]  # pyright: ignore[reportIncompatibleVariableOverride] - all of one kind
        super().__init__([make] * num_envs, autoreset_mode=_mode(autoreset_mode))
        first = self.envs[0]
        buffer = first.observation_buffer
        self._places = buffer.places
        self._values: Matrix = np.zeros((num_envs, len(buffer.values)))
        self._last_rewards: Array = np.zeros(num_envs)
        self._terminated: Flags = np.zeros(num_envs, dtype=np.bool_)
        self._truncated: Flags = np.zeros(num_envs, dtype=np.bool_)
        self._pictures = tuple(first.cameras.space)
        self._may_choose = threads is None
        self._helpers = min(threads or _processors(), num_envs) - 1
        self._pool = ThreadPoolExecutor(max(1, self._helpers), "wbc_suite-env")
        self.closed = False

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Observations, Info]:
        """Start episodes.

        Args:
            seed: Seed of the first environment, increased by one for each next; or
                one for each.
            options: `reset_mask`, which environments to reset, shape (num_envs,).

        Raises:
            ConfigError: If a seed or an option is wrong; then nothing has changed.
        """
        seeds = self._seeds(seed)
        chosen = np.flatnonzero(self._mask(options))
        infos: list[Info] = [{} for _ in self.envs]

        def begin(i: int) -> None:
            infos[i] = self._begin(i, seeds[i])

        self._for_each(begin, chosen.tolist())
        return self._observe(), gather_infos(infos)

    def step(
        self, actions: Any
    ) -> tuple[Observations, NDArray[Any], NDArray[Any], NDArray[Any], Info]:
        """Advance every environment; actions have shape (num_envs, size).

        Raises:
            ActionError: If an action is wrong; names the environment. Then no
                environment was stepped.
            PhysicsError: If an environment's episode ended in one and it was not reset.
        """
        over = self._terminated | self._truncated
        if self.autoreset_mode is not AutoresetMode.NEXT_STEP:
            over[:] = False
        rows = self._checked(actions, ~over)
        infos: list[Info] = [{} for _ in self.envs]

        def advance(i: int) -> None:
            infos[i] = self._begin(i) if over[i] else self._advance(i, rows[i])

        self._for_each(advance, range(self.num_envs))
        if self.autoreset_mode is AutoresetMode.SAME_STEP:
            self._begin_next(infos)
        return (
            self._observe(),
            self._last_rewards.copy(),
            self._terminated.copy(),
            self._truncated.copy(),
            gather_infos(infos),
        )

    def set_attr(self, name: str, values: Any) -> None:
        """Set an attribute of each environment: a list must have a value for each."""
        if isinstance(values, list | tuple) and len(values) != self.num_envs:
            raise ConfigError(
                f"set_attr: {len(values)} values for {self.num_envs} environments."
            )
        super().set_attr(name, values)

    def close_extras(self, **kwargs: Any) -> None:
        """End the threads and close the environments."""
        self._pool.shutdown()
        super().close_extras(**kwargs)

    def _begin(self, i: int, seed: int | None = None) -> Info:
        env = self.envs[i]
        info = env.begin(seed)
        self._values[i] = env.observation_buffer.values
        self._last_rewards[i], self._terminated[i], self._truncated[i] = (
            0.0,
            False,
            False,
        )
        return info

    def _advance(self, i: int, action: Array) -> Info:
        env = self.envs[i]
        reward, terminated, truncated, info = env.advance(action)
        self._values[i], self._last_rewards[i] = env.observation_buffer.values, reward
        self._terminated[i], self._truncated[i] = terminated, truncated
        return info

    def _begin_next(self, infos: list[Info]) -> None:
        """Begin the next episodes of environments whose episode is over.

        Rewards and flags remain those of the last step.
        """
        over = np.flatnonzero(self._terminated | self._truncated).tolist()
        finals = {
            i: {"final_obs": self.envs[i].observation(), "final_info": infos[i]}
            for i in over
        }

        def begin(i: int) -> None:
            infos[i] = finals[i] | self.envs[i].begin()
            self._values[i] = self.envs[i].observation_buffer.values

        self._for_each(begin, over)

    def _for_each(self, do: Callable[[int], None], indices: Iterable[int]) -> None:
        """Call `do` with every index, on all threads.

        When all are done, the error of the first environment that failed is raised.
        """
        waiting, failed = deque(indices), dict[int, Exception]()

        def work() -> None:
            while True:
                try:
                    i = waiting.popleft()
                except IndexError:
                    return
                try:
                    do(i)
                except Exception as error:  # noqa: BLE001 - raised again below
                    failed[i] = error

        count = 0 if self._may_choose and self._plans else self._helpers
        helpers = [self._pool.submit(work) for _ in range(count)]
        work()
        for helper in helpers:
            helper.result()
        if failed:
            first = min(failed)
            raise _named(failed[first], first)

    @property
    def _plans(self) -> bool:
        """Whether controllers ran in Python between physics steps, last time."""
        simulations = (env.simulation for env in self.envs)
        return any(s.loop_calls > 1 or not s.compiled for s in simulations)

    def _checked(self, actions: Any, used: Flags) -> Matrix:
        """Return actions, shape (num_envs, size), after checking the used ones."""
        shape = self.action_space.shape
        if np.shape(actions) != shape:
            raise ActionError(
                f"Actions have shape {shape}, one row per environment, "
                f"not {np.shape(actions)}."
            )
        rows = np.asarray(actions)
        if rows.dtype.kind == "f" and np.isfinite(rows).all():
            return rows
        for i in np.flatnonzero(used).tolist():
            try:
                self.envs[i].action_layout.check(rows[i])
            except ActionError as error:
                raise _named(error, i) from None
        return rows

    def _observe(self) -> Observations:
        observations = {
            key: self._values[:, at].copy() for key, at in self._places.items()
        }
        if self._pictures:
            each = [env.observation() for env in self.envs]
            for key in self._pictures:
                observations[key] = np.stack([one[key] for one in each])
        return observations

    def _seeds(self, seed: object) -> list[int | None]:
        if seed is None or isinstance(seed, int | np.integer):
            first = checked_seed(seed)
            return [None if first is None else first + i for i in range(self.num_envs)]
        seeds = list(seed) if isinstance(seed, Iterable) else [seed]
        if len(seeds) != self.num_envs:
            raise ConfigError(
                f"reset: {len(seeds)} seeds for {self.num_envs} environments."
            )
        return [checked_seed(one) for one in seeds]

    def _mask(self, options: dict[str, Any] | None) -> Flags:
        if not options:
            return np.ones(self.num_envs, dtype=np.bool_)
        mask = np.asarray(options.get("reset_mask"))
        known = set(options) == {"reset_mask"}
        if not known or (mask.shape, mask.dtype) != ((self.num_envs,), np.bool_):
            raise ConfigError(
                f"reset: the one option is 'reset_mask', an array of {self.num_envs} "
                f"booleans; got {options!r:.80}."
            )
        return mask


def _named(error: Exception, index: int) -> Exception:
    """Return the error with the environment's index in its message."""
    error.args = (f"Environment {index}: {error}", *error.args[1:])
    return error


def _check_count(name: str, count: object) -> None:
    if not isinstance(count, int) or isinstance(count, bool) or count < 1:
        raise ConfigError(f"{name} is a whole number from 1 on, not {count!r}.")


def _mode(given: object) -> AutoresetMode:
    try:
        return AutoresetMode(given)
    except ValueError:
        known = ", ".join(mode.value for mode in AutoresetMode)
        raise ConfigError(
            f"autoreset_mode is one of {known}, not {given!r:.60}."
        ) from None


def _processors() -> int:
    """Return the number of processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def gather_infos(infos: Sequence[Info]) -> Info:
    """Return one info whose values have an entry for each environment.

    Each key has a mask `_{key}`, which environments have it. Numbers and arrays become
    arrays, with zeros for environments without the key; dictionaries are gathered
    likewise; all else becomes an array of objects, and so does `final_obs`.

    Source: Gymnasium's documentation of `VectorEnv`.
    """
    gathered: Info = {}
    for key in dict.fromkeys(key for info in infos for key in info):
        has = np.array([key in info for info in infos])
        values = [info.get(key) for info in infos]
        first = values[int(has.argmax())]
        if isinstance(first, dict) and key != "final_obs":
            gathered[key] = gather_infos([value or {} for value in values])
        else:
            gathered[key] = _stacked(first, values, plain=key != "final_obs")
        gathered[f"_{key}"] = has
    return gathered


def _stacked(first: Any, values: list[Any], *, plain: bool) -> NDArray[Any]:
    if plain and isinstance(first, np.ndarray):
        empty = np.zeros_like(first)
    elif plain and isinstance(first, bool | int | float | np.number):
        empty = type(first)(0)
    else:
        stacked = np.full(len(values), None, dtype=object)
        for k, value in enumerate(values):
            stacked[k] = value
        return stacked
    return np.array([empty if value is None else value for value in values])
