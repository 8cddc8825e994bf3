"""What we write is loaded by the packages whose layout it is, in their environment."""

import numpy as np
import pytest

from wbc_suite.recording import Dataset
from wbc_suite.recording.converting import convert
from wbc_suite.recording.extracting import extract

pytestmark = [pytest.mark.peer, pytest.mark.slow]


@pytest.fixture(scope="module")
def with_pictures(lift_recording, tmp_path_factory):
    """The shared recording, with pictures of one camera."""
    out = tmp_path_factory.mktemp("pictures") / "lift.hdf5"
    seen = {"camera_names": ("agentview",), "camera_heights": 64, "camera_widths": 64}
    extract(lift_recording, out, use_camera_obs=True, **seen)
    return out


@pytest.fixture(scope="module")
def episodes(with_pictures):
    with Dataset(with_pictures) as dataset:
        return list(dataset)


def sums(episodes, column):
    return [float(e.columns[column].astype(np.float64).sum()) for e in episodes]


def check(told, episodes):
    """Compare lengths and sums of actions with what was recorded."""
    assert told["lengths"] == [e.length for e in episodes]
    np.testing.assert_allclose(told["actions"], sums(episodes, "actions"), atol=1e-4)


@pytest.mark.parametrize("kind", ["minari", "mcap"])
def test_logs_and_minari_datasets_hold_what_was_recorded(
    with_pictures, episodes, peer_readers, tmp_path, kind
):
    told = peer_readers.read(kind, convert(with_pictures, tmp_path / "lift-v0", kind))
    check(told, episodes)
    np.testing.assert_allclose(told["cube"], sums(episodes, "obs/cube_pos"), 1e-12)
    assert told["ended"] == [e.success for e in episodes]
    assert told["environment"].removeprefix("wbc_suite/").startswith("Lift")


@pytest.mark.parametrize("converted", [False, True])
def test_robomimics_dataset_class_loads_what_was_recorded(
    with_pictures, episodes, peer_readers, tmp_path, converted
):
    out = with_pictures
    if converted:
        out = convert(with_pictures, tmp_path / "out.hdf5", "robomimic")
    told = peer_readers.read("robomimic", out)
    check(told, episodes)
    seen = told["observations"]
    np.testing.assert_allclose(
        seen["cube_pos"], sums(episodes, "obs/cube_pos"), atol=1e-4
    )
    assert (told["environment"], told["ended"]) == ("Lift", [True, True])
    assert told["items"] == sum(told["lengths"])


@pytest.mark.parametrize("pieces", [1, 2])
def test_lerobots_dataset_class_loads_frames_and_videos(
    with_pictures, episodes, peer_readers, tmp_path, pieces
):
    out = tmp_path / "lift"
    peer_readers.convert(with_pictures, out, "lerobot", pieces=pieces)
    assert len(list(out.glob("videos/*/chunk-000/file-*.mp4"))) == pieces
    told = peer_readers.read("lerobot", out)
    check(told, episodes)
    with Dataset(with_pictures) as dataset:
        instructions = {dataset.facts(name)["instruction"] for name in dataset.names}
    assert told["tasks"] == sorted(instructions)
    for shown, episode in zip(told["pictures"], episodes, strict=True):
        first = episode.columns["obs/agentview_image"][0] / 255.0
        error = np.abs(np.moveaxis(np.array(shown), 0, -1) - first)
        assert error.mean() < 0.03  # H.264 and 4:2:0 colours
    mean = np.concatenate([e.columns["obs/agentview_image"] for e in episodes]).mean()
    assert told["means"] == pytest.approx([mean / 255.0], abs=0.01)
