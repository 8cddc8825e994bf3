"""Arguments of an environment, checked once."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias, TypedDict

import numpy as np
from pydantic import (
    ConfigDict,
    Field,
    NonNegativeFloat,
    PositiveFloat,
    PositiveInt,
    field_validator,
    model_validator,
)

from wbc_suite.config_files import FrozenModel, parse_model
from wbc_suite.control import CompositeControllerName, PartControllerName
from wbc_suite.envs.states import Randomiser
from wbc_suite.errors import ConfigError, UnknownArgumentError, did_you_mean
from wbc_suite.robot import RobotDescription
from wbc_suite.scene.placement import Sampler
from wbc_suite.sensing.cameras import CameraRequest
from wbc_suite.sensing.renderer import RenderPreset
from wbc_suite.sensing.segmentation import SegmentationLevel
from wbc_suite.typing import RobotName

RATE = 20.0
"""Hz; rate of actions that horizons of benchmarks are given for, and the default."""

LONGEST_STEP = 0.002
"""s; gains of servos and contacts are made for it."""

Pixels: TypeAlias = Annotated[int, Field(gt=0, le=8192)]
Segmentations: TypeAlias = SegmentationLevel | tuple[SegmentationLevel, ...] | None

_PER_CAMERA = (
    "camera_heights",
    "camera_widths",
    "camera_depths",
    "camera_segmentations",
)


class NoiseConfig(FrozenModel):
    """Noise on the arms' joints at reset; `magnitude` in rad (or m)."""

    type: Literal["gaussian", "uniform"] = "gaussian"
    magnitude: NonNegativeFloat = 0.02


Robot: TypeAlias = RobotName | str | Path | RobotDescription
Controller: TypeAlias = (
    CompositeControllerName | PartControllerName | str | Path | Mapping[str, Any]
)
Configuration: TypeAlias = Literal["default", "single-robot", "opposed", "parallel"]
Noise: TypeAlias = NoiseConfig | Mapping[str, Any] | Literal["default"]
Preset: TypeAlias = RenderPreset | Literal["fast", "balanced", "quality"]
Level: TypeAlias = SegmentationLevel | Literal["element", "instance", "class"]
RenderMode: TypeAlias = Literal["human", "rgb_array", "depth_array"]


class EnvArguments(TypedDict, total=False):
    """Keyword arguments of `make` as users write them; see `EnvConfig`."""

    robots: Robot | Sequence[Robot]
    arena: str | Path | Mapping[str, Any] | None
    env_configuration: Configuration
    controller_configs: Controller | Sequence[Controller | None] | None
    placement_initializer: Sampler | str | Mapping[str, Any] | None
    gripper_types: str | Mapping[str, str] | None
    base_types: str | None
    skin: str | Path | None
    initialization_noise: Noise | None
    control_freq: float
    lite_physics: bool
    compiled: bool
    horizon: int | None
    reward_shaping: bool
    reward_scale: float
    terminate_on_success: bool
    use_object_obs: bool
    randomisation: Randomiser | None
    use_sensor_obs: bool
    observables: Mapping[str, Mapping[str, Any]] | None
    use_camera_obs: bool
    camera_names: str | Sequence[str]
    camera_heights: int | Sequence[int]
    camera_widths: int | Sequence[int]
    camera_depths: bool | Sequence[bool]
    camera_segmentations: Level | Sequence[Level | Sequence[Level] | None] | None
    render_preset: Preset | None
    render_mode: RenderMode | None
    has_renderer: bool
    has_offscreen_renderer: bool
    render_camera: str
    render_size: tuple[int, int] | Sequence[int]


