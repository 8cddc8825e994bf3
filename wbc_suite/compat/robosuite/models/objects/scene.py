"""Objects of our benchmarks, as robosuite's scripts see them."""

from typing import Any

import numpy as np

from wbc_suite.compat.robosuite.models.base import MujocoModel
from wbc_suite.scene.objects import ObjectState


class TaskObject(MujocoModel):
    """An object in a scene of ours; its names are those of the scene."""

    def __init__(self, state: ObjectState) -> None:
        self._state = state
        self.name = state.name

    @property
    def root_body(self) -> str:
        """Name of its body, robosuite's."""
        return f"{self.name}_main"

    @property
    def joints(self) -> list[str]:
        """Names of its joints, robosuite's."""
        count = int(self._state.model.body_jntnum[self._state.body])
        return [f"{self.name}_joint{k}" for k in range(count)]

    @property
    def contact_geoms(self) -> list[str]:
        """Names of its geoms that collide."""
        return [self._state.model.geom(g).name for g in sorted(self._state.geoms)]

    @property
    def horizontal_radius(self) -> Any:  # pyright: ignore[reportIncompatibleVariableOverride] - measured
        """Radius of its upright bounding cylinder, m."""
        return self._state.extent().radius

    @property
    def bottom_offset(self) -> Any:  # pyright: ignore[reportIncompatibleVariableOverride] - measured
        """Its lowest point when it stands upright, from its origin, m."""
        return np.array([0.0, 0.0, -self._state.extent().bottom])

    @property
    def top_offset(self) -> Any:  # pyright: ignore[reportIncompatibleVariableOverride] - measured
        """Its highest point when it stands upright, from its origin, m."""
        return np.array([0.0, 0.0, self._state.extent().top])

    @property
    def sites(self) -> list[str]:
        """Names of its sites."""
        model = self._state.model
        return [
            model.site(i).name
            for i in range(model.nsite)
            if model.site_bodyid[i] == self._state.body
        ]
