"""Control laws: what turns targets into joint accelerations, torques and set points."""

from collections.abc import Sequence

import mujoco
import numpy as np

from wbc_suite.control.loop.table import DRIVE, LAW, LawKind, Records
from wbc_suite.control.loop.window import RATE
from wbc_suite.control.part.joint_step import follow, rest_at
from wbc_suite.control.state import RobotState
from wbc_suite.errors import ConfigError
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["Law", "ServoLaw", "TorqueLaw", "accelerations", "commands", "observe"]

BRAKING = 10.0
"""rad/s^2 or m/s^2; with it joints stop at their limits unless the robot's description
says what they can. Arms of the catalogue can do so carrying themselves."""

FOREVER = np.inf
"""s; a target that moves on until it is replaced."""


class Law:
    """One law on some driven joints; its numbers are in records the loop reads.

    The method `acceleration` is the readable form; `control.loop.kernels` holds the
    compiled one.

    Args:
        kind: Tells the loop which kernel computes it.
        state: The robot in the simulation.
        joints: Driven joints; each has an actuator.

    Attributes:
        joints: The driven joints.
        record: Its `LAW` record, shape (1,).
        drives: Its `DRIVE` records, shape (n,).

    Raises:
        ConfigError: If a joint has no actuator.
    """

    def __init__(self, kind: LawKind, state: RobotState, joints: Sequence[str]) -> None:
        self.joints = tuple(joints)
        places = {name: i for i, name in enumerate(state.actuators)}
        for name in joints:
            if name not in places:
                raise ConfigError(f"{state.robot.name}: joint '{name}' has no motor.")
        self.outputs: Indices = np.array([places[j] for j in joints], dtype=np.int64)
        self.record: Records = np.zeros(1, LAW)
        self.drives: Records = np.zeros(len(self.joints), DRIVE)
        self.record["kind"], self.record["compensation"] = kind, 1.0
        self.record["duration"] = FOREVER
        drives = self.drives
        drives["qpos"], drives["dof"] = state.joint_addresses(self.joints)
        drives["ctrl"] = state.actuator_ids[self.outputs]
        limits = state.model.actuator_ctrlrange[drives["ctrl"]]
        limited = state.model.actuator_ctrllimited[drives["ctrl"]].astype(bool)
        drives["low"] = np.where(limited, limits[:, 0], -np.inf)
        drives["high"] = np.where(limited, limits[:, 1], np.inf)
        drives["lowest"], drives["highest"], drives["fastest"] = -np.inf, np.inf, np.inf
        drives["braking"], drives["leash"], drives["most"] = BRAKING, np.inf, np.inf

    def reset(self, state: RobotState) -> None:
        """Forget what the observer has found out."""
        drives = self.drives
        drives["asked"] = drives["lack"] = drives["disturbance"] = 0.0
        drives["before"] = state.data.qvel[drives["dof"]]

    def keep_limits(self, state: RobotState) -> None:
        """Keep the robot's position and velocity limits; see `within_limits`.

        Positions end where the joint's stop begins to act.
        """
        for drive, name in zip(self.drives, self.joints, strict=True):
            joint = state.robot.joint(name)
            margin = state.model.joint(state.prefix + name).margin.item()
            low, high = joint.range or (-np.inf, np.inf)
            drive["lowest"], drive["highest"] = low + margin, high - margin
            drive["fastest"] = joint.velocity or np.inf
            drive["braking"] = joint.acceleration or BRAKING

    @property
    def is_following(self) -> bool:
        """Whether it asks for accelerations: torques and set points are given."""
        kind = self.record["kind"][0]
        return not self.is_of_feet and kind not in (LawKind.TORQUE, LawKind.SERVO)

    @property
    def is_of_feet(self) -> bool:
        """Whether it tells what feet give, and drives no joint itself."""
        return bool(self.record["kind"][0] >= LawKind.STANCE)

    def stand(self, state: RobotState, asked: Vector) -> None:
        """Ask root and legs for accelerations, as laws of feet do."""
        raise NotImplementedError

    def adopt(self, record: Records, drives: Records) -> None:
        """Go on with these records, which hold the same values: a table's."""
        self.record, self.drives = record, drives

    def aim(
        self,
        position: Vector,
        velocity: Vector | float = 0.0,
        acceleration: Vector | float = 0.0,
        jerk: Vector | float = 0.0,
        *,
        duration: float = FOREVER,
    ) -> None:
        """Set the target from now on.

            position + velocity s + acceleration s^2 / 2 + jerk s^3 / 6

        Args:
            position: Shape (n,), rad or m (N m or N of a torque law).
            velocity: Shape (n,).
            acceleration: Shape (n,).
            jerk: Shape (n,).
            duration: The target stands still after so many seconds.
        """
        drives = self.drives
        drives["position"], drives["velocity"] = position, velocity
        drives["acceleration"], drives["jerk"] = acceleration, jerk
        self.record["since"], self.record["duration"] = 0.0, duration

    def rest_at(self, position: Vector) -> None:
        """Set a target that stands still: `aim` in one compiled call.

        Args:
            position: Shape (n,), contiguous.
        """
        assert len(position) == len(self.drives), "one position for each drive"
        rest_at(self.record, self.drives, position)

    def follow(self, motion: Matrix) -> None:
        """Set a target that moves on: `aim` in one compiled call.

        Args:
            motion: Positions, velocities, accelerations and jerks, shape (4, n),
                contiguous.
        """
        assert motion.shape == (4, len(self.drives)), "one column for each drive"
        follow(self.record, self.drives, motion)

    def move(self, position: Vector, duration: float) -> None:
        """Let the target go to a position at constant speed.

        Args:
            position: Shape (n,).
            duration: Time that it takes, s; at 0 the target is there at once.
        """
        if duration > 0.0:
            now, _, _ = self.target()
            self.aim(now, (position - now) / duration, duration=duration)
        else:
            self.rest_at(position)

    def narrow(self, low: Vector | float, high: Vector | float) -> None:
        """Keep commands within these limits as well as the actuators', N m or N."""
        drives = self.drives
        drives["low"] = np.maximum(drives["low"], low)
        drives["high"] = np.minimum(drives["high"], high)

    def advance(self, state: RobotState) -> None:
        """Let a step's time pass, as the loop does before each step."""
        self.record["since"] += state.model.opt.timestep

    def target(self) -> tuple[Vector, Vector, Vector]:
        """Return position, velocity and acceleration of the target now, (n,) each."""
        since, duration = float(self.record["since"][0]), self.record["duration"][0]
        s, moving = min(since, duration), float(since <= duration)
        drives = self.drives
        rate, curve, bend = drives["velocity"], drives["acceleration"], drives["jerk"]
        position = drives["position"] + s * (rate + s * (0.5 * curve + s / 6.0 * bend))
        velocity = moving * (rate + s * (curve + 0.5 * s * bend))
        return position, velocity, moving * (curve + s * bend)

    def acceleration(self, state: RobotState, others: Vector) -> Vector:
        """Return the joint accelerations asked for, shape (n,).

        Args:
            state: The robot, after `mj_step1`.
            others: What laws before this one asked of the whole scene, shape (nv,).
        """
        raise NotImplementedError

    def within_limits(self, state: RobotState, a: Vector) -> Vector:
        """Return accelerations that keep position and velocity limits, shape (n,).

        At the distance d from a limit the speed towards it may be

            u(d) = min(sqrt(2 b d + (b / r)^2) - b / r, fastest)

        so that the braking b stops the joint in time, by an exponential decay of rate
        r at the end. A joint that obeys has `v' = -u'(d) v`; one that is slower or too
        fast tends to u at the rate r:

            v' <= r (u(d) - v) - u'(d) v.

        The a returned is the nearest in that interval, joint by joint: the minimiser
        of `|| a' - a ||^2`. Beyond a limit u is r d, back inside.
        """
        lower, upper = self.window(state)
        return np.maximum(np.minimum(a, upper), lower)

    def window(self, state: RobotState) -> tuple[Vector, Vector]:
        """Return the bounds of `within_limits`, shape (n,) each."""
        drives, data = self.drives, state.data
        q, v = data.qpos[drives["qpos"]], data.qvel[drives["dof"]]
        upper = _most(drives["highest"] - q, v, drives)
        return -_most(q - drives["lowest"], -v, drives), upper

    def command(self, state: RobotState, force: Vector, bias: Vector) -> Vector:
        """Return the actuators' commands within their limits, shape (n,).

        Args:
            state: The robot, after `mj_step1`.
            force: M times all accelerations asked for, shape (nv,).
            bias: Coriolis, centrifugal, gravity less passive forces, shape (nv,).
        """
        dofs = self.drives["dof"]
        tau = force[dofs] + self.record["compensation"][0] * bias[dofs]
        return self._clipped(tau - self.drives["disturbance"])

    def _clipped(self, command: Vector) -> Vector:
        drives = self.drives
        drives["command"] = np.clip(command, drives["low"], drives["high"])
        drives["lack"] = drives["command"] - command
        return drives["command"]


