# pyright: reportOperatorIssue=false, reportIndexIssue=false
# h5py's types cannot say what is in a file.
"""Datasets verified, mended, merged, split and filtered."""

import h5py
import pytest
from random_episodes import HEADER, make_episode

from wbc_suite.errors import DatasetError
from wbc_suite.recording import Dataset, Store, editing


def test_one_changed_number_is_found_and_repair_keeps_the_rest(small_recording):
    assert not any(f.problem for f in editing.verify(small_recording))
    with h5py.File(small_recording, "r+") as file:
        file["data/demo_2/actions"][3, 1] += 1e-12
    problems = [f for f in editing.verify(small_recording) if f.problem]
    assert [f.place for f in problems] == ["small.hdf5: demo_2"]
    assert "checksum does not match" in problems[0].problem
    editing.repair(small_recording)
    with Dataset(small_recording) as dataset:
        assert dataset.names == ("demo_0", "demo_1", "demo_3")
        assert len(list(dataset)) == 3
    assert small_recording.with_name("small.hdf5.damaged").exists()


def test_repair_restores_parts_beside_a_file_that_cannot_be_opened(small_recording):
    store = Store(small_recording, HEADER)
    store.add(make_episode(9))
    store._lock.close()  # as a killed process leaves it
    small_recording.write_bytes(small_recording.read_bytes()[:3000])
    with pytest.raises(DatasetError):
        Dataset(small_recording)
    findings = editing.repair(small_recording)
    assert sum(f.problem is not None for f in findings) == 1
    with Dataset(small_recording) as dataset:
        assert [e.facts["uid"] for e in dataset] == ["9"]


def test_a_file_of_which_nothing_is_left_is_refused_in_words(small_recording):
    small_recording.write_bytes(b"no HDF5")
    with pytest.raises(
        DatasetError, match=r"^Nothing can be read\. '.*' is not an HDF5"
    ):
        editing.repair(small_recording)
    assert small_recording.read_bytes() == b"no HDF5"


@pytest.mark.slow
def test_merging_twice_changes_nothing(small_recording, tmp_path):
    other, merged = tmp_path / "other.hdf5", tmp_path / "merged.hdf5"
    with Store(other, HEADER) as store:
        for seed in (2, 7):
            store.add(make_episode(seed))
    assert editing.merge([small_recording, other], merged) == 5
    assert editing.merge([merged, other, small_recording], merged) == 5
    with Dataset(merged) as dataset:
        assert dataset.names == tuple(f"demo_{k}" for k in range(5))
        assert [e.facts["uid"] for e in dataset] == ["0", "1", "2", "3", "7"]
    with Store(tmp_path / "x.hdf5", {"env_args": '{"env_name": "Door"}'}) as store:
        store.add(make_episode(0))
    words = 'different environments.*env_name is ".*" and "Door"'
    with pytest.raises(DatasetError, match=words):
        editing.merge([merged, tmp_path / "x.hdf5"], merged)


def test_split_and_filter_keep_the_numbers(small_recording, tmp_path, same_numbers):
    masks = editing.split(small_recording, valid=0.25, seed=3)
    assert sorted([*masks["train"], *masks["valid"]]) == [f"demo_{k}" for k in range(4)]
    with h5py.File(small_recording) as file:
        assert [n.decode() for n in file["mask/valid"]] == masks["valid"]
    out = tmp_path / "out.hdf5"
    count = editing.filter_dataset(
        small_recording, out, lambda d, n: bool(d.facts(n)["success"])
    )
    assert count == 2
    with Dataset(small_recording) as all_of_them, Dataset(out) as kept:
        assert kept.names == ("demo_1", "demo_3")
        assert set(kept.masks["train"]) <= set(kept.names)
        for name in kept.names:
            same_numbers(all_of_them.episode(name), kept.episode(name))
    with pytest.raises(DatasetError, match="None of the 4"):
        editing.filter_dataset(small_recording, out, lambda *_: False)
    with pytest.raises(DatasetError, match="may be empty"):
        editing.split(small_recording, valid=0.01)


def test_each_file_that_cannot_be_opened_is_named(tmp_path, monkeypatch):
    bad = {tmp_path / "b.hdf5", tmp_path / "e.hdf5"}

    def check(files):
        for file in bad.intersection(files):
            raise DatasetError(f"{file.name} hangs")

    monkeypatch.setattr(editing, "check_files", check)
    found = editing._damage([tmp_path / f"{name}.hdf5" for name in "abcdef"])
    assert found == {file: f"{file.name} hangs" for file in bad}
