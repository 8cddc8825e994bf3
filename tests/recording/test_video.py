"""Videos, contact sheets and charts of recordings."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from random_episodes import HEADER, make_episode

from wbc_suite.errors import DatasetError
from wbc_suite.recording import Dataset, Store, video
from wbc_suite.recording.plots import (
    HEIGHT,
    LABEL,
    SHEET_COLUMNS,
    SHEET_SIZE,
    WIDTH,
    write_plots,
    write_sheet,
)
from wbc_suite.recording.video import check_video, write_video

RED, BLUE = (250, 10, 10), (10, 10, 250)


def pictures(*colours):
    return [np.full((32, 48, 3), colour, dtype=np.uint8) for colour in colours]


@pytest.mark.parametrize("suffix", [".gif", ".webp", ".WEBP"])
def test_animations_have_every_picture_and_the_rate(tmp_path, suffix):
    path = tmp_path / "new" / f"a{suffix}"
    write_video(pictures(RED, BLUE, RED), path, rate=10.0)
    with Image.open(path) as video:
        assert (video.n_frames, video.size) == (3, (48, 32))
        video.seek(1)
        colour = np.asarray(video.convert("RGB")).mean(axis=(0, 1))
        assert video.info["duration"] == 100  # ms
    np.testing.assert_allclose(colour, BLUE, atol=12.0)


def test_a_video_without_pictures_is_refused(tmp_path):
    with pytest.raises(DatasetError, match="no pictures"):
        write_video([], tmp_path / "a.gif", rate=10.0)


@pytest.mark.parametrize("name", ["a.avi", "a", "mp4"])
def test_unknown_formats_are_refused(tmp_path, name):
    with pytest.raises(DatasetError, match=r"\.mp4, \.webp or \.gif"):
        check_video(tmp_path / name)


def test_mp4_names_its_extra(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(DatasetError, match=r"'av'.*wbc-suite\[video\]"):
        check_video(tmp_path / "a.mp4")


def test_mp4_holds_the_pictures(tmp_path):
    av = pytest.importorskip("av")
    path = tmp_path / "a.mp4"
    write_video(pictures(RED, BLUE, BLUE), path, rate=20.0)
    with av.open(str(path)) as video:
        frames = [frame.to_ndarray(format="rgb24") for frame in video.decode(video=0)]
        assert float(video.streams.video[0].average_rate) == 20.0
    assert len(frames) == 3
    np.testing.assert_allclose(frames[0].mean(axis=(0, 1)), RED, atol=25.0)


def test_a_path_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(DatasetError, match="cannot be written"):
        write_video(pictures(RED), tmp_path / "file" / "a.gif", rate=10.0)


@pytest.mark.parametrize(
    ("options", "drawn"), [({}, [0, 1, 2, 3, 4]), ({"every": 2}, [0, 2, 4])]
)
@pytest.mark.parametrize("by_states", [True, False])
def test_every_state_or_every_so_many_are_drawn(monkeypatch, options, drawn, by_states):
    class Env:
        now = None

        def render(self):
            return np.full((2, 2, 3), self.now)

    def play(env, episode):
        for env.now in range(episode):
            yield env.now

    name = "play_states" if by_states else "play_actions"
    monkeypatch.setattr(video, name, play)
    pictures = video.episode_pictures(Env(), 5, by_states=by_states, **options)
    assert [picture[0, 0, 0] for picture in pictures] == drawn


def test_a_sheet_has_12_episodes_at_most(tmp_path):
    path = tmp_path / "many.hdf5"
    with Store(path, HEADER) as store:
        for seed in range(14):
            episode = make_episode(seed)
            shown = {"obs/agentview_image": np.zeros((5, 8, 8, 3), dtype=np.uint8)}
            store.add(replace(episode, columns={**episode.columns, **shown}))
    with Dataset(path) as dataset:
        write_sheet(dataset, tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as sheet:
        assert sheet.size == (6 * 128, 12 * (128 + LABEL))


@pytest.fixture
def with_pictures(tmp_path):
    """Two episodes whose pictures turn from black to white."""
    path = tmp_path / "pictures.hdf5"
    with Store(path, HEADER) as store:
        for seed in range(2):
            episode = make_episode(seed, length=12)
            shades = np.linspace(0, 255, 12).astype(np.uint8)
            shown = np.broadcast_to(shades[:, None, None, None], (12, 16, 16, 3)).copy()
            columns = {**episode.columns, "obs/agentview_image": shown}
            store.add(replace(episode, columns=columns))
    return path


def test_a_sheet_shows_recorded_pictures_from_first_to_last(with_pictures, tmp_path):
    path = tmp_path / "sheet.png"
    with Dataset(with_pictures) as dataset:
        write_sheet(dataset, path)
    with Image.open(path) as sheet:
        height = SHEET_SIZE + LABEL
        assert sheet.size == (SHEET_COLUMNS * SHEET_SIZE, 2 * height)
        pixels = np.asarray(sheet)
        centres = [
            pixels[LABEL + SHEET_SIZE // 2, int((j + 0.5) * SHEET_SIZE), 0]
            for j in range(SHEET_COLUMNS)
        ]
    assert centres[0] == 0
    assert centres[-1] == 255
    assert centres == sorted(centres)


def test_a_chart_has_a_bar_for_each_episode_in_the_colour_of_its_result(
    small_recording, tmp_path
):
    path = tmp_path / "new" / "folder" / "chart.png"
    with Dataset(small_recording) as dataset:
        for _ in range(2):  # the folder is new, then it is there
            write_plots(dataset, path)
    with Image.open(path) as chart:
        assert chart.size == (WIDTH, 3 * HEIGHT)
        row = [chart.getpixel((x, HEIGHT - 20)) for x in range(WIDTH)]
    green, red = (0x3F, 0x8F, 0x5B), (0xC8, 0x55, 0x3D)
    runs = [c for c, before in zip(row[1:], row, strict=False) if c != before]
    assert [c for c in runs if c in (green, red)] == [red, green, red, green]


def test_empty_recordings_and_bad_paths_are_refused(small_recording, tmp_path):
    with Dataset(small_recording) as dataset:
        with pytest.raises(DatasetError, match="cannot be written"):
            write_plots(dataset, tmp_path / "chart.unknown")
        dataset.names = ()
        with pytest.raises(DatasetError, match="no episodes"):
            write_plots(dataset, tmp_path / "a.png")
        with pytest.raises(DatasetError, match="no episodes"):
            write_sheet(dataset, tmp_path / "a.png")
