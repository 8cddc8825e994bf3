"""Damaged benchmark and controller files work, or one error names file and key."""

import copy
import functools

import pytest
from damage import dump, parent_of, places
from hypothesis import given, settings
from hypothesis import strategies as st

import wbc_suite
from wbc_suite.benchmark import load_benchmark
from wbc_suite.catalogue import Catalogue
from wbc_suite.config_files import read_toml
from wbc_suite.control.ik.config import read_whole_body
from wbc_suite.errors import ConfigError, WbcError
from wbc_suite.scene import empty_arena

FILES = [
    path
    for path in Catalogue().files("controllers")
    if path.stem.endswith("_whole_body_ik")
]
CONTROLLERS = [read_toml(path) for path in FILES]
ROBOTS = [
    wbc_suite.load_robot(path.stem.removesuffix("_whole_body_ik")) for path in FILES
]
load_robot = functools.cache(wbc_suite.load_robot)
TASKS = [read_toml(path) for path in Catalogue().files("tasks")]

NUMBERS = st.one_of(
    st.floats(), st.sampled_from([0, -1, 1e300, 1e-300, 10**30, True, 0.5])
)
NAMES = st.one_of(st.text(max_size=8), st.sampled_from(["right_tcp", "redy", "world"]))
VALUES = st.one_of(
    NUMBERS,
    NAMES,
    st.lists(NUMBERS, max_size=5),
    st.dictionaries(NAMES, NUMBERS, max_size=2),
)
FAST = settings(max_examples=60)


def damage(draw, data):
    """Return a copy with one value replaced, renamed or removed, and its top key."""
    data = copy.deepcopy(data)
    path = draw(st.sampled_from(list(places(data))))
    holder, key = parent_of(data, path), path[-1]
    match draw(st.sampled_from(["replace", "rename", "remove"])):
        case "replace":
            holder[key] = draw(VALUES)
        case "rename" if isinstance(holder, dict):
            holder[draw(NAMES)] = holder.pop(key)
        case _:
            del holder[key]
    return data


@FAST
@given(data=st.data())
def test_a_damaged_controller_names_source_and_key(data):
    k = data.draw(st.integers(0, len(CONTROLLERS) - 1))
    config = damage(data.draw, CONTROLLERS[k])
    try:
        read_whole_body(config, ROBOTS[k], "my.toml")
    except WbcError as error:
        text = str(error)
    else:
        text = "my.toml: no key is wrong"
    assert text.startswith("my.toml: ")
    assert "key" in text
    assert len(text) < 3000


@FAST
@given(data=st.data())
def test_a_damaged_benchmark_works_or_names_the_file(data, tmp_path_factory):
    task = damage(data.draw, data.draw(st.sampled_from(TASKS)))
    file = tmp_path_factory.mktemp("tasks") / "mine.toml"
    file.write_text("\n".join(f"{dump(k)} = {dump(v)}" for k, v in task.items()))
    try:
        benchmark = load_benchmark(file)
        robots = [load_robot(r, gripper=benchmark.gripper) for r in benchmark.robots]
        benchmark.arrange(robots, "default")
        spec = empty_arena()
        benchmark.build(spec)
        spec.compile()
    except WbcError as error:
        text = str(error)
    else:
        text = "mine.toml"
    assert "mine.toml" in text
    assert len(text) < 3000


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_a_shipped_controller_file_can_be_passed_by_path(path, tmp_path):
    robot = wbc_suite.load_robot(path.stem.removesuffix("_whole_body_ik"))
    config = wbc_suite.load_composite_controller_config(path, robot)
    assert config["type"] == "WHOLE_BODY_IK"
    typo = tmp_path / path.name
    typo.write_text(path.read_text().replace("frame = ", "frame = 'nose' #", 1))
    with pytest.raises(ConfigError, match=rf"{path.name}: key 'frame\[0\]\.frame'"):
        wbc_suite.load_composite_controller_config(typo, robot)
