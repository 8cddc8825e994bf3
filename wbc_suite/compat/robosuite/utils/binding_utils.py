"""`sim`: model, data and state of a simulation under robosuite's names."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from wbc_suite.arguments import check_array
from wbc_suite.compat.robosuite.forwarding import does_nothing
from wbc_suite.envs.states import motion_size, write_physics
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.files import check_file
from wbc_suite.typing import Array, Vector

KINDS = "body|joint|geom|site|light|camera|actuator|sensor|tendon|mesh"
_OF_MODEL = re.compile(rf"_?({KINDS})_(name2id|id2name|names)")
_COUNTS = {"joint": "jnt", "camera": "cam", "actuator": "u"}
_OF_DATA = re.compile(r"get_(body|geom|site|camera|joint|light)_(\w+)")
_OF_MOCAP = re.compile(r"(get|set)_(mocap_pos|mocap_quat)")
_ARRAYS = {"body_xpos": "xpos", "body_xquat": "xquat", "body_xmat": "xmat"}
_KIND = {"body": "BODY", "geom": "GEOM", "site": "SITE"}

Aliases = Mapping[str, Mapping[str, str]]
"""Other names of elements, by kind: robosuite's name, and ours."""


class MjModel:
    """MuJoCo's model (`_model`), and names and indices of its elements.

    `site_name2id(name)`, `site_id2name(index)`, `site_names` and the like exist for all
    kinds. Elements that robosuite has too have its names; ours are understood as well.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        aliases: Aliases | None = None,
        write_xml: Callable[[], str] | None = None,
    ) -> None:
        self._model, self._aliases = model, aliases or {}
        self.theirs: Aliases = {}
        self._write_xml = write_xml
        self._all: dict[str, tuple[str, ...]] = {}
        self._ids: dict[str, dict[str, int]] = {}

    def __getattr__(self, name: str) -> Any:
        found = _OF_MODEL.fullmatch(name)
        if found is None:
            return getattr(self.__dict__["_model"], name)
        kind = found[1]
        if found[2] == "names":
            return self.names(kind)
        if found[2] == "id2name":
            names = self.names(kind)
            return lambda id: names[id] or None
        return lambda name: self.index(kind, name)

    def names(self, kind: str) -> tuple[str, ...]:
        """Return the names of all elements of a kind, `""` for those without one."""
        if kind not in self._all:
            count = getattr(self._model, f"n{_COUNTS.get(kind, kind)}")
            get = getattr(self._model, kind)
            own = tuple(get(i).name for i in range(count))
            theirs = self.theirs.get(kind, {})
            self._all[kind] = tuple(theirs.get(name, name) for name in own)
            ids = {name: i for i, name in enumerate(own) if name}
            others = self._aliases.get(kind, {}).items()
            more = {name: ids[n] for name, n in others if n in ids}
            self._ids[kind] = more | ids
        return self._all[kind]

    def understand(self, aliases: Aliases, theirs: Aliases) -> None:
        """Take over other names of elements, and those that are shown."""
        self._aliases, self.theirs = aliases, theirs
        self._all, self._ids = {}, {}

    def find(self, kind: str, name: str) -> int | None:
        """Return the index of an element; None if there is none with that name."""
        self.names(kind)
        return self._ids[kind].get(name)

    def index(self, kind: str, name: str | int) -> int:
        """Return the index of an element; raises UnknownNameError."""
        if isinstance(name, int | np.integer):
            return int(name)
        found = self.find(kind, name)
        if found is None:
            raise UnknownNameError(kind, name, self._ids[kind])
        return found

    def get_xml(self) -> str:
        """Return the scene as MJCF text, as it is now."""
        if self._write_xml is None:
            raise NotImplementedError("This model was compiled without a scene.")
        return self._write_xml()

    def get_joint_qpos_addr(self, name: str) -> Any:
        """Return the index of a joint in qpos; a pair (begin, end) for free joints."""
        return self._place_of(name, "qposadr", {0: 7, 1: 4})

    def get_joint_qvel_addr(self, name: str) -> Any:
        """Return the index of a joint in qvel; a pair (begin, end) for free joints."""
        return self._place_of(name, "dofadr", {0: 6, 1: 3})

    def _place_of(self, name: str, field: str, sizes: Mapping[int, int]) -> Any:
        joint = self.index("joint", name)
        first = int(getattr(self._model, f"jnt_{field}")[joint])
        size = sizes.get(int(self._model.jnt_type[joint]), 1)
        return first if size == 1 else (first, first + size)


class MjData:
    """MuJoCo's data (`_data`), and values of elements by name.

    `get_site_xpos(name)`, `get_body_xvelp(name)`, `set_mocap_pos(name, value)` and the
    like exist for all kinds.
    """

    def __init__(self, model: MjModel, data: mujoco.MjData) -> None:
        object.__setattr__(self, "model", model)
        object.__setattr__(self, "_data", data)

    def __getattr__(self, name: str) -> Any:
        if found := _OF_MOCAP.fullmatch(name):
            return partial(self._mocap, *found.groups())
        if name in _ARRAYS:
            return getattr(self._data, _ARRAYS[name])
        found = _OF_DATA.fullmatch(name)
        if found is None:
            return getattr(self.__dict__["_data"], name)
        kind, column = found.groups()
        if column in ("xvelp", "xvelr"):
            return lambda name: self._velocity(kind, name)[column[-1] == "p"]
        if column in ("jacp", "jacr"):
            return lambda name: self._jacobian(kind, name)[column[-1] == "r"]
        return lambda name: self._value(kind, name, column)

    def __setattr__(self, name: str, value: Any) -> None:
        setattr(self._data, name, value)

    def get_sensor(self, name: str) -> float:
        """Return the first value of a sensor."""
        sensor = self.model.index("sensor", name)
        return self._data.sensordata[self.model.sensor_adr[sensor]]

    def set_joint_qpos(self, name: str, value: Any) -> None:
        """Write a joint's position."""
        self._view("joint", name, "qpos")[:] = value

    def set_joint_qvel(self, name: str, value: Any) -> None:
        """Write a joint's velocity."""
        self._view("joint", name, "qvel")[:] = value

    def _mocap(self, verb: str, column: str, name: str, *value: Any) -> Any:
        """Write, or return a view of, a mocap body's pose, m or w x y z."""
        body = self.model.index("body", name)
        row = getattr(self._data, column)[int(self.model.body_mocapid[body])]
        if verb == "get":
            return row
        row[:] = value[0]

    def _value(self, kind: str, name: str, column: str) -> Any:
        found = self._view(kind, name, column)
        if kind == "joint" and found.size == 1:
            return found[0]
        return found.reshape(3, 3) if column.endswith("mat") else found

    def _view(self, kind: str, name: str, column: str) -> Any:
        index = self.model.index(kind, name)
        return getattr(getattr(self._data, kind)(index), column)

    def _velocity(self, kind: str, name: str) -> Array:
        """Return angular and linear velocity in world axes, shape (2, 3)."""
        result = np.zeros(6)
        mujoco.mj_objectVelocity(
            self.model._model,
            self._data,
            getattr(mujoco.mjtObj, f"mjOBJ_{_KIND[kind]}"),
            self.model.index(kind, name),
            result,
            0,
        )
        return result.reshape(2, 3)

    def _jacobian(self, kind: str, name: str) -> tuple[Array, Array]:
        """Return the Jacobians of position and orientation, shape (3, nv) each."""
        model = self.model._model
        linear, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        compute = getattr(mujoco, f"mj_jac{kind.capitalize()}")
        compute(model, self._data, linear, angular, self.model.index(kind, name))
        return linear, angular


