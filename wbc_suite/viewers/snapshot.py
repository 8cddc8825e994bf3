"""What a teleoperation session shows at one tick."""

from collections.abc import Mapping
from dataclasses import dataclass

import pinocchio as pin

from wbc_suite.recording.desk import DeskStatus
from wbc_suite.typing import Matrix, Vector

__all__ = ["LimbStatus", "Snapshot"]


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
        acting: What stages of the pipeline do to its target, in words.
    """

    measured: pin.SE3
    target: pin.SE3
    position_error: float
    orientation_error: float
    reached: bool
    reasons: tuple[str, ...]
    holder: int | None
    enabled: bool
    acting: tuple[str, ...]


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
        grippers: How far each gripper's synergies shall close, -1 open .. 1 closed.
        solve_time: Time of the controller's last solve, in s.
        latency: Median time from an input to its joint target, in s; nan before any.
        speed: Simulated seconds per second of wall time.
        paused: Whether time stands still.
        success: Whether the benchmark counts as solved.
        message: What the session wants to tell people, possibly empty.
        device: What the pipeline says of the device beside the page, in words.
        switched_to: Limb that a device for one hand moves; empty where none is used.
        recording: How the recording stands; None if nothing records.
    """

    tick: int
    epoch: int
    time: float
    body_positions: Matrix
    body_quaternions: Matrix
    limbs: Mapping[str, LimbStatus]
    grippers: Mapping[str, Vector]
    solve_time: float
    latency: float
    speed: float
    paused: bool
    success: bool
    message: str
    device: tuple[str, ...]
    switched_to: str
    recording: DeskStatus | None
