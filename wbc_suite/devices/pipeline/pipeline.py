"""The pipeline: what a device says becomes an action."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import pinocchio as pin

from wbc_suite.devices.limbs import LimbKind, LimbPort, robot_of, side_of
from wbc_suite.devices.pipeline.config import PipelineConfig
from wbc_suite.devices.pipeline.drives import BaseDrive, GripDrive, JointDrive
from wbc_suite.devices.pipeline.limb import LimbPipeline
from wbc_suite.devices.pipeline.mirror import mirrored
from wbc_suite.devices.pipeline.retarget import retarget
from wbc_suite.devices.pipeline.switch import Switch
from wbc_suite.devices.pipeline.watchdog import Phase, Watchdog
from wbc_suite.devices.ports import joint_ports, limb_ports, speed_ports
from wbc_suite.devices.state import DeviceState, LimbInput
from wbc_suite.errors import ConfigError
from wbc_suite.typing import Vector

__all__ = ["Pipeline"]

FIRST_PACE = 0.1  # of the greatest speed, at the beginning of the start ramp


class Pipeline:
    """Turns states of a device into actions, one for each step of an environment.

    The way of a state: watchdog, mirror, switch; then for each limb clutch, workspace,
    leash, filter and limits; and all of them are packed into one action. Whatever the
    device says, `update` returns an action, and targets keep the limits of
    `PipelineConfig`.

    Args:
        env: Environment to act in.
        config: Which stages there are.

    Raises:
        ConfigError: If the environment's controllers cannot be driven by hand.

    Attributes:
        limbs: Each limb's stages, by slice.
        grips: Each gripper's goal and limits, by slice.
        acting: Which stages did something at the last `update`, in words, by limb and
            for the `device`.
    """

    def __init__(self, env: Any, config: PipelineConfig | None = None) -> None:
        self._env, self._config = env.unwrapped, config or PipelineConfig()
        self._layout, settings = self._env.action_layout, self._config
        self._dt = dt = 1.0 / self._env.config.control_freq
        ports = limb_ports(env)
        self.limbs = {n: LimbPipeline(p, settings, dt) for n, p in ports.items()}
        self.grips = {
            s.name: GripDrive(len(s.labels), settings, dt)
            for s in self._layout.slices
            if s.kind == "gripper"
        }
        self._bases = {
            name: BaseDrive(port, settings, dt)
            for name, port in speed_ports(env).items()
        }
        self._joints = {
            name: JointDrive(port, settings, dt)
            for name, port in joint_ports(env).items()
        }
        if not (ports or self._joints):
            raise ConfigError(
                "Nothing in the action can be moved by hand: no frame that is placed, "
                "and no joint position. Use a whole-body controller, or OSC_POSE or "
                "JOINT_POSITION for the arms."
            )
        self._switch = Switch(list(ports), _hands(ports, self.grips))
        self._watchdog = Watchdog(settings.hold_after, settings.return_after, dt)
        self.reset()

    def reset(self) -> None:
        """Begin an episode: every target is where its limb is."""
        for drive in (*self.limbs.values(), *self._joints.values()):
            drive.reset()
        held = self._layout.unpack(self._env.hold_action)
        for name, grip in self.grips.items():
            grip.reset(held[name])
        for base in self._bases.values():
            base.reset()
        self._watchdog.reset()
        self._mirror, self._pressed = self._config.mirror, frozenset[str]()
        self._time, self._height = 0.0, 0.0
        self._said: dict[str, LimbInput] = {}
        self._driven: set[str] = set()
        self.acting: dict[str, tuple[str, ...]] = {}

    @property
    def active(self) -> str:
        """The limb that a device for one hand moves now."""
        return self._switch.active

    def update(self, state: DeviceState) -> Vector:
        """Return the action of one step; call it once per step."""
        news = self._watchdog.look(state)
        if news is not None:
            self._press(news.buttons)
            self._take(mirrored(news) if self._mirror else news)
        if self._watchdog.phase is not Phase.LIVE:
            self._let_go()
        action = self._layout.pack(self._move(), base=self._env.hold_action)
        words = {name: limb.acting for name, limb in self.limbs.items()}
        words["device"] = tuple(filter(None, [self._watchdog.acting]))
        self.acting = {name: told for name, told in words.items() if told}
        return action

    def _press(self, buttons: frozenset[str]) -> None:
        """Do what buttons ask for that were not down before."""
        for button in buttons - self._pressed:
            match button:
                case "next" if self.limbs:
                    self.limbs[self._switch.active].release()
                    self._switch.next()
                case "grip":
                    name = _gripper_of(self.active, self.grips)
                    if name is not None:
                        self.grips[name].toggle()
                case "mirror":
                    self._mirror = not self._mirror
                    self._release(self.limbs)
                case "home":
                    for limb in self.limbs.values():
                        limb.go_home()
        self._pressed = buttons

    def _take(self, state: DeviceState) -> None:
        """Note what is said of each limb, gripper, joint and base."""
        self._said = {}
        for name, said in state.limbs.items():
            limb = self._switch.find(name)
            if limb is not None:
                self._said[limb] = said
            self._close(limb or name, said)  # a leader arm places joints, not a limb
        for joints in self._joints.values():
            joints.aim(state.joints)
        self._height = state.height
        if state.base is not None:
            self._steer(self._bounded(state.base))
        self._driven |= self._said.keys()

    def _close(self, limb: str, said: LimbInput) -> None:
        """Aim the gripper of a limb: at what is said, else at what fingers show."""
        name, way = _gripper_of(limb, self.grips), self._config.fingers
        if name is None or not said.engaged:
            return
        if said.grip is not None:
            self.grips[name].aim(said.grip)
        elif said.fingers is not None and way is not None:
            labels = self._layout[name].labels
            grip = retarget(said.fingers, labels, by_pinch=way == "pinch")
            self.grips[name].aim(grip)

    def _bounded(self, velocity: Vector) -> Vector:
        linear, angular = self._config.base_speed
        fast = max(1.0, float(np.hypot(*velocity[:2])) / linear)
        turn = np.clip(velocity[2], -angular, angular)
        return np.array([velocity[0] / fast, velocity[1] / fast, turn])

    def _steer(self, velocity: Vector) -> None:
        """Let the base of the robot that is switched to drive: forward, left, turn."""
        robot = robot_of(self._switch.active)
        for base in self._bases.values():
            base.goal = velocity if base.robot == robot else np.zeros(3)
        for name, limb in self.limbs.items():
            if limb.port.kind is LimbKind.PLANAR and robot_of(name) == robot:
                R = limb.clutch.target.rotation
                along = R @ np.array([velocity[0], velocity[1], 0.0])
                twist = np.array([*along, 0.0, 0.0, velocity[2]])
                self._said[name] = LimbInput(twist=twist)

    def _move(self) -> dict[str, Vector]:
        """Move everything on by one tick; return the action's values by slice."""
        self._time += self._dt
        pace = self._pace()
        values: dict[str, Vector] = {}
        planar = [n for n, b in self.limbs.items() if b.port.kind is LimbKind.PLANAR]
        for name in (*planar, *(n for n in self.limbs if n not in planar)):
            limb = self.limbs[name]
            before = limb.target
            values[name] = limb.update(self._said.get(name), pace)
            if name in planar:
                self._carry(name, limb.target * before.inverse())
        values |= {name: grip.update() for name, grip in self.grips.items()}
        values |= {name: base.update() for name, base in self._bases.items()}
        for name, joints in self._joints.items():
            joints.lift(self._height * self._dt)
            values[name] = joints.update(pace)
        return values

    def _carry(self, base: str, T_step: pin.SE3) -> None:
        """Let the targets of a robot's hands ride on its base."""
        for name, limb in self.limbs.items():
            if limb.port.kind is LimbKind.POSE and robot_of(name) == robot_of(base):
                limb.carry(T_step)

    def _pace(self) -> float:
        """Return the start ramp's fraction of the greatest speeds."""
        ramp = self._config.ramp
        done = 1.0 if ramp == 0.0 else min(1.0, self._time / ramp)
        return FIRST_PACE + (1.0 - FIRST_PACE) * done

    def _let_go(self) -> None:
        """Hold what the device drove, or bring it home when it was silent for long."""
        self._said, self._height = {}, 0.0
        for base in self._bases.values():
            base.goal = np.zeros(3)
        for joints in self._joints.values():
            joints.hold()
        if self._watchdog.phase is Phase.RETURN:
            for name in self._driven:
                self.limbs[name].go_home()
        else:
            self._release(self._driven)

    def _release(self, names: Iterable[str]) -> None:
        for name in names:
            self.limbs[name].release()


def _gripper_of(limb: str, grippers: dict[str, GripDrive]) -> str | None:
    """Return the gripper on the same side of the same robot as a limb."""
    name = f"{robot_of(limb)}{side_of(limb)}_gripper"
    return name if name in grippers else None


def _hands(ports: dict[str, LimbPort], grippers: dict[str, GripDrive]) -> list[str]:
    """Return the limbs that a device for one hand goes through."""
    placed = [n for n, port in ports.items() if port.kind is LimbKind.POSE]
    hands = [n for n in placed if "hand" in n.split("_") or _gripper_of(n, grippers)]
    return hands or placed or list(ports)
