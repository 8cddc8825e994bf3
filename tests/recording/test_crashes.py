# pyright: reportOperatorIssue=false, reportIndexIssue=false
# h5py's types cannot say what is in a file.
"""A recording survives what befalls it: kill -9, a full disk, a read-only folder."""

import errno
import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from random_episodes import HEADER, make_episode

from wbc_suite import atomic_files
from wbc_suite.errors import DatasetError
from wbc_suite.recording import Dataset, Store, editing
from wbc_suite.wrappers import DataCollection

KILLS = int(os.environ.get("WBC_SUITE_KILLS", "4"))
"""200 of them take about three minutes."""


@pytest.mark.slow
def test_every_finished_episode_outlives_kills(tmp_path):
    script = Path(__file__).with_name("kill_recordings.py")
    command = [sys.executable, str(script), str(tmp_path), str(KILLS)]
    told = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    held = 0
    for line in told.splitlines():
        name, *finished = line.split()
        path = tmp_path / name
        if not finished and not path.exists():
            continue
        with Dataset(path) as dataset:  # without repair
            uids = [int(episode.facts["uid"]) for episode in dataset]
            for episode, uid in zip(dataset, uids, strict=True):
                expected = make_episode(uid, length=200).columns["actions"]
                np.testing.assert_array_equal(episode.columns["actions"], expected)
        assert len(set(uids)) == len(uids)
        assert {int(seed) for seed in finished} <= set(uids)
        held += len(uids)
        assert not any(f.problem for f in editing.repair(path))
        with Dataset(path, alone=True) as dataset:
            assert len(dataset) == len(uids)
    assert held > KILLS


@pytest.mark.slow
def test_commands_that_are_killed_leave_nothing_torn(tmp_path):
    """The next run makes what the first would have made, and removes what was left."""
    script = Path(__file__).with_name("kill_commands.py")
    command = [sys.executable, str(script), str(tmp_path), str(4 * KILLS)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    rows = [line.split() for line in result.stdout.splitlines()]
    assert {"robomimic", "npz", "minari", "merge", "split", "repair", "export"} <= {
        name for name, *_ in rows
    }
    assert sum(int(cut) for *_, cut in rows) > KILLS


def test_the_temporary_file_of_another_process_is_kept(tmp_path):
    path = tmp_path / "a.hdf5"
    ours = atomic_files.temporary_path(path)
    assert ours.suffix == ".hdf5"
    running = ours.with_name(ours.name.replace(str(os.getpid()), str(os.getppid())))
    dead = ours.with_name(ours.name.replace(str(os.getpid()), "999999999"))
    elsewhere = ours.with_name(ours.name.replace(platform.node(), "other-node"))
    for left in (running, dead, elsewhere):
        left.touch()
    atomic_files.write_bytes(path, b"whole")
    assert set(tmp_path.iterdir()) == {path, running, elsewhere}


def test_a_full_disk_loses_nothing_that_is_finished(tmp_path, monkeypatch):
    path = tmp_path / "a.hdf5"
    store = Store(path, HEADER)
    store.add(make_episode(0))

    def no_room(file, content, place):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(os, "pwrite", no_room)
        with pytest.raises(DatasetError, match="No space left"):
            store.add(make_episode(1))
    usage = shutil.disk_usage(tmp_path)._replace(free=1000)
    with monkeypatch.context() as patched:
        patched.setattr(atomic_files.shutil, "disk_usage", lambda _: usage)
        with pytest.raises(DatasetError, match=r"0\.0 MB left .*nothing finished"):
            store.add(make_episode(1))
        with pytest.raises(DatasetError, match="Free some space"):
            store.close()
    with Dataset(path) as dataset:
        assert dataset.names == ("demo_0",)
    with Store(path, HEADER) as again:
        assert again.add(make_episode(1)) == "demo_1"
    with Dataset(path, alone=True) as dataset:
        assert [e.facts["uid"] for e in dataset] == ["0", "1"]


@pytest.mark.slow
def test_an_episode_that_could_not_be_kept_goes_on(lift_env, tmp_path, monkeypatch):
    recorded = DataCollection(lift_env, tmp_path / "a.hdf5", automatic=False)
    recorded.reset(seed=0)
    recorded.recorder.begin()
    usage = shutil.disk_usage(tmp_path)._replace(free=1000)
    for steps in (1, 300):  # in memory, then partly on disk
        for _ in range(steps):
            recorded.step(lift_env.hold_action)
        with monkeypatch.context() as patched:
            patched.setattr(atomic_files.shutil, "disk_usage", lambda _: usage)
            with pytest.raises(DatasetError, match=r"0\.0 MB left"):
                recorded.recorder.keep()
    recorded.step(lift_env.hold_action)
    assert recorded.recorder.keep(success=False) == "demo_0"
    recorded.close()
    with Dataset(tmp_path / "a.hdf5") as dataset:
        columns = dataset.episode("demo_0").columns
    over = np.arange(302) >= lift_env.horizon - 1  # and not where it was not kept
    np.testing.assert_array_equal(columns["dones"], over)
    assert (np.diff(columns["states"][:, 0]) > 0.0).all()
    assert (np.diff(columns["stamp"]) > 0.0).all()


def test_a_folder_that_cannot_be_written_is_said_before_anything_is_recorded():
    with pytest.raises(DatasetError, match="cannot be written to"):
        Store("/proc/none/a.hdf5", HEADER)


def test_two_recordings_into_one_file_at_once_are_refused(tmp_path):
    with (
        Store(tmp_path / "a.hdf5", HEADER),
        pytest.raises(DatasetError, match="Another process records"),
    ):
        Store(tmp_path / "a.hdf5", HEADER)


def test_another_environments_episodes_are_not_added(small_recording):
    wanted = r'another env.*env_name is ".*" and "Stack"'
    with pytest.raises(DatasetError, match=wanted):
        Store(small_recording, {"env_args": '{"env_name": "Stack"}'})


@pytest.mark.slow
def test_a_close_that_was_cut_off_before_it_cleared_up_counts_episodes_once(
    small_recording, tmp_path
):
    copy = tmp_path / "copy.hdf5"
    store = Store(copy, HEADER)
    for seed in range(2):
        store.add(make_episode(seed))
    store._consolidate()  # ... and no more: what was killed leaves all the parts
    store._lock.close()
    with Dataset(copy) as dataset:
        assert [e.facts["uid"] for e in dataset] == ["0", "1"]
    editing.repair(copy)
    assert [p.name for p in tmp_path.glob("copy*")] == ["copy.hdf5"]
    with Dataset(copy) as dataset:
        assert [e.facts["uid"] for e in dataset] == ["0", "1"]
