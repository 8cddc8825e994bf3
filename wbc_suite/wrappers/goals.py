"""Benchmarks with a goal among the observations, for hindsight experience replay."""

from collections.abc import Callable, Sequence
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from wbc_suite.benchmark import Benchmark, Lift, PickPlace, Reach, Stack
from wbc_suite.benchmark.pick_place import REST
from wbc_suite.envs import RobotEnv
from wbc_suite.errors import ConfigError
from wbc_suite.typing import Matrix, Vector
from wbc_suite.wrappers.flat import Flat, Flattened

REACHED_WITHIN = {Lift: 0.05, Stack: 0.02, PickPlace: 0.05, Reach: 0.02}
"""Distance of a point from its goal that counts as reached, m."""
LIFTED = np.array([[-0.1, -0.1, 0.04], [0.1, 0.1, 0.2]])
"""Corners of the box of Lift's goals, from the middle of the table's top, m."""

GoalObservation = dict[str, NDArray[Any]]


class Goals(gymnasium.Wrapper[GoalObservation, Any, Flattened, Flattened]):
    """Observations `observation`, `achieved_goal` and `desired_goal`, reward 0 or -1.

    A goal is a place of each point, m: of the cube in the air (Lift), of the red cube
    on the green one (Stack), of the groceries of the episode in their quadrants
    (PickPlace), of the hands at their targets (Reach). It is drawn or read at a reset.
    The reward is 0 where all points are within `REACHED_WITHIN` of their places, and -1
    elsewhere. `info["is_success"]` says so too, `info["success"]` is the benchmark's.

    Source of the interface: Plappert et al. (2018), arXiv:1802.09464.
    """

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        flat: Any = Flat(env)  # the type of its observations is what changes here
        super().__init__(flat)
        self._benchmark: Benchmark = env.unwrapped.benchmark  # pyright: ignore[reportAttributeAccessIssue] - ours
        kinds = [kind for kind in REACHED_WITHIN if isinstance(self._benchmark, kind)]
        if not kinds:
            raise ConfigError(
                f"{self._benchmark.name} has no goals; those that have: "
                f"{', '.join(kind.__name__ for kind in REACHED_WITHIN)}."
            )
        self.near = REACHED_WITHIN[kinds[0]]
        self._points: Sequence[Vector]
        self._points, self._desired = _goal(self._benchmark, np.random.default_rng(0))
        anywhere = gymnasium.spaces.Box(
            -np.inf, np.inf, self._desired.shape, dtype=np.float64
        )
        spaces: dict[str, Any] = {"observation": self.env.observation_space}
        spaces |= dict.fromkeys(("achieved_goal", "desired_goal"), anywhere)
        self.observation_space: Any = gymnasium.spaces.Dict(spaces)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[GoalObservation, dict[str, Any]]:
        """Start an episode, and draw its goal from the environment's generator."""
        seen, info = self.env.reset(seed=seed, options=options)
        rng = self.env.unwrapped.np_random
        self._points, self._desired = _goal(self._benchmark, rng)
        return self._observation(seen), info | {"is_success": self._is_reached()}

    def step(
        self, action: Any
    ) -> tuple[GoalObservation, float, bool, bool, dict[str, Any]]:
        """Advance one control period."""
        seen, _, terminated, truncated, info = self.env.step(action)
        found = self._observation(seen)
        reward = self.compute_reward(found["achieved_goal"], self._desired, info)
        info["is_success"] = self._is_reached()
        return found, float(reward), terminated, truncated, info

    def compute_reward(
        self, achieved_goal: Matrix, desired_goal: Matrix, info: Any
    ) -> NDArray[np.float64]:
        """Return the rewards of goals, shape (..., 3n), each 0 or -1."""
        offset = np.asarray(achieved_goal) - desired_goal
        points = offset.reshape(*offset.shape[:-1], -1, 3)
        return -(np.linalg.norm(points, axis=-1).max(axis=-1) > self.near).astype(float)

    def _is_reached(self) -> bool:
        achieved = np.concatenate(self._points)
        return bool(self.compute_reward(achieved, self._desired, None) == 0.0)

    def _observation(self, seen: Any) -> GoalObservation:
        return {
            "observation": seen,
            "achieved_goal": np.concatenate(self._points),
            "desired_goal": self._desired.copy(),
        }


def _goal(
    benchmark: Benchmark, rng: np.random.Generator
) -> tuple[Sequence[Vector], Vector]:
    """Return views of a benchmark's points, and a goal for them, shape (3n,)."""
    match benchmark:
        case Lift():
            place = benchmark.config.table.center + rng.uniform(*LIFTED)
            return [benchmark.cube_position], place
        case Stack():
            a, b = benchmark.states["cubeA"], benchmark.states["cubeB"]
            sizes = benchmark.config.cube_a.half_size, benchmark.config.cube_b.half_size
            return [a.position], b.position + np.array([0.0, 0.0, sum(sizes)])
        case PickPlace():
            floor, names = benchmark.config.target.center[2], benchmark.sorting.active
            places = [(*benchmark.goal(name), floor + REST[name]) for name in names]
            points = [benchmark.states[name].position for name in names]
            return points, np.ravel(places)
        case Reach():
            points = [hand.position for hand in benchmark.hands]
            return points, np.concatenate([t.position for t in benchmark.targets])
    raise ConfigError(f"{benchmark.name} has no goals.")


def make_goal_env(benchmark: str | Callable[[], Benchmark], **arguments: Any) -> Goals:
    """Make an environment with goals; for arguments see `wbc_suite.make`."""
    return Goals(RobotEnv(benchmark, **arguments))
