"""Arguments of an environment, checked once."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import (
    ConfigDict,
    Field,
    NonNegativeFloat,
    PositiveFloat,
    PositiveInt,
    field_validator,
    model_validator,
)

from wbc_suite.robot import RobotDescription
from wbc_suite.tomlfile import FrozenModel, parse_model

__all__ = ["EnvConfig", "NoiseConfig", "parse_env_config"]


Pixels: TypeAlias = Annotated[int, Field(gt=0, le=8192)]


class NoiseConfig(FrozenModel):
    """Noise on the arms' joints at reset; `magnitude` in rad (or m)."""

    type: Literal["gaussian", "uniform"] = "gaussian"
    magnitude: NonNegativeFloat = 0.02


class EnvConfig(FrozenModel):
    """Arguments of an environment, under the names this field knows.

    Attributes:
        robots: One robot, or several: names, files or descriptions.
        controller_configs: Composite controller: a name, a file or a config; one for
            all robots, or one for each.
        gripper_types: Another gripper; "default" keeps the robot's own.
        base_types: Another base; "default" keeps the robot's own.
        skin: "meshes" draws robots with the meshes of installed packages, a folder with
            those found there.
        initialization_noise: "default", None, or `{"type": ..., "magnitude": ...}`.
        control_freq: Actions per second.
        horizon: Actions in an episode; the benchmark's own when absent.
        reward_shaping: A reward on the way, or only for success.
        reward_scale: Factor on the reward.
        terminate_on_success: Whether success ends the episode.
        use_object_obs: Whether objects are observed.
        render_mode: `rgb_array`, or None.
        render_camera: Camera of `render`.
        render_size: Width and height of `render`, pixels.
    """

    model_config = ConfigDict(arbitrary_types_allowed=True)

    robots: Any = "Panda"
    controller_configs: Any = None
    gripper_types: Any = "default"
    base_types: Any = "default"
    skin: str | Path | None = None
    initialization_noise: NoiseConfig | Literal["default"] | None = "default"
    control_freq: PositiveFloat = 20.0
    horizon: PositiveInt | None = None
    reward_shaping: bool = False
    reward_scale: PositiveFloat = 1.0
    terminate_on_success: bool = False
    use_object_obs: bool = True
    render_mode: Literal["rgb_array"] | None = None
    render_camera: str = "agentview"
    render_size: tuple[Pixels, Pixels] = (512, 512)

    @field_validator("robots")
    @classmethod
    def _robots_are_robots(cls, robots: Any) -> Any:
        given = robots if isinstance(robots, list | tuple) else [robots]
        if not all(isinstance(r, str | Path | RobotDescription) for r in given):
            raise ValueError(
                "a robot is a name, a file or a RobotDescription; several are a list"
            )
        return robots

    @model_validator(mode="after")
    def _one_controller_each(self) -> "EnvConfig":
        robots, controllers = len(self.robot_list), len(self.controller_list)
        if robots != controllers:
            raise ValueError(
                f"controller_configs has {controllers} entries for {robots} robot(s); "
                "give one for all, or one for each"
            )
        return self

    @property
    def robot_list(self) -> list[str | Path | RobotDescription]:
        """The robots, always as a list."""
        one = isinstance(self.robots, str | Path | RobotDescription)
        return [self.robots] if one else list(self.robots)

    @property
    def controller_list(self) -> list[str | Path | Mapping[str, Any] | None]:
        """One controller for each robot."""
        given = self.controller_configs
        if isinstance(given, Sequence) and not isinstance(given, str):
            return list(given)
        return [given] * len(self.robot_list)


def parse_env_config(arguments: Mapping[str, Any]) -> EnvConfig:
    """Check arguments.

    Raises:
        ConfigError: Names the argument, its value and the nearest legal name.
    """
    return parse_model(EnvConfig, dict(arguments), source="make()")
