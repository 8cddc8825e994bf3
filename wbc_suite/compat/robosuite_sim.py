"""`env.sim` under robosuite's names: model, data, states in one vector, pictures."""

import re
from typing import Any

import mujoco
import numpy as np

from wbc_suite.envs import RobotEnv
from wbc_suite.envs.states import write_physics
from wbc_suite.errors import UnknownNameError
from wbc_suite.typing import Vector

__all__ = ["Sim"]

KINDS = "body|joint|geom|site|light|camera|actuator|sensor|tendon|mesh"
_OF_MODEL = re.compile(rf"({KINDS})_(name2id|id2name|names)")
_COUNTS = {"joint": "jnt", "camera": "cam", "actuator": "u"}
_OF_DATA = re.compile(r"get_(body|geom|site|camera|joint)_(\w+)")


class FlatState:
    """A physics state."""

    def __init__(self, values: Vector) -> None:
        self._values = values

    def flatten(self) -> Vector:
        """Return time, qpos and qvel in one vector."""
        return self._values


class Model:
    """MuJoCo's model, its names (`site_name2id`, `camera_names`, ...), and its text."""

    def __init__(self, env: RobotEnv) -> None:
        self._env = env

    def __getattr__(self, name: str) -> Any:
        found = _OF_MODEL.fullmatch(name)
        if found is None:
            return getattr(self._model, name)
        names = _names(self._model, found[1])
        if found[2] == "names":
            return names
        if found[2] == "id2name":
            return lambda index: names[index]
        return lambda name: _index(found[1], name, names)

    @property
    def _model(self) -> mujoco.MjModel:
        """MuJoCo's own."""
        return self._env.simulation.model

    def get_xml(self) -> str:
        """Return the scene as MJCF text."""
        return self._env.scene_xml


class Data:
    """MuJoCo's state, and what of it belongs to a name: `get_site_xpos`, ..."""

    def __init__(self, env: RobotEnv) -> None:
        object.__setattr__(self, "_env", env)

    def __getattr__(self, name: str) -> Any:
        found = _OF_DATA.fullmatch(name)
        if found is None:
            return getattr(self._data, name)
        kind, column = found.groups()
        return lambda name: np.array(self._view(kind, name, column))

    def __setattr__(self, name: str, value: Any) -> None:
        setattr(self._data, name, value)

    @property
    def _data(self) -> mujoco.MjData:
        """MuJoCo's own."""
        return self._env.simulation.data

    def set_joint_qpos(self, name: str, value: Any) -> None:
        """Write a joint's position."""
        self._view("joint", name, "qpos")[:] = value

    def set_joint_qvel(self, name: str, value: Any) -> None:
        """Write a joint's velocity."""
        self._view("joint", name, "qvel")[:] = value

    def _view(self, kind: str, name: str, column: str) -> Any:
        _index(kind, name, _names(self._env.simulation.model, kind))
        found: Any = getattr(getattr(self._data, kind)(name), column)
        return found.reshape(3, 3) if column.endswith("mat") else found


class Sim:
    """The simulation of one environment.

    Attributes:
        model: The scene.
        data: Its state.
    """

    def __init__(self, env: RobotEnv) -> None:
        self._env, self.model, self.data = env, Model(env), Data(env)

    def get_state(self) -> FlatState:
        """Return the physics state."""
        return FlatState(self._env.physics_state)

    def set_state_from_flattened(self, values: Vector) -> None:
        """Write a physics state; controllers start from there."""
        model, data = self._env.simulation.model, self._env.simulation.data
        write_physics(model, data, values)
        self._env.simulation.start()

    def forward(self) -> None:
        """Compute what follows from the state."""
        self._env.simulation.forward()

    def reset(self) -> None:
        """Do nothing: what follows writes a state."""

    def look(self) -> dict[str, Any]:
        """Return what is seen of the state as it is now."""
        self._env.observables.look()
        return self._env.observation()

    def render(
        self,
        width: int | None = 256,
        height: int | None = 256,
        *,
        camera_name: str = "agentview",
        depth: bool = False,
        segmentation: bool = False,
    ) -> Any:
        """Return a picture, upside down as OpenGL has it; with depth, both (0 to 1)."""
        view = {"width": width or 256, "height": height or 256}
        cameras = self._env.cameras
        if segmentation:
            return cameras.segmentation(camera_name, level="element", **view)[::-1]
        picture = cameras.image(camera_name, **view)[::-1]
        if not depth:
            return picture
        model = self._env.simulation.model
        near, far = (
            getattr(model.vis.map, plane) * model.stat.extent
            for plane in ("znear", "zfar")
        )
        distance = np.maximum(cameras.depth(camera_name, **view)[::-1, :, 0], near)
        return picture, ((1.0 - near / distance) / (1.0 - near / far))


def _names(model: mujoco.MjModel, kind: str) -> tuple[str, ...]:
    count = getattr(model, f"n{_COUNTS.get(kind, kind)}")
    return tuple(getattr(model, kind)(i).name for i in range(count))


def _index(kind: str, name: str, names: tuple[str, ...]) -> int:
    if name not in names:
        raise UnknownNameError(kind, name, [known for known in names if known])
    return names.index(name)
