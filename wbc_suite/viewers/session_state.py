"""State of a teleoperation session as its page displays it."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias

import mujoco
import pinocchio as pin

from wbc_suite.control.reasons import Reason
from wbc_suite.devices.action_ports import LimbKind
from wbc_suite.recording.episode_control import EpisodeStatus
from wbc_suite.typing import Matrix, Vector
from wbc_suite.viewers.balance_status import BalanceStatus

PauseOwner: TypeAlias = int | Literal["device"]
"""Who paused: a client, or the device beside the page."""


def plain(name: str) -> str:
    """Return the name of a joint, link or limb as words.

    `right_elbow_joint` becomes `right elbow`, `robot0_right_hand` becomes
    `robot 0 right hand`.
    """
    name = re.sub(r"^robot(\d+)_", r"robot \1 ", name)
    return name.removesuffix("_joint").removesuffix("_link").replace("_", " ").strip()


@dataclass(frozen=True, slots=True, kw_only=True)
class LimbInfo:
    """Constant properties of a limb: as those of its `LimbPort`."""

    name: str
    kind: LimbKind
    body: int

    @property
    def title(self) -> str:
        """The name as it is displayed: `right_hand` becomes `Right hand`."""
        return "Centre of mass" if self.name == "com" else plain(self.name).capitalize()


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionInfo:
    """Constant properties of a session.

    Attributes:
        limbs: Limbs that can be dragged, by name.
        grippers: Names of each gripper's synergies, by the gripper's name.
        drive: Greatest velocity forward, left (m/s), turn (rad/s) and up (m/s) that
            keys command, 0 for what the robot cannot do, shape (4,).
        rides: Whether targets of hands can move with the body.
        walks: Whether the robot walks, and reports its balance.
        task: What is to be done, in a few words; empty if the benchmark does not say.
    """

    model: mujoco.MjModel
    limbs: Mapping[str, LimbInfo]
    grippers: Mapping[str, tuple[str, ...]]
    records: bool
    drive: Vector
    rides: bool
    walks: bool
    task: str


@dataclass(frozen=True, slots=True, kw_only=True)
class LimbStatus:
    """State of one limb after a tick.

    Attributes:
        measured: Pose of the simulated frame in the world.
        target: Requested pose in the world; components that are not commanded are as
            measured.
        position_error: Tracking error of the commanded position, m.
        orientation_error: Tracking error of the commanded orientation, rad.
        reached: Whether the controller can bring the frame to its target; else
            `reasons` says why not.
        holder: Client that holds the limb, or None.
        enabled: Whether the limb's clutch is engaged.
        acting: What stages of the pipeline do to the target.
        moved: Whether somebody has moved the target since the reset.
    """

    measured: pin.SE3
    target: pin.SE3
    position_error: float
    orientation_error: float
    reached: bool
    reasons: tuple[Reason, ...]
    holder: int | None
    enabled: bool
    acting: tuple[str, ...]
    moved: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshot:
    """State of a session at one tick.

    Attributes:
        tick: Number of ticks since the session was created.
        epoch: Number of resets; a reset moves all targets.
        solved: Number of attempts, from reset to reset, in which the task was solved.
        solved_at: Simulated time when it was solved in this attempt, s; else nan.
        time: Simulated time, s.
        positions: Generalised positions of the scene, shape (nq,).
        body_positions: Positions of all bodies in the world, m, shape (nbody, 3).
        body_quaternions: Their orientations (wxyz), shape (nbody, 4).
        limbs: Status by limb name.
        grippers: Commanded closing of each gripper's synergies, -1 open .. 1 closed.
        step_time: Measured time of a step of control and physics, s; nan before any.
        step_period: Measured time between two steps, s; nan before two.
        overruns: Number of steps that ended after the next one was due.
        skipped: Number of periods that were skipped for them.
        latency: Median time from an input to its joint target, s; nan before any.
        speed: Simulated time per wall time.
        paused_by: Who paused, and alone may resume; None if they have left, and anybody
            may, or if the session is not paused.
        message: Message to the user, possibly empty.
        device: State of the device beside the page, as the pipeline reports it.
        selected: Limb that a device for one hand moves; empty if none is used.
        recording: State of the recording; None if the session cannot record.
        velocity: Commanded velocity forward, left (m/s), turn (rad/s), up (m/s).
        drive_waits: Whether a velocity is commanded by a key that was held while the
            connection dropped, in a pause or in a reset, and has to be released first.
        rides: Whether targets of hands move with the body.
        balance: Balance of a robot that walks, if a client displays it.
        fell: When and why the robot fell; empty while it has not.
    """

    tick: int
    epoch: int
    solved: int
    solved_at: float
    time: float
    positions: Vector
    body_positions: Matrix
    body_quaternions: Matrix
    limbs: Mapping[str, LimbStatus]
    grippers: Mapping[str, Vector]
    step_time: float
    step_period: float
    overruns: int
    skipped: int
    latency: float
    speed: float
    paused: bool
    paused_by: PauseOwner | None
    success: bool
    message: str
    device: tuple[str, ...]
    selected: str
    recording: EpisodeStatus | None
    velocity: Vector
    drive_waits: bool
    rides: bool
    balance: BalanceStatus | None
    fell: str