class ServoLaw(Law):
    """Set points of actuators that are servos themselves, such as fingers'."""

    def __init__(self, state: RobotState, joints: Sequence[str]) -> None:
        super().__init__(LawKind.SERVO, state, joints)

    def acceleration(self, state: RobotState, others: Vector) -> Vector:
        """Ask for nothing: the servo does."""
        return np.zeros(len(self.joints))

    def command(self, state: RobotState, force: Vector, bias: Vector) -> Vector:
        """Return the set points."""
        return self._clipped(self.target()[0])


class TorqueLaw(Law):
    """Torques as they are told, and what carries gravity and Coriolis forces on top.

        tau = tau* + h

    It minimises `|| tau - h - tau* ||^2`. The joints' own friction stays, so motion
    dies out; nothing else takes part, so joints at rest stay at rest.
    """

    def __init__(self, state: RobotState, joints: Sequence[str]) -> None:
        super().__init__(LawKind.TORQUE, state, joints)

    def acceleration(self, state: RobotState, others: Vector) -> Vector:
        """Ask for no acceleration."""
        return np.zeros(len(self.joints))

    def command(self, state: RobotState, force: Vector, bias: Vector) -> Vector:
        """Return the torques, shape (n,)."""
        carried = state.data.qfrc_bias[self.drives["dof"]]
        return self._clipped(self.target()[0] + self.record["compensation"] * carried)


