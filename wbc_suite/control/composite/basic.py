"""BASIC: every part of a robot has a controller of its own."""

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, InstanceOf

from wbc_suite.config_files import FrozenModel, located, parse_model
from wbc_suite.control.action import ActionLayout
from wbc_suite.control.law.joint_laws import JointLaw, JointLawConfig
from wbc_suite.control.law.law import Law, ServoLaw
from wbc_suite.control.memory import Parts
from wbc_suite.control.part.controller import (
    UNTIL_NEXT_ACTION,
    PartController,
    PoseInput,
)
from wbc_suite.control.part.gripper import GripperController
from wbc_suite.control.part.ik_tick import HandIk
from wbc_suite.control.part.part_settings import PartSettings
from wbc_suite.control.part.registry import (
    check_part,
    make_part,
    parse_part,
    part_controller,
)
from wbc_suite.control.robot_parts import hands_of, motors, parts_of
from wbc_suite.control.state import RobotState
from wbc_suite.errors import ConfigError
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.elements import Name
from wbc_suite.typing import Vector


class BasicConfig(FrozenModel):
    """Config of BASIC.

    Attributes:
        format: Version of the format, 1.
        type: Registered name.
        body_parts: Controller by part, in the order of the action; grippers follow.
            Joints that no part names are held.
        may_fall: Whether a robot with a free root may go without a STANCE, such as for
            learning to walk by the joints of its legs.
    """

    format: Literal[1] = 1
    type: str = "BASIC"
    body_parts: dict[Name, InstanceOf[BaseModel]]
    may_fall: bool = False


class BasicController:
    """Drives parts side by side; the config is plain data of a `BasicConfig`.

    Attributes:
        layout: Slices of the action: parts, then grippers.
        parts: Controllers by part, grippers as `{part}_gripper`.
        laws: Their laws, and those that hold joints of no part.
        standing: Finds the contact forces of a robot on its feet, or None.
    """

    def __init__(self, config: Mapping[str, Any], state: RobotState) -> None:
        self.config = check_basic(config, state.robot, str(config.get("type")))
        self.parts: dict[str, PartController] = {
            name: make_part(name, part, state)
            for name, part in self.config.body_parts.items()
        }
        hands = hands_of(state.robot)
        for name, part in self.config.body_parts.items():
            gripper = f"{name}_gripper"
            grip = part.gripper if isinstance(part, PartSettings) else None
            if grip is not None and gripper in state.robot.synergies:
                synergies, grasp = state.robot.synergies[gripper], hands.get(name)
                self.parts[gripper] = GripperController(
                    gripper, synergies, state, grip, grasp
                )
        self.layout = ActionLayout(s for p in self.parts.values() for s in p.slices)
        self._places = [
            (
                part,
                self.layout[part.slices[0].name].start,
                self.layout[part.slices[-1].name].stop,
            )
            for part in self.parts.values()
            if part.slices
        ]
        driven = {joint for part in self.parts.values() for joint in part.law.joints}
        self._idle = _holding_laws(state, driven)
        self.laws: tuple[Law, ...] = (
            *(part.law for part in self.parts.values()),
            *self._idle,
        )
        standing = (part.standing for part in self.parts.values())
        self.standing = next((found for found in standing if found is not None), None)
        self.reset(state)

    @property
    def memory(self) -> Parts:
        """What parts and contact forces remember; views."""
        parts = [array for part in self.parts.values() for array in part.memory]
        return *parts, *(self.standing.memory if self.standing else ())

    def resume(self, state: RobotState) -> None:
        """Go on from values that were written into `memory`."""
        for part in self.parts.values():
            part.resume(state)

    def reset(self, state: RobotState) -> None:
        """Hold every part where it is."""
        for law in self.laws:
            law.reset(state)
        for part in self.parts.values():
            part.reset(state)
        for law in self._idle:
            law.aim(state.data.qpos[law.drives["qpos"]])
        if self.standing is not None:
            self.standing.reset(state)

    def set_goal(self, action: Vector, period: float = 0.05) -> None:
        """Hand each part its values; see `layout`."""
        for part, start, stop in self._places:
            part.set_goal(action[start:stop], period)

    def prepare(self, state: RobotState) -> int:
        """Let parts do what is due."""
        return min(
            (part.prepare(state) for part in self.parts.values()),
            default=UNTIL_NEXT_ACTION,
        )

    def loop_ticks(self) -> tuple[HandIk, ...]:
        """Return the ticks of parts that the control loop runs."""
        ticks = (part.loop_tick() for part in self.parts.values())
        return tuple(tick for tick in ticks if tick is not None)

    def finish_tick(self) -> None:
        """Finish the ticks that the loop has begun."""
        for part in self.parts.values():
            part.finish_tick()

    @property
    def hold_action(self) -> Vector:
        """The action that keeps all goals."""
        held = [part.hold_action for part in self.parts.values()]
        return np.concatenate([np.zeros(0), *held])

    def pose_inputs(self) -> tuple[PoseInput, ...]:
        """Return how devices move the hands of the parts."""
        given = (part.pose_input() for part in self.parts.values())
        return tuple(pose_input for pose_input in given if pose_input is not None)

    def info(self, state: RobotState) -> dict[str, Any]:
        """Return `{"ik": ...}` with the reports of parts, if there are any."""
        reports = {name: part.report(state) for name, part in self.parts.items()}
        frames = {name: report for name, report in reports.items() if report}
        if not frames:
            return {}
        reached = all(frame["reached"] for frame in frames.values())
        return {"ik": {"reached": reached, "frames": frames}}


