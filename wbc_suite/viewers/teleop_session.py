"""The teleoperation loop: targets of clients and devices in, simulated motion out.

It does not depend on browsers. Inputs call `grab`, `drag`, `release` and `set_gripper`
from any thread; displays read `snapshot`. Both take a short lock at most, so that the
loop never waits for a page.
"""

import threading
import time
from collections.abc import Callable
from typing import Any

import gymnasium
import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.devices import Device, DeviceState, Pipeline, PipelineConfig
from wbc_suite.devices.device import ButtonReader
from wbc_suite.devices.pipeline.config import DRAGGED
from wbc_suite.devices.pipeline.drive import HeldCommand
from wbc_suite.errors import DatasetError, UnknownNameError
from wbc_suite.recording.episode_control import EpisodeCommand, EpisodeControl
from wbc_suite.typing import Vector
from wbc_suite.viewers.balance_status import BalanceReader
from wbc_suite.viewers.limb_targets import LimbTarget
from wbc_suite.viewers.loop_timing import LoopTimer, StepTimes, raise_priority
from wbc_suite.viewers.session_state import PauseOwner, SessionInfo, Snapshot

DEVICE_GONE = 20.0  # s; a device that is silent for so long no longer owns a pause
DRIVE_TIMEOUT = 0.5  # s; a robot stops if the page does not repeat a velocity


