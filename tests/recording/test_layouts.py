"""Layouts: pieces, what is left after an interruption, and names."""

import json
from dataclasses import replace

import h5py
import numpy as np
import pytest
from random_episodes import HEADER, make_episode

from wbc_suite.errors import DatasetError, UnknownNameError
from wbc_suite.executors import Serial
from wbc_suite.recording import Dataset, Store
from wbc_suite.recording.converting import (
    LAYOUTS,
    Layout,
    convert,
    register_layout,
)
from wbc_suite.recording.converting.layout import split_dataset, whole_dataset


@pytest.fixture
def uneven_recording(tmp_path):
    """Seven episodes of 1 to 7 actions."""
    path = tmp_path / "uneven.hdf5"
    with Store(path, HEADER) as store:
        for seed in range(7):
            store.add(make_episode(seed, length=seed + 1))
    return path


@pytest.mark.parametrize("workers", [1, 2, 3, 7, 50])
def test_pieces_cover_every_episode_once_and_in_order(uneven_recording, workers):
    with Dataset(uneven_recording) as dataset:
        pieces = split_dataset(dataset, workers)
        assert sum((piece.names for piece in pieces), ()) == dataset.names
        lengths = [dataset.length(name) for name in dataset.names]
    assert len(pieces) <= workers
    assert [piece.number for piece in pieces] == list(range(len(pieces)))
    for piece in pieces:
        assert piece.start == sum(lengths[: piece.before])
        assert piece.names[0] == f"demo_{piece.before}"


def test_large_datasets_come_in_small_pieces():
    class Many:
        names = tuple(f"demo_{k}" for k in range(120))

        def length(self, name):
            return 1

    pieces = split_dataset(Many(), 2)  # pyright: ignore[reportArgumentType] - no file
    assert [len(piece.names) for piece in pieces] == [50, 50, 20]


def test_the_whole_dataset_is_one_piece(uneven_recording):
    with Dataset(uneven_recording) as dataset:
        piece = whole_dataset(dataset)
        assert (piece.names, piece.start, piece.before) == (dataset.names, 0, 0)


@pytest.mark.parametrize("layout", [n for n in LAYOUTS if n != "lerobot"])
def test_an_empty_recording_is_refused(tmp_path, layout):
    path = tmp_path / "empty.hdf5"
    with h5py.File(path, "w") as file:
        file.create_group("data")
    with pytest.raises(DatasetError, match="no episodes"):
        convert(path, tmp_path / "out", layout)
    assert not (tmp_path / "out").exists()


def test_a_layout_of_ones_own_is_registered_by_one_line(
    uneven_recording, tmp_path, forget
):
    def write(dataset, piece, path, progress):
        path.write_text(" ".join(piece.names))

    forget(LAYOUTS, "names")
    register_layout("names", Layout(begin=lambda path: None, write=write))
    written = convert(uneven_recording, tmp_path / "names.txt", "Names")
    assert written.read_text() == " ".join(f"demo_{k}" for k in range(7))
    with pytest.raises(UnknownNameError, match="Did you mean 'names'"):
        convert(uneven_recording, tmp_path / "out", "nams")


@pytest.mark.parametrize("layout", ["robomimic", "npz", "minari"])
def test_progress_is_reported_for_each_episode(uneven_recording, tmp_path, layout):
    counts = []
    convert(uneven_recording, tmp_path / "out", layout, counts.append)
    assert counts == [1] * 7


def damage(path, name):
    with h5py.File(path, "r+") as file:
        actions = file[f"data/{name}/actions"]
        assert isinstance(actions, h5py.Dataset)
        actions[0, 0] += 1.0


@pytest.mark.parametrize("layout", ["robomimic", "npz", "minari"])
def test_damage_halfway_leaves_no_partial_file(uneven_recording, tmp_path, layout):
    damage(uneven_recording, "demo_3")
    out = tmp_path / "out"
    with pytest.raises(DatasetError, match="demo_3"):
        convert(uneven_recording, out, layout)
    assert not out.exists() or list(out.iterdir()) == []
    assert {path.name for path in tmp_path.iterdir()} <= {
        *("out", uneven_recording.name, f"{uneven_recording.name}.parts")
    }


def test_a_damaged_episode_fails_its_piece_and_the_rest_is_not_done_again(
    uneven_recording, tmp_path
):
    content = uneven_recording.read_bytes()
    damage(uneven_recording, "demo_6")
    out = tmp_path / "out"
    with pytest.raises(DatasetError, match=r"1 of 7 pieces failed.*demo_6"):
        convert(uneven_recording, out, "npz", executor=Serial(), workers=7)
    assert list(out.iterdir()) == []
    uneven_recording.write_bytes(content)
    convert(uneven_recording, out, "npz", executor=Serial(), workers=7)
    assert len(list(out.iterdir())) == 7


@pytest.mark.parametrize("executor", [None, Serial()])
def test_minaris_name_is_that_of_the_folder_for_every_executor(
    small_recording, tmp_path, executor
):
    out = convert(small_recording, tmp_path / "cubes-v2", "minari", executor=executor)
    metadata = json.loads((out / "data/metadata.json").read_text())
    assert metadata["dataset_id"] == "cubes-v2"


def test_minari_refuses_episodes_with_other_columns(tmp_path):
    path = tmp_path / "a.hdf5"
    with Store(path, HEADER) as store:
        store.add(make_episode(0))
        other = make_episode(1)
        store.add(replace(other, columns={**other.columns, "obs/x": np.zeros((5, 1))}))
    with pytest.raises(DatasetError, match="'demo_1' has other columns"):
        convert(path, tmp_path / "out", "minari")


def test_robomimic_names_episodes_anew_and_keeps_masks(small_recording, tmp_path):
    with h5py.File(small_recording, "r+") as file:
        del file["data/demo_1"]
        file["mask/train"] = np.array(["demo_0", "demo_1", "demo_3"], dtype="S")
    out = convert(small_recording, tmp_path / "out.hdf5", "robomimic")
    with Dataset(out) as dataset:
        assert dataset.names == ("demo_0", "demo_1", "demo_2")
        assert dataset.masks == {"train": ["demo_0", "demo_2"]}
        assert [dataset.facts(n)["uid"] for n in dataset.names] == ["0", "2", "3"]


def test_a_path_that_cannot_be_written_is_named_before_anything_is_read(
    small_recording, tmp_path
):
    (tmp_path / "file").write_text("")
    for layout in ("npz", "robomimic", "minari"):
        with pytest.raises(DatasetError, match="file"):
            convert(small_recording, tmp_path / "file" / "out", layout)