def _holding_laws(state: RobotState, driven: set[str]) -> tuple[JointLaw, ServoLaw]:
    """Return laws that hold the joints of no part, by torque and by setpoint."""
    idle = [joint for joint in state.actuators if joint not in driven]
    robot, gains = state.robot, JointLawConfig()
    torques = {*motors(robot), *(wheel.joint for wheel in robot.wheels)}
    return (
        JointLaw(state, [j for j in idle if j in torques], kp=gains.kp, kd=gains.kd),
        ServoLaw(state, [j for j in idle if j not in torques]),
    )


def check_basic(
    config: Mapping[str, Any], robot: RobotDescription | None, source: str
) -> BasicConfig:
    """Return the config as a model.

    Raises:
        ConfigError: If it breaks a rule of the format, names a part that the robot
            does not have, or would let it fall.
    """
    parts = config.get("body_parts")
    if isinstance(parts, Mapping):
        models = {k: parse_part(str(k), part, source) for k, part in parts.items()}
        config = {**config, "body_parts": models}
    read = parse_model(BasicConfig, config, source=source)
    if robot is None:
        return read
    for name, part in read.body_parts.items():
        try:
            check_part(name, part, robot)
        except ConfigError as error:
            where = f"{source}: {located(f'body_parts.{name}', source)}"
            raise ConfigError(f"{where}: {error}") from error
    kinds = [part_controller(part) for part in read.body_parts.values()]
    stands = any(kind.holds_root for kind in kinds)
    feet = any(frame.role == "foot" for frame in robot.frames)
    stands |= bool(robot.wheels) and not feet
    if robot.root.kind == "free" and not (stands or read.may_fall):
        raise ConfigError(
            f"{source}: key 'body_parts': {robot.name} has a free root, and no part "
            "keeps it on its feet. Give its legs the type 'STANCE', or the robot a "
            "root 'fixed' or 'planar'; 'may_fall = true' lets it fall."
        )
    return read


def default_basic_config(robot: RobotDescription) -> dict[str, Any]:
    """Return a config for a robot without a file.

    Hands move in operational space, other joints by steps, bases by speeds, and legs
    under a free root carry it.
    """
    hands = hands_of(robot)
    parts: dict[str, Any] = {
        name: {"type": "OSC_POSE" if name in hands else "JOINT_POSITION"}
        for name in parts_of(robot)
    }
    if "base" in parts:
        parts["base"] = {"type": "BASE_VELOCITY"}
    on_wheels = robot.wheels and "legs" not in parts
    if robot.root.kind == "free" and parts and not on_wheels:
        legs = [name for name in parts if name not in hands] or list(parts)
        parts["legs" if "legs" in parts else legs[-1]] = {"type": "STANCE"}
    return {"format": 1, "body_parts": parts}
