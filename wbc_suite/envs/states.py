"""States of an environment: episodes, physics states and scenes as text."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from wbc_suite.arguments import check_array
from wbc_suite.control.run.state_checks import FASTEST
from wbc_suite.errors import ConfigError
from wbc_suite.typing import Vector

PHYSICS = int(mujoco.mjtState.mjSTATE_INTEGRATION)
"""Signature of the part of a physics state that is MuJoCo's; time, qpos, qvel first."""

ORIGIN = 24
"""Numbers at the end of a physics state; see `physics_states.Origin`."""

_QUATERNION = {
    int(mujoco.mjtJoint.mjJNT_FREE): slice(3, 7),
    int(mujoco.mjtJoint.mjJNT_BALL): slice(0, 4),
}
"""Where the quaternion is among the positions of a joint, by type."""


@dataclass(frozen=True, kw_only=True, slots=True)
class EnvState:
    """An episode up to now: its start and its actions.

    Solvers and controllers cannot be copied, and an episode is determined by its start
    and its actions. It can be pickled.

    Attributes:
        began_with: State of the random generator at the start.
        placed: Physics state at the start, if the episode began with `reset_to`.
        taken: Actions since then.
        observables: State of observables that these do not determine.
        rng: The present random generator, and its `seed`.
    """

    began_with: Mapping[str, Any]
    placed: Vector | None
    taken: tuple[Vector, ...]
    observables: dict[str, Any]
    rng: np.random.Generator | None
    seed: int | None


class Randomiser(Protocol):
    """Changes a scene at the start of each episode; can be pickled."""

    def bind(self, env: Any) -> "BoundRandomiser":
        """Bind to an environment, whose present model is the nominal one."""
        ...


class BoundRandomiser(Protocol):
    """A randomiser of one environment."""

    def restore(self) -> None:
        """Restore the nominal values."""
        ...

    def apply(self, rng: np.random.Generator) -> None:
        """Draw all values, after the benchmark has reset its objects."""
        ...


def motion_size(model: mujoco.MjModel) -> int:
    """Return how many numbers time, qpos and qvel are: the first of a physics state."""
    return 1 + model.nq + model.nv


def physics_size(model: mujoco.MjModel) -> int:
    """Return how many numbers of a physics state are MuJoCo's."""
    return mujoco.mj_stateSize(model, PHYSICS)


def write_physics(model: mujoco.MjModel, data: mujoco.MjData, state: ArrayLike) -> None:
    """Write what a physics state says of MuJoCo's; see `PhysicsStates`.

    Raises:
        ConfigError: If its size is wrong, a value is not finite, a speed is beyond
            `FASTEST`, or a quaternion is not of length 1 within 10 %.
    """
    values = check_array("A physics state", state, None)
    short, full = motion_size(model), physics_size(model)
    if values.ndim != 1 or not (values.size == short or values.size >= full + ORIGIN):
        raise ConfigError(
            f"A physics state has shape {values.shape}, but must have ({short},), "
            f"which is time, qpos and qvel, or at least ({full + ORIGIN},)."
        )
    if not np.isfinite(values).all():
        raise ConfigError("A physics state must be finite.")
    qpos, qvel = values[1 : 1 + model.nq], values[1 + model.nq : short]
    if np.abs(qvel).max(initial=0.0) > FASTEST:
        raise ConfigError(f"A physics state has a speed above {FASTEST:g}.")
    for joint in map(model.joint, range(model.njnt)):
        quat = qpos[joint.qposadr[0] :][_QUATERNION.get(joint.type[0], slice(0))]
        if quat.size and abs(np.linalg.norm(quat) - 1.0) > 0.1:
            raise ConfigError(
                f"A physics state has the quaternion {quat} for joint '{joint.name}'."
            )
    if values.size == short:
        data.time, data.qpos[:], data.qvel[:] = values[0], qpos, qvel
    else:
        mujoco.mj_setState(model, data, values[:full], PHYSICS)


def write_scene(spec: mujoco.MjSpec) -> str:
    """Write a scene as MJCF text; computed textures become plain colours."""
    for texture in spec.textures:
        if len(texture.data):
            texture.data = b""
            texture.builtin = mujoco.mjtBuiltin.mjBUILTIN_FLAT
            texture.rgb1 = texture.rgb2 = (0.77, 0.61, 0.44)
    spec.compile()
    return spec.to_xml()
