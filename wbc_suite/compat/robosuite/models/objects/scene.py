"""Objects of our benchmarks, as robosuite's scripts see them."""

from typing import Any

from wbc_suite.compat.robosuite.models.base import MujocoModel
from wbc_suite.scene.objects import ObjectState


class TaskObject(MujocoModel):
    """An object in a scene of ours; its names are those of the scene."""

    def __init__(self, state: ObjectState) -> None:
        self._state = state
        self.name = state.name

    @property
    def root_body(self) -> str:
        """Name of its body."""
        return self.name

    @property
    def joints(self) -> list[str]:
        """Names of its joints."""
        body = self._state.model.body(self._state.body)
        first = int(body.jntadr[0])
        return [
            self._state.model.joint(first + k).name for k in range(int(body.jntnum[0]))
        ]

    @property
    def contact_geoms(self) -> list[str]:
        """Names of its geoms that collide."""
        return [self._state.model.geom(g).name for g in sorted(self._state.geoms)]

    @property
    def horizontal_radius(self) -> Any:  # pyright: ignore[reportIncompatibleVariableOverride] - measured
        """Radius of its upright bounding cylinder, m."""
        return self._state.extent().radius

    @property
    def sites(self) -> list[str]:
        """Names of its sites."""
        model = self._state.model
        return [
            model.site(i).name
            for i in range(model.nsite)
            if model.site_bodyid[i] == self._state.body
        ]
