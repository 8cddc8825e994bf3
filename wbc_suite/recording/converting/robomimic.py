"""robomimic's HDF5 layout with its own columns only, for its training and roll-outs.

Observations are those of robosuite's interface, in which robomimic rolls out.
"""

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from wbc_suite.errors import DatasetError
from wbc_suite.recording.atomic_files import check_folder
from wbc_suite.recording.converting.layout import (
    Layout,
    Piece,
    Progress,
    policy_actions,
)
from wbc_suite.recording.dataset import Dataset
from wbc_suite.recording.env_source import PACKAGE, EnvSource
from wbc_suite.recording.episode import Episode, Fact
from wbc_suite.recording.hdf5_writer import write_dataset
from wbc_suite.sensing.proprioception import gripper_groups

ROBOSUITE_TYPE = 1
"""Type of robosuite's environments in robomimic's `env_args`."""

_OTHER_COLUMNS = ("clipped", "step_time", "stamp", "intended", "disturbed")
_OTHER_ARGUMENTS = ("terminate_on_success",)
_FACTS = ("model_file", "success", "seed", "uid")


def _write(dataset: Dataset, piece: Piece, out: Path, on_progress: Progress) -> None:
    """Write `demo_0`, ...; the last `next_obs` repeats `obs` if it was not recorded."""
    names = {name: f"demo_{k}" for k, name in enumerate(piece.names)}

    fingers = _fingers(dataset)

    def episodes() -> Iterator[Episode]:
        for episode in map(dataset.episode, piece.names):
            columns = {**episode.columns, **_finger_columns(episode, fingers)}
            yield _own_columns(replace(episode, columns=columns), names[episode.name])
            on_progress(1)

    masks = {
        key: [names[name] for name in masked if name in names]
        for key, masked in dataset.masks.items()
    }
    write_dataset(out, episodes(), _header(dataset.header), masks=masks)


def _header(header: Mapping[str, Fact]) -> dict[str, Fact]:
    """Return attributes with which robomimic makes the environment of robosuite's name.

    There, controllers, sites and signs are robosuite's by default; ours are named.
    """
    if "env_args" not in header:
        return dict(header)
    source = EnvSource.parse(str(header["env_args"]))
    if source.package != PACKAGE:
        return dict(header)
    given = source.arguments.items()
    arguments = {key: value for key, value in given if key not in _OTHER_ARGUMENTS}
    arguments["conventions"] = PACKAGE
    if "controller_config" in header:
        try:
            controllers = json.loads(str(header["controller_config"]))
        except (ValueError, RecursionError) as error:
            raise DatasetError(f"controller_config: not readable JSON: {error}") from (
                error
            )
        arguments["controller_configs"] = controllers
    fields = json.loads(replace(source, arguments=arguments).text)
    text = json.dumps(fields | {"type": ROBOSUITE_TYPE}, sort_keys=True)
    return {**header, "env_args": text}


def _fingers(dataset: Dataset) -> dict[str, list[int]]:
    """Return where `states` hold the joints of grippers, by keys of `obs`.

    robosuite observes all joints of a gripper, we those that are driven. Nothing is
    found where the environment cannot be made from the file.
    """
    first = dataset.episode(dataset.names[0])
    if "env_args" not in dataset.header or "states" not in first.columns:
        return {}
    source = EnvSource.parse(str(dataset.header["env_args"]))
    seen = [key for key in first.observed if key.endswith("gripper_qpos")]
    if source.package != PACKAGE or not seen:
        return {}
    env, found = source.build(), {}
    for state in env.simulation.robots:
        groups = gripper_groups(state.robot)
        for name, driven in groups.items():
            joints = tuple(
                joint.name
                for joint in state.robot.joints
                if (joint.mimic.joint if joint.mimic else joint.name) in driven
            )
            q, v = state.joint_addresses(joints)
            key = state.prefix + (name if len(groups) > 1 else "gripper")
            found[f"{key}_qpos"] = (1 + q).tolist()  # behind the time
            found[f"{key}_qvel"] = (1 + state.model.nq + v).tolist()
    env.close()
    return {key: places for key, places in found.items() if key in first.observed}


def _finger_columns(
    episode: Episode, fingers: Mapping[str, list[int]]
) -> dict[str, np.ndarray]:
    columns, states = {}, episode.columns.get("states")
    if states is not None and fingers:
        last = states[-1] if episode.final_state is None else episode.final_state
        after = np.concatenate([states[1:], last[None]])
        for key, places in fingers.items():
            columns[f"obs/{key}"] = states[:, places]
            columns[f"next_obs/{key}"] = after[:, places]
    return columns


def _own_columns(episode: Episode, name: str) -> Episode:
    columns = {n: c for n, c in episode.columns.items() if n not in _OTHER_COLUMNS}
    columns["actions"] = policy_actions(episode)
    if "obs/object-state" in columns:
        columns["obs/object"] = columns["obs/object-state"]
    for key in [n.removeprefix("obs/") for n in columns if n.startswith("obs/")]:
        before = columns[f"obs/{key}"]
        columns.setdefault(f"next_obs/{key}", np.concatenate([before[1:], before[-1:]]))
    facts = {n: f for n, f in episode.facts.items() if n in _FACTS}
    return replace(episode, name=name, columns=columns, facts=facts, final_state=None)


LAYOUT = Layout(begin=lambda out: check_folder(out.parent), write=_write)
