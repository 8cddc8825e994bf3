"""A gait of your own: Spot ambles, its feet land one after another.

One kernel, one config and one line of registration: after that, `type = "amble"` in
`[gait]` of a controller file names it, and it runs in the compiled loop as ours do.
"""

from typing import Literal

import numpy as np
from pydantic import Field, PositiveFloat

import wbc_suite
from wbc_suite.compiling import compiled
from wbc_suite.locomotion import (
    Gait,
    Measured,
    Plan,
    TrotConfig,
    plan_trot,
    register_gait,
)


class AmbleConfig(TrotConfig):
    """A trot whose hind legs are early.

    Attributes:
        lead: How much earlier than its diagonal front foot a hind foot lifts, as a part
            of the cycle.
    """

    type: Literal["amble"] = "amble"  # pyright: ignore - narrower than "trot"
    period: PositiveFloat = 0.6
    duty: float = Field(default=0.6, gt=0.5, lt=1.0)
    lead: float = Field(default=0.15, ge=0.0, le=0.25)


@compiled
def plan_amble(
    gait: Gait, measured: Measured, command: np.ndarray, dt: float, plan: Plan
) -> None:
    """Shift the phases of the hind feet, and plan the rest as a trot."""
    for k in range(gait.offset.shape[0]):
        diagonal = 0.0 if gait.nominal[k, 0] * gait.nominal[k, 1] > 0.0 else 0.5
        early = gait.settings[0].lead if gait.nominal[k, 0] < 0.0 else 0.0
        gait.offset[k] = (diagonal + early) % 1.0
    plan_trot(gait, measured, command, dt, plan)


register_gait("amble", plan_amble, AmbleConfig)


def main() -> None:
    """Walk ahead, turn, and print how many feet stand at a time."""
    config = wbc_suite.load_composite_controller_config("WHOLE_BODY_ID", "Spot")
    config |= {"gait": {"type": "amble", "lead": 0.12}}
    env = wbc_suite.make("Stand", robots="Spot", controller_configs=config)
    _, info = env.reset(seed=0)
    layout, stand = env.action_layout, env.hold_action
    trunk = env.simulation.data.body("robot0_body")
    start, standing = trunk.xpos.copy(), np.zeros(5, dtype=int)
    for i in range(120):  # 6 s
        turn = 0.3 if i >= 80 else 0.0
        *_, info = env.step(layout.pack({"walk": [0.4, 0.0, turn]}, base=stand))
        standing[len(info["balance"]["stance"])] += 1
    way = np.linalg.norm(trunk.xpos[:2] - start[:2])
    print(f"Spot ambled {way:.2f} m; fell: {info['balance']['fell']}")
    for feet in (2, 3, 4):
        print(f"{feet} feet stood in {100 * standing[feet] / standing.sum():.0f} %")
    env.close()


if __name__ == "__main__":
    main()
