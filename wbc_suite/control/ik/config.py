"""Config of the whole-body composites: `controllers/{robot}_whole_body_ik.toml`."""

from collections.abc import Collection, Iterable, Iterator, Mapping
from functools import partial
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import (
    AfterValidator,
    Field,
    NonNegativeFloat,
    PositiveFloat,
)

from wbc_suite.config_files import FrozenModel, located, parse_model
from wbc_suite.control.ground.feasible_acceleration import weight_shares
from wbc_suite.control.ik.frame_kinds import ControlledFrame, GoalsConfig
from wbc_suite.control.ik.reduced_robot import gripper_groups
from wbc_suite.control.law.joint_laws import JointLawConfig
from wbc_suite.control.part.part_settings import InputFrame, InputType
from wbc_suite.control.part.stance_controller import HeldFrame
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.qp import LIMITS, TASKS
from wbc_suite.registry import Registry
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.arms import FEW_JOINTS, has_few_joints
from wbc_suite.robot.elements import Name
from wbc_suite.robot.mjcf_export import STOP_MARGIN
from wbc_suite.robot.shapes import Interval

__all__ = [
    "ControlledFrame",
    "GoalsConfig",
    "HeldFrame",
    "InputFrame",
    "InputType",
    "LimitsConfig",
    "PostureConfig",
    "WholeBodyIKConfig",
    "default_whole_body_config",
    "read_whole_body",
]

CLOSE_FIT = 0.0025  # m; small arms have links 5 mm apart wherever they are


def _with_type(registry: Registry[Any], table: dict[str, Any]) -> dict[str, Any]:
    """Return a table; ValueError if its `type` is no name of a registry."""
    try:
        return table | {"type": registry.spelled(table.get("type"))}
    except UnknownNameError as error:
        raise ValueError(str(error)) from error


TaskTable: TypeAlias = Annotated[
    dict[str, Any], AfterValidator(partial(_with_type, TASKS))
]
LimitTable: TypeAlias = Annotated[
    dict[str, Any], AfterValidator(partial(_with_type, LIMITS))
]
"""The `type` of a registered task or limit, and its arguments."""


class PostureConfig(FrozenModel):
    """Pull to a posture, on the last level.

    Attributes:
        keyframe: The posture.
        cost: [cost]/rad or [cost]/m for all joints.
        costs: Costs of single joints, in place of `cost`.
        level: Strict priority.
        gain: Fraction of the difference that one solve removes, (0, 1].
        speed: Greatest joint speed asked for, rad/s or m/s.
        braking: Deceleration towards the posture, as a part of the joints' limits.
    """

    keyframe: Name = "ready"
    cost: PositiveFloat = 0.1
    costs: dict[Name, NonNegativeFloat] = {}
    level: int = Field(default=1, ge=0, le=3)
    gain: float = Field(default=0.1, gt=0.0, le=1.0)
    speed: PositiveFloat = 1.0
    braking: float = Field(default=0.8, gt=0.0, le=1.0)


