"""Physics with controllers in the loop: n steps of one call."""

import math
from collections.abc import Sequence

import mujoco
import numpy as np

from wbc_suite.compiling import Callback, is_compiling, plain
from wbc_suite.control import CompositeController, RobotState, SteppedController
from wbc_suite.control.composite.protocols import (
    ResumableController,
    TickedController,
    solver_of_body,
)
from wbc_suite.control.contact.state_source import (
    begin_source,
    make_state_source,
    source_memory,
)
from wbc_suite.control.ground.records import gather
from wbc_suite.control.ik.compiled_tick import WholeBodyArrays
from wbc_suite.control.memory import Memory
from wbc_suite.control.part.ik_tick import HandIk
from wbc_suite.control.run.advance import advance
from wbc_suite.control.run.data import LoopData, loop_data
from wbc_suite.control.run.kernel_table import DECIDING, bind_kernels
from wbc_suite.envs.physics_watch import PhysicsWatch, check_laws, check_model
from wbc_suite.typing import Vector


class Simulation:
    """A MuJoCo model and its state, driven by one controller per robot.

    MuJoCo answers bad numbers by zeroing controls or by resetting the state, and a full
    arena by dropping contacts. Here automatic reset is off, and every warning is a
    `PhysicsError`.

    Args:
        model: Compiled scene; its automatic reset is switched off.
        data: Its state.
        pairs: Robots with their controllers.
        compiled: Whether the control laws are compiled. Otherwise the same functions
            run as plain Python, to be read in a debugger: 9 ms a step for a Panda.
        lite: Whether a tick ends with positions alone brought up to date. Else all that
            follows from the new state is computed, such as contacts, accelerations and
            sensors; MuJoCo leaves them one step behind.

    Attributes:
        compiled: Whether the whole loop is compiled: not if a controller computes
            commands itself, see `SteppedController`.
        memory: Numbers of laws, controllers and sensors that outlive a step.
        loop_calls: Number of calls of the loop in the last tick. Before each but the
            first a controller has run in Python.
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
        check_model(model)
        self.model, self.data, self._made_for = model, data, float(model.opt.timestep)
        self._watch, self.lite = PhysicsWatch(data), lite
        self.robots = tuple(state for state, _ in pairs)
        self.controllers = tuple(controller for _, controller in pairs)
        self.pairs = tuple(pairs)
        self._left = np.zeros(len(pairs), dtype=np.int64)
        self.loop_calls = 1
        self._stepped = [(r, c) for r, c in pairs if isinstance(c, SteppedController)]
        self._override = Callback(self._compute) if self._stepped else None
        self._runs_plain = not (compiled and is_compiling())
        self.compiled = not (self._runs_plain or self._stepped)
        laws = [law for controller in self.controllers for law in controller.laws]
        self._laws, self._drives = gather([(law.record, law.drives) for law in laws])
        for k, law in enumerate(laws):
            first, last = self._laws["first"][k], self._laws["last"][k]
            law.adopt(self._laws[k : k + 1], self._drives[first:last], k)
        found = map(solver_of_body, self.controllers)
        self._dynamic = [solver for solver in found if solver is not None]
        self._needed = list[bytes]()
        self._loop = self._loop_data()
        self.memory = self._make_memory()
        self._new = self.memory.read()
        self._call_loop(0)

    def _loop_data(self) -> LoopData:
        """Return what the loop reads and writes."""
        model, data = self.model, self.data
        self._ticked = [c for c in self.controllers if isinstance(c, TickedController)]
        ticks: list[WholeBodyArrays | HandIk] = []
        self._prepared: list[tuple[int, RobotState, CompositeController]] = []
        for k, (state, controller) in enumerate(self.pairs):
            is_ticked = isinstance(controller, TickedController)
            own = controller.loop_ticks() if is_ticked else ()
            ticks += own
            if not any(isinstance(tick, WholeBodyArrays) for tick in own):
                self._prepared.append((k, state, controller))
        exact = all(solver.sensors.is_exact for solver in self._dynamic)
        believed = data if exact else mujoco.MjData(model)
        self._sources = [
            make_state_source(
                c.sensors, c.dynamics, model=model, data=data, believed=believed
            )
            for c in ([] if exact else self._dynamic)
        ]
        loop = loop_data(model, data, self._laws, self._drives, believed=believed)
        return loop._replace(
            checked=self._watch.state,
            bodies=tuple(solver.dynamics for solver in self._dynamic),
            ticks=tuple(x for x in ticks if isinstance(x, WholeBodyArrays)),
            hands=tuple(x for x in ticks if isinstance(x, HandIk)),
            sources=tuple(self._sources),
        )

    def _make_memory(self) -> Memory:
        """Return what laws, controllers and sensors go on from."""
        laws = [law for controller in self.controllers for law in controller.laws]
        parts = [array for law in laws for array in law.memory]
        for controller in self.controllers:
            if isinstance(controller, ResumableController):
                parts += controller.memory
        for source in self._sources:
            parts += source_memory(source)
        return Memory([self._left, *parts])

    @property
    def timestep(self) -> float:
        """Duration of one physics step, s."""
        return float(self.model.opt.timestep)

    def forward(self) -> None:
        """Compute everything that follows from positions and velocities; see `tick`."""
        with self._watch:
            mujoco.mj_forward(self.model, self.data)

    def start(self) -> None:
        """Compute what follows from the state, and let controllers start from there.

        Raises:
            PhysicsError: If the state or the model has numbers that cannot be.
        """
        check_model(self.model, self._made_for)
        check_laws(self._laws, self._drives)
        self.forward()
        self.memory.write(self._new)  # nothing is left of an episode before
        for state, controller in self.pairs:
            controller.reset(state)
        for source in self._sources:
            begin_source(source, self.data)
        self._left[:] = self._loop.resumes[:] = 0

    def resume(self, memory: Vector) -> None:
        """Let controllers go on from values of `memory`, after `start`."""
        self.memory.write(memory)
        for state, controller in self.pairs:
            if isinstance(controller, ResumableController):
                controller.resume(state)

    def tick(self, n: int) -> None:
        """Advance n physics steps with the controllers in the loop.

        Raises:
            PhysicsError: If MuJoCo warns, or the state is not finite; names the
                warning. The state is left as it was found, for inspection.
        """
        if self.timestep != self._made_for:
            check_model(self.model, self._made_for)
        self._advance(n)
        if not self.lite:
            self._refresh()

    def _advance(self, n: int) -> None:
        """Advance n steps; controllers run in Python in between when they are due."""
        self.loop_calls = 0
        while n > 0:
            steps = n
            for k, state, controller in self._prepared:
                if self._left[k] <= 0:
                    with self._watch:
                        self._left[k] = controller.prepare(state)
                steps = min(steps, int(self._left[k]))
            done = self._call_loop(steps)
            self.loop_calls += 1
            n -= done
            self._left -= done
            if done < steps:
                with self._watch:
                    for ticked in self._ticked:
                        ticked.finish_tick()
                    for dynamic in self._dynamic:
                        dynamic.finish_tick()

    def _refresh(self) -> None:
        """Compute what follows from the state, without effect on the next step."""
        start = self.data.qacc_warmstart.copy()
        with self._watch:
            mujoco.mj_forward(self.model, self.data)
        self.data.qacc_warmstart[:] = start

    def _bind_kernels(self) -> None:
        """Compile what the laws need, if that is not the same as before."""
        needed = [self._laws[name].tobytes() for name in DECIDING]
        if needed != self._needed:
            loop, kernels, self._owner = bind_kernels(
                self._loop,
                compiled=not self._runs_plain,
                override=self._override,
            )
            self.loop_arguments = loop, kernels
            if self._runs_plain:
                self._plain_advance = plain(advance)
            self._needed = needed

    def _call_loop(self, steps: int) -> int:
        """Advance steps; return how many were made."""
        self._bind_kernels()
        done = -1
        if math.isfinite(self.data.time):
            run = self._plain_advance if self._runs_plain else advance
            done = run(*self.loop_arguments, steps=steps)
        if self._override is not None and self._override.error is not None:
            error, self._override.error = self._override.error, None
            raise error
        if done < 0:
            self._watch.check()
        return done

    def _compute(self) -> None:
        """Write the commands of controllers that compute them."""
        for state, controller in self._stepped:
            self.data.ctrl[state.actuator_ids] = controller.compute(state)
