"""MCAP logs, read back with the reader of the package `mcap`."""

import base64
import io
import json
import sys
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from random_episodes import HEADER, make_episode

from wbc_suite.errors import DatasetError
from wbc_suite.recording import Dataset, Store
from wbc_suite.recording.converting import convert

reader = pytest.importorskip("mcap.reader")

SECOND = 1_000_000_000


def convert_and_read(recording, out):
    """Return the summary, the metadata and all messages of a converted recording.

    Messages are triples of topic, time in ns and decoded JSON.
    """
    convert(recording, out, "mcap")
    with out.open("rb") as stream:
        log = reader.make_reader(stream, validate_crcs=True)
        messages = [
            (channel, message.log_time, json.loads(message.data))
            for _, channel, message in log.iter_messages()
        ]
        return log.get_summary(), list(log.iter_metadata()), messages


def record(path, *episodes):
    with Store(path, HEADER) as store:
        for episode in episodes:
            store.add(episode)
    return path


def rows(messages, topic):
    return [content["data"] for c, _, content in messages if c.topic == topic]


def test_logs_hold_every_number_in_order(small_recording, tmp_path):
    summary, metadata, messages = convert_and_read(small_recording, tmp_path / "a.mcap")
    with Dataset(small_recording) as dataset:
        episodes = list(dataset)
        header = dataset.header
    for name in ("actions", "states", "rewards", "obs/cube_pos"):
        expected = np.concatenate([e.columns[name] for e in episodes])
        found = np.array(rows(messages, f"/{name}")).reshape(expected.shape)
        np.testing.assert_array_equal(found, expected)
    assert [record.metadata["env_args"] for record in metadata] == [header["env_args"]]
    times = [time for _, time, _ in messages]
    assert times == sorted(times)
    assert summary.statistics.message_count == len(messages)
    assert summary.statistics.message_start_time == times[0]
    assert summary.statistics.message_end_time == times[-1]


def test_each_episode_begins_with_its_summary(small_recording, tmp_path):
    *_, messages = convert_and_read(small_recording, tmp_path / "a.mcap")
    began = [(t, content) for c, t, content in messages if c.topic == "/episode"]
    assert [content["name"] for _, content in began] == [f"demo_{k}" for k in range(4)]
    assert [content["success"] for _, content in began] == [False, True, False, True]
    assert {content["length"] for _, content in began} == {5}
    starts = [time for time, _ in began]
    assert min(np.diff(starts)) >= SECOND


def test_channels_have_json_schemas_and_shapes(small_recording, tmp_path):
    summary, *_ = convert_and_read(small_recording, tmp_path / "a.mcap")
    channels = {channel.topic: channel for channel in summary.channels.values()}
    assert {channel.message_encoding for channel in channels.values()} == {"json"}
    assert json.loads(channels["/obs/cube_pos"].metadata["shape"]) == [3]
    assert json.loads(channels["/rewards"].metadata["shape"]) == []
    for schema in summary.schemas.values():
        assert schema.encoding == "jsonschema"
        assert json.loads(schema.data)["title"] == schema.name
    assert len(summary.schemas) == 2  # one for each type, not for each channel


def test_simulated_times_are_kept_and_start_at_the_clock(tmp_path):
    episode = make_episode(0, began="2026-01-02T03:04:05.678+00:00")
    episode.columns["states"][:, 0] = [0.0, 0.05, 0.1, 0.2, 0.25]
    path = record(tmp_path / "a.hdf5", episode)
    *_, messages = convert_and_read(path, tmp_path / "a.mcap")
    times = [t for channel, t, _ in messages if channel.topic == "/actions"]
    start = 1_767_323_045_678 * (SECOND // 1000)
    elapsed = [(t - start) / SECOND for t in times]
    assert elapsed == [0.0, 0.05, 0.1, 0.2, 0.25]


def test_pictures_are_png_and_numbers_that_are_not_finite_null(tmp_path):
    pixels = np.random.default_rng(0).integers(0, 256, (5, 8, 9, 3), dtype=np.uint8)
    episode = make_episode(0)
    columns = {**episode.columns, "obs/front_image": pixels}
    columns["rewards"] = np.array([0.0, np.nan, np.inf, 1.0, 2.0])
    path = record(tmp_path / "a.hdf5", replace(episode, columns=columns))
    *_, messages = convert_and_read(path, tmp_path / "a.mcap")
    shown = [content for c, _, content in messages if c.topic == "/obs/front_image"]
    for message, expected in zip(shown, pixels, strict=True):
        picture = Image.open(io.BytesIO(base64.b64decode(message["data"])))
        np.testing.assert_array_equal(np.asarray(picture), expected)
        assert message["format"] == "png"
        assert message["frame_id"] == "obs/front_image"
    assert rows(messages, "/rewards") == [[0.0], [None], [None], [1.0], [2.0]]


@pytest.mark.slow
def test_long_logs_come_in_several_chunks(tmp_path):
    path = record(tmp_path / "a.hdf5", make_episode(0, length=4000))
    summary, _, messages = convert_and_read(path, tmp_path / "a.mcap")
    assert len(summary.chunk_indexes) > 1
    assert len(messages) == 4000 * 5 + 1


def test_a_missing_package_is_named_with_its_extra(
    small_recording, tmp_path, monkeypatch
):
    monkeypatch.setitem(sys.modules, "mcap.writer", None)
    with pytest.raises(DatasetError, match=r"'mcap'.*wbc-suite\[mcap\]"):
        convert(small_recording, tmp_path / "a.mcap", "mcap")
    assert not (tmp_path / "a.mcap").exists()


def test_an_interrupted_conversion_leaves_the_old_log(small_recording, tmp_path):
    out = tmp_path / "a.mcap"
    out.write_bytes(b"old")

    def interrupt(count):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        convert(small_recording, out, "mcap", interrupt)
    assert out.read_bytes() == b"old"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.mcap", "small.hdf5"]
