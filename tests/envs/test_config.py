"""Arguments of environments are checked once, and spread over robots and cameras."""

from pathlib import Path

import numpy as np
import pytest

from wbc_suite.envs.config import EnvConfig, NoiseConfig, checked_seed, parse_env_config
from wbc_suite.errors import ConfigError
from wbc_suite.randomisation import Randomisation
from wbc_suite.scene.placement import Region, UniformSampler
from wbc_suite.sensing.segmentation import SegmentationLevel


def test_one_robot_may_come_without_a_list():
    assert parse_env_config({"robots": "Panda"}).robot_list == ["Panda"]
    assert parse_env_config({"robots": ["Panda"]}).robot_list == ["Panda"]
    path = Path("mine.toml")
    assert parse_env_config({"robots": path}).robot_list == [path]


def test_a_controller_is_for_all_robots_or_one_for_each():
    pair = {"robots": ["Panda", "UR5e"]}
    both = parse_env_config(pair | {"controller_configs": "BASIC"})
    assert both.controller_list == ["BASIC", "BASIC"]
    each = parse_env_config(pair | {"controller_configs": ["BASIC", None]})
    assert each.controller_list == ["BASIC", None]
    given = {"type": "BASIC"}
    assert parse_env_config({"controller_configs": given}).controller_list == [given]


@pytest.mark.parametrize(
    ("given", "magnitude"),
    [("default", 0.02), ({"magnitude": 0.1}, 0.1), (NoiseConfig(magnitude=0.3), 0.3)],
)
def test_noise_has_a_default(given, magnitude):
    noise = parse_env_config({"initialization_noise": given}).noise
    assert noise is not None
    assert (noise.type, noise.magnitude) == ("gaussian", magnitude)


def test_noise_may_be_absent():
    assert parse_env_config({"initialization_noise": None}).noise is None


def test_cameras_are_not_observed_by_default():
    assert parse_env_config({"camera_names": ["frontview"]}).cameras == []


def test_values_of_cameras_are_spread():
    config = parse_env_config(
        {
            "use_camera_obs": True,
            "camera_names": ["frontview", "birdview"],
            "camera_heights": [32, 64],
            "camera_widths": 48,
            "camera_depths": [True, False],
            "camera_segmentations": ["class", ["instance", "element"]],
        }
    )
    first, second = config.cameras
    assert (first.name, first.height, first.width, first.depth) == (
        *("frontview", 32, 48),
        True,
    )
    assert first.segmentations == (SegmentationLevel.CLASS,)
    assert second.segmentations == (
        SegmentationLevel.INSTANCE,
        SegmentationLevel.ELEMENT,
    )
    assert first.segmentation_key(SegmentationLevel.CLASS) == "frontview_segmentation"
    assert second.segmentation_key(SegmentationLevel.ELEMENT) == (
        "birdview_segmentation_element"
    )


class Sampler:
    def sample(self, rng, objects, taken):
        return {}


@pytest.mark.parametrize(
    "sampler",
    [Sampler(), UniformSampler(names=["a"], region=Region(x=(0, 1), y=(0, 1))), None],
)
def test_any_object_with_sample_is_a_sampler(sampler):
    config = parse_env_config({"placement_initializer": sampler})
    assert config.placement_initializer is sampler


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"robot": "Panda"}, "Did you mean 'robots'"),
        ({"robots": 3}, "a robot is a name"),
        ({"robots": ["Panda", None]}, "a robot is a name"),
        ({"controller_configs": ["BASIC", "BASIC"]}, "2 entries for 1 robot"),
        ({"placement_initializer": 3}, "a method `sample`"),
        ({"randomisation": 0.1}, "wbc_suite.randomisation.Randomisation"),
        ({"control_freq": 0}, "control_freq"),
        ({"control_freq": float("nan")}, "control_freq"),
        ({"horizon": 0}, "horizon"),
        ({"horizon": 10.5}, "horizon"),
        ({"reward_scale": -1.0}, "reward_scale"),
        ({"initialization_noise": {"magnitude": -1}}, "magnitude"),
        ({"initialization_noise": {"kind": "gaussian"}}, "kind"),
        ({"camera_names": ["a", "a"]}, "a camera twice"),
        ({"camera_heights": [32, 64]}, "2 entries for 1 camera"),
        ({"camera_heights": 0}, "camera_heights"),
        ({"camera_widths": 10_000}, "camera_widths"),
        ({"camera_segmentations": "colour"}, "camera_segmentations"),
        ({"render_mode": "ascii"}, "render_mode"),
        ({"render_preset": "ugly"}, "render_preset"),
        ({"render_size": (512,)}, "render_size"),
        ({"env_configuration": "circle"}, "env_configuration"),
    ],
)
def test_wrong_arguments_are_named(wrong, message):
    with pytest.raises(ConfigError, match=message) as caught:
        parse_env_config(wrong)
    assert "make()" in str(caught.value)


def test_a_config_cannot_change():
    config = parse_env_config({"randomisation": Randomisation(mass=0.1)})
    with pytest.raises(ValueError, match="frozen"):
        config.horizon = 3
    assert config.randomisation == Randomisation(mass=0.1)


def test_every_field_is_documented():
    documented = EnvConfig.__doc__ or ""
    for name in EnvConfig.model_fields:
        assert f"        {name}: " in documented, name


@pytest.mark.parametrize("seed", [None, 0, 7, np.int64(3), 2**40])
def test_seeds_are_whole_numbers(seed):
    assert checked_seed(seed) == seed
    assert seed is None or type(checked_seed(seed)) is int


@pytest.mark.parametrize("seed", [-1, 1.0, True, "3", [3], np.float64(2)])
def test_other_seeds_are_refused(seed):
    with pytest.raises(ConfigError, match="whole number from 0 on"):
        checked_seed(seed)
