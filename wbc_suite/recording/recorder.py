"""Recording of an environment: steps become episodes, kept or discarded."""

import hashlib
import json
import time
import uuid
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from wbc_suite.errors import DatasetError
from wbc_suite.recording.env_source import header_of
from wbc_suite.recording.episode import Episode, Fact, pieces
from wbc_suite.recording.episode_store import Store
from wbc_suite.recording.step_buffer import StepBuffer


class Recorder:
    """Records episodes of an environment of this package, wrapped or not.

    With `next_obs`, observations after each action are stored too. `succeeded` says
    whether the benchmark counts as solved at the last action. For the file see `Store`.
    Of an environment with `Disturbance`, actions are recorded as they were taken, and
    `intended` and `disturbed` beside them.

    Attributes:
        notes: Further facts of each episode.
    """

    def __init__(self, env: Any, path: str | Path, *, next_obs: bool = False) -> None:
        self._inner, self._next_obs = env.unwrapped, next_obs
        self._model_file = self._inner.scene_xml
        digest = hashlib.sha256(self._model_file.encode()).hexdigest()
        date = datetime.now(UTC).isoformat(timespec="seconds")
        header = header_of(env) | {"model_hash": digest, "date": date}
        self._store = Store(path, header)
        self._rows = StepBuffer(env, self._store.path.parent)
        self._facts: dict[str, Fact] | None = None
        self._clipped, self.succeeded = 0, False
        self.notes: dict[str, Fact] = {}

    @property
    def kept(self) -> int:
        """Episodes in the file."""
        return len(self._store)

    @property
    def recording(self) -> bool:
        """Whether an episode is in progress."""
        return self._facts is not None

    @property
    def length(self) -> int:
        """Actions of the episode in progress."""
        return len(self._rows)

    def begin(self) -> None:
        """Begin an episode, right after the environment's reset."""
        self.discard()
        state, placed = self._inner.beginning
        seed = self._inner.np_random_seed
        self._facts = {
            "uid": uuid.uuid4().hex,
            "began": datetime.now(UTC).isoformat(timespec="milliseconds"),
            "rng_state": json.dumps(state),
            "model_file": self._model_file,
            "instruction": self._inner.instruction,
            **self.notes,
        }
        if seed is not None and seed >= 0:
            self._facts["seed"] = int(seed)
        if placed is not None:
            self._facts["placed"] = json.dumps(placed.tolist())
        self._clipped, self.succeeded, self._began = 0, False, time.monotonic()
        self._rows.begin()

    def add(
        self,
        action: Any,
        observation: Mapping[str, Any],
        reward: float,
        *,
        done: bool,
        info: Mapping[str, Any],
        step_time: float,
    ) -> None:
        """Record a step that was taken; if the disk is full, the episode is lost."""
        success = bool(info.get("success", False))
        clipped = int(info.get("clipped", 0))
        stamp = time.monotonic() - self._began
        outcome = float(reward), int(done or success), clipped, step_time, stamp
        try:
            self._rows.add(info.get("executed", action), observation, outcome, info)
        except DatasetError:
            self.discard()
            raise
        self._clipped += clipped > 0
        self.succeeded = success

    def keep(self, success: bool | None = None) -> str | None:
        """End the episode and store it; return its name, or None if it has no steps.

        `success` is an operator's judgement; None for the benchmark's. An episode that
        cannot be stored stays in progress, and `keep` may be called again.
        """
        if self._facts is None or not len(self._rows):
            self.discard()
            return None
        columns, final_state = self._rows.columns(next_obs=self._next_obs)
        dones = np.concatenate([piece for _, piece in pieces(columns["dones"])])
        dones[-1] = 1
        facts = self._facts | {
            "success": self.succeeded if success is None else bool(success),
            "clipped_steps": self._clipped,
        }
        columns |= {"dones": dones}
        name = self._store.add(
            Episode(name="", columns=columns, facts=facts, final_state=final_state)
        )
        self.discard()
        return name

    def discard(self) -> None:
        """Discard the episode in progress."""
        self._facts = None
        self._rows.close()

    def undo(self) -> str | None:
        """Delete the last episode that was kept; return its name, or None."""
        return self._store.undo()

    def close(self) -> None:
        """Discard the episode in progress, and merge all episodes into one file."""
        self.discard()
        self._store.close()
