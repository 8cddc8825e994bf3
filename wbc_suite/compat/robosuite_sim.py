"""`env.sim` and `env.robots` under robosuite's names."""

import re
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from wbc_suite.control import CompositeController, RobotState
from wbc_suite.envs import RobotEnv
from wbc_suite.envs.states import write_physics
from wbc_suite.errors import UnknownNameError
from wbc_suite.typing import Array, Indices, Vector

KINDS = "body|joint|geom|site|light|camera|actuator|sensor|tendon|mesh"
_OF_MODEL = re.compile(rf"({KINDS})_(name2id|id2name|names)")
_COUNTS = {"joint": "jnt", "camera": "cam", "actuator": "u"}
_OF_DATA = re.compile(r"get_(body|geom|site|camera|joint)_(\w+)")


class Model:
    """MuJoCo's model (`_model`), its names (`site_name2id`, ...), and its text."""

    def __init__(self, env: RobotEnv) -> None:
        self._env = env

    def __getattr__(self, name: str) -> Any:
        found = _OF_MODEL.fullmatch(name)
        model = self._env.simulation.model
        if found is None:
            return model if name == "_model" else getattr(model, name)
        names = _names(model, found[1])
        if found[2] == "names":
            return names
        if found[2] == "id2name":
            return lambda index: names[index]
        return lambda name: _index(found[1], name, names)

    def get_xml(self) -> str:
        """Return the scene as MJCF text."""
        return self._env.scene_xml


class Data:
    """MuJoCo's state (`_data`), and its arrays by name: `get_site_xpos`, ..."""

    def __init__(self, env: RobotEnv) -> None:
        object.__setattr__(self, "_env", env)

    def __getattr__(self, name: str) -> Any:
        found = _OF_DATA.fullmatch(name)
        if found is None:
            data = self._env.simulation.data
            return data if name == "_data" else getattr(data, name)
        kind, column = found.groups()
        return lambda name: np.array(self._view(kind, name, column))

    def __setattr__(self, name: str, value: Any) -> None:
        setattr(self._env.simulation.data, name, value)

    def set_joint_qpos(self, name: str, value: Any) -> None:
        """Write a joint's position."""
        self._view("joint", name, "qpos")[:] = value

    def set_joint_qvel(self, name: str, value: Any) -> None:
        """Write a joint's velocity."""
        self._view("joint", name, "qvel")[:] = value

    def _view(self, kind: str, name: str, column: str) -> Any:
        simulation = self._env.simulation
        _index(kind, name, _names(simulation.model, kind))
        found: Any = getattr(getattr(simulation.data, kind)(name), column)
        return found.reshape(3, 3) if column.endswith("mat") else found


class Sim:
    """The simulation of one environment; `forward` computes what depends on a state."""

    def __init__(self, env: RobotEnv) -> None:
        self._env, self.model, self.data = env, Model(env), Data(env)
        self.forward = env.simulation.forward

    def get_state(self) -> SimpleNamespace:
        """Return the physics state; `flatten()` gives time, qpos and qvel."""
        state = self._env.physics_state
        return SimpleNamespace(flatten=lambda: state)

    def set_state_from_flattened(self, values: Vector) -> None:
        """Write a physics state; controllers start from there."""
        simulation = self._env.simulation
        write_physics(simulation.model, simulation.data, values)
        simulation.start()

    def reset(self) -> None:
        """Do nothing: scripts write a state after it."""

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
        distance = cameras.depth(camera_name, **view)[::-1, :, 0]
        return picture, self.opengl_depth(distance)

    def opengl_depth(self, distance: Array) -> Array:
        """Return distances from a camera, m, as OpenGL's depths, 0 to 1."""
        model = self._env.simulation.model
        near, far = model.vis.map.znear, model.vis.map.zfar
        scaled = np.maximum(distance / model.stat.extent, near)
        return (1.0 - near / scaled) / (1.0 - near / far)


def _names(model: mujoco.MjModel, kind: str) -> tuple[str, ...]:
    count = getattr(model, f"n{_COUNTS.get(kind, kind)}")
    return tuple(getattr(model, kind)(i).name for i in range(count))


def _index(kind: str, name: str, names: tuple[str, ...]) -> int:
    if name not in names:
        raise UnknownNameError(kind, name, [known for known in names if known])
    return names.index(name)


class RobotView:
    """One robot; other attributes are those of its description.

    Attributes:
        robot_model: Its `name`, and `naming_prefix` of its names in the scene.
        composite_controller: Its controller.
        arms: `right`, `left`, or the names of its hands.
        gripper: The gripper of each arm; `dof` is its number of action values.
        action_dim: Length of this robot's part of an action.
        is_mobile: Whether the robot has a moving base.
    """

    def __init__(self, state: RobotState, controller: CompositeController) -> None:
        robot, layout = state.robot, controller.layout
        self._state = state
        self.name = robot.name
        self.robot_model = SimpleNamespace(name=robot.name, naming_prefix=state.prefix)
        self.composite_controller, self.action_dim = controller, layout.size
        self.is_mobile = robot.root.kind != "fixed"
        self.arms = tuple(robot.hands)
        sizes = {part.name: part.stop - part.start for part in layout.slices}
        self.gripper = {
            arm: SimpleNamespace(dof=sizes.get(f"{arm}_gripper", 0))
            for arm in self.arms
        }

    def __getattr__(self, name: str) -> Any:
        return getattr(self._state.robot, name)

    @property
    def action_limits(self) -> tuple[Vector, Vector]:
        """Least and greatest values of this robot's part of an action."""
        layout = self.composite_controller.layout
        return layout.low.copy(), layout.high.copy()

    @property
    def _action_split_indexes(self) -> dict[str, tuple[int, int]]:
        """Begin and end of each part of the action."""
        slices = self.composite_controller.layout.slices
        return {part.name: (part.start, part.stop) for part in slices}

    @property
    def _ref_joint_pos_indexes(self) -> Indices:
        """Indices of the robot's joints in qpos, without grippers."""
        robot, model = self._state.robot, self._state.model
        groups = [name for name in robot.groups if not name.endswith("gripper")]
        joints = [joint for group in groups for joint in robot.groups[group]]
        places = [model.joint(self._state.prefix + j).qposadr[0] for j in joints]
        return np.array(places, dtype=np.int64)

    def create_action_vector(self, parts: Mapping[str, ArrayLike]) -> Vector:
        """Return an action from values of parts, and zeros for the others."""
        layout = self.composite_controller.layout
        return layout.pack(parts, base=np.zeros(layout.size))
