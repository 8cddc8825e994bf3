"""The pipeline: from the states of a device to actions."""

import time
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from wbc_suite.control.action import ActionSlice
from wbc_suite.devices.action_ports import (
    LimbKind,
    LimbPort,
    SpeedPort,
    height_slices,
    joint_ports,
    limb_ports,
    robot_of,
    side_of,
    speed_ports,
)
from wbc_suite.devices.pipeline.config import PipelineConfig
from wbc_suite.devices.pipeline.drive import RobotDrive
from wbc_suite.devices.pipeline.fingertips import fingertip_retargetings
from wbc_suite.devices.pipeline.limb_pipeline import LimbPipeline
from wbc_suite.devices.pipeline.part_targets import GripTarget, JointTargets
from wbc_suite.devices.pipeline.retarget import retarget
from wbc_suite.devices.pipeline.watchdog import Phase, Watchdog
from wbc_suite.devices.state import (
    DeviceState,
    LimbInput,
    mirrored,
    without_velocities,
)
from wbc_suite.errors import ConfigError
from wbc_suite.typing import Matrix, Vector

FIRST_PACE = 0.1  # of the speed limits, at the start of the ramp
HELD_KEYS = "keys and sticks have to be released first"


class Pipeline:
    """Compute an action from the state of a device, once for each environment step.

    Stages: watchdog, mirror, selection of the limb; then for each limb clutch,
    workspace, leash, filter and motion limit. Whatever the device sends, `update`
    returns an action whose targets keep the limits of `PipelineConfig`.

    After a silence of the device, and after `hold`, poses are latched anew, and
    velocities count only once the device has sent a state that commands none: a key
    that was held meanwhile, or whose release was lost, moves nothing.

    Args:
        env: Environment to act in.
        config: Settings of the stages.
        clock: Source of time that never goes back, s; it tells how long the device
            has been silent.

    Raises:
        ConfigError: If no slice of the action can be commanded by a device.

    Attributes:
        limbs: Stages of each limb, by slice.
        grips: Goal and limits of each gripper, by slice.
        acting: What stages did at the last `update`, by limb and for the `device`.
    """

    def __init__(
        self,
        env: Any,
        config: PipelineConfig | None = None,
        *,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._env, self._config = env.unwrapped, config or PipelineConfig()
        self._layout, settings = self._env.action_layout, self._config
        self._dt = dt = 1.0 / self._env.config.control_freq
        ports = limb_ports(env)
        self.limbs = {n: LimbPipeline(p, settings, dt) for n, p in ports.items()}
        self._planar = [n for n, p in ports.items() if p.kind is LimbKind.PLANAR]
        self.grips = {
            s.name: GripTarget(s.labels, settings, dt)
            for s in self._layout.slices
            if s.kind == "gripper"
        }
        self._by_tips = (
            fingertip_retargetings(env) if settings.fingers == "tips" else {}
        )
        self._joints = {
            name: JointTargets(port, settings, dt)
            for name, port in joint_ports(env).items()
        }
        speeds, heights = speed_ports(env), height_slices(env)
        if not (ports or self._joints or speeds):
            raise ConfigError(
                "The action has no slice that a device can command: no frame, no joint "
                "position and no velocity of a base. Use a whole-body controller, or "
                "OSC_POSE or JOINT_POSITION for the arms."
            )
        self._drives = self._make_drives(speeds.values(), heights.values())
        self._selector = LimbSelector(list(ports), _hands(ports, self.grips))
        self._watchdog = Watchdog(settings.hold_after, settings.return_after, clock)
        self.reset()

    def _make_drives(
        self, speeds: Iterable[SpeedPort], heights: Iterable[ActionSlice]
    ) -> dict[str, RobotDrive]:
        """Return the drive of each robot, by the prefix of its slices."""
        planar = {robot_of(name) for name in self._planar}
        lifts = {robot_of(n) for n, joints in self._joints.items() if joints.lifts}
        speeds, heights = tuple(speeds), tuple(heights)
        names = (*self.limbs, *self._joints, *(port.name for port in speeds))
        return {
            robot: RobotDrive(
                [port for port in speeds if robot_of(port.name) == robot],
                [part for part in heights if robot_of(part.name) == robot],
                self._config,
                self._dt,
                glides=robot in planar,
                lifts=robot in lifts,
            )
            for robot in sorted({robot_of(name) for name in names})
        }

    def reset(self) -> None:
        """Start an episode: every target is at its limb."""
        for part in (*self.limbs.values(), *self._joints.values()):
            part.reset()
        held = self._layout.unpack(self._env.hold_action)
        for drive in self._drives.values():
            drive.reset(held)
        for name, grip in self.grips.items():
            grip.reset(held[name])
        for hand in self._by_tips.values():
            hand.reset()
        self._watchdog.reset()
        self._mirror, self._pressed = self._config.mirror, frozenset[str]()
        self._time, self._velocity = 0.0, np.zeros(4)
        self._inputs: dict[str, LimbInput] = {}
        self._driven: set[str] = set()
        self._let_go = True  # whether velocities of the device count
        self.acting: dict[str, tuple[str, ...]] = {}

    @property
    def selected(self) -> str:
        """The limb that a device for one hand moves."""
        return self._selector.selected

    @property
    def carries(self) -> bool:
        """Whether targets of hands can move with a base, or be held in the world."""
        hands = [x for x in self.limbs.values() if x.port.kind is LimbKind.POSE]
        grounded = any(limb.port.ground is not None for limb in hands)
        return grounded or bool(hands and self._planar)

    @property
    def drive(self) -> RobotDrive:
        """What drives the robot of the selected hand, or the first one."""
        robot = robot_of(self.selected) if self.selected else min(self._drives)
        return self._drives[robot]

    @property
    def silence(self) -> float:
        """Time since the device sent new data, s; infinite before any."""
        return self._watchdog.silence

    def leave(self, name: str) -> None:
        """Leave a limb to other inputs while the device sends nothing for it."""
        self._driven.discard(name)

    def update(self, state: DeviceState, drive: Vector | None = None) -> Vector:
        """Return the action of one step; call it once per step.

        Args:
            state: State of the device.
            drive: Velocity forward, left (m/s), turn (rad/s) and up (m/s) that is
                commanded while the device commands none, shape (4,).
        """
        new = self._watchdog.check(state)
        if new is not None:
            self._press(new.buttons)
            self._let_go = self._let_go or new.at_rest
            counted = new if self._let_go else without_velocities(new)
            self._read(mirrored(counted) if self._mirror else counted)
        if self._watchdog.phase is not Phase.LIVE:
            self._release()
        if self._watchdog.phase is Phase.RETURN:
            for name in self._driven:
                self.limbs[name].go_home()
        self._steer(drive)
        action = self._layout.pack(self._move(), base=self._env.hold_action)
        self._report()
        return action

    def hold(self, state: DeviceState) -> None:
        """Read the device without a step, as in a pause, and let go of its limbs."""
        self._watchdog.check(state)
        self._pressed = state.buttons
        self._release()
        self._report()

    def _report(self) -> None:
        """Set what the stages did."""
        device = self._watchdog.acting or ("" if self._let_go else HELD_KEYS)
        notes = {name: limb.acting for name, limb in self.limbs.items()}
        notes["device"] = (device,) if device else ()
        self.acting = {name: texts for name, texts in notes.items() if texts}

    def _press(self, buttons: frozenset[str]) -> None:
        """Handle the buttons that were not pressed before."""
        for button in buttons - self._pressed:
            match button:
                case "next" if self.limbs:
                    self.limbs[self._selector.selected].release()
                    self._selector.next()
                case "grip":
                    name = _gripper_of(self.selected, self.grips)
                    if name is not None:
                        self.grips[name].toggle()
                case "mirror":
                    self._mirror = not self._mirror
                    for limb in self.limbs.values():
                        limb.release()
                case "home":
                    for limb in self.limbs.values():
                        limb.go_home()
        self._pressed = buttons

    def _read(self, state: DeviceState) -> None:
        """Read the inputs of limbs, grippers, joints and base."""
        self._inputs = {}
        for name, given in state.limbs.items():
            limb = self._selector.find(name)
            if limb is not None:
                self._inputs[limb] = given
            self._close(limb or name, given)  # a leader arm has no limb
        for joints in self._joints.values():
            joints.aim(state.joints)
        base = np.zeros(3) if state.base is None else state.base
        self._velocity = np.append(base, state.height)
        self._driven |= self._inputs.keys()

    def _close(self, limb: str, given: LimbInput) -> None:
        """Set the goal of a limb's gripper, by the grip or the fingers of an input."""
        name = _gripper_of(limb, self.grips)
        if name is None or not given.engaged:
            return
        if given.grip is not None:
            self.grips[name].aim(given.grip)
        elif given.fingers is not None and self._config.fingers is not None:
            self.grips[name].aim(self._grip_of(name, given.fingers))

    def _grip_of(self, gripper: str, fingers: Matrix) -> Vector:
        """Return the synergies of a gripper for the joints of the user's hand."""
        if self._config.fingers == "tips" and gripper in self._by_tips:
            return self._by_tips[gripper](fingers)
        labels, by_pinch = self.grips[gripper].labels, self._config.fingers == "pinch"
        return retarget(fingers, labels, by_pinch=by_pinch)

    def _steer(self, drive: Vector | None) -> None:
        """Drive the robot of the selected hand; others stop."""
        velocity = self._velocity
        if drive is not None and not velocity.any():
            velocity = drive
        for other in self._drives.values():
            other.aim(velocity if other is self.drive else np.zeros(4))

    def _base_input(self, name: str) -> LimbInput | None:
        """Return the input of a base whose pose is commanded, in place of a speed."""
        forward, left, turn, _ = self._drives[robot_of(name)].velocity
        if not any((forward, left, turn)):
            return self._inputs.get(name)
        R = self.limbs[name].clutch.target.rotation
        along = R @ np.array([forward, left, 0.0])
        return LimbInput(twist=np.array([*along, 0.0, 0.0, turn]))

    def _move(self) -> dict[str, Vector]:
        """Advance all targets by one tick; return the action's values by slice."""
        self._time += self._dt
        ramp = self._config.ramp
        started = 1.0 if ramp == 0.0 else min(1.0, self._time / ramp)
        pace = FIRST_PACE + (1.0 - FIRST_PACE) * started
        values: dict[str, Vector] = {}
        for drive in self._drives.values():
            values |= drive.update()
        others = [name for name in self.limbs if name not in self._planar]
        for name in (*self._planar, *others):
            limb = self.limbs[name]
            before, is_base = limb.target, name in self._planar
            given = self._base_input(name) if is_base else self._inputs.get(name)
            values[name] = limb.update(given, pace)
            if is_base:  # it carries the robot's hands
                for other in self.limbs.values():
                    same = robot_of(other.port.name) == robot_of(name)
                    if same and other.rides and other.port.kind is LimbKind.POSE:
                        other.carry(limb.target * before.inverse())
        values |= {name: grip.update() for name, grip in self.grips.items()}
        for name, joints in self._joints.items():
            joints.lift(self._drives[robot_of(name)].velocity[3] * self._dt)
            values[name] = joints.update(pace)
        return values

    def _release(self) -> None:
        """Let go of what the device moves; its velocities have to become zero."""
        self._inputs, self._velocity = {}, np.zeros(4)
        self._let_go = self._let_go and not self._watchdog.has_data
        for joints in self._joints.values():
            joints.hold()
        for name in self._driven:
            self.limbs[name].release()


class LimbSelector:
    """Maps the names of inputs to limbs, and selects the limb of a one-hand device.

    An input `hand` is for the selected hand; `right` and `left` are for the hands, or
    other limbs, of that hand's robot; any other name is that of a slice. `names` are
    those of all limbs, in the order of the action; `hands` can be selected.
    """

    def __init__(self, names: Sequence[str], hands: Sequence[str]) -> None:
        self._names, self._hands = tuple(names), tuple(hands or names)
        self._index = 0

    @property
    def selected(self) -> str:
        """The selected limb; empty if there is none."""
        return self._hands[self._index] if self._hands else ""

    def next(self) -> str:
        """Select the next hand; the first follows the last."""
        self._index = (self._index + 1) % len(self._hands)
        return self.selected

    def find(self, name: str) -> str | None:
        """Return the limb of an input, or None."""
        if name in self._names:
            return name
        if name == "hand":
            return self.selected or None
        prefix = robot_of(self.selected)
        if prefix + name in self._names:
            return prefix + name
        near = (n for n in (*self._hands, *self._names) if robot_of(n) == prefix)
        return next((n for n in near if side_of(n) == name), None)


def _gripper_of(limb: str, grippers: dict[str, GripTarget]) -> str | None:
    """Return the gripper on the same side of the same robot as a limb."""
    name = f"{robot_of(limb)}{side_of(limb)}_gripper"
    return name if name in grippers else None


def _hands(ports: dict[str, LimbPort], grippers: dict[str, GripTarget]) -> list[str]:
    """Return the limbs that a device for one hand can select."""
    placed = [n for n, port in ports.items() if port.kind is LimbKind.POSE]
    hands = [n for n in placed if "hand" in n.split("_") or _gripper_of(n, grippers)]
    return hands or placed or list(ports)
