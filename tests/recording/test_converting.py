# pyright: reportOperatorIssue=false, reportIndexIssue=false
# h5py's types cannot say what is in a file.
"""Recordings seen anew, and in the layouts of others."""

import json

import h5py
import numpy as np
import pytest

from wbc_suite.errors import DatasetError, UnknownNameError
from wbc_suite.recording import Dataset, editing, rebuild
from wbc_suite.recording.converting import convert
from wbc_suite.recording.extracting import extract
from wbc_suite.recording.replaying import play_states


def test_robomimics_layout_holds_its_columns_and_nothing_else(lift_recording, tmp_path):
    out = convert(lift_recording, tmp_path / "out.hdf5", "robomimic")
    with h5py.File(out) as file:
        demo = file["data/demo_0"]
        columns = {"states", "actions", "rewards", "dones", "obs", "next_obs"}
        assert set(demo) == columns
        np.testing.assert_array_equal(
            demo["next_obs/cube_pos"][:-1], demo["obs/cube_pos"][1:]
        )
        assert set(demo["obs"]) == set(demo["next_obs"])
    assert not any(f.problem for f in editing.verify(out))


def test_arrays_are_loaded_without_pickle(small_recording, tmp_path):
    out = convert(small_recording, tmp_path / "out", "npz")
    with Dataset(small_recording) as dataset:
        for episode in dataset:
            with np.load(out / f"{episode.name}.npz", allow_pickle=False) as arrays:
                for name, column in episode.columns.items():
                    np.testing.assert_array_equal(
                        arrays[name.replace("/", ".")], column
                    )
                assert bool(arrays["success"]) is episode.success


def test_lerobots_layout_or_what_to_install(small_recording, tmp_path):
    try:
        parquet = pytest.importorskip("pyarrow.parquet")
    except pytest.skip.Exception:
        with pytest.raises(DatasetError, match=r"pip install 'wbc-suite\[lerobot\]'"):
            convert(small_recording, tmp_path / "out", "lerobot")
        return
    out = convert(small_recording, tmp_path / "out", "lerobot")
    info = json.loads((out / "meta/info.json").read_text())
    assert info["codebase_version"] == "v3.0"
    assert (info["total_episodes"], info["total_frames"]) == (4, 20)
    table = parquet.read_table(out / "data/chunk-000/file-000.parquet")
    with Dataset(small_recording) as dataset:
        actions = np.concatenate([e.columns["actions"] for e in dataset])
    np.testing.assert_allclose(np.array(table["action"].to_pylist()), actions, 1e-6)
    assert table["frame_index"].to_pylist() == 4 * list(range(5))
    with pytest.raises(DatasetError, match="not empty"):
        convert(small_recording, out, "lerobot")


def test_unknown_layouts_are_named(small_recording, tmp_path):
    with pytest.raises(UnknownNameError, match="Did you mean 'lerobot'"):
        convert(small_recording, tmp_path / "out", "lerobott")


def test_extracting_sees_the_same_and_more(lift_recording, tmp_path):
    out = tmp_path / "out.hdf5"
    changes = {"camera_heights": 16, "camera_widths": 24, "reward_shaping": True}
    short = tmp_path / "short.hdf5"
    editing.filter_dataset(lift_recording, short, lambda _, name: name == "demo_1")
    assert extract(short, out, use_camera_obs=True, **changes) == 1
    with Dataset(lift_recording) as before, Dataset(out) as after:
        one, other = before.episode("demo_1"), after.episode("demo_1")
    assert other.columns["obs/agentview_image"].shape == (one.length, 16, 24, 3)
    assert np.ptp(other.columns["obs/agentview_image"]) > 50
    for key in ("cube_pos", "robot0_joint_pos", "robot0_eef_pos"):
        np.testing.assert_allclose(
            other.columns[f"obs/{key}"], one.columns[f"obs/{key}"], atol=1e-9
        )
    np.testing.assert_array_equal(one.columns["states"], other.columns["states"])
    assert other.columns["rewards"].max() > one.columns["rewards"].max()


def test_raw_files_of_robosuite_replay_by_states(lift_recording, tmp_path):
    raw = tmp_path / "raw.hdf5"
    with h5py.File(lift_recording) as ours, h5py.File(raw, "w") as file:
        data = file.create_group("data")
        data.attrs["env"] = "Lift"
        data.attrs["env_info"] = json.dumps({"env_name": "Lift", "robots": ["Panda"]})
        demo = data.create_group("demo_1")
        demo.attrs["model_file"] = "<mujoco/>"
        for name in ("states", "actions"):
            demo[name] = ours[f"data/demo_0/{name}"][()]
    with Dataset(raw) as dataset:
        episode = dataset.episode("demo_1")
        env = rebuild(dataset)
        last = list(play_states(env, episode))[-1]
    assert last == episode.length - 1
    np.testing.assert_array_equal(env.physics_state, episode.columns["states"][-1])


def test_states_of_another_robot_are_refused(small_recording):
    with Dataset(small_recording) as dataset:
        env = rebuild(dataset, robots="Panda")
        with pytest.raises(DatasetError, match="states of 4 numbers, and this"):
            list(play_states(env, dataset.episode("demo_0")))
