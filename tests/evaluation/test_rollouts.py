"""Rollouts are counted right, whoever plays them, and go on where they stopped."""

import json

import pytest
from typer.testing import CliRunner

from wbc_suite.cli.app import app
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.evaluation import (
    Case,
    make_policy,
    plan_rollouts,
    run_rollouts,
    summarise,
)
from wbc_suite.executors import Processes, Serial, run_items
from wbc_suite.recording import Dataset

CASE = Case(
    benchmark="Lift",
    robots=("Panda",),
    controller="JOINT_POSITION",
    arguments=(("horizon", 5),),
)


def episode(seed, *, succeeded=False, **more):
    line = {"seed": seed, "succeeded": succeeded, "return": 1.0, "steps": 5}
    return line | {"seconds": 0.5, "physics_error": None} | more


def lift_a_little(env, rng):
    """Act as a policy of a user's own module."""
    return lambda observation: env.hold_action + 0.01 * rng.standard_normal()


def without_time(outcomes):
    lines = [line for o in outcomes for line in o.result["episodes"]]
    return [{k: v for k, v in line.items() if k != "seconds"} for line in lines]


def test_items_cover_every_seed_once_and_keep_their_names():
    items = plan_rollouts([CASE], seeds=range(3, 10), chunk=3)
    seeds = [s for i in items for s in range(*i.payload["seeds"])]
    assert seeds == list(range(3, 10))
    assert len({i.name for i in items}) == 3
    more = plan_rollouts(
        [Case(benchmark="Door", robots=("UR5e",)), CASE], seeds=range(3, 12), chunk=3
    )
    assert {i.name for i in items[:2]} < {i.name for i in more}


@pytest.mark.parametrize(("seeds", "chunk"), [(range(0), 1), (range(3), 0)])
def test_nothing_to_do_is_refused(seeds, chunk):
    with pytest.raises(ConfigError, match="at least one"):
        plan_rollouts([CASE], seeds=seeds, chunk=chunk)


@pytest.mark.slow
def test_processes_play_the_same_episodes_as_this_one(tmp_path):
    items = plan_rollouts([CASE], seeds=range(4), chunk=2)
    here = run_items(run_rollouts, items, folder=tmp_path / "a", executor=Serial())
    there = run_items(run_rollouts, items, folder=tmp_path / "b", executor=Processes(2))
    assert [o.error for o in here + there] == [None] * 4
    lines = without_time(here)
    assert without_time(there) == lines
    assert [line["steps"] for line in lines] == [5] * 4
    assert [line["seed"] for line in lines] == [0, 1, 2, 3]


@pytest.mark.slow
def test_recorded_episodes_are_those_that_were_counted(tmp_path):
    case = Case(**{**_fields(CASE), "record": True})
    items = plan_rollouts([case], seeds=range(3), chunk=2)
    half_done = tmp_path / "episodes" / f"{items[0].name}.hdf5"
    half_done.parent.mkdir()
    half_done.write_bytes(b"what a dead worker left")
    outcomes = run_items(run_rollouts, items, folder=tmp_path, executor=Serial())
    assert [o.error for o in outcomes] == [None, None]
    files = [tmp_path / "episodes" / f"{item.name}.hdf5" for item in items]
    seeds = []
    for path in files:
        with Dataset(path) as dataset:
            episodes = [dataset.episode(name) for name in dataset.names]
        assert [e.length for e in episodes] == [5] * len(episodes)
        seeds += [e.facts["seed"] for e in episodes]
    assert seeds == [0, 1, 2]


def test_a_policy_of_ones_own_is_found_and_a_lost_one_is_named(tmp_path):
    (item,) = plan_rollouts(
        [Case(**{**_fields(CASE), "policy": f"{__name__}:lift_a_little"})],
        seeds=range(1),
        chunk=1,
    )
    assert run_rollouts(item, tmp_path)["episodes"][0]["steps"] == 5
    with pytest.raises(ConfigError, match="cannot be found"):
        make_policy(f"{__name__}:nowhere", None, 0)
    with pytest.raises(UnknownNameError, match="Did you mean 'random'"):
        make_policy("randon", None, 0)


def _fields(case):
    return {name: getattr(case, name) for name in case.__slots__}


def test_summary_counts_each_seed_once():
    lines = [episode(0), episode(1, succeeded=True), episode(1, succeeded=True)]
    lines.append(episode(2, physics_error="Not finite"))
    summary = summarise(lines)
    assert summary.episodes == 3
    assert summary.success == pytest.approx(1 / 3)
    assert summary.physics_errors == 1
    assert summary.steps_per_second == pytest.approx(10.0)


def test_interval_is_wilsons():
    def interval(wins, count):
        played = [episode(seed, succeeded=seed < wins) for seed in range(count)]
        return summarise(played).interval

    # 8 of 10, as Wilson's formula gives it in Brown, Cai and DasGupta (2001).
    assert interval(8, 10) == pytest.approx((0.4902, 0.9433), abs=1e-4)
    assert interval(0, 10)[0] == 0.0
    assert interval(10, 10)[1] == 1.0


@pytest.mark.slow
def test_command_plays_writes_and_goes_on(tmp_path):
    command = ["rollout", "Lift", "--controller", "JOINT_POSITION", "--episodes", "3"]
    command += ["--horizon", "4", "--chunk", "2", "--executor", "serial"]
    command += ["--policy", "hold", "-o", str(tmp_path)]
    first = CliRunner().invoke(app, command)
    assert first.exit_code == 0, first.output
    (figures,) = json.loads((tmp_path / "summary.json").read_text()).values()
    assert (figures["episodes"], figures["mean_steps"]) == (3, 4.0)
    stamps = {p: p.stat().st_mtime_ns for p in (tmp_path / "results").iterdir()}
    assert len(stamps) == 2
    assert CliRunner().invoke(app, command).exit_code == 0
    assert {p: p.stat().st_mtime_ns for p in stamps} == stamps


def test_command_says_what_failed(tmp_path):
    command = ["rollout", "Lift", "--controller", "NOTHING", "--executor", "serial"]
    result = CliRunner().invoke(app, [*command, "-o", str(tmp_path)])
    assert result.exit_code == 1
    assert "NOTHING" in result.output
    assert "1 of 1 items failed" in result.output


@pytest.mark.slow
def test_command_knows_at_once_that_a_robot_is_missing(tmp_path):
    command = ["rollout", "Lift", "--robots", "Panda,Panada", "-o", str(tmp_path)]
    result = CliRunner().invoke(app, command)
    assert isinstance(result.exception, UnknownNameError)
    assert list(tmp_path.iterdir()) == []
