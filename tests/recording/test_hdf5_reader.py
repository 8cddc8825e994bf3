"""What is read of an HDF5 file, node by node, and what is refused."""

import h5py
import numpy as np
import pytest

from wbc_suite.errors import DatasetError, UnknownNameError
from wbc_suite.recording import hdf5_reader as reader


@pytest.fixture
def file(tmp_path):
    with h5py.File(tmp_path / "a.hdf5", "w") as file:
        yield file


def test_errors_name_the_file_once(tmp_path):
    path = tmp_path / "a.hdf5"
    for raised, message in (
        (DatasetError("too many"), f"'{path}': too many"),
        (DatasetError(f"'{path}' is odd"), f"'{path}' is odd"),
        (MemoryError(), f"'{path}' declares more data than memory holds."),
        (OSError("bad\n  header"), f"'{path}' cannot be read: bad header. It may be "),
        (KeyError("demo"), f"'{path}' cannot be read: 'demo'. It may be damaged"),
    ):
        with pytest.raises(DatasetError) as caught, reader.reading(path):
            raise raised
        assert str(caught.value).startswith(message)
        assert str(caught.value).count(str(path)) == 1
    unknown = UnknownNameError("episode", "a", ["b"])
    with pytest.raises(UnknownNameError), reader.reading(path):
        raise unknown


@pytest.mark.parametrize("count", [3, 4])
def test_groups_have_so_many_entries_at_most(file, monkeypatch, count):
    monkeypatch.setattr(reader, "MAX_CHILDREN", 3)
    for k in range(count):
        file.create_group(f"g{k}")
    if count == 3:
        assert reader.child_names(file) == ["g0", "g1", "g2"]
        return
    with pytest.raises(DatasetError, match="4 entries; at most 3"):
        reader.child_names(file)


def test_children_are_groups_or_datasets_of_this_file(file, tmp_path):
    group = file.create_group("data")
    group["column"] = np.zeros(3)
    group["soft"] = h5py.SoftLink("/data/column")
    group["outside"] = h5py.ExternalLink(str(tmp_path / "b.hdf5"), "/x")
    assert reader.child(group, "column", h5py.Dataset) == group["column"]
    assert reader.child(file, "data", h5py.Group) == group
    assert reader.child(group, "missing", h5py.Dataset) is None
    with pytest.raises(DatasetError, match="is a Dataset, not a Group"):
        reader.child(group, "column", h5py.Group)
    for name in ("soft", "outside"):
        with pytest.raises(DatasetError, match=r"is a link .*not followed"):
            reader.child(group, name, h5py.Dataset)


@pytest.mark.parametrize("name", ["a/b", "", ".", "..", "a\x00b", "x" * 1_000_000])
def test_names_that_lead_elsewhere_are_refused(file, name):
    with pytest.raises(DatasetError, match="not a valid name"):
        reader.child(file, name, h5py.Group)


@pytest.mark.parametrize(
    ("value", "read"),
    [
        ("text", "text"),
        (b"bytes", "bytes"),
        (3, 3),
        (2.5, 2.5),
        (np.True_, True),
        (np.array([7]), 7),
    ],
)
def test_attributes_are_single_texts_or_numbers(file, value, read):
    file.attrs["a"] = value
    found = reader.attribute(file, "a")
    assert found == read
    assert type(found) is type(read)
    assert reader.attribute(file, "missing") is None
    assert reader.attribute_names(file) == ["a"]


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (np.zeros(2), "not a single string or number"),
        (np.array(1j), "has the type complex128"),
        ("x" * 3000, "too long|not a single"),
    ],
)
def test_other_attributes_are_refused(file, value, message, monkeypatch):
    monkeypatch.setattr(reader, "MAX_TEXT", 2000)
    file.attrs["a"] = value
    with pytest.raises(DatasetError, match=message):
        reader.attribute(file, "a")


