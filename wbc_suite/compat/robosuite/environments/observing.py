"""What environments do with their observations."""

from collections import OrderedDict
from typing import Any

import numpy as np

from wbc_suite.compat.robosuite.utils.observables import MODIFIERS, Observable
from wbc_suite.errors import ConfigError, UnknownNameError

Observation = OrderedDict[str, Any]


class Observing:
    """Samples the observations of an environment and hands them out."""

    env: Any
    control_freq: float
    model_timestep: float
    _observables: dict[str, Observable]

    def _reset_observables(self) -> None:
        for observable in self._observables.values():
            observable.reset()

    def _update_observables(self, force: bool = False) -> None:
        """Sample what is due after one physics step, or everything."""
        self._obs_cache = {}
        self.env.observables.forget_pictures()
        for observable in self._observables.values():
            observable.update(self.model_timestep, self._obs_cache, force)

    def follows_physics(self) -> bool:
        """Whether an observation is sampled otherwise than once in a control period."""
        return not all(
            observable.is_plain_at(self.control_freq)
            for observable in self._observables.values()
            if observable.is_enabled()
        )

    def _get_observations(self, force_update: bool = False) -> Observation:
        """Return what is enabled and active, and each modality in one vector."""
        if force_update or not self.follows_physics():
            self._update_observables(force=True)
        found: Observation = OrderedDict()
        groups: dict[str, list[Any]] = {}
        for name, observable in self._observables.items():
            if observable.is_enabled() and observable.is_active():
                found[name] = observable.obs
                if not observable.modality.startswith("image"):
                    parts = groups.setdefault(observable.modality, [])
                    parts.append(np.ravel(observable.obs))
        for modality, parts in groups.items():
            found[f"{modality}-state"] = np.concatenate(parts)
        return found

    def observation_spec(self) -> Observation:
        """Return an example of the observations."""
        return self._get_observations(force_update=True)

    def add_observable(self, observable: Observable) -> None:
        """Add an observation with a new name.

        Raises:
            ConfigError: If the name is taken.
        """
        if observable.name in self._observables:
            raise ConfigError(f"There is an observable '{observable.name}' already.")
        self._observables[observable.name] = observable

    def modify_observable(
        self, observable_name: str, attribute: str, modifier: Any
    ) -> None:
        """Change an observation: its sensor, corrupter, filter, delayer, ...

        Raises:
            UnknownNameError: If there is no such observation, or no such attribute.
        """
        if observable_name not in self._observables:
            known = self._observables
            raise UnknownNameError("observable", observable_name, known)
        if attribute not in MODIFIERS:
            raise UnknownNameError("attribute", attribute, MODIFIERS)
        getattr(self._observables[observable_name], f"set_{attribute}")(modifier)

    @property
    def observation_names(self) -> set[str]:
        """Names of all observations."""
        return set(self._observables)

    @property
    def observation_modalities(self) -> set[str]:
        """Modalities of all observations."""
        return {observable.modality for observable in self._observables.values()}

    @property
    def enabled_observables(self) -> set[str]:
        """Names of the observations that are sampled."""
        return {n for n, o in self._observables.items() if o.is_enabled()}

    @property
    def active_observables(self) -> set[str]:
        """Names of the observations that are returned."""
        return {n for n, o in self._observables.items() if o.is_active()}
