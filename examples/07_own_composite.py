"""Register a composite controller: one action moves both hands, mirrored."""

from collections.abc import Mapping
from typing import Any

import numpy as np

import wbc_suite
from wbc_suite.control import (
    ActionLayout,
    BasicController,
    RobotState,
    default_basic_config,
    register_composite,
)


class Mirrored(BasicController):
    """BASIC in which the left hand and gripper mirror the right ones."""

    MIRROR = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])  # at the plane y = 0

    def __init__(self, config: Mapping[str, Any], state: RobotState) -> None:
        super().__init__(config, state)
        self.full = self.layout
        self.layout = ActionLayout(
            part for part in self.full.slices if not part.name.startswith("left")
        )

    def set_goal(self, action: np.ndarray, period: float = 0.05) -> None:
        """Apply the values of the right side to both sides."""
        values = self.layout.unpack(action)
        values["left"] = self.MIRROR * values["right"]
        values["left_gripper"] = values["right_gripper"]
        super().set_goal(self.full.pack(values), period)

    @property
    def hold_action(self) -> np.ndarray:
        """The right side of the action that holds the robot."""
        held = self.full.unpack(super().hold_action)
        return self.layout.pack(
            {part.name: held[part.name] for part in self.layout.slices}
        )


register_composite(
    "MIRRORED", Mirrored, family="mirrored", default=default_basic_config
)

env = wbc_suite.make("Lift", robots="Baxter", controller_configs="MIRRORED")
env.reset(seed=0)
print(env.action_layout)

sites = [env.simulation.data.site(f"robot0_{side}_tcp") for side in ("right", "left")]
before = [site.xpos.copy() for site in sites]
step = env.action_layout.pack({"right": [0, 1, 1, 0, 0, 0]}, base=env.hold_action)
for _ in range(3):
    env.step(step)
for _ in range(20):
    env.step(env.hold_action)
for site, start, side in zip(sites, before, ("right", "left"), strict=True):
    print(f"the {side} hand moved by", np.round(1e3 * (site.xpos - start)), "mm")
env.close()
