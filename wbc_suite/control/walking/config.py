"""Config of WHOLE_BODY_ID: `controllers/{robot}_whole_body_id.toml`."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any, Literal

import numpy as np
from pydantic import (
    Field,
    NonNegativeFloat,
    PositiveFloat,
    SerializeAsAny,
    model_validator,
)

from wbc_suite import logs
from wbc_suite.config_files import FrozenModel, located, parse_model
from wbc_suite.control.contact.state_source import StateSourceConfig
from wbc_suite.control.ik.config import (
    InputFrame,
    check_names,
    default_whole_body_config,
    position_first,
)
from wbc_suite.control.ik.frame_kinds import ControlledFrame, GoalsConfig
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.locomotion import GAITS, GaitConfig, TrotConfig, WalkConfig
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.adopt.soles import ball_radius, guess_sole, sole_fault
from wbc_suite.robot.arms import has_few_joints
from wbc_suite.robot.elements import Name
from wbc_suite.robot.shapes import Interval

LOG = logs.logger(__name__)

NOISY_CUTOFF = 25.0
"""Hz; GR1 walks with a delay of 20 ms and noise of 0.05 rad/s at it, not at 40 Hz."""


class FootConfig(FrozenModel):
    """A foot.

    Attributes:
        frame: Frame or link of the robot.
        sole: Edges of the sole in the frame's axes, m: heel, toes (along x), right,
            left (along y); absent for a foot that touches the ground in a point.
        height: Of the frame over the sole, m, as in a file whose foot is the ankle.
        radius: Of a foot that is a ball about the frame, m.
        rolls: Whether a sole may turn about its x axis, as the blade of a leg whose
            ankle does not roll.
    """

    frame: Name
    sole: tuple[float, float, float, float] | None = None
    height: float = 0.0
    radius: NonNegativeFloat = 0.0
    rolls: bool = False

    @model_validator(mode="after")
    def _sole_is_a_rectangle(self) -> "FootConfig":
        if self.sole is not None:
            heel, toes, right, left = self.sole
            if not (heel < toes and right < left):
                raise ValueError(
                    "'sole' is [heel, toes, right, left], with heel < toes and "
                    "right < left"
                )
        return self


class UprightConfig(FrozenModel):
    """Links that keep their orientation while the robot turns and walks.

    Attributes:
        frame: Frame or link of the robot.
        weight: Weight of its angular acceleration.
    """

    frame: Name
    weight: PositiveFloat = 5.0


class StanceConfig(FrozenModel):
    """Pull of the joints to a posture.

    Attributes:
        keyframe: The posture.
        weight: Weight of the accelerations of all joints.
        weights: Weights of the joints of single groups, in place of `weight`.
    """

    keyframe: Name = "ready"
    weight: PositiveFloat = 0.1
    weights: dict[Name, PositiveFloat] = {}


class WholeBodyIDConfig(GoalsConfig):
    """Config of whole-body inverse dynamics.

    Attributes:
        format: Version of the format, 1.
        type: Registered name.
        frames: Hands; costs are weights of accelerations.
        feet: Feet; those of a biped from the left.
        gait: How the robot steps.
        upright: Links that stay upright.
        posture: Pull to a posture.
        sensors: Where the state of the robot comes from: the simulation, or an IMU and
            encoders, with noise and delay.
        friction: Coefficient of friction that contact forces keep to.
        velocity_cutoff: Cut-off frequency of the low-pass filter of velocities, Hz;
            when absent `NOISY_CUTOFF` if velocities are noisy, else without a filter.
        max_walk: Greatest commands: forward, left (m/s), turn (rad/s).
        height: Lowest and highest command of height, m.
        tolerance: Errors below which a hand has reached its target, m and rad.
        input_ref_frame: Axes of hands' targets and steps, of which `base` is the
            heading of the robot at its centre of mass.
    """

    format: Literal[1] = 1
    type: str = "WHOLE_BODY_ID"
    frames: tuple[ControlledFrame, ...] = Field(default=(), alias="frame")
    feet: tuple[FootConfig, ...] = Field(default=(), alias="foot", max_length=8)
    gait: SerializeAsAny[GaitConfig] | None = None
    upright: tuple[UprightConfig, ...] = ()
    posture: StanceConfig = StanceConfig()
    sensors: StateSourceConfig = StateSourceConfig()
    friction: PositiveFloat = 0.6
    velocity_cutoff: PositiveFloat | None = None
    max_walk: tuple[PositiveFloat, PositiveFloat, PositiveFloat] = (1.0, 0.4, 1.0)
    height: Interval = (-0.15, 0.02)
    tolerance: tuple[PositiveFloat, PositiveFloat] = (2e-3, 1e-2)
    input_ref_frame: InputFrame = "base"

    @property
    def cutoff(self) -> float:
        """Cut-off frequency of velocities, Hz, infinite without a filter."""
        noisy = NOISY_CUTOFF if self.sensors.velocity_noise > 0.0 else np.inf
        return self.velocity_cutoff or noisy

    @model_validator(mode="after")
    def _gait_fits_feet(self) -> "WholeBodyIDConfig":
        if self.gait is None:
            if self.feet:
                raise ValueError("feet need a [gait]: type 'walk' or 'trot'")
            return self
        if fault := self.gait.misfit([foot.sole is not None for foot in self.feet]):
            raise ValueError(fault)
        return self


def default_dynamics_config(robot: RobotDescription) -> dict[str, Any]:
    """Return a config for a robot without a file: four feet trot, two walk.

    The soles of a biped are those of its collision shapes.

    Raises:
        ConfigError: If a robot with a free root has no two feet, or a biped no soles.
    """
    hands = [
        {"name": x["name"], "frame": x["frame"]}
        for x in default_whole_body_config(robot)["frame"]
        if x["frame"] in robot.hands.values()
    ]
    if robot.root.kind != "free":
        for hand in hands:
            hand["position_cost"] = 6.0  # as SpotWithArm's
            if not has_few_joints(robot, hand["frame"]):
                hand["orientation_cost"] = 2.0
        return {"format": 1, "frame": hands}
    feet = [frame.name for frame in robot.frames if frame.role == "foot"]
    if len(feet) < 2:
        raise ConfigError(
            f"{robot.name} has {len(feet)} frames with the role 'foot'. Name its feet "
            "in a controller file with [[foot]]; see docs/locomotion.md."
        )
    if len(feet) == 2:
        return {"format": 1, "frame": hands, **_on_soles(robot, feet)}
    return {
        "format": 1,
        "frame": hands,
        "foot": [{"frame": x, "radius": ball_radius(robot, x)} for x in feet],
        "gait": TrotConfig().model_dump(),
        "upright": [{"frame": robot.links[0].name}],
    }


def _check_root(
    config: WholeBodyIDConfig, robot: RobotDescription, source: str
) -> None:
    """Raise ConfigError unless a free root, and no other, has feet and sensors."""
    stands = robot.root.kind == "free"
    if stands and len(config.feet) < 2:
        raise ConfigError(f"{source}: {robot.name} has a free root: name its [[foot]].")
    if not stands and (config.feet or not config.sensors.is_exact):
        raise ConfigError(
            f"{source}: {robot.name} has a {robot.root.kind} root: it needs no "
            "[[foot]] and no [gait], and [sensors] are for robots on their feet."
        )


def _on_soles(robot: RobotDescription, feet: list[str]) -> dict[str, Any]:
    """Return feet, gait and trunk of a biped, with the soles of its collision shapes.

    Raises:
        ConfigError: If these are no pair of soles.
    """
    left_first = sorted(feet, key=lambda name: "left" not in name.lower())
    soles = [guess_sole(robot, name) for name in left_first]
    tables = [
        {"frame": name, "sole": [*sole.edges], "height": sole.height}
        for name, sole in zip(left_first, soles, strict=True)
        if sole is not None
    ]
    file = _as_file(tables, robot.links[0].name) if len(tables) == len(feet) else ""
    if fault := sole_fault(*soles):
        raise ConfigError(
            f"{robot.name} has two feet, and {fault}: it could tip over. Write a "
            "controller file with [[foot]] for the left and right one; see "
            "docs/locomotion.md." + f" Its shapes suggest:\n\n{file}" * bool(file)
        )
    LOG.warning(
        "%s: stands on the soles that its collision shapes have; to change them, write "
        "a controller file:\n\n%s",
        *(robot.name, file),
    )
    gait, trunk = WalkConfig().model_dump(), {"frame": robot.links[0].name}
    return {"foot": tables, "gait": gait, "upright": [trunk]}


def _as_file(feet: Sequence[Mapping[str, Any]], trunk: str) -> str:
    """Return the text of a controller file with two feet."""
    parts = ['format = 1\ntype = "WHOLE_BODY_ID"']
    for foot in feet:
        edges = ", ".join(f"{edge:.3f}" for edge in foot["sole"])
        parts.append(
            f'[[foot]]\nframe = "{foot["frame"]}"\nsole = [{edges}]\n'
            f"height = {foot['height']:.3f}"
        )
    parts += ['[gait]\ntype = "walk"', f'[[upright]]\nframe = "{trunk}"']
    return "\n\n".join(parts) + "\n"


def read_dynamics(
    config: Mapping[str, Any], robot: RobotDescription | None, source: str
) -> WholeBodyIDConfig:
    """Return the config as a model.

    Raises:
        ConfigError: If it breaks a rule of the format, names what the robot, if one
            is given, does not have, or has feet where the root is not free.
    """
    if robot is not None:
        config = position_first(config, robot)
    read = _parse(config, source)
    if robot is not None:
        _check_root(read, robot, source)
        check_names(_names(read, robot), robot, source)
    return read


def _parse(config: Mapping[str, Any], source: str) -> WholeBodyIDConfig:
    gait = config.get("gait")
    if isinstance(gait, Mapping):
        config = {**config, "gait": _parse_gait(gait, source)}
    return parse_model(WholeBodyIDConfig, config, source=source)


def _parse_gait(given: Mapping[str, Any], source: str) -> GaitConfig:
    """Return the numbers of the gait that a table names by `type`."""
    if "type" not in given:
        raise ConfigError(f"{source}: missing {located('gait.type', source)}")
    try:
        name = GAITS.spelled(given["type"])
    except UnknownNameError as error:
        where = located("gait.type", source)
        raise ConfigError(f"{source}: {where}: {error}") from error
    given = {**given, "type": name}
    return parse_model(GAITS[name].config, given, source=source, within="gait")


def _names(
    config: WholeBodyIDConfig, robot: RobotDescription
) -> Iterator[tuple[str, str, str, Collection[str]]]:
    frames = [*(f.name for f in robot.frames), *(x.name for x in robot.links)]
    groups = (
        ("frame", [frame.frame for frame in config.frames]),
        ("foot", [foot.frame for foot in config.feet]),
        ("upright", [upright.frame for upright in config.upright]),
    )
    for key, names in groups:
        for k, name in enumerate(names):
            if name is not None:
                yield f"{key}[{k}].frame", "frame", name, frames
    for group in config.posture.weights:
        yield f"posture.weights.{group}", "group", group, robot.groups
