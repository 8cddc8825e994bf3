"""Recording of episodes into a folder, in robosuite's layout."""

import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from wbc_suite.compat.robosuite.wrappers.plain import Wrapper


class DataCollectionWrapper(Wrapper):
    """Writes a folder for each episode: `model.xml`, `ep_meta.json`, `state_*.npz`.

    A state file holds `states` (of `flatten`), `action_infos`, whether the task was
    `successful` in one of its steps, and `env`.
    """

    def __init__(
        self, env: Any, directory: str, collect_freq: int = 1, flush_freq: int = 100
    ) -> None:
        super().__init__(env)
        self.directory = directory
        self.collect_freq, self.flush_freq = collect_freq, flush_freq
        self.states: list[Any] = []
        self.action_infos: list[dict[str, Any]] = []
        self.successful, self.has_interaction, self.t = False, False, 0
        self.ep_directory: str | None = None

    def reset(self) -> Any:
        """Write what is left, and start an episode."""
        self._flush()
        self.has_interaction, self.t = False, 0
        return self.env.reset()

    def step(self, action: Any) -> Any:
        """Advance one control period and record it."""
        if not self.has_interaction:
            self._begin()
        if self.t % self.collect_freq == 0:
            self.states.append(self.env.sim.get_state().flatten())
            self.action_infos.append({"actions": np.array(action)})
        self.t += 1
        result = self.env.step(action)
        self.successful = self.successful or bool(self.env._check_success())
        if self.t % self.flush_freq == 0:
            self._flush()
        return result

    def _begin(self) -> None:
        """Make the episode's folder, and start from the state that it tells."""
        self.has_interaction = True
        stamp = str(time.time()).replace(".", "_")
        folder = Path(self.directory) / f"ep_{stamp}"
        folder.mkdir(parents=True)
        (folder / "model.xml").write_text(self.env.sim.model.get_xml())
        (folder / "ep_meta.json").write_text(json.dumps(self.env.get_ep_meta()))
        self.ep_directory = str(folder)

    def _flush(self) -> None:
        """Write the steps since the last time."""
        if not self.states or self.ep_directory is None:
            return
        stamp = str(time.time()).replace(".", "_")
        np.savez(
            Path(self.ep_directory) / f"state_{stamp}.npz",
            states=np.array(self.states),
            action_infos=np.array(self.action_infos),
            successful=self.successful,
            env=self.env.unwrapped.name,
        )
        self.states, self.action_infos, self.successful = [], [], False

    def close(self) -> None:
        """Write what is left, and close the environment."""
        self._flush()
        self.env.close()
