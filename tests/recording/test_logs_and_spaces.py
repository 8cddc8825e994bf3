# pyright: reportOperatorIssue=false, reportIndexIssue=false
# h5py's types cannot say what is in a file.
"""MCAP and Minari layouts, read by their specifications; see test_peer_readers too."""

import json
import struct
import zlib

import h5py
import numpy as np
import pytest

from wbc_suite.errors import DatasetError
from wbc_suite.recording import Dataset
from wbc_suite.recording.converting import convert
from wbc_suite.recording.converting.mcap_file import MAGIC, McapFile


def records(content):
    """Split bytes into pairs of opcode and content, with the place of each."""
    at = 0
    while at < len(content):
        kind, length = struct.unpack_from("<BQ", content, at)
        yield at, kind, content[at + 9 : at + 9 + length]
        at += 9 + length


def test_logs_hold_every_row_and_their_index_leads_to_it(small_recording, tmp_path):
    content = convert(small_recording, tmp_path / "a.mcap", "mcap").read_bytes()
    assert content.startswith(MAGIC)
    assert content.endswith(MAGIC)
    held = list(records(content[8:-8]))
    ((_, _, chunk),) = [r for r in held if r[1] == 6]
    first, last, size, crc, no_compression, stored = struct.unpack_from(
        "<QQQIIQ", chunk
    )
    inner = chunk[40:]
    assert (size, no_compression, stored) == (len(inner), 0, len(inner))
    assert crc == zlib.crc32(inner)
    topics, rows, times = {}, [], []
    for _, kind, record in records(inner):
        if kind == 4:
            number, _, length = struct.unpack_from("<HHI", record)
            topics[number] = record[8 : 8 + length].decode()
        if kind == 5:
            number, _, time, _ = struct.unpack_from("<HIQQ", record)
            times.append(time)
            if topics[number] == "/actions":
                rows.append(json.loads(record[22:])["data"])
    with Dataset(small_recording) as dataset:
        actions = np.concatenate([e.columns["actions"] for e in dataset])
    np.testing.assert_array_equal(rows, actions)
    assert times == sorted(times)
    assert (first, last) == (times[0], times[-1])
    for _, kind, record in held:
        if kind == 7:  # an index of one channel: (time, place of the message)
            number, length = struct.unpack_from("<HI", record)
            for time, place in struct.iter_unpack("<QQ", record[6 : 6 + length]):
                assert inner[place] == 5
                assert struct.unpack_from("<H", inner, place + 9) == (number,)
                assert struct.unpack_from("<Q", inner, place + 15) == (time,)
    start, _, summary_crc = struct.unpack("<QQI", held[-1][2])
    assert zlib.crc32(content[start:-12]) == summary_crc


def test_long_logs_come_in_several_chunks(tmp_path):
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream, McapFile(stream, "test") as log:
        number = log.channel("/a", "A", b"{}", {})
        for k in range(5):
            log.message(number, k, bytes(600_000))
    kinds = [kind for _, kind, _ in records(path.read_bytes()[8:-8])]
    assert (kinds.count(6), kinds.count(8)) == (3, 3)


def test_minari_has_an_observation_more_than_actions(small_recording, tmp_path):
    out = convert(small_recording, tmp_path / "random-v3", "minari")
    told = json.loads((out / "data/metadata.json").read_text())
    assert (told["total_episodes"], told["total_steps"]) == (4, 20)
    assert told["dataset_id"] == "random-v3"
    assert json.loads(told["env_spec"])["id"] == "wbc_suite/Lift-v0"
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
