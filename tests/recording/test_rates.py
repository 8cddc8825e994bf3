"""The rate of actions in recordings, data sets, logs and videos is the true one."""

import json
from fractions import Fraction

import numpy as np
import pytest
from PIL import Image

import wbc_suite
from wbc_suite.recording import Dataset
from wbc_suite.recording.converting import convert
from wbc_suite.recording.video import write_video
from wbc_suite.wrappers import DataCollection

RATE, LENGTH = 30, 6


@pytest.fixture(scope="module")
def at_30_hz(tmp_path_factory):
    """An episode of Lift at 30 actions a second, 17 physics steps each."""
    path = tmp_path_factory.mktemp("rates") / "lift.hdf5"
    env = wbc_suite.make("Lift", robots="Panda", control_freq=RATE)
    recorded = DataCollection(env, path)
    recorded.reset(seed=0)
    for _ in range(LENGTH):
        *_, info = recorded.step(env.unwrapped.hold_action)
    assert info["control_freq"] == env.metadata["render_fps"] == RATE
    recorded.close()
    return path


def test_recorded_times_are_those_of_the_rate(at_30_hz):
    with Dataset(at_30_hz) as dataset:
        (episode,) = dataset
        assert dataset.header["control_freq"] == RATE
    times = episode.columns["states"][:, 0]
    np.testing.assert_allclose(np.diff(times), 1.0 / RATE, atol=1e-12)


def test_lerobot_has_the_rate(at_30_hz, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    convert(at_30_hz, tmp_path / "set", "lerobot")
    info = json.loads((tmp_path / "set/meta/info.json").read_text())
    assert info["fps"] == RATE
    assert isinstance(info["fps"], int)
    (frames,) = (tmp_path / "set/data").rglob("*.parquet")
    times = parquet.read_table(frames)["timestamp"].to_numpy()
    np.testing.assert_allclose(times, np.arange(LENGTH) / RATE, atol=1e-6)


def test_robomimic_has_the_rate(at_30_hz, tmp_path):
    convert(at_30_hz, tmp_path / "set.hdf5", "robomimic")
    with Dataset(tmp_path / "set.hdf5") as dataset:
        arguments = json.loads(str(dataset.header["env_args"]))["env_kwargs"]
    assert arguments["control_freq"] == RATE


def test_mcap_has_the_rate(at_30_hz, tmp_path):
    reader = pytest.importorskip("mcap.reader")
    convert(at_30_hz, tmp_path / "log.mcap", "mcap")
    with (tmp_path / "log.mcap").open("rb") as stream:
        messages = reader.make_reader(stream).iter_messages(topics=["/actions"])
        times = [message.log_time for _, _, message in messages]
    assert np.ptp(times) / (LENGTH - 1) == pytest.approx(1e9 / RATE, abs=0.5)  # ns
    assert np.abs(np.diff(times) - 1e9 / RATE).max() < 1.0


@pytest.mark.parametrize(
    ("suffix", "rate", "error"),
    [("webp", 30.0, 0.5), ("gif", 30.0, 5.0), ("webp", 12.5, 0.5), ("gif", 7.0, 5.0)],
)
def test_an_animation_takes_as_long_as_the_episode(tmp_path, suffix, rate, error):
    """Durations are whole ms, in gif 10 ms: they alternate."""
    path = tmp_path / f"a.{suffix}"
    write_video(
        np.random.default_rng(0).integers(0, 255, (31, 8, 8, 3), np.uint8),
        path,
        rate=rate,
    )
    total = 0
    with Image.open(path) as video:
        assert video.n_frames == 31
        for k in range(31):
            video.seek(k)
            video.load()
            total += video.info["duration"]
    assert total == pytest.approx(1e3 * 31 / rate, abs=error)  # ms


@pytest.mark.parametrize(
    ("rate", "exact"), [(30.0, Fraction(30)), (12.5, Fraction(25, 2)), (29.97, None)]
)
def test_mp4_has_the_rate(tmp_path, rate, exact):
    av = pytest.importorskip("av")
    pictures = np.random.default_rng(0).integers(0, 255, (9, 32, 32, 3), np.uint8)
    write_video(pictures, tmp_path / "a.mp4", rate=rate)
    with av.open(str(tmp_path / "a.mp4")) as video:
        stream = video.streams.video[0]
        times = [frame.time for frame in video.decode(stream)]
    np.testing.assert_allclose(np.diff(times), 1.0 / rate, rtol=1e-4)
    if exact is not None:
        assert stream.average_rate == exact