class TeleopSession:
    """Step an environment at its own rate with the targets of clients and devices.

    Args:
        env: Environment whose actions are absolute targets in the world.
        period: Simulated and wall time of one step, s.
        seed: Seed of every reset.
        clock: Source of wall time, s.
        device: A device that is used beside the page; it has been started.
        pipeline: Stages between inputs and the controller.
        episode_control: Starts and ends recorded episodes; None if nothing records.

    Attributes:
        info: Constant properties.
        snapshot: State after the last tick.
        limbs: Targets by limb.
        timer: Times the steps of the loop.
        quit: Set when the device's button `quit` is pressed, or all is recorded.
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
        episode_control: EpisodeControl | None = None,
    ) -> None:
        self.env, self.episode_control = env, episode_control
        self.period, self.timer = period, LoopTimer(period, clock=clock)
        self._seed, self._clock = seed, clock
        self._device = ButtonReader(device)
        self._simulation = env.unwrapped.simulation  # type: ignore[attr-defined]
        self.model: mujoco.MjModel = self._simulation.model
        self._lock = threading.Lock()
        self._inputs: list[float] = []  # arrival times since the last tick
        self._reset_requested = self._paused = False
        self._paused_by: PauseOwner | None = None
        self._epoch = self._tick = self._solved = 0
        self._thread: threading.Thread | None = None
        self._stopping, self.quit = threading.Event(), threading.Event()
        self._message, self._success, self._selected = "", False, ""
        self._solved_at, self._ik = np.nan, dict[str, Any]()
        self._drive, self._times = HeldCommand(4, DRIVE_TIMEOUT), StepTimes()

        env.reset(seed=seed)
        controller = env.unwrapped.controllers[0]  # type: ignore[attr-defined]
        self._balance = BalanceReader(self.model, self._simulation.data, controller)
        self._pipeline = Pipeline(env, pipeline, clock=clock)
        self.limbs = {n: LimbTarget(limb) for n, limb in self._pipeline.limbs.items()}
        self._open_grippers()
        self.info = SessionInfo(
            model=self.model,
            limbs={name: limb.info for name, limb in self.limbs.items()},
            grippers={name: grip.labels for name, grip in self._pipeline.grips.items()},
            records=self.episode_control is not None,
            drive=self._pipeline.drive.limits,
            rides=self._pipeline.carries,
            walks=self._balance.walks,
            task=getattr(getattr(env.unwrapped, "benchmark", None), "title", ""),
        )
        self._publish()

    def grab(self, name: str, client: int, T_world_input: pin.SE3) -> bool:
        """Take a limb and latch the input to it; False if another client holds it."""
        now = self._clock()
        with self._lock:
            self._pipeline.leave(name)
            return self._limb(name).drag(client, T_world_input, now=now, grab=True)

    def drag(
        self,
        name: str,
        client: int,
        T_world_input: pin.SE3,
        arrived: float | None = None,
    ) -> bool:
        """Move a limb's target; `arrived` is by the session's clock, None for now."""
        now = self._clock()
        with self._lock:
            limb = self._limb(name)
            taken = limb.drag(client, T_world_input, now=now)
            if taken and limb.enabled:
                self._inputs.append(now if arrived is None else arrived)
            return taken

    def release(self, name: str, client: int) -> None:
        """Release a limb; its target stays, and the limb goes on towards it."""
        with self._lock:
            self._limb(name).release(client)

    def leave(self, client: int) -> None:
        """Release everything that a client holds, for instance when its tab closes."""
        for name in self.limbs:
            self.release(name, client)
        self.watch_balance(client, False)
        with self._lock:
            self._drive.leave(client)
            if self._paused_by == client:
                self._paused_by = None

    def drive(self, client: int, velocity: Vector) -> None:
        """Drive by forward, left (m/s), turn (rad/s), up (m/s); see `HeldCommand`.

        A client sends zeros first.
        """
        now = self._clock()
        with self._lock:
            if self._drive.set(velocity, client=client, now=now):
                self._inputs.append(now)

    def ride(self, rides: bool) -> None:
        """Hold hands' targets in the body if `rides`, else in the world."""
        with self._lock:
            for limb in self.limbs.values():
                limb.stages.rides = rides

    def watch_balance(self, client: int, watched: bool) -> None:
        """Publish the balance while a client displays it."""
        with self._lock:
            self._balance.watch(client, watched)

    def enable(self, name: str, enabled: bool) -> None:
        """Engage or disengage a limb's clutch; its target does not move."""
        with self._lock:
            self._limb(name).enable(enabled)

    def set_gripper(self, name: str, index: int, value: float) -> None:
        """Set one synergy of a gripper, -1 open .. 1 closed; nan is ignored."""
        if name not in self.grippers:
            raise UnknownNameError("gripper", name, self.grippers)
        if np.isnan(value):
            return
        now = self._clock()
        with self._lock:
            self.grippers[name][index] = float(np.clip(value, -1.0, 1.0))
            self._inputs.append(now)

    @property
    def grippers(self) -> dict[str, Vector]:
        """Goal of each gripper's synergies, -1 open .. 1 closed."""
        return {name: grip.goal for name, grip in self._pipeline.grips.items()}

    def pause(self, owner: PauseOwner, paused: bool) -> bool:
        """Pause, or resume: only who paused may, and anybody after they have left.

        A pause lasts until somebody resumes, also after its owner has left. Commands
        that were held meanwhile move nothing. Returns whether the session now is as
        asked.
        """
        with self._lock:
            if self._paused and self._paused_by not in (None, owner):
                return paused
            self._paused, self._paused_by = paused, owner if paused else None
            if not paused:
                self._drive.clear()
            return True

    def reset(self) -> None:
        """Reset the environment at the next tick."""
        self._reset_requested = True

    def command_episode(self, command: EpisodeCommand) -> None:
        """Send a command to the recording; ignored if the session does not record."""
        if self.episode_control is not None:
            self.episode_control.request(command)

    def _limb(self, name: str) -> LimbTarget:
        if name not in self.limbs:
            raise UnknownNameError("limb", name, self.limbs)
        return self.limbs[name]

    def start(self, *, urgent: bool = False) -> None:
        """Run the loop in a thread, if `urgent` with a real-time priority."""
        self._stopping.clear()
        self._thread = threading.Thread(
            target=self._run, args=(urgent,), name="teleop", daemon=True
        )
        self._thread.start()

    @property
    def running(self) -> bool:
        """Whether the loop's thread runs; an error ends it."""
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
            inputs, self._inputs = self._inputs, []
            reset, self._reset_requested = self._reset_requested, False
        state = self._read_device()
        if reset:
            self._reset()
        if self.episode_control is not None:
            self.episode_control.update(self._reset)
            if self.episode_control.finished:
                self.quit.set()
        if self._paused:
            with self._lock:
                self._pipeline.hold(state)
                if self._paused_by == "device" and self._pipeline.silence > DEVICE_GONE:
                    self._paused_by = None
        else:
            self._step(state, inputs)
        self._publish()

    def latencies(self) -> Vector:
        """Return times from inputs to the joint targets that follow from them, s."""
        return self._times.latencies

    def _read_device(self) -> DeviceState:
        """Return the device's state; handle the buttons of the session."""
        state, pressed = self._device.read()
        if "pause" in pressed:
            self.pause("device", not self._paused)
        if "reset" in pressed:
            self._reset()
        if "quit" in pressed:
            self.quit.set()
        if self.episode_control is not None:
            self.episode_control.press_buttons(pressed)
        return state

    def _act(self, state: DeviceState) -> Vector:
        """Return the action of a tick; that which holds if an input causes an error."""
        with self._lock:
            try:
                velocity = self._drive.read(self._clock())
                return self._pipeline.update(state, velocity)
            except Exception as error:  # noqa: BLE001 -- no input ends the loop
                self._pipeline.reset()
                self._message = f"An input was refused: {error}"
        return self.env.unwrapped.hold_action  # type: ignore[attr-defined]

    def _run(self, urgent: bool) -> None:
        if urgent:
            raise_priority(rank=2)
        self.timer.start()
        try:
            while not self._stopping.is_set():
                self.tick()
                self.timer.finish_step()
        finally:
            self.timer.stop()
            if not self._stopping.is_set():  # an error ended the loop
                self._message = "Stopped by an error: see the terminal."
                self._paused = True
                self._publish()

    def _step(self, state: DeviceState, inputs: list[float]) -> None:
        action = self._act(state)
        self._selected = self._pipeline.selected if "hand" in state.limbs else ""
        self.timer.wait_for_step()
        begun = self._clock()
        try:
            *_, info = self.env.step(action)
        except DatasetError as error:  # the disk is full; teleoperation goes on
            info, self._message = {}, str(error)
        now = self._clock()
        self._times.end_step(inputs, begun, now)
        self._balance.take(info.get("balance", {}))
        self._ik, self._success = info.get("ik", {}), bool(info.get("success", False))
        if self._success and np.isnan(self._solved_at):
            self._solved += 1
            self._solved_at = float(self._simulation.data.time)
        if "physics_error" in info:
            self._reset()
            self._message = f"The simulation diverged ({info['physics_error']}): reset."
        with self._lock:
            for name, limb in self.limbs.items():
                limb.settle(self.snapshot.limbs[name], period=self.period, now=now)
        self._tick += 1

    def _reset(self, seed: int | None = None) -> None:
        self.env.reset(seed=self._seed if seed is None else seed)
        with self._lock:
            self._pipeline.reset()
            for limb in self.limbs.values():
                limb.rest = None
            self._open_grippers()
            self._drive.clear()
        self._message, self._success, self._ik = "", False, {}
        self._solved_at = np.nan
        self._balance.take({})
        self._times.restart()
        self.timer.restart()
        self._epoch += 1

    def _open_grippers(self) -> None:
        for grip in self._pipeline.grips.values():
            grip.goal[:] = -1.0

    def _publish(self) -> None:
        data, now = self._simulation.data, self._clock()
        with self._lock:
            limbs = {
                name: limb.status(self._ik.get("frames", {}).get(name, {}), now=now)
                for name, limb in self.limbs.items()
            }
            grippers = {name: goal.copy() for name, goal in self.grippers.items()}
            balance = self._balance.status()
            drive_waits = self._drive.waits(now)
        self.snapshot = Snapshot(
            tick=self._tick,
            epoch=self._epoch,
            solved=self._solved,
            solved_at=self._solved_at,
            time=float(data.time),
            positions=data.qpos.copy(),
            body_positions=data.xpos.copy(),
            body_quaternions=data.xquat.copy(),
            limbs=limbs,
            grippers=grippers,
            step_time=self._times.duration,
            step_period=self._times.period,
            overruns=self.timer.overruns,
            skipped=self.timer.skipped,
            latency=self._times.latency,
            speed=self.period / max(self._times.period, 1e-9),
            paused=self._paused,
            paused_by=self._paused_by,
            success=self._success,
            message=self._message,
            device=self._device.faults + self._pipeline.acting.get("device", ()),
            selected=self._selected,
            recording=self.episode_control and self.episode_control.status,
            velocity=self._pipeline.drive.velocity,
            drive_waits=drive_waits,
            rides=all(limb.stages.rides for limb in self.limbs.values()),
            balance=balance,
            fell=self._balance.fell,
        )
