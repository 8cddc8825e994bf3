# pyright: reportOperatorIssue=false, reportIndexIssue=false
# h5py's types cannot say what is in a file.
"""Recordings seen anew, and in the layouts of others."""

import json
import os
import signal
from dataclasses import replace
from pathlib import Path
from shutil import rmtree

import h5py
import numpy as np
import pytest
from random_episodes import HEADER, make_episode

import wbc_suite
from wbc_suite.envs.states import motion_size
from wbc_suite.errors import DatasetError, UnknownNameError
from wbc_suite.executors import Processes, Serial
from wbc_suite.recording import Dataset, Store, editing, rebuild
from wbc_suite.recording.converting import convert, convert_piece, lerobot
from wbc_suite.recording.converting.layout import Piece
from wbc_suite.recording.extracting import extract
from wbc_suite.recording.replaying import divergence, play_states
from wbc_suite.wrappers import DataCollection


@pytest.mark.slow
def test_robomimics_layout_holds_its_columns_and_nothing_else(lift_recording, tmp_path):
    out = convert(lift_recording, tmp_path / "out.hdf5", "robomimic")
    with h5py.File(out) as file:
        demo = file["data/demo_0"]
        columns = {"states", "actions", "rewards", "dones", "obs", "next_obs"}
        assert set(demo) == columns
        np.testing.assert_array_equal(
            demo["next_obs/cube_pos"][:-1], demo["obs/cube_pos"][1:]
        )
        assert set(demo["obs"]) == set(demo["next_obs"])
        np.testing.assert_array_equal(demo["obs/object"], demo["obs/object-state"])
    assert not any(f.problem for f in editing.verify(out))


def test_policies_learn_the_intended_actions(tmp_path):
    episode = make_episode(0)
    intended = episode.columns["actions"] + 1.0
    labelled = {"intended": intended, "disturbed": np.zeros(episode.length)}
    with Store(tmp_path / "labelled.hdf5", HEADER) as store:
        store.add(replace(episode, columns=episode.columns | labelled))
    out = convert(tmp_path / "labelled.hdf5", tmp_path / "out.hdf5", "robomimic")
    with h5py.File(out) as file:
        np.testing.assert_array_equal(file["data/demo_0/actions"], intended)
        assert not {"intended", "disturbed"} & set(file["data/demo_0"])


def test_arrays_are_loaded_without_pickle(small_recording, tmp_path):
    out = convert(small_recording, tmp_path / "out", "npz")
    with Dataset(small_recording) as dataset:
        for episode in dataset:
            with np.load(out / f"{episode.name}.npz", allow_pickle=False) as arrays:
                for name, column in episode.columns.items():
                    np.testing.assert_array_equal(
                        arrays[name.replace("/", ".")], column
                    )
                assert bool(arrays["success"]) is episode.success


def test_lerobots_layout_or_what_to_install(small_recording, tmp_path):
    try:
        parquet = pytest.importorskip("pyarrow.parquet")
    except pytest.skip.Exception:
        with pytest.raises(DatasetError, match=r"pip install 'wbc-suite\[lerobot\]'"):
            convert(small_recording, tmp_path / "out", "lerobot")
        return
    out = convert(small_recording, tmp_path / "out", "lerobot")
    info = json.loads((out / "meta/info.json").read_text())
    assert info["codebase_version"] == "v3.0"
    assert (info["total_episodes"], info["total_frames"]) == (4, 20)
    table = parquet.read_table(out / "data/chunk-000/file-000.parquet")
    with Dataset(small_recording) as dataset:
        actions = np.concatenate([e.columns["actions"] for e in dataset])
    np.testing.assert_allclose(np.array(table["action"].to_pylist()), actions, 1e-6)
    assert table["frame_index"].to_pylist() == 4 * list(range(5))
    assert table["index"].to_pylist() == list(range(20))
    assert table["episode_index"].to_pylist() == [k for k in range(4) for _ in range(5)]
    times = np.array(table["timestamp"].to_pylist())
    np.testing.assert_allclose(times, 4 * [k / info["fps"] for k in range(5)])
    stats = json.loads((out / "meta/stats.json").read_text())["action"]
    for name in ("min", "max", "mean", "std"):
        expected = getattr(actions.astype(np.float32), name)(axis=0)
        np.testing.assert_allclose(stats[name], expected, rtol=1e-5)
    np.testing.assert_allclose(stats["q50"], np.median(actions, axis=0), rtol=1e-5)
    assert stats["count"] == [20]
    with pytest.raises(DatasetError, match="not empty"):
        convert(small_recording, out, "lerobot")


