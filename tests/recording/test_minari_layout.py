# pyright: reportOperatorIssue=false, reportIndexIssue=false
# h5py's types cannot say what is in a file.
"""Minari's layout by its specification; test_peer_readers reads it with Minari."""

import json

import h5py
import numpy as np
import pytest

from wbc_suite.errors import DatasetError
from wbc_suite.recording import Dataset
from wbc_suite.recording.converting import convert


def test_minari_has_an_observation_more_than_actions(small_recording, tmp_path):
    out = convert(small_recording, tmp_path / "random-v3", "minari")
    told = json.loads((out / "data/metadata.json").read_text())
    assert (told["total_episodes"], told["total_steps"]) == (4, 20)
    assert told["dataset_id"] == "random-v3"
    assert json.loads(told["env_spec"])["id"] == "wbc_suite/Lift-v1"
    spaces = json.loads(told["observation_space"])["subspaces"]
    assert spaces["cube_pos"]["shape"] == [3]
    with (
        h5py.File(out / "data/main_data.hdf5") as file,
        Dataset(small_recording) as dataset,
    ):
        for k, episode in enumerate(dataset):
            group = file[f"episode_{k}"]
            seen = group["observations/cube_pos"][()]
            np.testing.assert_array_equal(seen[:-1], episode.columns["obs/cube_pos"])
            np.testing.assert_array_equal(group["actions"], episode.columns["actions"])
            np.testing.assert_array_equal(
                group["infos/states"][-1], episode.final_state
            )
            assert group["terminations"][()].tolist() == [False] * 4 + [episode.success]
            assert group["truncations"][-1] != group["terminations"][-1]
    with pytest.raises(DatasetError, match="not empty"):
        convert(small_recording, out, "minari")


def test_actions_of_ours_have_bounds_in_minari(lift_recording, tmp_path):
    out = convert(lift_recording, tmp_path / "lift", "minari")
    told = json.loads((out / "data/metadata.json").read_text())
    space = json.loads(told["action_space"])
    assert (space["low"], space["high"]) == ([-1.0] * 7, [1.0] * 7)
    assert told["dataset_id"] == "lift-v0"