class LimitsConfig(FrozenModel):
    """Limits of the command.

    Attributes:
        position_margin: Distance kept from joint limits, rad or m.
        positions: Narrower ranges of single joints, rad or m.
        velocity_scale: Factor on the robot's own velocity limits.
        acceleration: Greatest joint acceleration, rad/s^2 or m/s^2.
        base_acceleration: Greatest acceleration of a moving root, m/s^2 and rad/s^2.
        jerk: Greatest jerk of a joint's target, rad/s^3 or m/s^3; targets lag by
            `acceleration / jerk`.
        effort_share: Part of a motor's effort that acceleration may take; it bounds
            the joint's acceleration through the inertia at the posture.
        self_collision: Whether links are kept apart.
        collision_pairs: How many of the nearest pairs of links are watched.
        collision_distance: Distance kept between links, m.
        floor: Height of the floor in the world, m; all but legs keep that distance.
        obstacles: Whether the robot keeps out of the scene's fixed things.
        obstacle_distance: Distance kept from them, m.
        press_depth: How far links of hands may be commanded into them, m, to press.
        weight_shares: Part of a joint's effort that holding still may take, by joint.
        weight_rate: How fast what is left of that may be used up, 1/s.
        balance_margin: Distance kept from the edges of the soles, m.
    """

    position_margin: NonNegativeFloat = STOP_MARGIN
    positions: dict[Name, Interval] = {}
    velocity_scale: float = Field(default=1.0, gt=0.0, le=1.0)
    acceleration: PositiveFloat = 50.0
    base_acceleration: tuple[PositiveFloat, PositiveFloat] = (5.0, 10.0)
    jerk: float = Field(default=5000.0, ge=100.0)
    effort_share: float = Field(default=0.6, gt=0.0, le=1.0)
    self_collision: bool = True
    collision_pairs: int = Field(default=20, ge=1, le=200)
    collision_distance: PositiveFloat = 0.005
    floor: float = 0.0
    obstacles: bool = True
    obstacle_distance: NonNegativeFloat = 0.002
    press_depth: NonNegativeFloat = 0.001
    weight_shares: dict[Name, PositiveFloat] = {}
    weight_rate: PositiveFloat = 2.0
    balance_margin: NonNegativeFloat = 0.03


class WholeBodyIKConfig(GoalsConfig):
    """Config of a whole-body IK controller.

    Attributes:
        format: Version of the format, 1.
        type: Registered name.
        frames: Controlled frames, in the order of the action.
        held: Frames in contact.
        tasks: Tasks beside those of frames and posture, `[[task]]`: the `type` is a
            registered name, the other keys are arguments of the task.
        more_limits: Limits beside `limits`, `[[limit]]`, likewise.
        locked: Groups of joints that are kept at the posture.
        posture: Pull to a posture.
        limits: Limits of the command.
        solve_hz: Solves per second.
        joint_law: Gains of the joint-position law.
        planning: Whether to plan motions around obstacles and local minima; else all
            goals are approached on straight lines.
        far: Distances of a goal, m and rad, from which on a goal configuration is
            searched and a joint-space motion to it planned.
        search_iterations: Iterations of that search in one solve; twice as many while
            the robot stands.
        tolerance: Errors below which a frame counts as reached, m and rad.
    """

    format: Literal[1] = 1
    type: str = "WHOLE_BODY_IK"
    frames: tuple[ControlledFrame, ...] = Field(alias="frame", min_length=1)
    held: tuple[HeldFrame, ...] = ()
    tasks: tuple[TaskTable, ...] = Field(default=(), alias="task")
    more_limits: tuple[LimitTable, ...] = Field(default=(), alias="limit")
    locked: tuple[Name, ...] = ()
    posture: PostureConfig = PostureConfig()
    limits: LimitsConfig = LimitsConfig()
    input_ref_frame: InputFrame = "world"
    solve_hz: Annotated[float, Field(ge=10.0, le=1000.0)] = 100.0
    joint_law: JointLawConfig = JointLawConfig()
    planning: bool = True
    far: tuple[PositiveFloat, PositiveFloat] = (0.15, 0.6)
    search_iterations: int = Field(default=25, ge=0)
    tolerance: tuple[PositiveFloat, PositiveFloat] = (1e-3, 3.5e-3)


def default_whole_body_config(robot: RobotDescription) -> dict[str, Any]:
    """Return a config for a robot without a file: hands as poses, feet held.

    A base that glides is moved where the hands leave it free. A robot without hands is
    moved by its trunk or its head. Motors keep to postures that they can hold.
    """
    frames: list[dict[str, Any]] = []
    for side, frame in robot.hands.items():
        name = _hand_name(side, len(robot.hands))
        frames.append({"name": name, "frame": frame, "kind": "pose"})
    if robot.root.kind == "planar":
        frames.append(_gliding_base(robot))
    frames = frames or [{"name": name, "frame": name} for name in [_foremost(robot)]]
    is_free = robot.root.kind == "free"
    held = [f.name for f in robot.frames if is_free and f.role == "foot"]
    contact = "surface" if len(held) < 3 else "point"  # a biped balances on its soles
    feet = [{"frame": name, "contact": contact} for name in held]
    config: dict[str, Any] = {"format": 1, "frame": frames, "held": feet}
    if held:  # no faster than pressure under the feet can follow
        config["limits"] = {"acceleration": 12.0, "base_acceleration": (1.0, 2.0)}
        for frame in frames:
            frame |= {"linear_braking": 1.0, "angular_braking": 2.0}
    else:
        weights = weight_shares(robot, without=gripper_groups(robot))
        config["limits"] = {"collision_distance": CLOSE_FIT, "weight_shares": weights}
    if "ready" in robot.keyframes:
        config["posture"] = {"keyframe": "ready"}
    return config


