"""Physics with controllers in the loop: n steps of one call."""

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import mujoco
import numpy as np

from wbc_suite.control import CompositeController, RobotState
from wbc_suite.errors import PhysicsError

__all__ = ["Simulation"]

log = logging.getLogger(__name__)

_NAMES = [
    name.removeprefix("mjWARN_")
    for name, value in mujoco.mjtWarning.__members__.items()
    if value != mujoco.mjtWarning.mjNWARNING
]


class Simulation:
    """A MuJoCo model and its state, driven by one controller per robot.

    MuJoCo answers bad numbers by zeroing controls or by resetting the state, and a full
    arena by dropping contacts. Here automatic reset is off, and every warning is a
    `PhysicsError`.

    Args:
        model: Compiled scene; its automatic reset is switched off.
        data: Its state.
        pairs: Controllers with their robots.

    Attributes:
        model: The scene.
        data: The state.
        robots: The robots in the scene.
        controllers: Their controllers.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        pairs: Sequence[tuple[RobotState, CompositeController]] = (),
    ) -> None:
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        self.model, self.data = model, data
        self.robots = tuple(state for state, _ in pairs)
        self.controllers = tuple(controller for _, controller in pairs)

    @property
    def timestep(self) -> float:
        """Duration of one physics step, s."""
        return float(self.model.opt.timestep)

    def forward(self) -> None:
        """Compute everything that follows from positions and velocities.

        Raises:
            PhysicsError: If the state is not finite or MuJoCo warns.
        """
        with self._watched():
            mujoco.mj_forward(self.model, self.data)

    def tick(self, n: int) -> None:
        """Advance n physics steps with the controllers in the loop.

        Raises:
            PhysicsError: If MuJoCo warns, or the state is not finite; names the
                warning. The state is left as it was found, for inspection.
        """
        with self._watched():
            for _ in range(n):
                mujoco.mj_step1(self.model, self.data)
                self._control()
                mujoco.mj_step2(self.model, self.data)

    def _control(self) -> None:
        for state, controller in zip(self.robots, self.controllers, strict=True):
            self.data.ctrl[state.actuator_ids] = controller.compute(state)

    @contextmanager
    def _watched(self) -> Iterator[None]:
        """Turn MuJoCo's warnings into an error, and keep its log file unwritten."""
        data = self.data
        self._check_finite()
        before = data.warning.number.copy()
        previous = mujoco.get_mju_user_warning()
        mujoco.set_mju_user_warning(log.warning)
        failed: Exception | None = None
        try:
            yield
        except np.linalg.LinAlgError as error:
            failed = error  # mostly of a state that MuJoCo has warned of
        finally:
            mujoco.set_mju_user_warning(previous)
        raised = np.flatnonzero(data.warning.number - before)
        if raised.size:
            names = ", ".join(_NAMES[i] for i in raised)
            raise PhysicsError(
                f"MuJoCo reported {names} at t = {data.time:.3f} s "
                f"(index {int(data.warning.lastinfo[raised[0]])}). The state is no "
                "longer to be trusted: reset."
            ) from failed
        self._check_finite()
        if failed is not None:
            raise PhysicsError(
                f"A controller failed at t = {data.time:.3f} s: {failed}. Reset."
            ) from failed

    def _check_finite(self) -> None:
        data = self.data
        for name, values in (
            ("QPOS", data.qpos),
            ("QVEL", data.qvel),
            ("QFRC_APPLIED", data.qfrc_applied),
            ("XFRC_APPLIED", data.xfrc_applied),
            ("TIME", data.time),
        ):
            if not np.isfinite(values).all():
                raise PhysicsError(
                    f"Not finite: {name} at t = {data.time:.3f} s. Reset, and look at "
                    "what was written into the simulation."
                )
