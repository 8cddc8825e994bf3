"""Perturbations: named changes of a benchmark that a policy was not trained on."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from wbc_suite.envs import RobotEnv
from wbc_suite.errors import ConfigError
from wbc_suite.randomisation import Randomisation
from wbc_suite.registry import Registry
from wbc_suite.scene.placement import (
    RejectionSampler,
    Sampler,
    SequentialSampler,
    UniformSampler,
)

WIDER = 1.5  # of the region of start poses, along x and y


@dataclass(frozen=True, kw_only=True, slots=True)
class Perturbation:
    """What is drawn anew in each episode, from its seed.

    Attributes:
        summary: What varies, in a few words.
        arguments: Of `wbc_suite.make`.
        change: Called with the environment after it was made.
    """

    summary: str
    arguments: Mapping[str, Any] = field(default_factory=dict)
    change: Callable[[RobotEnv], None] = lambda env: None


def widen_layout(env: RobotEnv) -> None:
    """Place objects in a region that is `WIDER` along x and y.

    Raises:
        ConfigError: If the benchmark has no such region, as where bins bound it.
    """
    benchmark: Any = env.benchmark
    sampler = getattr(benchmark, "sampler", None)
    wider = sampler and _widened(sampler)
    if wider == sampler:
        raise ConfigError(
            f"{benchmark.name} has no region of start poses that could be wider. "
            "Perturb something else, or give it a sampler."
        )
    benchmark.sampler = wider


def _widened(sampler: Sampler) -> Sampler:
    """Return a sampler with wider regions, where no container bounds them."""
    match sampler:
        case UniformSampler(region=region) if not region.inside:
            ranges = {"x": _stretched(region.x), "y": _stretched(region.y)}
            return replace(sampler, region=region.model_copy(update=ranges))
        case SequentialSampler():
            return replace(sampler, samplers=[*map(_widened, sampler.samplers)])
        case RejectionSampler():
            return replace(sampler, sampler=_widened(sampler.sampler))
    return sampler


def _stretched(interval: tuple[float, float]) -> tuple[float, float]:
    low, high = interval
    middle, half = (low + high) / 2, WIDER * (high - low) / 2
    return middle - half, middle + half


def _paraphrase(env: RobotEnv) -> None:
    env.paraphrased = True


def _drawn(**amounts: Any) -> dict[str, Any]:
    return {"randomisation": Randomisation(**amounts)}


PERTURBATIONS: Registry[Perturbation] = Registry("perturbation")
"""Perturbations by name, for `--perturb`."""

register_perturbation = PERTURBATIONS.register
register_perturbation(
    "camera",
    Perturbation(
        summary="cameras by 5 cm, 0.1 rad and 5 degrees of their field of view",
        arguments=_drawn(camera_position=0.05, camera_rotation=0.1, camera_fovy=5.0),
    ),
)
register_perturbation(
    "light",
    Perturbation(
        summary="lights by 1 m and half their brightness",
        arguments=_drawn(light_position=1.0, light_brightness=0.5),
    ),
)
register_perturbation(
    "colour",
    Perturbation(
        summary="half of each colour, and all textures",
        arguments=_drawn(color=0.5, texture=True),
    ),
)
register_perturbation(
    "layout",
    Perturbation(
        summary=f"start poses of objects in a region {WIDER} times as wide",
        change=widen_layout,
    ),
)
register_perturbation(
    "start",
    Perturbation(
        summary="joints of the robot at the start by 0.1 rad (standard deviation)",
        arguments={"initialization_noise": {"type": "gaussian", "magnitude": 0.1}},
    ),
)
register_perturbation(
    "wording",
    Perturbation(
        summary="instructions in words that recordings never use", change=_paraphrase
    ),
)