def _hand_name(side: str, count: int) -> str:
    if side in ("right", "left"):
        return f"{side}_hand"
    return "right_hand" if count == 1 else side


def _gliding_base(robot: RobotDescription) -> dict[str, Any]:
    """Return the frame of a planar root, with the pace of a careful driver."""
    root = robot.links[0].name
    found = [f.name for f in robot.frames if f.role == "base" and f.link == root]
    return {
        "name": "base",
        "frame": (found or [root])[0],
        "kind": "base",
        "level": 1,
        "position_cost": 5.0,  # above the posture, which is on the same level
        "orientation_cost": 5.0,
        "max_linear_speed": 0.3,
        "max_angular_speed": 0.4,
        "linear_braking": 0.5,
        "angular_braking": 0.8,
    }


def _foremost(robot: RobotDescription) -> str:
    """Return the frame, or else the link, that moves a robot without hands."""
    moving: list[str] = []
    for link in robot.links:
        root_moves = link.parent is None and robot.root.kind != "fixed"
        if root_moves or link.joint is not None or link.parent in moving:
            moving.append(link.name)
    if not moving:
        raise ConfigError(f"{robot.name}: it has no joint, so nothing can be moved.")
    frames = {f.role: f.name for f in robot.frames if f.link in moving}
    last = robot.links[0].name if robot.root.kind == "free" else moving[-1]
    return next((frames[r] for r in ("torso", "base", "head") if r in frames), last)


def position_first(
    config: Mapping[str, Any], robot: RobotDescription
) -> Mapping[str, Any]:
    """Return a config in which hands whose arms have few joints turn as far as they go.

    Those of its frames that state no cost of orientation get a small one, so that
    orientation is not bought with position.
    """
    frames = config.get("frame")
    if not isinstance(frames, list | tuple):
        return config  # which is refused when it is read
    few = {x for x in robot.hands.values() if has_few_joints(robot, x)}
    least = {"orientation_cost": FEW_JOINTS}
    known = [
        {**least, **x} if isinstance(x, Mapping) and x.get("frame") in few else x
        for x in frames
    ]
    return {**config, "frame": known}


def read_whole_body(
    config: Mapping[str, Any], robot: RobotDescription | None, source: str
) -> WholeBodyIKConfig:
    """Return the config as a model; hands of few joints are `position_first`.

    Raises:
        ConfigError: If it breaks a rule of the format, or names what the robot, if one
            is given, does not have. It names the source, the key, the value and the
            nearest name.
    """
    if robot is not None:
        config = position_first(config, robot)
    read = parse_model(WholeBodyIKConfig, config, source=source)
    if robot is not None:
        check_names(_names(read, robot), robot, source)
    return read


def check_names(
    names: Iterable[tuple[str, str, str, Collection[str]]],
    robot: RobotDescription,
    source: str,
) -> None:
    """Raise ConfigError for a name that a robot does not have.

    Args:
        names: Key in the file, kind of thing, name, and the names that there are.
        robot: The robot.
        source: What the config is called in messages.
    """
    for key, kind, name, known in names:
        if name not in known:
            unknown = UnknownNameError(kind, name, known)
            where = f"{source}: {located(key, source)}"
            raise ConfigError(f"{where}: {robot.name}: {unknown}")


def _names(
    config: WholeBodyIKConfig, robot: RobotDescription
) -> Iterator[tuple[str, str, str, Collection[str]]]:
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