@pytest.mark.slow
def test_tasks_of_lerobots_layout_are_the_instructions_of_episodes(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    path, told = tmp_path / "sorted.hdf5", []
    env = DataCollection(wbc_suite.make("PickPlaceSingle", horizon=2), path)
    for seed in range(6):
        env.reset(seed=seed)
        told.append(env.unwrapped.instruction)
        for _ in range(2):
            env.step(env.unwrapped.hold_action)
    env.close()
    out = convert(path, tmp_path / "out", "lerobot")
    tasks = parquet.read_table(out / "meta/tasks.parquet").to_pydict()
    assert tasks["task"] == sorted({*told})
    assert len(tasks["task"]) > 2
    (episodes,) = out.glob("meta/episodes/*/*.parquet")
    rows = parquet.read_table(episodes).to_pylist()
    assert [row["tasks"] for row in rows] == [[words] for words in told]
    (frames,) = out.glob("data/*/*.parquet")
    table = parquet.read_table(frames).to_pydict()
    assert [tasks["task"][k] for k in table["task_index"]] == np.repeat(
        told, 2
    ).tolist()
    info = json.loads((out / "meta/info.json").read_text())
    assert info["total_tasks"] == len(tasks["task"])


def test_an_episode_in_lerobots_layout_is_a_span_of_its_film():
    """Without pyarrow, which the tests of files need."""
    piece = Piece(number=1002, names=("demo_7",), start=400, before=7)
    row = lerobot._episode_row(10.0, piece, 7, 30, 450, ["top_image"])
    film = "videos/observation.images.top"
    assert (row[f"{film}/from_timestamp"], row[f"{film}/to_timestamp"]) == (5.0, 8.0)
    assert (row["dataset_from_index"], row["dataset_to_index"]) == (450, 480)
    assert (row["data/chunk_index"], row["data/file_index"]) == (1, 2)


def test_lerobots_videos_have_a_frame_for_each_action(tmp_path):
    pytest.importorskip("pyarrow")
    av = pytest.importorskip("av")
    path = tmp_path / "a.hdf5"
    with Store(path, HEADER) as store:
        for seed in range(2):
            episode = make_episode(seed)
            seen = np.full((episode.length, 32, 48, 3), 100 * seed, dtype=np.uint8)
            columns = {**episode.columns, "obs/front_image": seen}
            store.add(replace(episode, columns=columns))
    out = convert(path, tmp_path / "out", "lerobot")
    (video,) = (out / "videos/observation.images.front").rglob("*.mp4")
    with av.open(str(video)) as file:
        frames = [frame.to_ndarray(format="rgb24") for frame in file.decode(video=0)]
    assert [frame.shape for frame in frames] == 10 * [(32, 48, 3)]
    brightness = [frame.mean() for frame in frames]
    np.testing.assert_allclose(brightness, 5 * [0.0] + 5 * [100.0], atol=8.0)  # lossy


def killed_once(item, folder):
    """Convert a piece; the first one kills its worker in the middle, the first time."""
    begun = folder / "begun"
    result = convert_piece(item, folder)
    if item.name.startswith("000000") and not begun.exists():
        begun.touch()
        written = next(folder.rglob("demo_*.npz"))
        written.with_name(f".{written.name}.1.tmp").touch()  # of one it was writing
        os.kill(os.getpid(), signal.SIGKILL)
    return result


class Killing(Processes):
    """Processes, one of which is killed."""

    def run(self, work, items, folder):
        return super().run(killed_once, items, folder)


@pytest.mark.slow
def test_converting_is_shared_out_and_stands_a_killed_worker(small_recording, tmp_path):
    told, alone, shared = [], tmp_path / "alone", tmp_path / "shared"
    convert(small_recording, alone, "npz")
    executor = Killing(2)
    convert(small_recording, shared, "npz", told.append, executor=executor, workers=2)
    assert told == [2, 2]
    assert not (tmp_path / "shared.work").exists()
    files = sorted(alone.iterdir())
    assert [file.name for file in sorted(shared.iterdir())] == [f.name for f in files]
    for file in files:
        assert (shared / file.name).read_bytes() == file.read_bytes()


@pytest.mark.parametrize("layout", ["robomimic", "mcap", "minari"])
def test_layouts_of_one_file_are_one_piece_of_work(small_recording, tmp_path, layout):
    told, alone, shared = [], tmp_path / "alone-v0", tmp_path / "shared-v0"
    convert(small_recording, alone, layout)
    convert(small_recording, shared, layout, told.append, executor=Serial(), workers=2)
    assert told == [4]
    if layout == "mcap":
        assert shared.read_bytes() == alone.read_bytes()
    elif layout == "robomimic":
        assert not any(f.problem for f in editing.verify(shared))
    else:
        names = [sorted(p.name for p in o.rglob("*")) for o in (alone, shared)]
        assert names[0] == names[1]


def test_converting_goes_on_where_it_was_stopped(small_recording, tmp_path):
    class Stopped(Serial):
        def run(self, work, items, folder):
            yield from super().run(work, items[:1], folder)
            raise KeyboardInterrupt

    out, told = tmp_path / "out", []
    with pytest.raises(KeyboardInterrupt):
        convert(small_recording, out, "npz", executor=Stopped(), workers=4)
    assert [path.name for path in out.iterdir()] == []
    (first,) = (tmp_path / "out.work/written/out").iterdir()
    written = first.stat().st_mtime_ns
    convert(small_recording, out, "npz", told.append, executor=Serial(), workers=4)
    assert told == [1, 1, 1, 1]
    assert sorted(path.name for path in out.iterdir()) == [
        f"demo_{k}.npz" for k in range(4)
    ]
    assert (out / first.name).stat().st_mtime_ns == written


def test_unknown_layouts_are_named(small_recording, tmp_path):
    with pytest.raises(UnknownNameError, match="Did you mean 'lerobot'"):
        convert(small_recording, tmp_path / "out", "lerobott")


@pytest.mark.slow
def test_extracting_sees_the_same_and_more(lift_recording, tmp_path):
    out = tmp_path / "out.hdf5"
    changes = {"camera_heights": 16, "camera_widths": 24, "reward_shaping": True}
    short = tmp_path / "short.hdf5"
    editing.filter_dataset(lift_recording, short, lambda _, name: name == "demo_1")
    assert extract(short, out, use_camera_obs=True, **changes) == 1
    with Dataset(lift_recording) as before, Dataset(out) as after:
        one, other = before.episode("demo_1"), after.episode("demo_1")
    assert other.columns["obs/agentview_image"].shape == (one.length, 16, 24, 3)
    assert np.ptp(other.columns["obs/agentview_image"]) > 50
    for key in ("cube_pos", "robot0_joint_pos", "robot0_eef_pos"):
        np.testing.assert_allclose(
            other.columns[f"obs/{key}"], one.columns[f"obs/{key}"], atol=1e-9
        )
    np.testing.assert_array_equal(one.columns["states"], other.columns["states"])
    assert other.columns["rewards"].max() > one.columns["rewards"].max()


@pytest.mark.slow
def test_extracting_is_shared_out_to_processes(lift_recording, tmp_path):
    told, path = [], tmp_path / "out.hdf5"
    count = extract(
        lift_recording,
        path,
        executor=Processes(2),
        workers=2,
        on_progress=told.append,
        reward_shaping=True,
    )
    assert (count, told) == (2, [1, 1])
    alone = tmp_path / "alone.hdf5"
    extract(lift_recording, alone, reward_shaping=True)
    with Dataset(path) as shared, Dataset(alone) as serial:
        assert shared.names == serial.names
        for one, other in zip(shared, serial, strict=True):
            assert one.columns.keys() == other.columns.keys()
            for name, column in one.columns.items():
                np.testing.assert_array_equal(column, other.columns[name])
    assert list(tmp_path.glob("out.hdf5.work")) == []


@pytest.mark.slow
@pytest.mark.parametrize("damage", [Path.unlink, lambda part: part.write_bytes(b"x")])
def test_a_damaged_work_folder_says_that_it_can_be_deleted(
    lift_recording, tmp_path, damage
):
    class Damaged(Serial):
        def run(self, work, items, folder):
            yield from super().run(work, items, folder)
            damage(folder / f"{items[-1].name}.hdf5")

    out, work = tmp_path / "out.hdf5", tmp_path / "out.hdf5.work"
    wanted = f"^Finished pieces in '{work}' are damaged. Delete this folder and run"
    with pytest.raises(DatasetError, match=wanted):
        extract(lift_recording, out, executor=Damaged(), workers=2)
    with pytest.raises(DatasetError, match=wanted):
        extract(lift_recording, out, executor=Serial(), workers=2)
    rmtree(work)
    assert extract(lift_recording, out, executor=Serial(), workers=2) == 2


ROBOSUITES_PART = {
    "type": "OSC_POSE",
    "input_max": 1,
    "input_min": -1,
    "output_max": [0.05, 0.05, 0.05, 0.5, 0.5, 0.5],
    "output_min": [-0.05, -0.05, -0.05, -0.5, -0.5, -0.5],
    "kp": 150,
    "damping_ratio": 1,
    "impedance_mode": "fixed",
    "input_type": "delta",
    "input_ref_frame": "base",
    "gripper": {"type": "GRIP"},
}


def robosuites_demonstrations(path, ours, **changes):
    """Write what robosuite's `collect_human_demonstrations.py` writes.

    Source of the layout: its documentation, "Human Demonstrations".
    """
    info = {
        "env_name": "Lift",
        "robots": ["Panda"],
        "controller_configs": {
            "type": "BASIC",
            "body_parts": {"right": ROBOSUITES_PART},
        },
        **changes,
    }
    size = motion_size(wbc_suite.make("Lift", robots="Panda").simulation.model)
    with h5py.File(ours) as recorded, h5py.File(path, "w") as file:
        data = file.create_group("data")
        data.attrs["date"] = "6-11-2025"
        data.attrs["time"] = "14:3:21"
        data.attrs["repository_version"] = "1.5.1"
        data.attrs["env"] = "Lift"
        data.attrs["env_info"] = json.dumps(info)
        for number, name in enumerate(recorded["data"], start=1):
            demo = data.create_group(f"demo_{number}")
            demo.attrs["model_file"] = '<mujoco model="base"><worldbody/></mujoco>'
            demo["states"] = recorded[f"data/{name}/states"][:, :size]
            demo["actions"] = recorded[f"data/{name}/actions"][()]
    return path


@pytest.mark.slow
def test_robosuites_own_demonstrations_are_imported(lift_recording, tmp_path):
    raw = robosuites_demonstrations(tmp_path / "demo.hdf5", lift_recording)
    with Dataset(raw) as dataset:
        assert dataset.names == ("demo_1", "demo_2")
        episode = dataset.episode("demo_1")
        env = rebuild(dataset)
        last = list(play_states(env, episode))[-1]
        assert last == episode.length - 1
        last = episode.columns["states"][-1]
        np.testing.assert_array_equal(env.physics_state[: len(last)], last)
        again = rebuild(dataset)
        figures = divergence(again, episode)  # open loop, by controllers of ours
    assert figures.steps == episode.length
    assert np.isfinite(figures.largest)
    seen = tmp_path / "seen.hdf5"
    assert extract(raw, seen) == 2
    with Dataset(seen) as dataset, Dataset(lift_recording) as recorded:
        for one, other in zip(dataset, recorded, strict=True):
            np.testing.assert_allclose(
                one.columns["obs/cube_pos"], other.columns["obs/cube_pos"], atol=1e-9
            )


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"robots": ["UR5e"]}, r"states of \d+ numbers, but those"),
        ({"robots": ["PandaX"]}, r"cannot be made here.*PandaX"),
        ({"robots": ["/etc/robot.xml"]}, "names a file"),
    ],
)
def test_what_cannot_be_imported_is_said(lift_recording, tmp_path, changes, words):
    raw = robosuites_demonstrations(tmp_path / "demo.hdf5", lift_recording, **changes)
    with Dataset(raw) as dataset, pytest.raises(DatasetError, match=words):
        list(play_states(rebuild(dataset), dataset.episode("demo_1")))


