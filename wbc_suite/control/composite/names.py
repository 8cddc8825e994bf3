"""Check a whole-body config against a robot: every name in it must exist there."""

from collections.abc import Collection, Iterator, Mapping
from typing import Any

from wbc_suite.control.composite.config import WholeBodyIKConfig
from wbc_suite.control.composite.reduced import gripper_groups
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.robot import RobotDescription
from wbc_suite.tomlfile import parse_model

__all__ = ["check_whole_body", "read_whole_body"]

Named = tuple[str, str, str, Collection[str]]


def check_whole_body(
    config: Mapping[str, Any], robot: RobotDescription | None, source: str
) -> None:
    """Raise what `read_whole_body` raises; without a robot only the format's rules."""
    if robot is None:
        parse_model(WholeBodyIKConfig, config, source=source)
    else:
        read_whole_body(config, robot, source)


def read_whole_body(
    config: Mapping[str, Any], robot: RobotDescription, source: str
) -> WholeBodyIKConfig:
    """Return the config as a model.

    Raises:
        ConfigError: If it breaks a rule of the format, or names what the robot does
            not have; says the source, the key, the value and the nearest name.
    """
    read = parse_model(WholeBodyIKConfig, config, source=source)
    for key, kind, name, known in _names(read, robot):
        if name not in known:
            unknown = UnknownNameError(kind, name, known)
            raise ConfigError(f"{source}: key '{key}': {robot.name}: {unknown}")
    return read


def _names(config: WholeBodyIKConfig, robot: RobotDescription) -> Iterator[Named]:
    frames = [*(f.name for f in robot.frames), *(x.name for x in robot.links)]
    for k, frame in enumerate(config.frames):
        if frame.frame is not None:
            yield f"frame[{k}].frame", "frame", frame.frame, frames
    for k, held in enumerate(config.held):
        yield f"held[{k}].frame", "frame", held.frame, frames
    for k, group in enumerate(config.locked):
        yield f"locked[{k}]", "group", group, robot.groups
    if "keyframe" in config.posture.model_fields_set:
        keyframe = config.posture.keyframe
        yield "posture.keyframe", "keyframe", keyframe, robot.keyframes
    rigid = {*config.locked, *gripper_groups(robot)}
    fixed = {j for group in rigid for j in robot.groups.get(group, ())}
    moving = [j for j in robot.joint_names if j not in fixed]
    for joint in config.posture.costs:
        known = [*moving, *robot.root_joint_names]
        yield f"posture.costs.{joint}", "moving joint", joint, known