def test_nodes_have_so_many_attributes_at_most(file, monkeypatch):
    monkeypatch.setattr(reader, "MAX_ATTRIBUTES", 2)
    for k in range(3):
        file.attrs[f"a{k}"] = k
    with pytest.raises(DatasetError, match="has 3 attributes"):
        reader.attribute_names(file)


@pytest.mark.parametrize("kind", [h5py.string_dtype(), "S10"])
def test_lists_of_names_are_read(file, kind):
    file.create_dataset("mask", data=["demo_1", "demo_20"], dtype=kind)
    assert reader.read_names(file["mask"]) == ["demo_1", "demo_20"]


@pytest.mark.parametrize(
    ("data", "kind", "message"),
    [
        ([1, 2], "i8", "not a list of names"),
        ([["a"], ["b"]], h5py.string_dtype(), "not a list of names"),
        (["a" * 300], "S300", "names of 300 characters"),
        (["a" * 300], h5py.string_dtype(), "a name of 300 letters"),
    ],
)
def test_other_lists_are_refused(file, data, kind, message):
    file.create_dataset("mask", data=data, dtype=kind)
    with pytest.raises(DatasetError, match=message):
        reader.read_names(file["mask"])


@pytest.mark.parametrize(
    ("options", "sliced"),
    [
        ({}, True),
        ({"chunks": (1, 4)}, True),
        ({"chunks": (20, 4), "compression": "gzip", "shuffle": True}, True),
        ({"compression": "lzf", "fletcher32": True}, True),
    ],
)
def test_columns_are_read_slice_by_slice(file, tmp_path, options, sliced):
    values = np.arange(80.0).reshape(20, 4)
    file.create_dataset("a", data=values, **options)
    column = reader.StoredColumn(file["a"], tmp_path / "a.hdf5")
    np.testing.assert_array_equal(column[3:7], values[3:7])
    assert (len(column), column.shape, column.ndim) == (20, (20, 4), 2)
    assert (column.nbytes, column.dtype) == (640, np.float64)
    assert column.sliced == sliced


def test_columns_in_large_chunks_are_not_sliced(file, tmp_path, monkeypatch):
    file.create_dataset("a", data=np.zeros((20, 4)), chunks=(10, 4))
    for most, sliced in ((320, True), (319, False)):
        monkeypatch.setattr(reader, "HIGHEST_CHUNK", most)
        column = reader.StoredColumn(file["a"], tmp_path / "a.hdf5")
        assert column.sliced == sliced


@pytest.mark.parametrize("kind", ["S3", "c8", "c16"])
def test_columns_hold_numbers_of_8_bytes_at_most(file, tmp_path, kind):
    file.create_dataset("a", data=np.zeros(3, dtype=kind))
    with pytest.raises(DatasetError, match="not numbers"):
        reader.StoredColumn(file["a"], tmp_path)


def test_columns_outside_of_the_file_or_behind_other_filters_are_refused(
    file, tmp_path
):
    layout = h5py.VirtualLayout(shape=(3,), dtype="f8")
    file.create_virtual_dataset("virtual", layout)
    file.create_dataset("raw", (3,), "f8", external=[(str(tmp_path / "b"), 0, 24)])
    for name in ("virtual", "raw"):
        with pytest.raises(DatasetError, match="stored outside of the file"):
            reader.StoredColumn(file[name], tmp_path)
    file.create_dataset("scaled", data=np.zeros(9, dtype="i8"), scaleoffset=3)
    with pytest.raises(DatasetError, match="needs HDF5's filter 6; allowed are gzip"):
        reader.StoredColumn(file["scaled"], tmp_path)


def test_columns_that_claim_more_than_is_stored_are_refused(file, tmp_path):
    file.create_dataset("empty", (1000,), "f8")  # nothing is written
    with pytest.raises(DatasetError, match=r"claims 8000 bytes .* only 0 are stored"):
        reader.StoredColumn(file["empty"], tmp_path)
    file.create_dataset("zeros", data=np.zeros(100_000), compression="gzip")
    reader.StoredColumn(file["zeros"], tmp_path)
