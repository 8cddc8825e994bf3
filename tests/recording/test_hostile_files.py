# pyright: reportOperatorIssue=false, reportIndexIssue=false
# h5py's types cannot say what is in a file.
"""Files that lie: each is refused with a DatasetError, and costs little."""

import os
import resource

import h5py
import numpy as np
import pytest
from hypothesis import event, given, settings
from hypothesis import strategies as st

from wbc_suite.errors import DatasetError
from wbc_suite.recording import Dataset, EnvSource
from wbc_suite.recording.editing import merge
from wbc_suite.recording.episode import fingerprint

EXAMPLES = int(os.environ.get("WBC_SUITE_FUZZ", "25"))
"""Damaged recordings; 1,000 of them take about 100 s."""


def outside(file, tmp_path):
    with h5py.File(tmp_path / "secret.hdf5", "w") as secret:
        secret["actions"] = np.zeros((5, 2))
    del file["data/demo_1/actions"]
    file["data/demo_1/actions"] = h5py.ExternalLink("secret.hdf5", "/actions")


def soft_link(file, tmp_path):
    del file["data/demo_1/actions"]
    file["data/demo_1/actions"] = h5py.SoftLink("/data/demo_0/actions")


def stored_outside(file, tmp_path):
    (tmp_path / "raw").write_bytes(bytes(80))
    del file["data/demo_1/actions"]
    file["data/demo_1"].create_dataset(
        "actions", (5, 2), "f8", external=[(str(tmp_path / "raw"), 0, 80)]
    )


def virtual(file, tmp_path):
    del file["data/demo_1/actions"]
    layout = h5py.VirtualLayout(shape=(5, 2), dtype="f8")
    layout[:] = h5py.VirtualSource(str(tmp_path / "x.hdf5"), "a", shape=(5, 2))
    file["data/demo_1"].create_virtual_dataset("actions", layout)


def endless(file, tmp_path):
    del file["data/demo_1/actions"]
    file["data/demo_1"].create_dataset("actions", (2**40, 2), "f8", chunks=(64, 2))


def swollen(file, tmp_path):
    del file["data/demo_1/actions"]
    file["data/demo_1"].create_dataset(
        "actions", data=np.zeros((2**17, 16)), chunks=(2**17, 16), compression="gzip"
    )


def objects(file, tmp_path):
    del file["data/demo_1/actions"]
    file["data/demo_1"].create_dataset(
        "actions", data=["a", "b"], dtype=h5py.string_dtype()
    )


def references(file, tmp_path):
    del file["data/demo_1/actions"]
    file["data/demo_1"].create_dataset(
        "actions", data=np.array([file["data"].ref] * 5), dtype=h5py.ref_dtype
    )


def a_group(file, tmp_path):
    del file["data/demo_1/actions"]
    file.create_group("data/demo_1/actions")


def other_length(file, tmp_path):
    del file["data/demo_1/states"]
    file["data/demo_1/states"] = np.zeros((4, 4))


def flat(file, tmp_path):
    del file["data/demo_1/actions"]
    file["data/demo_1/actions"] = np.zeros(5)


def not_finite(file, tmp_path):
    del file["data/demo_1"].attrs["sha256"]
    file["data/demo_1/actions"][2, 1] = np.nan


def many_attributes(file, tmp_path):
    for k in range(1200):
        file["data/demo_1"].attrs[f"a{k}"] = k


def list_attribute(file, tmp_path):
    file["data/demo_1"].attrs["seed"] = np.zeros(50)


def many_samples(file, tmp_path):
    file["data/demo_1"].attrs["num_samples"] = 10**15


def name_that_is_not_utf8(file, tmp_path):
    file["data/demo_1"].create_dataset(b"\xff\xfe", data=np.zeros(5))


def no_data(file, tmp_path):
    del file["data"]


def names_that_are_numbers(file, tmp_path):
    file["mask/train"] = np.zeros(5)


LIES = [
    outside, soft_link, stored_outside, virtual, endless, objects, references,
    a_group, other_length, flat, not_finite, many_attributes, list_attribute, no_data,
    names_that_are_numbers, many_samples, name_that_is_not_utf8,
]  # fmt: skip


