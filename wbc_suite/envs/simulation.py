"""Physics with controllers in the loop: n steps of one call."""

import math
from collections.abc import Sequence

import mujoco

from wbc_suite.compiling import announced
from wbc_suite.control import CompositeController, RobotState
from wbc_suite.control.loop import (
    advance,
    bind_haste,
    bind_physics,
    gather,
    needed,
    physics_table,
)
from wbc_suite.envs.watch import PhysicsWatch

__all__ = ["Simulation"]


class Simulation:
    """A MuJoCo model and its state, driven by one controller per robot.

    MuJoCo answers bad numbers by zeroing controls or by resetting the state, and a full
    arena by dropping contacts. Here automatic reset is off, and every warning is a
    `PhysicsError`.

    Args:
        model: Compiled scene; its automatic reset is switched off.
        data: Its state.
        pairs: Controllers with their robots.
        compiled: Whether controllers run in the compiled loop; one of them that has no
            compiled law keeps all of them out. The plain loop gives the same states.
        lite: Whether a tick ends with positions alone brought up to date. Else all that
            follows from the new state is computed, such as contacts, accelerations and
            what sensors read; MuJoCo leaves them one step behind.

    Attributes:
        model: The scene.
        data: The state.
        robots: The robots in the scene.
        controllers: Their controllers.
        compiled: Whether the compiled loop runs.
        spans: How many calls of the loop the last tick was: controllers plan before
            each.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        pairs: Sequence[tuple[RobotState, CompositeController]] = (),
        *,
        compiled: bool = True,
        lite: bool = True,
    ) -> None:
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        self.model, self.data = model, data
        self._watch, self.lite = PhysicsWatch(data), lite
        self.robots = tuple(state for state, _ in pairs)
        self.controllers = tuple(controller for _, controller in pairs)
        self._pairs = tuple(pairs)
        self._left, self._prepared = [0] * len(pairs), False
        self.spans = 1
        self._look = any(getattr(c, "looks", True) for c in self.controllers)
        self.compiled = compiled and all(c.laws for c in self.controllers)
        physics = bind_physics(model, data)
        self._table, self._haste = physics_table(physics), bind_haste(model, data)
        laws = [law for controller in self.controllers for law in controller.laws]
        self._laws, self._drives = gather([(law.record, law.drives) for law in laws])
        for k, law in enumerate(laws):
            first, last = self._laws["first"][k], self._laws["last"][k]
            law.adopt(self._laws[k : k + 1], self._drives[first:last])
        tables = self._table.table, self._haste.table, self._watch.sound
        records = self._laws, self._drives, *needed(self._laws)
        self._bound = (*physics[:3], *tables, *records)
        if self.compiled:
            with announced("the control loop"):
                self._advance_compiled(0)

    @property
    def timestep(self) -> float:
        """Duration of one physics step, s."""
        return float(self.model.opt.timestep)

    def forward(self) -> None:
        """Compute everything that follows from positions and velocities.

        Raises:
            PhysicsError: If the state is not finite or MuJoCo warns.
        """
        with self._watch:
            mujoco.mj_forward(self.model, self.data)

    def start(self) -> None:
        """Compute what follows from the state, and let controllers start from there.

        Raises:
            PhysicsError: If the state is not finite or MuJoCo warns.
        """
        self.forward()
        for state, controller in self._pairs:
            controller.reset(state)
        self._left = [0] * len(self._pairs)

    def tick(self, n: int) -> None:
        """Advance n physics steps with the controllers in the loop.

        Raises:
            PhysicsError: If MuJoCo warns, or the state is not finite; names the
                warning. The state is left as it was found, for inspection.
        """
        if self.compiled and n <= min(self._left, default=n):
            self._left = [left - n for left in self._left]
            self._advance_compiled(n)
            self.spans = 1
        elif self._prepared:
            self._advance_by_parts(n)
        else:
            with announced("the controllers"):
                self._advance_by_parts(n)
            self._prepared = True
        if not self.lite:
            self._refresh()

    def _advance_by_parts(self, n: int) -> None:
        """Advance n steps; controllers do in between what is due."""
        self.spans = 0
        with self._watch:
            while n > 0:
                span = n
                for k, (state, controller) in enumerate(self._pairs):
                    if self._left[k] <= 0:
                        self._left[k] = controller.prepare(state)
                    span = min(span, self._left[k])
                n -= span
                self.spans += 1
                self._advance(span, seen=n == 0 or self._look)
                self._left = [left - span for left in self._left]

    def _refresh(self) -> None:
        """Compute what follows from the state; physics goes on as if it had not."""
        start = self.data.qacc_warmstart.copy()
        with self._watch:
            mujoco.mj_forward(self.model, self.data)
        self.data.qacc_warmstart[:] = start

    def _advance(self, steps: int, *, seen: bool) -> None:
        if self.compiled:
            self._advance_compiled(steps, seen=seen)
        else:
            self._advance_plainly(steps)

    def _advance_compiled(self, steps: int, *, seen: bool = True) -> None:
        if not math.isfinite(self.data.time) or not advance(*self._bound, steps, seen):
            self._watch.check()

    def _advance_plainly(self, steps: int) -> None:
        """Do what the compiled loop does, step by step: to be read and debugged."""
        model, data = self.model, self.data
        for _ in range(steps):
            mujoco.mj_step1(model, data)
            for state, controller in self._pairs:
                data.ctrl[state.actuator_ids] = controller.compute(state)
            mujoco.mj_step2(model, data)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
