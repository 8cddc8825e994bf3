"""Load a dataset with its layout's own package, and print its content as JSON.

    python datasets_side.py minari|mcap|robomimic|lerobot PATH

Runs in `.venv-clients`, and imports nothing of ours.
"""

import json
import os
import sys
from pathlib import Path

import numpy as np


def digest(array):
    return float(np.asarray(array, dtype=np.float64).sum())


def read_minari(path):
    os.environ["MINARI_DATASETS_PATH"] = str(path.parent)
    import minari

    dataset = minari.load_dataset(path.name)
    for episode in dataset:
        assert episode.observations["cube_pos"].shape == (len(episode) + 1, 3)
        assert dataset.action_space.contains(episode.actions[0].astype(np.float32))
        assert episode.infos["states"].shape[0] == len(episode) + 1
    sampled = dataset.sample_episodes(1)
    assert len(sampled) == 1
    return {
        "lengths": [len(e) for e in dataset],
        "actions": [digest(e.actions) for e in dataset],
        "cube": [digest(e.observations["cube_pos"][:-1]) for e in dataset],
        "ended": [bool(e.terminations[-1]) for e in dataset],
        "environment": dataset.env_spec.id,
    }


def read_mcap(path):
    from mcap.reader import make_reader

    lengths, actions, cube, pictures, ended, times = [], [], [], [], [], []
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary.statistics.chunk_count >= 1
        counted = 0
        for schema, channel, message in reader.iter_messages():
            told = json.loads(message.data)
            counted += 1
            times.append(message.log_time)
            assert set(told) <= set(json.loads(schema.data)["properties"])
            match channel.topic:
                case "/episode":
                    lengths.append(told["length"])
                    ended.append(told["success"])
                    actions.append(0.0)
                    cube.append(0.0)
                    pictures.append(0)
                case "/actions":
                    actions[-1] += digest(told["data"])
                case "/obs/cube_pos":
                    cube[-1] += digest(told["data"])
                case "/obs/agentview_image":
                    pictures[-1] += told["format"] == "png"
        assert times == sorted(times)
        assert counted == summary.statistics.message_count
        one = list(reader.iter_messages(topics=["/actions"]))
        assert len(one) == sum(lengths)
        late = list(reader.iter_messages(starting_at=times[-1]))
        assert 1 <= len(late) < counted
        header = next(dict(m.metadata) for m in reader.iter_metadata())
    name = json.loads(header["env_args"])["env_name"]
    return {
        "lengths": lengths, "actions": actions, "cube": cube, "ended": ended,
        "environment": name, "pictures": pictures,
    }  # fmt: skip


def read_robomimic(path):
    import h5py
    import robomimic.utils.file_utils as file_utils
    import robomimic.utils.obs_utils as obs_utils
    from robomimic.utils.dataset import SequenceDataset
    from torch.utils.data import DataLoader

    with h5py.File(path) as file:
        has_next = "data/demo_0/next_obs" in file
        shapes = {key: obs.shape[1:] for key, obs in file["data/demo_0/obs"].items()}
    low_dim = [key for key, shape in shapes.items() if len(shape) == 1]
    pictures = [key for key, shape in shapes.items() if len(shape) == 3]
    obs_utils.initialize_obs_utils_with_obs_specs(
        {"obs": {"low_dim": low_dim, "rgb": pictures}}
    )
    keys = [*low_dim, *pictures]
    dataset = SequenceDataset(
        hdf5_path=str(path),
        obs_keys=keys,
        dataset_keys=("actions", "rewards", "dones"),
        frame_stack=1,
        seq_length=5,
        pad_seq_length=True,
        pad_frame_stack=True,
        load_next_obs=has_next,
        hdf5_cache_mode=None,
    )
    meta = file_utils.get_env_metadata_from_dataset(str(path))
    told = file_utils.get_shape_metadata_from_dataset(str(path), all_obs_keys=keys)
    batch = next(iter(DataLoader(dataset, batch_size=4)))
    assert tuple(batch["actions"].shape) == (4, 5, told["ac_dim"])
    for key in keys:
        assert tuple(batch["obs"][key].shape) == (4, 5, *shapes[key])
    whole = [dataset.get_trajectory_at_index(k) for k in range(dataset.n_demos)]
    return {
        "lengths": [len(t["actions"]) for t in whole],
        "actions": [digest(t["actions"]) for t in whole],
        "observations": {
            key: [digest(t["obs"][key]) for t in whole] for key in low_dim
        },
        "ended": [bool(t["dones"][-1]) for t in whole],
        "environment": meta["env_name"],
        "items": len(dataset),
    }


def read_lerobot(path):
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    dataset = LeRobotDataset("local/recording", root=path, video_backend="pyav")
    lengths, actions, pictures = [], [], []
    cameras = dataset.meta.camera_keys
    for k in range(dataset.num_frames):
        row = dataset[k]
        if int(row["frame_index"]) == 0:
            lengths.append(0)
            actions.append(0.0)
            pictures += [row[camera].numpy().tolist() for camera in cameras]
        lengths[-1] += 1
        actions[-1] += digest(row["action"])
    stats = [np.mean(dataset.meta.stats[camera]["mean"]) for camera in cameras]
    return {
        "lengths": lengths,
        "actions": actions,
        "pictures": pictures,
        "tasks": list(dataset.meta.tasks.index),
        "means": [float(mean) for mean in stats],
    }


if __name__ == "__main__":
    kind, place = sys.argv[1:]
    readers = {
        "minari": read_minari,
        "mcap": read_mcap,
        "robomimic": read_robomimic,
        "lerobot": read_lerobot,
    }
    print(json.dumps(readers[kind](Path(place))))