def sums_of_pieces(path):
    """Read all episodes as closing a recording does, and tell their sums."""
    with Dataset(path) as dataset:
        return [fingerprint(e.columns, e.final_state) for e in dataset.streamed()]


def read_all(path):
    with Dataset(path) as dataset:
        for name in dataset.names:
            dataset.length(name)
        return list(dataset)


@pytest.mark.parametrize("lie", LIES, ids=lambda lie: lie.__name__)
def test_a_file_that_lies_is_refused(small_recording, tmp_path, lie):
    with h5py.File(small_recording, "r+") as file:
        lie(file, tmp_path)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(DatasetError, match=str(small_recording)):
        read_all(small_recording)
    with pytest.raises(DatasetError, match=str(small_recording)):
        sums_of_pieces(small_recording)
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown < 100_000  # kB


def test_text_that_is_not_utf8_is_written_again(small_recording, tmp_path):
    with h5py.File(small_recording, "r+") as file:
        bad = np.array(b"<mujoco>\xff", dtype=h5py.string_dtype())
        file["data/demo_1"].attrs["model_file"] = bad
        file["data"].attrs["note"] = bad
    assert merge([small_recording], tmp_path / "out.hdf5") == 4
    with Dataset(tmp_path / "out.hdf5") as dataset:
        assert dataset.facts("demo_1")["model_file"] == "<mujoco>\ufffd"
        assert dataset.header["note"] == "<mujoco>\ufffd"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"control_freq": 1e-6}, r"control_freq.*1e-06.*greater than or equal to 0\.1"),
        ({"control_freq": 1e300}, "control_freq"),
        ({"use_camera_obs": True, "camera_heights": 8192}, "8192 pixels"),
        ({"use_camera_obs": True, "camera_widths": [64, 8192]}, "8192"),
        ({"use_camera_obs": True, "camera_widths": [64] * 1000}, "pixels"),
    ],
)
def test_an_environment_that_costs_too_much_is_refused(arguments, message):
    source = EnvSource(benchmark="Lift", arguments={"robots": "Panda"} | arguments)
    with pytest.raises(DatasetError, match=message):
        source.build()


@pytest.mark.slow
def test_numbers_that_compress_well_are_read(small_recording, tmp_path):
    with h5py.File(small_recording, "r+") as file:
        swollen(file, tmp_path)
        for name in ("states", "rewards", "dones", "obs"):
            del file[f"data/demo_1/{name}"]
        del file["data/demo_1"].attrs["sha256"]
        file["data/demo_1"].attrs["num_samples"] = 2**17
    assert read_all(small_recording)[1].length == 2**17


@pytest.mark.slow
@settings(max_examples=EXAMPLES)
@given(data=st.data())
def test_damaged_bytes_are_refused_or_change_nothing(
    small_recording, tmp_path, same_numbers, data
):
    content = bytearray(small_recording.read_bytes())
    originals = {e.name: e for e in read_all(small_recording)}
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(content) - 1))
        content[place] = data.draw(st.integers(0, 255))
    length = data.draw(st.one_of(st.just(len(content)), st.integers(0, len(content))))
    damaged = tmp_path / "damaged.hdf5"
    damaged.write_bytes(bytes(content[:length]))
    try:
        episodes = read_all(damaged)
    except DatasetError:
        event("refused")
        return
    event("read")
    assert sums_of_pieces(damaged) == [
        fingerprint(episode.columns, episode.final_state) for episode in episodes
    ]
    for episode in episodes:
        if episode.name in originals and "uid" in episode.facts:
            same_numbers(originals[episode.name], episode)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{",
        "[" * 10_000,
        '{"env_name": 3}',
        '{"env_name": "", "env_kwargs": 1}',
    ],
)
def test_env_args_that_are_none_are_refused(text):
    with pytest.raises(DatasetError):
        EnvSource.parse(text)


@pytest.mark.parametrize(
    "content", [b"", b"not hdf5", b"\x89HDF\r\n\x1a\n" + bytes(99)]
)
def test_what_is_no_recording_is_refused(tmp_path, content):
    path = tmp_path / "a.hdf5"
    path.write_bytes(content)
    with pytest.raises(DatasetError, match=str(path)):
        Dataset(path)
    with pytest.raises(DatasetError, match="no file"):
        Dataset(tmp_path / "none.hdf5")
