# pyright: reportOperatorIssue=false, reportIndexIssue=false
# h5py's types cannot say what is in a file.
"""From an environment to a file and back, bit by bit."""

import json

import gymnasium
import h5py
import numpy as np
import pytest
from random_episodes import make_episode

import wbc_suite
from wbc_suite.errors import DatasetError, UnknownNameError
from wbc_suite.recording import Dataset, EnvSource, rebuild, replaying
from wbc_suite.recording.recorder import Recorder
from wbc_suite.recording.replaying import divergence, play_states
from wbc_suite.recording.step_buffer import BLOCK_BYTES
from wbc_suite.wrappers import DataCollection


def test_episodes_replay_bit_by_bit_by_their_actions(lift_recording):
    with Dataset(lift_recording) as dataset:
        env = rebuild(dataset)
        found = [divergence(env, episode) for episode in dataset]
    assert [f.exact for f in found] == [True, True]
    assert [f.success for f in found] == [True, False]


def test_a_changed_action_is_seen_as_a_divergence(lift_recording, lift_env):
    with Dataset(lift_recording) as dataset:
        episode = dataset.episode("demo_1")
    episode.columns["actions"][4] *= 0.5
    found = divergence(lift_env, episode)
    assert found.first == 4
    assert found.largest > 1e-3


def test_states_show_what_was_observed(lift_recording, lift_env):
    with Dataset(lift_recording) as dataset:
        episode = dataset.episode("demo_1")
    for k in play_states(lift_env, episode):
        if k < episode.length:
            seen = lift_env.observation()["cube_pos"]
            np.testing.assert_allclose(
                seen, episode.columns["obs/cube_pos"][k], atol=1e-12
            )
    np.testing.assert_array_equal(lift_env.physics_state, episode.final_state)


def test_the_file_has_the_layout_that_robomimic_reads(lift_recording):
    with h5py.File(lift_recording) as file:
        data, demo = file["data"], file["data/demo_0"]
        env_args = json.loads(data.attrs["env_args"])
        assert env_args["env_name"] == "Lift"
        assert env_args["env_kwargs"]["robots"] == "Panda"
        lengths = [data[name].attrs["num_samples"] for name in data]
        assert data.attrs["total"] == sum(lengths)
        for name in ("states", "actions", "rewards", "dones"):
            assert len(demo[name]) == demo.attrs["num_samples"] == lengths[0]
        assert demo["actions"].shape[1] == 7
        assert "<mujoco" in demo.attrs["model_file"]
        assert demo["dones"][-1] == 1
        assert {"cube_pos", "robot0_eef_pos", "object-state"} <= set(demo["obs"])


def test_facts_tell_seed_success_clipping_versions_and_controller(lift_recording):
    with Dataset(lift_recording) as dataset:
        facts = [dataset.facts(name) for name in dataset.names]
        header = dataset.header
        clipped = dataset.column("demo_0", "clipped")
        times = dataset.column("demo_0", "step_time")
    assert [f["seed"] for f in facts] == [0, 1]
    assert [f["success"] for f in facts] == [True, False]
    assert facts[0]["clipped_steps"] == np.count_nonzero(clipped)
    assert (times > 0.0).all()
    assert header["schema_version"] == 1
    assert "mujoco" in json.loads(str(header["versions"]))
    config = json.loads(str(header["controller_config"]))[0]
    assert config["body_parts"]["right"]["type"] == "OSC_POSE"
    assert len(str(header["model_hash"])) == 64


@pytest.mark.slow
def test_a_step_belongs_to_what_was_seen_before_it(lift_env, tmp_path):
    recorder = Recorder(lift_env, tmp_path / "a.hdf5", next_obs=True)
    seen, _ = lift_env.reset(seed=5)
    first = seen["cube_pos"].copy()
    recorder.begin()
    for k in range(6):
        action = lift_env.hold_action + 1e-9
        action = action.astype(np.float32) if k == 0 else action
        seen, reward, *_, info = lift_env.step(action)
        recorder.add(action, seen, reward, done=False, info=info, step_time=0.0)
    assert recorder.keep(success=True) == "demo_0"
    recorder.close()
    with Dataset(tmp_path / "a.hdf5") as dataset:
        episode = dataset.episode("demo_0")
    assert episode.length == 6
    assert episode.columns["actions"].dtype == np.float64  # the first was float32
    np.testing.assert_array_equal(episode.columns["actions"][-1], action)
    assert episode.success is True
    np.testing.assert_array_equal(episode.columns["obs/cube_pos"][0], first)
    np.testing.assert_array_equal(
        episode.columns["next_obs/cube_pos"][:-1], episode.columns["obs/cube_pos"][1:]
    )
    np.testing.assert_array_equal(
        episode.columns["next_obs/cube_pos"][-1], seen["cube_pos"]
    )


