"""The description of an environment: plain data in, the same environment out."""

import json
from pathlib import Path

import gymnasium
import numpy as np
import pytest

import wbc_suite
from wbc_suite.errors import DatasetError
from wbc_suite.recording import EnvSource
from wbc_suite.recording.env_source import differences


def parse(name="Lift", **arguments):
    return EnvSource.parse(json.dumps({"env_name": name, "env_kwargs": arguments}))


def test_a_description_survives_a_round_trip():
    source = EnvSource(
        benchmark="Door",
        arguments={"robots": ["Panda"], "control_freq": 20.0, "horizon": 70},
    )
    again = EnvSource.parse(source.text)
    assert again == source
    assert again.text == source.text


def test_paths_arrays_and_numbers_of_numpy_become_plain_data():
    source = EnvSource(
        benchmark="Lift",
        arguments={
            "robots": Path("a") / "b.toml",
            "horizon": np.int64(7),
            "reward_scale": np.float32(0.5),
            "camera_heights": np.array([8, 9]),
        },
    )
    arguments = EnvSource.parse(source.text).arguments
    assert arguments == {
        "robots": "a/b.toml",
        "horizon": 7,
        "reward_scale": 0.5,
        "camera_heights": [8, 9],
    }


def test_robomimics_keys_are_written():
    fields = json.loads(EnvSource(benchmark="Lift", arguments={}).text)
    assert fields["type"] == 2  # Gymnasium, in robomimic's EnvType
    assert fields["package"] == "wbc_suite"
    assert fields["env_version"] == wbc_suite.__version__
    assert "missing" not in fields


def test_other_packages_and_missing_arguments_are_kept():
    text = '{"env_name": "Lift", "package": "other", "missing": ["robots", 3]}'
    source = EnvSource.parse(text)
    assert (source.package, source.missing) == ("other", ("robots", "3"))
    with pytest.raises(DatasetError, match="does not contain 3, robots"):
        source.build()


@pytest.mark.parametrize("text", [None, "", "null", "3", '{"name": 1}'])
def test_texts_that_name_no_environment_are_refused(text):
    with pytest.raises(DatasetError):
        EnvSource.parse(text)


def test_an_environment_of_another_package_is_refused():
    env = gymnasium.make("CartPole-v1")
    with pytest.raises(DatasetError, match="Only wbc_suite environments"):
        EnvSource.of(env)
    env.close()


@pytest.mark.parametrize(
    "arguments",
    [
        {"robots": "/etc/passwd"},
        {"robots": ["Panda", "..\\robot"]},
        {"robots": "robot.URDF"},
        {"controller_configs": "mine.toml"},
        {"controller_configs": {"body_parts": {"right": {"file": "a/b"}}}},
        {"gripper_types": [["x.xml"]]},
        {"base_types": "module.py"},
        {"base_types": "module:Base"},
        {"arena": "scene"},
        {"arena": {"file": "scene"}},
        {"controller_configs": {"type": "own:Controller"}},
        {"placement_initializer": "own:Sampler"},
        {"placement_initializer": {"type": "own:Sampler"}},
    ],
)
def test_paths_are_refused_wherever_they_stand(arguments):
    with pytest.raises(DatasetError, match=r"names a file.*--trust-files"):
        parse(**arguments).build()


@pytest.mark.parametrize("name", ["/tmp/task.toml", "own_tasks:Mine"])
def test_a_benchmark_that_is_a_path_or_a_module_is_refused(name):
    with pytest.raises(DatasetError, match="names a file or a module"):
        parse(name).build()


@pytest.mark.parametrize("name", ["lift", "Lift"])
def test_a_registered_benchmark_is_recorded_as_it_is_spelled(name):
    with wbc_suite.make(name, robots="Panda") as env:
        assert EnvSource.of(env).benchmark == "Lift"


def test_a_benchmark_of_a_file_is_recorded_with_its_path(tmp_path, monkeypatch):
    (tmp_path / "high.toml").write_text('extends = "lift"\nhorizon = 9\n')
    monkeypatch.chdir(tmp_path)
    with wbc_suite.make("high.toml", robots="Panda") as env:
        source = EnvSource.of(env)
    assert source.benchmark == str(tmp_path / "high.toml")
    with source.build(trust_files=True) as again:
        assert again.horizon == 9


def test_a_trusted_path_is_read_and_its_error_is_reported():
    with pytest.raises(DatasetError, match=r"cannot be made here.*none\.toml"):
        parse(robots="/nowhere/none.toml").build(trust_files=True)


def test_an_unknown_benchmark_names_what_is_meant():
    with pytest.raises(DatasetError, match=r"cannot be made here.*Lift"):
        parse("Lyft", robots="Panda").build()


def test_descriptions_differ_in_the_keys_of_nested_tables():
    arguments = {"robots": "Panda", "horizon": 5, "reward": {"scale": 1.0, "step": 0.0}}
    one = {"env_name": "Lift", "env_kwargs": arguments}
    other = {"env_name": "Lift", "env_kwargs": arguments | {"horizon": 6}}
    assert differences(json.dumps(one), json.dumps(one)) == ""
    assert differences(json.dumps(one), json.dumps(other)) == "horizon is 5 and 6"
    other["env_kwargs"]["reward"] = {"scale": 2.0, "step": 0.0}
    found = differences(json.dumps(one), json.dumps(other))
    assert found == "horizon is 5 and 6; reward.scale is 1.0 and 2.0"
