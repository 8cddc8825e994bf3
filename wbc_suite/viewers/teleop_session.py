"""The teleoperation loop: people's targets in, simulated motion out.

It knows nothing of browsers. Whoever has an input calls `grab`, `drag`, `release` and
`set_gripper` from any thread; whoever shows something reads `snapshot`. Both only take
a short lock or read one reference, so that the loop never waits for a page.
"""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import gymnasium
import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.devices import Clutch
from wbc_suite.errors import UnknownNameError
from wbc_suite.typing import Matrix, Vector
from wbc_suite.viewers.frames import FrameReader, frame_readers
from wbc_suite.viewers.history import History
from wbc_suite.viewers.limb import Limb, Ownership

__all__ = ["LimbStatus", "Snapshot", "TeleopSession"]

WINDOW = 600  # rows of history: 12 s at 50 Hz
LEAD_POSITION = 0.03  # m; a released target that is further than this from its limb ...
LEAD_ORIENTATION = 0.2  # rad; ... or turned by more than this, goes back to it ...
REST_SPEED = 0.02  # m/s; ... when the limb has been slower than this ...
REST_TIME = 0.4  # s; ... for so long


@dataclass(frozen=True, slots=True, kw_only=True)
class LimbStatus:
    """How one limb stands after a tick.

    Attributes:
        measured: Pose of the simulated frame in the world.
        target: Pose that was asked for, in the world; what is not commanded of it is
            as measured.
        position_error: Distance that is commanded and missing, in m, as the controller
            reports it.
        orientation_error: Angle that is commanded and missing, in rad.
        reached: Whether the controller can bring the frame to its target.
        reasons: Why it cannot, in words.
        holder: Client that holds the limb, or None.
        enabled: Whether the limb's clutch is in.
    """

    measured: pin.SE3
    target: pin.SE3
    position_error: float
    orientation_error: float
    reached: bool
    reasons: tuple[str, ...]
    holder: int | None
    enabled: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshot:
    """Everything a page shows, at one tick.

    Attributes:
        tick: Number of ticks since the session was made.
        epoch: Number of resets; when it grows, targets have moved by themselves.
        time: Simulated time, in s.
        body_positions: Positions of all bodies in the world, shape (nbody, 3).
        body_quaternions: Their orientations (wxyz), shape (nbody, 4).
        limbs: Status per limb name.
        solve_time: Time of the controller's last solve, in s.
        latency: Median time from an input to its joint target, in s; nan before any.
        speed: Simulated seconds per second of wall time.
        paused: Whether time stands still.
        success: Whether the benchmark counts as solved.
        message: What the session wants to tell people, possibly empty.
    """

    tick: int
    epoch: int
    time: float
    body_positions: Matrix
    body_quaternions: Matrix
    limbs: MappingProxyType[str, LimbStatus]
    solve_time: float
    latency: float
    speed: float
    paused: bool
    success: bool
    message: str


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
    """

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        *,
        period: float,
        seed: int = 0,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self.env = env
        self.period = period
        self._seed = seed
        self._clock = clock
        self._layout = env.unwrapped.action_layout  # type: ignore[attr-defined]
        self._simulation = env.unwrapped.simulation  # type: ignore[attr-defined]
        self.model: mujoco.MjModel = self._simulation.model
        self._lock = threading.Lock()
        self._inbox = _Inbox()
        self._paused = False
        self._epoch = self._tick = 0
        self._thread: threading.Thread | None = None
        self._stopping = threading.Event()
        self._message, self._success = "", False
        self._ik: dict[str, Any] = {}
        self._latencies = History(1, 512)
        self._begun = self._spent = float("nan")  # wall time of a tick, smoothed

        env.reset(seed=seed)
        self._controller = env.unwrapped.controllers[0]  # type: ignore[attr-defined]
        self._readers = frame_readers(self._controller, self.model)
        self._let_go: dict[str, int] = {}  # ticks at rest, of limbs let go lately
        self.limbs = {
            name: Limb(name, reader.kind, Clutch(self._measure(reader)), Ownership())
            for name, reader in self._readers.items()
        }
        self.grippers = self._open_grippers()
        self.gripper_labels = {
            s.name: tuple(s.labels) for s in self._layout.slices if s.kind == "gripper"
        }
        self.bodies = {name: reader.body for name, reader in self._readers.items()}
        # Columns: wall time, solve time, then the position error of every limb.
        self.history = History(2 + len(self.limbs), WINDOW)
        self._publish()

    # What people do. Any thread.

    def grab(self, name: str, client: int, T_world_input: pin.SE3) -> bool:
        """Take a limb and latch the input to it; False when another holds it."""
        limb, now = self._limb(name), self._clock()
        with self._lock:
            if not limb.ownership.take(client, now):
                return False
            if limb.enabled:
                limb.clutch.engage(T_world_input)
            return True

    def drag(self, name: str, client: int, T_world_input: pin.SE3) -> bool:
        """Move a limb's target with the input; False when another holds it."""
        limb, now = self._limb(name), self._clock()
        with self._lock:
            if not limb.ownership.take(client, now):
                return False
            if limb.enabled:
                if not limb.clutch.engaged:
                    limb.clutch.engage(T_world_input)
                limb.clutch.move(T_world_input)
                self._inbox.stamps.append(now)
            return True

    def release(self, name: str, client: int) -> None:
        """Let a limb go; its target stays, and the limb goes on towards it."""
        limb = self._limb(name)
        with self._lock:
            if limb.ownership.release(client):
                limb.clutch.release()
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
            limb.clutch.release()

    def set_gripper(self, name: str, index: int, value: float) -> None:
        """Set one synergy of a gripper, from -1 (open) to 1 (closed)."""
        if name not in self.grippers:
            raise UnknownNameError("gripper", name, self.grippers)
        now = self._clock()
        with self._lock:
            self.grippers[name][index] = value
            self._inbox.stamps.append(now)

    def pause(self, paused: bool) -> None:
        """Let time stand still, or go on."""
        self._paused = paused

    def reset(self) -> None:
        """Begin again from the start posture, at the next tick."""
        with self._lock:
            self._inbox.reset = True

    # The loop.

    def start(self) -> None:
        """Run the loop in a thread of its own, at the session's rate."""
        self._stopping.clear()
        self._thread = threading.Thread(target=self._run, name="teleop", daemon=True)
        self._thread.start()

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
        if inbox.reset:
            self._reset()
        if not self._paused:
            self._step(inbox.stamps)
        self._publish()

    def latencies(self) -> Vector:
        """Return the times from an input's arrival to its joint target, in s.

        The clock starts when this process receives the input and stops when the
        controller has found the joint targets that follow from it.
        """
        return self._latencies.rows()[:, 0]

    def _run(self) -> None:
        try:
            self._tick_on_time()
        finally:
            if not self._stopping.is_set():  # an error ends the loop; people must know
                self._message = "Stopped by an error: see the terminal."
                self._paused = True
                self._publish()

    def _tick_on_time(self) -> None:
        due = self._clock()
        while not self._stopping.is_set():
            self.tick()
            due += self.period
            wait = due - self._clock()
            if wait > 0:
                time.sleep(wait)
            elif wait < -5 * self.period:
                due = self._clock()  # too slow for real time: do not race after it

    def _step(self, stamps: list[float]) -> None:
        with self._lock:
            values = {name: limb.command() for name, limb in self.limbs.items()}
            values |= {name: value.copy() for name, value in self.grippers.items()}
        *_, info = self.env.step(self._layout.pack(values))
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
            measured = self._measure(self._readers[name])
            step = measured.translation - status.measured.translation
            rests = bool(np.linalg.norm(step) < REST_SPEED * self.period)
            self._let_go[name] = self._let_go[name] + 1 if rests else 0
            held = self.limbs[name].ownership.holder(self._clock()) is not None
            if held or status.reached:
                del self._let_go[name]
            elif self._let_go[name] * self.period > REST_TIME:
                del self._let_go[name]
                if _is_far(status):
                    self.limbs[name].clutch.place(measured)

    def _note_speed(self, now: float) -> None:
        if not np.isnan(self._begun):
            spent = now - self._begun
            old = self._spent
            self._spent = spent if np.isnan(old) else 0.97 * old + 0.03 * spent
        self._begun = now

    def _reset(self) -> None:
        self.env.reset(seed=self._seed)
        with self._lock:
            for name, reader in self._readers.items():
                self.limbs[name].clutch.place(self._measure(reader))
            self.grippers = self._open_grippers()
            self._let_go.clear()
        self._message, self._success, self._ik = "", False, {}
        self._begun = float("nan")
        self._epoch += 1

    def _open_grippers(self) -> dict[str, Vector]:
        """Return the least value, which is open, of every gripper's synergies."""
        return {
            s.name: np.array(s.low, dtype=np.float64)
            for s in self._layout.slices
            if s.kind == "gripper"
        }

    # What is shown.

    def _publish(self) -> None:
        data, now = self._simulation.data, self._clock()
        with self._lock:
            limbs = {name: self._status(name, now) for name in self.limbs}
        latencies = self.latencies()
        self.snapshot = Snapshot(
            tick=self._tick,
            epoch=self._epoch,
            time=float(data.time),
            body_positions=data.xpos.copy(),
            body_quaternions=data.xquat.copy(),
            limbs=MappingProxyType(limbs),
            solve_time=float(self._ik.get("solve_time", np.nan)),
            latency=float(np.median(latencies)) if len(latencies) else float("nan"),
            speed=self.period / max(self._spent, 1e-9),
            paused=self._paused,
            success=self._success,
            message=self._message,
        )
        if not self._paused:
            errors = [status.position_error for status in limbs.values()]
            self.history.append(np.array([now, self.snapshot.solve_time, *errors]))

    def _status(self, name: str, now: float) -> LimbStatus:
        limb = self.limbs[name]
        measured = self._measure(self._readers[name])
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
        )

    def _measure(self, reader: FrameReader) -> pin.SE3:
        return reader.pose(self._simulation.data)

    def _limb(self, name: str) -> Limb:
        if name not in self.limbs:
            raise UnknownNameError("limb", name, self.limbs)
        return self.limbs[name]


def _is_far(status: LimbStatus) -> bool:
    return (
        status.position_error > LEAD_POSITION
        or status.orientation_error > LEAD_ORIENTATION
    )
