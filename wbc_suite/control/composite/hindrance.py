"""What keeps a simulated robot from the configuration it was told to take."""

from collections import defaultdict
from collections.abc import Collection
from dataclasses import dataclass

import mujoco
import numpy as np

from wbc_suite.control.state import RobotState
from wbc_suite.typing import Vector

__all__ = ["Touch", "lagging_joint", "touches"]

_PRESS = 1.0
"""N; lighter contacts hold nothing back."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Touch:
    """One link pressing on something that is not the robot.

    Attributes:
        link: The robot's link.
        thing: Name of the body, or of the world's shape, such as `floor`.
        force: Sum of the normal forces, N.
    """

    link: str
    thing: str
    force: float

    def __str__(self) -> str:
        return f"contact: {self.link} - {self.thing}"


def touches(state: RobotState, *, apart_from: Collection[str] = ()) -> list[Touch]:
    """Return what the robot presses on, hardest first.

    Args:
        state: The robot in the simulation.
        apart_from: Links that may press, such as feet.
    """
    forces: dict[tuple[str, str], float] = defaultdict(float)
    wrench = np.zeros(6)
    for i, geoms in enumerate(state.data.contact.geom):
        links = [_link(state, int(geom)) for geom in geoms]
        if (links[0] is None) == (links[1] is None):
            continue
        own = 0 if links[0] is not None else 1
        link = str(links[own])
        if link not in apart_from:
            mujoco.mj_contactForce(state.model, state.data, i, wrench)
            forces[link, _thing(state, int(geoms[1 - own]))] += float(wrench[0])
    found = [Touch(link=a, thing=b, force=f) for (a, b), f in forces.items()]
    return sorted((t for t in found if t.force > _PRESS), key=lambda t: -t.force)


def lagging_joint(state: RobotState, joints: tuple[str, ...], targets: Vector) -> str:
    """Return in words which joint is farthest from its target, shape (n,)."""
    addresses, _ = state.joint_addresses(joints)
    worst = int(np.argmax(np.abs(targets - state.data.qpos[addresses])))
    actuator = state.actuator_ids[state.actuators.index(joints[worst])]
    low, high = state.model.actuator_ctrlrange[actuator]
    saturated = not low < state.data.ctrl[actuator] < high
    return f"{'motor limit' if saturated else 'lag'}: {joints[worst]}"


def _link(state: RobotState, geom: int) -> str | None:
    name = state.model.body(int(state.model.geom_bodyid[geom])).name
    own = state.prefix and name.startswith(state.prefix)
    return name.removeprefix(state.prefix) if own else None


def _thing(state: RobotState, geom: int) -> str:
    body = int(state.model.geom_bodyid[geom])
    names = state.model.body(body).name, state.model.geom(geom).name
    return names[0] if body else names[1] or "world"
