"""Noise on actions, and hands pushed off their way, for data that teach to correct.

Source of noise on demonstrations: Laskey et al. (2017), "DART: Noise Injection for
Robust Imitation Learning", CoRL.
"""

from typing import Any

import gymnasium
import numpy as np

from wbc_suite.arguments import check_number
from wbc_suite.control.action import SliceKind
from wbc_suite.envs import RobotEnv
from wbc_suite.errors import ConfigError
from wbc_suite.typing import Vector

FULL = {"m": 0.05, "rad": 0.5}
"""What a value of 1 stands for where values are the quantity itself; as `OSC_POSE`."""
PUSH = {"m": 0.6, "rad": 0.2}  # greatest component of a push, in shares of `FULL`
SHORTEST, LONGEST = 3, 6  # actions of a push
HANDS = (SliceKind.POSE, SliceKind.POSITION, SliceKind.ORIENTATION)


class Disturbance(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Disturbs what hands are told; `info` has what was done and what was intended.

    `info["executed"]` is the action that was taken, `info["intended"]` the one that was
    given, and `info["disturbed"]` is 1 during a push. `DataCollection` records them as
    `actions`, `intended` and `disturbed`. A seed at reset makes them repeatable.

    Args:
        env: An environment of this package.
        noise: Standard deviation of normal noise on each value, in full steps: 5 cm
            and 0.5 rad for poses in m and rad.
        pushes: Mean number of pushes in 100 actions. A push moves hands in a random
            direction for 3 to 6 actions, up to 3 cm in each along each axis.
    """

    labels_actions = True  # read by recordings

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        *,
        noise: float = 0.0,
        pushes: float = 0.0,
    ) -> None:
        super().__init__(env)
        inner = env.unwrapped
        if not isinstance(inner, RobotEnv):
            raise ConfigError(f"Disturbance needs a RobotEnv, not {inner}.")
        self._noise = check_number("Disturbance: noise", noise, least=0.0)
        self._pushes = check_number(
            "Disturbance: pushes", pushes, least=0.0, most=100.0
        )
        self._layout = layout = inner.action_layout
        self._full, self._push = np.zeros(layout.size), np.zeros(layout.size)
        self._absolute = np.zeros(layout.size, dtype=bool)
        for part in layout.slices:
            for k, unit in enumerate(part.units, part.start):
                if part.kind in HANDS:
                    self._absolute[k] = unit.scale is None
                    self._full[k] = FULL[unit.symbol] if unit.scale is None else 1.0
                    self._push[k] = PUSH[unit.symbol] * self._full[k]
        self._rng = np.random.default_rng()
        self._left = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode; the disturbances follow from its seed."""
        self._rng = np.random.default_rng(None if seed is None else [seed, 2])
        self._left = 0
        return self.env.reset(seed=seed, options=options)

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Take an action with noise, or with a push in place of the hands' steps."""
        intended, rng = self._layout.check(action), self._rng
        if not self._left and rng.uniform() < self._pushes / 100.0:
            self._left = int(rng.integers(SHORTEST, LONGEST + 1))
            self._way = rng.uniform(-self._push, self._push)
            self._drift = np.zeros_like(self._way)
        noise = self._noise * self._full * rng.standard_normal(self._full.size)
        executed = intended + noise
        pushed = int(self._left > 0)
        if pushed:
            executed = self._pushed(executed)
            self._left -= 1
        executed, _ = self._layout.clip(executed)
        observation, reward, terminated, truncated, info = self.env.step(executed)
        labels = {"executed": executed, "intended": intended, "disturbed": pushed}
        return observation, float(reward), terminated, truncated, info | labels

    def _pushed(self, executed: Vector) -> Vector:
        """Return an action with a push: steps replaced, or goals moved on."""
        self._drift = self._drift + self._way
        moved = np.where(self._absolute, executed + self._drift, self._way)
        return np.where(self._push > 0.0, moved, executed)