def commands(state: RobotState, laws: Sequence[Law]) -> Vector:
    """Return one command per actuator by the readable forms of all laws.

        tau = M a + h - d - J^T f,    a = what the laws ask for, 0 elsewhere

    with M and h of the whole scene, so parts that move do not disturb each other; d is
    what the observer has found out, f what feet give. Laws in operational space come
    last, since they make up for what carries them; then those of feet.
    """
    model, data = state.model, state.data
    observe(state, laws)
    asked = accelerations(state, laws)
    force = np.empty(model.nv)
    mujoco.mj_mulM(model, data, force, asked)
    bias = data.qfrc_bias - data.qfrc_passive
    command = np.zeros(len(state.actuators))
    for law in laws:
        if law.is_of_feet:
            force[law.drives["dof"]] -= law.drives["command"]
    for law in laws:
        if not law.is_of_feet:
            command[law.outputs] = law.command(state, force, bias)
    return command


def observe(state: RobotState, laws: Sequence[Law]) -> None:
    """Learn from the last step what pushes on the joints, where that is asked for.

    The force of others on the joints, less what was known of it, is

        f - d = M (v' - a) - lack

    with the change of velocity v' = (v - before) / dt, the acceleration a asked for,
    and what the actuator's limits took away from the command. d follows f as a
    low-pass of the first order does, and is never more than the motors can give.
    Gravity and Coriolis forces are not in it: the law knows them.

    Source: Ohnishi, Shibata and Murakami (1996), "Motion control for advanced
    mechatronics", IEEE/ASME Transactions on Mechatronics 1(1).
    """
    dt, deviation = state.model.opt.timestep, np.zeros(state.model.nv)
    following = [law for law in laws if law.is_following]
    for law in following:
        drives = law.drives
        change = (state.data.qvel[drives["dof"]] - drives["before"]) / dt
        deviation[drives["dof"]] = change - drives["asked"]
    for stance in (law.record["stance"][0] for law in laws if law.is_of_feet):
        root = slice(stance["dof"], stance["dof"] + 6)
        change = (state.data.qvel[root] - stance["before"]) / dt
        deviation[root] = change - stance["asked"]
    force = np.empty(state.model.nv)
    mujoco.mj_mulM(state.model, state.data, force, deviation)
    for law in following:
        drives, bandwidth = law.drives, law.record["observer"][0]
        if bandwidth <= 0.0:
            continue
        part = 1.0 - np.exp(-bandwidth * dt)
        estimate = drives["disturbance"] + part * (
            force[drives["dof"]] - drives["lack"]
        )
        drives["disturbance"] = np.clip(estimate, drives["low"], drives["high"])


def _most(distance: Vector, speed: Vector, drives: Records) -> Vector:
    """Return the greatest accelerations towards limits, shape (n,)."""
    b, inside = drives["braking"], np.maximum(distance, 0.0)
    root = np.sqrt(2.0 * b * inside + (b / RATE) ** 2)
    allowed = np.where(distance > 0.0, root - b / RATE, RATE * distance)
    slope = np.where(np.abs(allowed) < drives["fastest"], b / root, 0.0)
    allowed = np.clip(allowed, -drives["fastest"], drives["fastest"])
    return RATE * (allowed - speed) - slope * speed


def accelerations(state: RobotState, laws: Sequence[Law]) -> Vector:
    """Let time pass for all laws; return what they ask of the scene, shape (nv,)."""
    asked = np.zeros(state.model.nv)
    for law in laws:
        law.advance(state)
    for law in sorted(laws, key=lambda law: law.record["kind"][0] == LawKind.OSC):
        if law.is_following:
            a = law.within_limits(state, law.acceleration(state, asked))
            asked[law.drives["dof"]] = a
    for law in laws:
        if law.is_of_feet:
            law.stand(state, asked)
    for law in laws:
        if law.is_following:
            law.drives["asked"] = asked[law.drives["dof"]]
            law.drives["before"] = state.data.qvel[law.drives["dof"]]
    return asked