@dataclass(slots=True)
class MjSimState:
    """Time, s, and the arrays qpos and qvel.

    `rest` is what else the world of an environment consists of: what its scene drew,
    marks that are wiped, references of controllers. It is empty where there is none.
    """

    time: float
    qpos: Vector
    qvel: Vector
    rest: Vector = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def from_flattened(cls, array: Any, sim: "MjSim") -> "MjSimState":
        """Return the state of a vector: time, qpos, qvel, and perhaps the rest."""
        model = sim.model._model
        size = motion_size(model)
        values = np.array(check_array("A physics state", array, None))
        if values.ndim != 1 or values.size < size:
            raise ConfigError(
                f"A physics state has shape {values.shape}, but must have ({size},)."
            )
        qpos, qvel = np.split(values[1:size], [model.nq])
        return cls(float(values[0]), qpos, qvel, values[size:])

    def flatten(self) -> Vector:
        """Return time, qpos, qvel and the rest as one vector."""
        return np.concatenate([[self.time], self.qpos, self.qvel, self.rest])


class MjSim:
    """A simulation: `model`, `data`, and what advances them.

    `cameras` renders, if there is one. Of an environment, `start` runs after time, qpos
    and qvel were written, `read` returns a whole state and `restore` writes it.

    Attributes:
        whole_states: Whether states hold the rest of the world beside time, qpos and
            qvel; not in an episode that was set to a state without it, for scripts
            compare states of robosuite's datasets with those that they play back.
    """

    whole_states = True

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData | None = None,
        *,
        aliases: Aliases | None = None,
        write_xml: Callable[[], str] | None = None,
        cameras: Any = None,
        start: Callable[[], None] | None = None,
        read: Callable[[], Vector] | None = None,
        restore: Callable[[Vector], None] | None = None,
    ) -> None:
        self.model = MjModel(model, aliases, write_xml)
        self.data = MjData(self.model, mujoco.MjData(model) if data is None else data)
        self._cameras, self._start = cameras, start
        self._read, self._restore = read, restore
        self.next_step: Callable[[], None] | None = None

    @classmethod
    def from_xml_string(cls, xml: str) -> "MjSim":
        """Compile MJCF text."""
        return cls(mujoco.MjModel.from_xml_string(xml), write_xml=lambda: xml)

    @classmethod
    def from_xml_file(cls, xml_file: str) -> "MjSim":
        """Compile an MJCF file."""
        check_file(Path(xml_file))
        return cls(mujoco.MjModel.from_xml_path(xml_file))

    def reset(self) -> None:
        """Write the model's initial state."""
        mujoco.mj_resetData(self.model._model, self.data._data)

    def forward(self) -> None:
        """Compute everything that follows from positions and velocities."""
        mujoco.mj_forward(self.model._model, self.data._data)

    def step(self, with_udd: bool = True) -> None:
        """Advance physics by one step: by `next_step`, or with the present controls."""
        if self.next_step is not None:
            advance, self.next_step = self.next_step, None
            return advance()
        mujoco.mj_step(self.model._model, self.data._data)

    def step1(self) -> None:
        """Compute the first part of a step, before controls are set."""
        mujoco.mj_step1(self.model._model, self.data._data)

    def step2(self) -> None:
        """Compute the second part of a step."""
        mujoco.mj_step2(self.model._model, self.data._data)

    def get_state(self) -> MjSimState:
        """Return the physics state, copied."""
        data = self.data._data
        if self._read is not None and self.whole_states:
            return MjSimState.from_flattened(self._read(), self)
        return MjSimState(float(data.time), data.qpos.copy(), data.qvel.copy())

    def set_state(self, value: MjSimState) -> None:
        """Write a physics state; controllers start from there."""
        self.set_state_from_flattened(value.flatten())

    def set_state_from_flattened(self, value: Any) -> None:
        """Restore the world of a state of `get_state`.

        Of time, qpos and qvel alone the scene stays as it is drawn, and controllers
        start from there.
        """
        model = self.model._model
        self.whole_states = np.size(value) > motion_size(model)
        if self._restore is not None and self.whole_states:
            self._restore(value)
            return
        write_physics(model, self.data._data, value)
        if self._start is not None:
            self._start()

    def render(
        self,
        width: int | None = None,
        height: int | None = None,
        *,
        camera_name: str | None = None,
        depth: bool = False,
        mode: str = "offscreen",
        device_id: int = -1,
        segmentation: bool = False,
    ) -> Any:
        """Return a picture, upside down as OpenGL has it; with depth, both (0 to 1).

        A segmentation has two values a pixel: MuJoCo's type and index of the element.
        """
        view = {"width": width or 256, "height": height or 256}
        cameras, camera = self._cameras, camera_name or "frontview"
        if cameras is None:  # a world of the user's own, without segmentation
            with mujoco.Renderer(self.model._model, view["height"], view["width"]) as r:
                r.update_scene(self.data._data, camera_name or -1)
                return r.render()[::-1]
        if segmentation:
            geoms = cameras.segmentation(camera, level="element", **view)[::-1] - 1
            kind = np.where(geoms < 0, -1, int(mujoco.mjtObj.mjOBJ_GEOM))
            return np.concatenate([kind, geoms], axis=-1)
        picture = cameras.image(camera, **view)[::-1]
        if not depth:
            return picture
        distance = cameras.depth(camera, **view)[::-1, :, 0]
        return picture, self.opengl_depth(distance)

    def opengl_depth(self, distance: Array) -> Array:
        """Return distances from a camera, m, as OpenGL's depths, 0 to 1."""
        model = self.model._model
        near, far = model.vis.map.znear, model.vis.map.zfar
        scaled = np.maximum(distance / model.stat.extent, near)
        return (1.0 - near / scaled) / (1.0 - near / far)

    add_render_context = does_nothing("renderers are made when pictures are asked for")
    free = does_nothing("memory is freed when nothing refers to it")


class MjRenderContextOffscreen:
    """Nothing: `sim.render` makes its renderer itself."""

    def __init__(self, sim: MjSim, device_id: int = -1, **kwargs: Any) -> None:
        self.sim = sim
