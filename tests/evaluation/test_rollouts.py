"""Episodes are played as asked, whoever plays them."""

import numpy as np
import pytest

from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.evaluation import (
    Case,
    make_policy,
    plan_rollouts,
    run_rollouts,
)
from wbc_suite.evaluation.results import collect
from wbc_suite.evaluation.rollouts import prepare_rollouts
from wbc_suite.executors import Outcome, Processes, Serial, run_items
from wbc_suite.recording import Dataset

CASE = Case(
    benchmark="Lift",
    robots=("Panda",),
    controller="JOINT_POSITION",
    arguments=(("horizon", 5),),
)


def lift_a_little(env, rng):
    """Act as a policy of a user's own module."""
    return lambda observation: env.hold_action + 0.01 * rng.standard_normal()


def without_time(outcomes):
    lines = [line for o in outcomes for line in o.result["episodes"]]
    return [{k: v for k, v in line.items() if k != "seconds"} for line in lines]


def test_items_cover_every_seed_once_and_keep_their_names():
    items = plan_rollouts([CASE], seeds=range(3, 10), chunk=3)
    seeds = [s for i in items for s in i.payload["seeds"]]
    assert seeds == list(range(3, 10))
    assert len({i.name for i in items}) == 3
    more = plan_rollouts(
        [Case(benchmark="Door", robots=("UR5e",)), CASE], seeds=range(3, 12), chunk=3
    )
    assert {i.name for i in items[:2]} < {i.name for i in more}


@pytest.mark.parametrize(("seeds", "chunk"), [(range(0), 1), (range(3), 0)])
def test_nothing_to_do_is_refused(seeds, chunk):
    with pytest.raises(ConfigError, match="At least one seed"):
        plan_rollouts([CASE], seeds=seeds, chunk=chunk)


@pytest.mark.slow
def test_processes_play_the_same_episodes_as_this_one(tmp_path):
    items = plan_rollouts([CASE], seeds=range(4), chunk=2)
    here = run_items(run_rollouts, items, folder=tmp_path / "a", executor=Serial())
    there = run_items(run_rollouts, items, folder=tmp_path / "b", executor=Processes(2))
    forked = Processes(1, prepare=prepare_rollouts)
    again = run_items(run_rollouts, items, folder=tmp_path / "c", executor=forked)
    assert [o.error for o in here + there + again] == [None] * 6
    lines = without_time(here)
    assert without_time(there) == without_time(again) == lines
    assert [line["steps"] for line in lines] == [5] * 4
    assert [line["seed"] for line in lines] == [0, 1, 2, 3]
    assert all(line["max_reward"] <= line["return"] for line in lines)


SEEN = []
"""Environments of this process."""


def in_one_environment(env, rng):
    """Hold, but not in a second environment."""
    if not any(env is one for one in SEEN):
        SEEN.append(env)
    if len(SEEN) > 1:
        raise RuntimeError("This is another environment.")
    return lambda observation: env.hold_action


@pytest.mark.slow
def test_a_worker_makes_one_environment_for_all_items_of_a_case(tmp_path):
    policy = {"policy": f"{__name__}:in_one_environment"}
    case = Case(**{**_fields(CASE), **policy})
    items = plan_rollouts([case], seeds=range(4), chunk=1)
    outcomes = run_items(run_rollouts, items, folder=tmp_path, executor=Processes(1))
    errors = [e["error"] for o in outcomes for e in o.result["episodes"]]
    assert errors == [None] * 4


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


def test_a_policy_that_can_be_closed_is_closed_after_its_episode(tmp_path):
    closed.clear()
    case = Case(**{**_fields(CASE), "policy": f"{__name__}:Closing"})
    run_rollouts(*plan_rollouts([case], seeds=range(2), chunk=2), tmp_path)
    assert closed == [5, 5]


closed = []


class Closing:
    """Holds, and tells when it is closed after how many steps."""

    def __init__(self, env, rng):
        self.env, self.steps = env, 0

    def __call__(self, observation):
        self.steps += 1
        return self.env.hold_action

    def close(self):
        closed.append(self.steps)


def _fields(case):
    return {name: getattr(case, name) for name in case.__slots__}


class Faulty:
    """Fails in three of four episodes, each time in another way."""

    def __init__(self, env, rng):
        self.env, self.kind = env, env.np_random_seed % 8

    def __call__(self, observation):
        action = self.env.hold_action
        match self.kind:
            case 1:
                raise ValueError("no idea")
            case 2:
                return action[:-1]
            case 3:
                action[2] = np.nan
            case 4:
                while True:  # a policy that hangs
                    pass
            case 5:
                return "left"
            case 6:
                raise ConfigError("not configured")
        return action


def test_a_failing_policy_loses_its_episode_and_no_other(tmp_path):
    fields = _fields(CASE) | {"policy": f"{__name__}:Faulty", "action_time": 0.5}
    case = Case(**fields)
    items = plan_rollouts([case], seeds=range(60), chunk=30)
    outcomes = run_items(run_rollouts, items, folder=tmp_path, executor=Serial())
    results = collect({case: items}, outcomes, seconds=1.0)
    figures = results.figures()
    assert figures["episodes"] == 60
    assert figures["failed_items"] == 0
    assert [e["seed"] for e in results.episodes[case]] == [*range(60)]
    assert figures["cases"][0]["errors"] == {
        "exception": 8 + 7 + 7,  # of 1, 5 and 6
        "action of a wrong shape": 8,
        "action not finite": 8,
        "action out of time": 7,
    }
    told = {e["seed"] % 8: e["text"] for e in figures["errors"]}
    assert told[1] == "ValueError: no idea"
    assert told[2] == "An action has shape (7,); the environment's is (8,)."
    assert told[3] == "1 of 8 values."
    assert told[6] == "ConfigError: not configured"
    lengths = {e["seed"] % 8: e["steps"] for e in results.episodes[case]}
    assert lengths[0] == lengths[7] == 5


def test_an_episode_out_of_time_and_a_dead_worker_are_failures(tmp_path):
    case = Case(**_fields(CASE) | {"policy": "hold", "episode_time": 1e-9})
    (item,) = plan_rollouts([case], seeds=range(2), chunk=2)
    (outcome,) = run_items(run_rollouts, [item], folder=tmp_path, executor=Serial())
    for found, kind in (
        (outcome, "episode out of time"),
        (Outcome(name=item.name, error="It died."), "work item failed"),
    ):
        figures = collect({case: [item]}, [found], seconds=1.0).figures()
        assert figures["episodes"] == 2
        assert figures["success_rate"] == 0.0
        assert figures["cases"][0]["errors"] == {kind: 2}
