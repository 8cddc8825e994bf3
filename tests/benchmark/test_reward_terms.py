"""Terms of one's own in shaped rewards."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

import wbc_suite
from wbc_suite.benchmark import load_benchmark, register_reward_term
from wbc_suite.benchmark.object_benchmark import BELOW_ONE, ObjectBenchmark
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.registration import WITH_ID

TILT = """
extends = "lift"
name = "LevelLift"

[[term]]
type = "level_of_a_test"
weight = 0.1
thing = "cube"

[[term]]
type = "near"
weight = -0.2
thing = "cube"
scale = 4.0
"""


def level(benchmark, *, thing):
    return benchmark.states[thing].rotation[2, 2]


register_reward_term("level_of_a_test", level, replace=True)


def written(folder, text):
    path = folder / "level_lift.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_terms_are_added_to_the_reward_of_the_benchmark(tmp_path):
    env = wbc_suite.make(written(tmp_path, TILT), reward_shaping=True)
    env.reset(seed=3)
    _, reward, *_ = env.step(env.hold_action)
    task = env.benchmark
    distance = task.distance(task.cube_position)
    added = 0.1 * task.states["cube"].rotation[2, 2]
    added -= 0.2 * (1.0 - math.tanh(4.0 * distance))
    assert reward == pytest.approx(task.progress() + added, rel=1e-12)
    assert reward != pytest.approx(task.progress(), rel=1e-3)
    env.close()


@pytest.mark.parametrize("name", WITH_ID)
def test_no_benchmark_of_ours_has_terms(name):
    assert load_benchmark(name).terms == ()


@pytest.mark.parametrize("value", [-0.5, 0.0, 0.3, 0.1 + 0.2, BELOW_ONE, 1.5])
def test_without_terms_the_reward_is_the_progress_to_the_last_bit(value):
    task = SimpleNamespace(progress=lambda: value, terms=())
    reward = ObjectBenchmark.reward(task, shaped=True, success=False)
    assert reward == np.clip(value, 0.0, BELOW_ONE)


@pytest.mark.parametrize(
    ("term", "message"),
    [
        ('type = "nearr"\nthing = "cube"', "Did you mean 'near'"),
        ('type = "near"', "missing a required argument: 'thing'"),
        ('type = "near"\nthing = "cube"\nscael = 1.0', "unexpected keyword"),
        ('type = "near"\nthing = "cube"\nweight = "much"', "weight"),
    ],
)
def test_a_wrong_term_is_refused_by_file_and_key(tmp_path, term, message):
    path = written(tmp_path, f'extends = "lift"\n\n[[term]]\n{term}\n')
    with pytest.raises(ConfigError, match=message) as failure:
        load_benchmark(path)
    assert "level_lift.toml" in str(failure.value)


def test_a_thing_that_is_not_there_is_named(tmp_path):
    text = 'extends = "lift"\n\n[[term]]\ntype = "held"\nthing = "cub"\n'
    env = wbc_suite.make(written(tmp_path, text), reward_shaping=True)
    env.reset(seed=0)
    with pytest.raises(UnknownNameError, match="Did you mean 'cube'"):
        env.step(env.hold_action)
    env.close()
