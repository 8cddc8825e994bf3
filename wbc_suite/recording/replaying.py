"""Replay of episodes by their states or by their actions."""

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any

import numpy as np

from wbc_suite import logs
from wbc_suite.envs import RobotEnv
from wbc_suite.envs.states import motion_size
from wbc_suite.errors import ConfigError, DatasetError, WbcError
from wbc_suite.recording.episode import Episode
from wbc_suite.typing import Vector

log = logs.logger(__name__)

_JOINT = re.compile(r'<(?:free)?joint\b[^<>]*?\bname="([^"<>]{1,200})"')


@dataclass(frozen=True, kw_only=True, slots=True)
class Divergence:
    """Difference of a replay by actions from the recording."""

    steps: int  # actions played
    largest: float  # of time, qpos and qvel; s, m, rad, m/s, rad/s
    first: int | None  # action with the first difference after it; None without any
    success: bool  # at the end of the replay

    @property
    def exact(self) -> bool:
        """Whether every bit of time, qpos and qvel is as it was recorded."""
        return self.first is None


def start_as(env: RobotEnv, episode: Episode) -> None:
    """Reset the environment to the start of a recorded episode.

    With the recorded state of the random generator the start is equal to the bit, sizes
    of objects included. Without it, the first state is restored. Raises DatasetError if
    the state, or the names of joints, do not fit the environment.
    """
    if "states" not in episode.columns or not episode.length:
        raise DatasetError(f"'{episode.name}' has no states to start from.")
    state = episode.columns["states"][0]
    try:
        env.check_state(state)
    except ConfigError as error:
        raise DatasetError(
            f"'{episode.name}' has states of {state.size} numbers, but those of this "
            f"environment are others: {error}"
        ) from error
    _check_joints(env, episode)
    generator = episode.facts.get("rng_state")
    try:
        if generator is None:
            env.reset_to(state)
        else:
            placed = json.loads(str(episode.facts.get("placed", "null")))
            drawn = json.loads(str(generator)[:2000])
            if not isinstance(drawn, dict) or drawn.get("bit_generator") != "PCG64":
                raise ValueError("its random generator is not the one used here")
            env.begin_at(drawn, placed)
    except (ValueError, TypeError, KeyError, OverflowError, RecursionError) as error:
        raise DatasetError(f"'{episode.name}' has no usable start: {error}") from error
    except WbcError as error:
        raise DatasetError(f"'{episode.name}' cannot start here: {error}") from error


def play_states(env: RobotEnv, episode: Episode) -> Iterator[int]:
    """Set the simulation to every recorded state; yield the number of each."""
    start_as(env, episode)
    last = () if episode.final_state is None else (episode.final_state,)
    for k, state in enumerate((*episode.columns["states"], *last)):
        env.show_state(state)
        yield k


def play_actions(
    env: RobotEnv, episode: Episode
) -> Iterator[tuple[int, Vector, dict[str, Any]]]:
    """Apply the actions; yield number, difference after it, and `info`.

    The difference from the recording is that of time, qpos and qvel.
    """
    start_as(env, episode)
    size = motion_size(env.simulation.model)
    states, actions = episode.columns["states"], episode.columns["actions"]
    if actions.shape[1] != env.action_layout.size:
        raise DatasetError(
            f"'{episode.name}' has actions of {actions.shape[1]} numbers, but those of "
            f"this environment have {env.action_layout.size}: it can be replayed by "
            "states only."
        )
    for k, action in enumerate(actions):
        *_, info = env.advance(action)
        after = states[k + 1] if k + 1 < len(states) else episode.final_state
        now = env.physics_state[:size]
        yield k, now - (now if after is None else after[:size]), info
        if "physics_error" in info:
            return


def divergence(env: RobotEnv, episode: Episode) -> Divergence:
    """Replay an episode by its actions, and compare it with the recording."""
    largest, first, steps, success = 0.0, None, 0, False
    for k, difference, info in play_actions(env, episode):
        worst = float(np.abs(difference).max())
        largest, steps = max(largest, worst), k + 1
        success = bool(info.get("success", False))
        if worst > 0.0 and first is None:
            first = k
    return Divergence(steps=steps, largest=largest, first=first, success=success)


def _check_joints(env: RobotEnv, episode: Episode) -> None:
    """Refuse states of another robot with the same number of joints."""
    mjcf = str(episode.facts.get("model_file", ""))  # untrusted, and not parsed
    world = mjcf[mjcf.find("<worldbody") : mjcf.rfind("</worldbody>") + 1]
    recorded = _JOINT.findall(world)
    model = env.simulation.model
    here = [model.joint(number).name for number in range(model.njnt)]
    if not recorded or recorded == here:
        return
    pairs = zip_longest(recorded, here, fillvalue="nothing")
    differing = [f"'{one}' is '{other}' here" for one, other in pairs if one != other]
    words = f"{len(differing)} joints have other names: {', '.join(differing[:3])}"
    if "uid" in episode.facts:  # of this package
        raise DatasetError(
            f"'{episode.name}' was recorded with another robot or objects, though its "
            f"states have the same size; {words}."
        )
    log.warning("'%s': %s; states are taken in order", episode.name, words)