@pytest.mark.slow
def test_keep_discard_and_undo_leave_what_they_say(lift_env, tmp_path):
    path = tmp_path / "a.hdf5"
    recorder = Recorder(lift_env, path)

    def take(seed):
        lift_env.reset(seed=seed)
        recorder.begin()
        action = lift_env.hold_action
        seen, reward, *_, info = lift_env.step(action)
        recorder.add(action, seen, reward, done=False, info=info, step_time=0.0)

    take(0)
    recorder.keep()
    take(1)
    recorder.discard()
    assert recorder.keep() is None
    take(2)
    recorder.keep()
    assert recorder.undo() == "demo_1"
    take(3)
    assert recorder.keep() == "demo_1"
    recorder.close()
    with Dataset(path) as dataset:
        seeds = [dataset.facts(name)["seed"] for name in dataset.names]
    assert seeds == [0, 3]


@pytest.mark.slow
def test_what_was_observed_is_recorded_over_many_blocks(lift_env, tmp_path):
    path, rng, expected = tmp_path / "a.hdf5", np.random.default_rng(0), []
    recorded = DataCollection(lift_env, path, automatic=False, next_obs=True)
    seen, _ = recorded.reset(seed=3)
    recorded.recorder.begin()
    for _ in range(BLOCK_BYTES // 300):
        state, action = lift_env.physics_state, rng.uniform(-0.1, 0.1, 7)
        after, reward, _, ended, info = recorded.step(action)
        row = {"states": state, "actions": action, "rewards": reward}
        row |= {"clipped": info["clipped"], "dones": int(ended or info["success"])}
        row |= {f"obs/{key}": value for key, value in seen.items()}
        expected.append(row | {f"next_obs/{key}": v for key, v in after.items()})
        seen = after
    recorded.recorder.keep()
    recorded.close()
    with Dataset(path) as dataset:
        episode = dataset.episode("demo_0")
    expected[-1]["dones"] = 1
    assert set(episode.columns) == {*expected[0], "step_time", "stamp"}
    for name in expected[0]:
        column = np.array([row[name] for row in expected])
        np.testing.assert_array_equal(episode.columns[name], column)
    np.testing.assert_array_equal(episode.final_state, lift_env.physics_state)


class Blurred(gymnasium.ObservationWrapper):
    """Somebody's own: shifts what is seen."""

    def observation(self, observation):
        return {key: value + 1.0 for key, value in observation.items()}


@pytest.mark.slow
def test_what_a_wrapper_made_of_observations_is_recorded(lift_env, tmp_path):
    recorded = DataCollection(Blurred(lift_env), tmp_path / "a.hdf5")
    recorded.reset(seed=3)
    seen, *_ = recorded.step(lift_env.hold_action)
    recorded.step(lift_env.hold_action)
    recorded.close()
    with Dataset(tmp_path / "a.hdf5") as dataset:
        positions = dataset.column("demo_0", "obs/cube_pos")
    np.testing.assert_array_equal(positions[1], seen["cube_pos"])


@pytest.mark.slow
def test_other_keys_within_an_episode_are_told(tmp_path):
    env = wbc_suite.make("Lift", robots="Panda")
    recorded = DataCollection(env, tmp_path / "a.hdf5")
    recorded.reset(seed=3)
    recorded.step(env.hold_action)
    env.observables.modify("cube_pos", active=False)
    env.observables.modify("cube_pos", active=True)  # another observer, the same keys
    recorded.step(env.hold_action)
    assert recorded.recorder.length == 2
    env.observables.modify("cube_pos", active=False)
    with pytest.raises(DatasetError, match="lacks 'cube_pos'"):
        recorded.step(env.hold_action)
    assert not recorded.recorder.recording


def test_a_robot_of_ones_own_is_what_a_file_cannot_tell():
    env = wbc_suite.make("Lift", robots=wbc_suite.load_robot("Panda"))
    source = EnvSource.of(env)
    assert source.missing == ("robots",)
    with pytest.raises(DatasetError, match="does not contain robots"):
        EnvSource.parse(source.text).build()


def test_a_dataset_may_not_name_files_unless_trusted():
    told = '{"env_name": "Lift", "env_kwargs": {"robots": "/etc/robot.toml"}}'
    with pytest.raises(DatasetError, match=r"names a file.*--trust-files"):
        EnvSource.parse(told).build()


def test_unknown_episodes_and_columns_are_named(lift_recording):
    with Dataset(lift_recording) as dataset:
        with pytest.raises(UnknownNameError, match="Did you mean 'demo_1'"):
            dataset.episode("demo1")
        with pytest.raises(UnknownNameError, match="Did you mean 'actions'"):
            dataset.column("demo_0", "action")


class Played:
    """Notes the states that it is to show."""

    def __init__(self):
        self.shown = []

    def show_state(self, state):
        self.shown.append(state)


def test_a_replay_by_states_shows_each_and_the_last(monkeypatch):
    env, episode = Played(), make_episode(0, length=3)
    monkeypatch.setattr(replaying, "start_as", lambda env, episode: None)
    assert list(play_states(env, episode)) == [0, 1, 2, 3]
    states = [*episode.columns["states"], episode.final_state]
    np.testing.assert_array_equal(env.shown, states)
