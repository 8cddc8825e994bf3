"""Recording of many episodes: as many as asked, resumed, whoever plays them."""

import numpy as np
import pytest

from wbc_suite.errors import DatasetError
from wbc_suite.evaluation import generation
from wbc_suite.evaluation.generation import Plan, generate
from wbc_suite.executors import Processes
from wbc_suite.recording import Dataset
from wbc_suite.recording.resumable_work import work_folder

ARGUMENTS = {"robots": "Panda", "horizon": 4, "control_freq": 20.0}


def plan(**changes):
    values = {"policy": "random", "only_success": False, "arguments": ARGUMENTS}
    return Plan(benchmark="Lift", **{**values, **changes})


def content(path):
    with Dataset(path) as dataset:
        return [(e.facts["seed"], e.columns["actions"]) for e in dataset]


def same(one, other):
    return all(
        a == b and np.array_equal(x, y)
        for (a, x), (b, y) in zip(one, other, strict=True)
    )


class Lucky:
    """Holds, and ends at once; `benchmark.success` follows from the seed."""

    def __init__(self, env, rng):
        self.env, wins = env, rng.random() < 0.4
        env.benchmark.success = lambda: wins
        self.finished = True

    def __call__(self, observation):
        return self.env.hold_action


def test_failed_episodes_are_replaced_by_those_of_further_seeds(tmp_path):
    out, kept = tmp_path / "a.hdf5", []
    found = generate(
        plan(policy=f"{__name__}:Lucky", only_success=True),
        out,
        episodes=6,
        first_seed=50,
        on_kept=kept.append,
    )
    seeds = [seed for seed, _ in content(out)]
    won = [each["seed"] for each in found.played if each["success"]]
    assert seeds == won[:6]
    assert len(found.played) > found.successes >= found.kept == 6 == found.total
    assert [each["seed"] for each in found.played][:3] == [50, 51, 52]
    assert sum(kept) == found.successes
    assert {each["steps"] for each in found.played} == {1}, "the policy was finished"
    assert not work_folder(out).exists()


def test_it_gives_up_where_nothing_succeeds(tmp_path):
    out = tmp_path / "a.hdf5"
    found = generate(plan(policy="hold", only_success=True), out, episodes=1)
    assert (found.kept, found.total, len(found.played)) == (
        0,
        0,
        generation.TRIES_PER_EPISODE,
    )
    assert not out.exists()


def test_a_stopped_recording_goes_on(tmp_path, monkeypatch):
    monkeypatch.setattr(generation, "PART", 2)
    whole, out = tmp_path / "whole.hdf5", tmp_path / "out.hdf5"
    generate(plan(), whole, episodes=6)

    def stop(count):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        generate(plan(), out, episodes=6, on_kept=stop)
    assert not out.exists()
    played, real = [], generation.run_episode
    monkeypatch.setattr(
        generation,
        "run_episode",
        lambda *given, **more: played.append(given[2]) or real(*given, **more),
    )
    generate(plan(), out, episodes=6)
    assert played == [2, 3, 4, 5]
    assert same(content(out), content(whole))
    generate(plan(), out, episodes=2)
    assert [seed for seed, _ in content(out)] == [0, 1, 2, 3, 4, 5, 0, 1]


def test_a_file_of_another_environment_is_left_alone(tmp_path):
    out = tmp_path / "a.hdf5"
    generate(plan(), out, episodes=1)
    before = content(out)
    other = plan(arguments={**ARGUMENTS, "robots": "UR5e"})
    with pytest.raises(DatasetError, match="another environment"):
        generate(other, out, episodes=1)
    assert same(content(out), before)


@pytest.mark.slow
def test_processes_record_what_this_one_does(tmp_path, monkeypatch):
    noisy = plan(noise=0.1, pushes=10.0)
    generate(noisy, tmp_path / "a.hdf5", episodes=25)
    generate(noisy, tmp_path / "b.hdf5", episodes=25, executor=Processes(2))
    assert same(content(tmp_path / "a.hdf5"), content(tmp_path / "b.hdf5"))
    with Dataset(tmp_path / "b.hdf5") as dataset:
        facts = dataset.facts("demo_7")
        assert "intended" in dataset.episode("demo_7").columns
    assert (facts["policy"], facts["noise"], facts["pushes"]) == ("random", 0.1, 10.0)
