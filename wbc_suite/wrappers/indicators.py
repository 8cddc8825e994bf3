"""Visual marks in pictures, without physics."""

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import ArrayLike, NDArray

from wbc_suite.envs import RobotEnv
from wbc_suite.errors import ConfigError


class Indicators(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Draws a disc into `render`'s pictures at each hand and at chosen places.

    The environment has `render_mode="rgb_array"`; its observed pictures have no marks.
    `places` are places in the world and colours, by name, and may be changed.
    """

    def __init__(self, env: gymnasium.Env[Any, Any], *, radius: float = 0.012) -> None:
        super().__init__(env)
        inner = env.unwrapped
        if not isinstance(inner, RobotEnv) or inner.render_mode != "rgb_array":
            raise ConfigError("Indicators need a RobotEnv in mode rgb_array.")
        self._inner, self._radius = inner, radius
        self.places: dict[str, tuple[ArrayLike, Sequence[int]]] = {}

    def render(self) -> Any:
        """Return a picture with marks."""
        picture = np.array(self.env.render())
        height, width = picture.shape[:2]
        view = self._inner.cameras.projection(
            self._inner.config.render_camera, width=width, height=height
        )
        for place, color in (self._hands() | self.places).values():
            (u, v), depth = view.to_pixels(place)
            if depth > 0.0:
                radius = max(1.5, self._radius * view.K[0, 0] / float(depth))
                _disc(picture, float(u), float(v), radius, color)
        return picture

    def _hands(self) -> dict[str, tuple[ArrayLike, Sequence[int]]]:
        data = self._inner.simulation.data
        marks: dict[str, tuple[ArrayLike, Sequence[int]]] = {}
        for state in self._inner.simulation.robots:
            for side, frame in state.robot.hands.items():
                place = data.site(state.prefix + frame).xpos.copy()
                marks[state.prefix + side] = (place, (40, 200, 90))
        return marks


def _disc(
    picture: NDArray[Any], u: float, v: float, radius: float, color: Sequence[int]
) -> None:
    rows, columns = np.ogrid[: picture.shape[0], : picture.shape[1]]
    inside = (columns - u) ** 2 + (rows - v) ** 2 <= radius**2
    picture[inside] = 0.4 * picture[inside] + 0.6 * np.asarray(color)