def test_states_of_another_robot_are_refused(small_recording):
    with Dataset(small_recording) as dataset:
        env = rebuild(dataset, robots="Panda")
        with pytest.raises(DatasetError, match="states of 4 numbers, but those"):
            list(play_states(env, dataset.episode("demo_0")))


@pytest.mark.parametrize("ours", [True, False])
def test_states_of_another_robot_with_as_many_joints_are_told(
    lift_recording, caplog, ours
):
    with Dataset(lift_recording) as dataset:
        env = rebuild(dataset)
        episode = dataset.episode("demo_1")
        facts = dict(episode.facts)
        facts["model_file"] = str(facts["model_file"]).replace('_joint2"', '_elbow"')
        if not ours:
            del facts["uid"]
        other = replace(episode, facts=facts)
        if ours:
            with pytest.raises(DatasetError, match=r"another robot.*'.*elbow' is '.*"):
                next(play_states(env, other))
        else:
            assert next(play_states(env, other)) == 0
            assert "elbow' is '" in caplog.text
        assert next(play_states(env, episode)) == 0


@pytest.mark.slow
def test_robomimics_environment_keeps_our_conventions(lift_recording, tmp_path):
    with Dataset(convert(lift_recording, tmp_path / "out.hdf5", "robomimic")) as found:
        fields = json.loads(found.header["env_args"])
    assert fields["type"] == 1
    assert fields["env_kwargs"]["conventions"] == "wbc_suite"