class EnvConfig(FrozenModel):
    """Checked arguments of an environment, with their defaults.

    Attributes:
        robots: One robot, or several: names, files or descriptions; the benchmark's
            own choice by default.
        arena: MJCF file of a scene around the benchmark, or the keys of a
            `wbc_suite.scene.ArenaConfig`; an empty floor by default.
        env_configuration: Arrangement of robots: two `opposed` (by default) or
            `parallel`, one `single-robot`.
        controller_configs: Composite controller: a name, a file or a config; one for
            all robots, or one for each.
        placement_initializer: Sampler of start poses in place of the benchmark's, its
            registered name, `module:Name`, or its table; see
            `wbc_suite.scene.placement.make_sampler`.
        gripper_types: Another gripper, one for all hands or one for each; "none" for
            none; "default" for the benchmark's choice, most often the robot's own.
        base_types: Another base; "default" for the robot's own.
        skin: "meshes" draws robots with the meshes of installed packages, a folder with
            those found there.
        initialization_noise: "default", None, or `{"type": ..., "magnitude": ...}`.
        control_freq: Actions per second, from 0.1; see `timestep`.
        lite_physics: Whether contacts, accelerations and sensors are those of MuJoCo's
            last step, one step behind the positions; otherwise they are computed
            again, which costs one more step.
        compiled: Whether the control loop is compiled; the plain one can be debugged,
            and gives the same states.
        horizon: Actions in an episode; when absent the benchmark's own, which is that
            of 20 actions a second, and of the same duration at other rates.
        reward_shaping: Whether the reward is shaped, or given for success only.
        reward_scale: Factor on the reward.
        terminate_on_success: Whether success ends the episode. A shaped reward pays
            then for the steps that remain to the horizon too, 1 for each, so that
            winning earns more than waiting next to the goal.
        use_object_obs: Whether objects are observed.
        randomisation: A `wbc_suite.randomisation.Randomisation`, drawn at each reset.
        use_sensor_obs: Whether robots' sensors are observed: joint torques, wrists,
            IMU, fingers, feet.
        observables: Changes of observations by key, such as `{"cube_pos": {"delay":
            0.05}}`; see `wbc_suite.sensing.change.Change`.
        use_camera_obs: Whether cameras are observed.
        camera_names: The observed cameras: one name, or several.
        camera_heights: Pixels; one number for all cameras, or one for each.
        camera_widths: Pixels; likewise.
        camera_depths: Whether depth is observed too; one for all, or one for each.
        camera_segmentations: `instance`, `class`, `element` or None; one for all, or
            one for each camera, which may be a list of several.
        render_preset: `fast`, `balanced` or `quality`; when absent, `quality` on a
            graphics card and `fast` on a processor.
        render_mode: `human`, `rgb_array`, `depth_array`, or None.
        render_camera: Camera of `render`.
        render_size: Width and height of `render`, pixels.
    """

    model_config = ConfigDict(arbitrary_types_allowed=True)

    robots: Any = "Panda"
    arena: str | Path | dict[str, Any] | None = None
    env_configuration: Configuration = "default"
    controller_configs: Any = None
    placement_initializer: Any = None
    gripper_types: Any = "default"
    base_types: Any = "default"
    skin: str | Path | None = None
    initialization_noise: NoiseConfig | Literal["default"] | None = "default"
    control_freq: float = Field(default=RATE, ge=0.1, le=1e5)
    lite_physics: bool = True
    compiled: bool = True
    horizon: PositiveInt | None = None
    reward_shaping: bool = False
    reward_scale: PositiveFloat = 1.0
    terminate_on_success: bool = False
    use_object_obs: bool = True
    randomisation: Any = None
    use_sensor_obs: bool = False
    observables: dict[str, dict[str, Any]] | None = None
    use_camera_obs: bool = False
    camera_names: str | tuple[str, ...] = "agentview"
    camera_heights: Pixels | tuple[Pixels, ...] = 256
    camera_widths: Pixels | tuple[Pixels, ...] = 256
    camera_depths: bool | tuple[bool, ...] = False
    camera_segmentations: Segmentations | tuple[Segmentations, ...] = None
    render_preset: RenderPreset | None = None
    render_mode: RenderMode | None = None
    render_camera: str = "agentview"
    render_size: tuple[Pixels, Pixels] = (512, 512)

    @field_validator("placement_initializer")
    @classmethod
    def _draws_places(cls, sampler: Any) -> Any:
        named = sampler is None or isinstance(sampler, str | Mapping)
        if not named and not callable(getattr(sampler, "sample", None)):
            raise ValueError(
                "a sampler has a method `sample`, as those of wbc_suite.scene.placement"
            )
        return sampler

    @field_validator("robots")
    @classmethod
    def _robots_are_robots(cls, robots: Any) -> Any:
        given = robots if isinstance(robots, list | tuple) else [robots]
        if not all(isinstance(r, str | Path | RobotDescription) for r in given):
            raise ValueError(
                "a robot is a name, a file or a RobotDescription; several are a list"
            )
        return robots

    @field_validator("randomisation")
    @classmethod
    def _randomisation_binds(cls, given: Any) -> Any:
        if given is not None and not hasattr(given, "bind"):
            raise ValueError("randomisation is a wbc_suite.randomisation.Randomisation")
        return given

    @model_validator(mode="after")
    def _one_controller_each(self) -> "EnvConfig":
        robots, controllers = len(self.robot_list), len(self.controller_list)
        if robots != controllers:
            raise ValueError(
                f"controller_configs has {controllers} entries for {robots} robot(s); "
                "give one for all, or one for each"
            )
        return self

    @model_validator(mode="after")
    def _one_value_per_camera(self) -> "EnvConfig":
        names = self.camera_name_list
        if len(set(names)) < len(names):
            raise ValueError("camera_names has a camera twice")
        for key in _PER_CAMERA:
            given = getattr(self, key)
            if isinstance(given, tuple) and len(given) != len(names):
                raise ValueError(
                    f"{key} has {len(given)} entries for {len(names)} camera(s); give "
                    "one for all, or one for each"
                )
        return self

    @property
    def substeps(self) -> int:
        """Physics steps of an action."""
        return max(1, math.ceil(1.0 / (self.control_freq * LONGEST_STEP) - 1e-9))

    @property
    def timestep(self) -> float:
        """Duration of a physics step, s: 2 ms, or a little less.

        It is the longest of at most 2 ms of which an action takes a whole number: 17
        steps of 1.961 ms at 30 Hz, 25 of 2 ms at 20 Hz.
        """
        period = 1.0 / self.control_freq
        timestep = period / self.substeps
        if int(period / timestep) < self.substeps:  # by rounding
            timestep = math.nextafter(timestep, 0.0)
        return timestep

    @property
    def camera_name_list(self) -> list[str]:
        """Names of the observed cameras, always as a list."""
        given = self.camera_names
        return [given] if isinstance(given, str) else list(given)

    @property
    def cameras(self) -> list[CameraRequest]:
        """What is observed of cameras; empty without `use_camera_obs`."""
        if not self.use_camera_obs:
            return []
        requests = []
        for k, name in enumerate(self.camera_name_list):
            height, width, depth, levels = (
                given[k] if isinstance(given, tuple) else given
                for given in (getattr(self, key) for key in _PER_CAMERA)
            )
            if not isinstance(levels, tuple):
                levels = () if levels is None else (levels,)
            request = CameraRequest(
                name=name, height=height, width=width, depth=depth, segmentations=levels
            )
            requests.append(request)
        return requests

    @property
    def robot_list(self) -> list[str | Path | RobotDescription]:
        """The robots, always as a list."""
        one = isinstance(self.robots, str | Path | RobotDescription)
        return [self.robots] if one else list(self.robots)

    @property
    def noise(self) -> NoiseConfig | None:
        """The noise at reset."""
        given = self.initialization_noise
        return NoiseConfig() if given == "default" else given

    @property
    def controller_list(self) -> list[str | Path | Mapping[str, Any] | None]:
        """One controller for each robot."""
        given = self.controller_configs
        if isinstance(given, Sequence) and not isinstance(given, str):
            return list(given)
        return [given] * len(self.robot_list)


def parse_env_config(arguments: Mapping[str, Any]) -> EnvConfig:
    """Check arguments.

    `has_renderer` and `has_offscreen_renderer`, robosuite's, mean the render modes
    `human` and `rgb_array` where none is given.

    Raises:
        ConfigError: Names the argument, its value and the nearest legal name.
    """
    given = dict(arguments)
    shown = given.pop("has_renderer", False)
    drawn = given.pop("has_offscreen_renderer", False)
    if shown or drawn:
        given.setdefault("render_mode", "human" if shown else "rgb_array")
    known = sorted(EnvConfig.model_fields)
    for name in (name for name in given if name not in known):
        raise UnknownArgumentError(
            f"make() got an unexpected keyword argument '{name}'."
            f"{did_you_mean(name, known)} Known: {', '.join(known)}."
        )
    return parse_model(EnvConfig, given, source="make()")


def checked_seed(seed: object) -> int | None:
    """Return a seed, or None; a ConfigError if it is no whole number >= 0."""
    if seed is None:
        return None
    if not isinstance(seed, int | np.integer) or isinstance(seed, bool) or seed < 0:
        raise ConfigError(f"reset: a seed is a whole number from 0 on, not {seed!r}.")
    return int(seed)
