"""Seeds depend on base, benchmark and episode, and on nothing else."""

import json
import subprocess
import sys

import pytest

from wbc_suite.evaluation import episode_seed, episode_seeds
from wbc_suite.registration import WITH_ID


def test_more_episodes_change_no_earlier_seed():
    assert episode_seeds("Lift", 500)[:400] == episode_seeds("Lift", 400)


def test_every_scene_has_a_seed_of_its_own():
    seeds = [
        seed
        for base in (0, 1, 7000)
        for name in WITH_ID
        for seed in episode_seeds(name, 400, base=base)
    ]
    assert len(set(seeds)) == len(seeds)


def test_seeds_are_the_same_in_every_process():
    code = "from wbc_suite.evaluation import *; print(episode_seeds('Door', 3, base=7))"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)
    assert json.loads(told.stdout) == episode_seeds("Door", 3, base=7)


def test_seeds_are_those_of_the_published_formula():
    # sha256("0/lift/0") begins with these bytes: `printf 0/lift/0 | sha256sum`.
    assert episode_seed(0, "Lift", 0) == int(SHA256_OF_LIFT, 16) >> 11


SHA256_OF_LIFT = "b46887722574e5ea"


@pytest.mark.parametrize("name", ["lift", "LIFT", "tasks/lift.toml"])
def test_names_and_files_of_a_benchmark_have_the_same_scenes(name):
    assert episode_seed(3, name, 5) == episode_seed(3, "Lift", 5)


def test_seeds_survive_json_readers_that_use_floats():
    assert all(int(float(s)) == s for s in episode_seeds("Wipe", 1000))
