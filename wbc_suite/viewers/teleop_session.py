"""The teleoperation loop: people's targets in, simulated motion out.

It knows nothing of browsers. Whoever has an input calls `grab`, `drag`, `release` and
`set_gripper` from any thread; whoever shows something reads `snapshot`. Both only take
a short lock or read one reference, so that the loop never waits for a page.
"""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import gymnasium
import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.devices import Device, DeviceState, LimbInput, Pipeline, PipelineConfig
from wbc_suite.devices.pipeline.config import RatesConfig
from wbc_suite.errors import DatasetError, UnknownNameError
from wbc_suite.recording.desk import RecordingDesk, Wish
from wbc_suite.typing import Vector
from wbc_suite.viewers.beat import Beat
from wbc_suite.viewers.drivable import SessionTraits
from wbc_suite.viewers.history import History
from wbc_suite.viewers.keeping_time import run_first
from wbc_suite.viewers.limb import Limb, Ownership
from wbc_suite.viewers.snapshot import LimbStatus, Snapshot

__all__ = ["DRAGGED", "TeleopSession"]

LEAD_POSITION = 0.03  # m; a released target that is further than this from its limb ...
LEAD_ORIENTATION = 0.2  # rad; ... or turned by more than this, goes back to it ...
REST_SPEED = 0.02  # m/s; ... when the limb has been slower than this ...
REST_TIME = 0.4  # s; ... for so long

DRAGGED = PipelineConfig(
    jump=None,  # a page that draws slowly sends a drag in few, long steps
    leash=None,  # a handle that is far away says so; see `_settle`
    linear=RatesConfig(speed=2.0, acceleration=30.0, jerk=1500.0),
    angular=RatesConfig(speed=6.0, acceleration=90.0, jerk=4500.0),
    ramp=0.0,
    return_after=None,
)
"""The pipeline behind handles that people drag."""


@dataclass(slots=True)
class _Inbox:
    """What people asked for since the last tick."""

    stamps: list[float] = field(default_factory=list)
    reset: bool = False


class TeleopSession:
    """Step an environment at its own rate with the targets that people hold.

    Args:
        env: Environment whose actions are absolute targets in the world.
        period: Simulated and wall time of one step, in s.
        seed: Seed of every reset.
        clock: Source of wall time, in s.
        device: A device that people use beside the page; it has been started.
        pipeline: Stages between people and the controller.
        desk: Where people ask for episodes to be recorded; None if nothing records.

    Attributes:
        beat: When the loop steps, and when it rests.
    """

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        *,
        period: float,
        seed: int = 0,
        clock: Callable[[], float] = time.perf_counter,
        device: Device | None = None,
        pipeline: PipelineConfig = DRAGGED,
        desk: RecordingDesk | None = None,
    ) -> None:
        self.env, self.desk = env, desk
        self.period, self.beat = period, Beat(period, clock=clock)
        self._seed = seed
        self._clock = clock
        layout = env.unwrapped.action_layout  # type: ignore[attr-defined]
        self._device, self._pressed = device, frozenset[str]()
        self._switched_to = ""
        self._simulation = env.unwrapped.simulation  # type: ignore[attr-defined]
        self.model: mujoco.MjModel = self._simulation.model
        self._lock = threading.Lock()
        self._inbox = _Inbox()
        self._paused = False
        self._epoch = self._tick = 0
        self._thread: threading.Thread | None = None
        self._stopping = threading.Event()
        self.quit = threading.Event()  # by the device's button, or all is recorded
        self._message, self._success = "", False
        self._ik: dict[str, Any] = {}
        self._latencies = History(1, 512)
        self._begun = self._spent = float("nan")  # wall time of a tick, smoothed

        env.reset(seed=seed)
        self._controller = env.unwrapped.controllers[0]  # type: ignore[attr-defined]
        self._pipeline = Pipeline(env, pipeline)
        self._let_go: dict[str, int] = {}  # ticks at rest, of limbs let go lately
        stages = self._pipeline.limbs
        self.limbs = {name: Limb(limb, Ownership()) for name, limb in stages.items()}
        self._open_grippers()
        ports = [limb.port for limb in stages.values()]
        self.traits = SessionTraits.of(self.model, layout, ports, records=bool(desk))
        self._publish()

    # What people do. Any thread.

    def grab(self, name: str, client: int, T_world_input: pin.SE3) -> bool:
        """Take a limb and latch the input to it; False when another holds it."""
        limb, now = self._limb(name), self._clock()
        with self._lock:
            if not limb.ownership.take(client, now):
                return False
            if limb.enabled:
                limb.stages.release()
                limb.stages.follow(LimbInput(pose=T_world_input))
            return True

    def drag(
        self,
        name: str,
        client: int,
        T_world_input: pin.SE3,
        arrived: float | None = None,
    ) -> bool:
        """Move a limb's target with the input; False when another holds it.

        `arrived` is when the input came, by the session's clock; None for now.
        """
        limb, now = self._limb(name), self._clock()
        with self._lock:
            if not limb.ownership.take(client, now):
                return False
            if limb.enabled:
                limb.stages.follow(LimbInput(pose=T_world_input))
                self._inbox.stamps.append(now if arrived is None else arrived)
            return True

    def release(self, name: str, client: int) -> None:
        """Let a limb go; its target stays, and the limb goes on towards it."""
        limb = self._limb(name)
        with self._lock:
            if limb.ownership.release(client):
                limb.stages.release()
                self._let_go[name] = 0

    def leave(self, client: int) -> None:
        """Release everything that a client held, for instance when its tab closes."""
        for name in self.limbs:
            self.release(name, client)

    def enable(self, name: str, enabled: bool) -> None:
        """Put a limb's clutch in or out; its target does not move by that."""
        limb = self._limb(name)
        with self._lock:
            limb.enabled = enabled
            limb.stages.release()

    def set_gripper(self, name: str, index: int, value: float) -> None:
        """Set one synergy of a gripper, from -1 (open) to 1 (closed)."""
        if name not in self.grippers:
            raise UnknownNameError("gripper", name, self.grippers)
        now = self._clock()
        with self._lock:
            self.grippers[name][index] = float(np.clip(value, -1.0, 1.0))
            self._inbox.stamps.append(now)

    @property
    def grippers(self) -> dict[str, Vector]:
        """How far each gripper's synergies shall close, -1 open .. 1 closed."""
        return {name: grip.goal for name, grip in self._pipeline.grips.items()}

    def pause(self, paused: bool) -> None:
        """Let time stand still, or go on."""
        self._paused = paused

    def reset(self) -> None:
        """Begin again from the start posture, at the next tick."""
        with self._lock:
            self._inbox.reset = True

    def wish(self, wish: Wish) -> None:
        """Ask something of the recording; nobody hears it where nothing records."""
        if self.desk is not None:
            self.desk.ask(wish)

    # The loop.

    def start(self, *, urgent: bool = False) -> None:
        """Run the loop in a thread of its own, at the session's rate.

        Args:
            urgent: Whether it runs before other programs, where the system lets it.
        """
        self._stopping.clear()
        self._thread = threading.Thread(
            target=self._run, args=(urgent,), name="teleop", daemon=True
        )
        self._thread.start()

    @property
    def running(self) -> bool:
        """Whether the loop's thread goes on; an error ends it."""
        return self._thread is not None and self._thread.is_alive()

    def stop(self) -> None:
        """End the loop and wait for its last tick."""
        self._stopping.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def tick(self) -> None:
        """Do one step, or none while paused, and publish a snapshot."""
        with self._lock:
            inbox, self._inbox = self._inbox, _Inbox()
        state = self._hear()
        if inbox.reset:
            self._reset()
        if self.desk is not None:
            self.desk.serve(self._reset)
            if self.desk.finished:
                self.quit.set()
        if not self._paused:
            self._step(state, inbox.stamps)
        self._publish()

    def latencies(self) -> Vector:
        """Return the times from an input's arrival to its joint target, in s.

        The clock starts when this process receives the input and stops when the
        controller has found the joint targets that follow from it.
        """
        return self._latencies.rows()[:, 0]

    def _hear(self) -> DeviceState:
        """Return what the device says, and do what its buttons ask of the session."""
        if self._device is None:
            return DeviceState(time=self._clock())
        state = self._device.read()
        pressed, self._pressed = state.buttons - self._pressed, state.buttons
        if "pause" in pressed:
            self._paused = not self._paused
        if "reset" in pressed:
            self._reset()
        if "quit" in pressed:
            self.quit.set()
        if self.desk is not None:
            self.desk.press(pressed)
        return state

    def _run(self, urgent: bool) -> None:
        if urgent:
            run_first(rank=2)
        self.beat.start()
        try:
            while not self._stopping.is_set():
                self.tick()
                self.beat.rest()
        finally:
            self.beat.stop()
            if not self._stopping.is_set():  # an error ends the loop; people must know
                self._message = "Stopped by an error: see the terminal."
                self._paused = True
                self._publish()

    def _step(self, state: DeviceState, stamps: list[float]) -> None:
        with self._lock:
            action = self._pipeline.update(state)
        self._switched_to = self._pipeline.active if "hand" in state.limbs else ""
        self.beat.await_step()
        try:
            *_, info = self.env.step(action)
        except DatasetError as error:  # the disk is full; people go on without it
            info, self._message = {}, str(error)
        now = self._clock()
        found = getattr(self._controller, "solved_at", now)
        for stamp in stamps:
            self._latencies.append(np.array([max(found, stamp) - stamp]))
        self._ik = info.get("ik", {})
        self._success = bool(info.get("success", False))
        if "physics_error" in info:
            self._reset()
            self._message = f"Physics gave up ({info['physics_error']}): started again."
        self._note_speed(now)
        with self._lock:
            self._settle()
        self._tick += 1

    def _settle(self) -> None:
        """Bring a target that was let go back to its limb, which rests short of it.

        Otherwise a target pulled far out of reach would have to be pulled all the way
        back before the limb moves again. Targets of limbs that nobody touched stay,
        however far others drag their limbs off.
        """
        for name in list(self._let_go):
            status = self.snapshot.limbs[name]
            measured = self.limbs[name].stages.port.measure()
            step = measured.translation - status.measured.translation
            rests = bool(np.linalg.norm(step) < REST_SPEED * self.period)
            self._let_go[name] = self._let_go[name] + 1 if rests else 0
            held = self.limbs[name].ownership.holder(self._clock()) is not None
            if held or status.reached:
                del self._let_go[name]
            elif self._let_go[name] * self.period > REST_TIME:
                del self._let_go[name]
                if _is_far(status):
                    self.limbs[name].stages.place(measured)

    def _note_speed(self, now: float) -> None:
        if not np.isnan(self._begun):
            spent = now - self._begun
            old = self._spent
            self._spent = spent if np.isnan(old) else 0.97 * old + 0.03 * spent
        self._begun = now

    def _reset(self, seed: int | None = None) -> None:
        self.env.reset(seed=self._seed if seed is None else seed)
        with self._lock:
            self._pipeline.reset()
            self._open_grippers()
            self._let_go.clear()
        self._message, self._success, self._ik = "", False, {}
        self._begun = float("nan")
        self._epoch += 1

    def _open_grippers(self) -> None:
        for grip in self._pipeline.grips.values():
            grip.goal[:] = -1.0

    # What is shown.

    def _publish(self) -> None:
        data, now = self._simulation.data, self._clock()
        with self._lock:
            limbs = {name: self._status(name, now) for name in self.limbs}
            grippers = {name: goal.copy() for name, goal in self.grippers.items()}
        latencies = self.latencies()
        self.snapshot = Snapshot(
            tick=self._tick,
            epoch=self._epoch,
            time=float(data.time),
            body_positions=data.xpos.copy(),
            body_quaternions=data.xquat.copy(),
            limbs=limbs,
            grippers=grippers,
            solve_time=float(self._ik.get("solve_time", np.nan)),
            latency=float(np.median(latencies)) if len(latencies) else float("nan"),
            speed=self.period / max(self._spent, 1e-9),
            paused=self._paused,
            success=self._success,
            message=self._message,
            device=self._pipeline.acting.get("device", ()),
            switched_to=self._switched_to,
            recording=None if self.desk is None else self.desk.status,
        )

    def _status(self, name: str, now: float) -> LimbStatus:
        limb = self.limbs[name]
        measured = self.limbs[name].stages.port.measure()
        target = limb.seen_target(measured)
        report = self._ik.get("frames", {}).get(name, {})
        return LimbStatus(
            measured=measured,
            target=target,
            position_error=float(report.get("position_error", 0.0)),
            orientation_error=float(report.get("orientation_error", 0.0)),
            reached=bool(report.get("reached", True)),
            reasons=tuple(report.get("reasons", ())),
            holder=limb.ownership.holder(now),
            enabled=limb.enabled,
            acting=limb.stages.acting,
        )

    def _limb(self, name: str) -> Limb:
        if name not in self.limbs:
            raise UnknownNameError("limb", name, self.limbs)
        return self.limbs[name]


def _is_far(status: LimbStatus) -> bool:
    return (
        status.position_error > LEAD_POSITION
        or status.orientation_error > LEAD_ORIENTATION
    )
