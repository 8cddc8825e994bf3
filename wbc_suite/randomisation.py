"""Domain randomisation: properties of a scene that are drawn at each reset.

Each property is a function that writes into the compiled model, and the names of the
arrays that it writes. To add one: a field, a function, and a line of `_DRAWS`.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import mujoco
import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeFloat, field_validator

from wbc_suite.config_files import FrozenModel
from wbc_suite.scene import Push, PushConfig, draw_pushes
from wbc_suite.typing import Array

if TYPE_CHECKING:
    from wbc_suite.envs import RobotEnv

Share: TypeAlias = Annotated[float, Field(ge=0.0, lt=1.0)]


class Randomisation(FrozenModel):
    """Amounts by which properties of a scene vary at each reset.

    Shares multiply: 0.1 draws factors between 0.9 and 1.1. All values are drawn from
    the environment's generator, so they follow the seed of the episode, and are nominal
    again before the next draw.

    Attributes:
        color: Share of each shape's colour that a random one replaces.
        texture: Whether textures are replaced by random patterns.
        light_position: Largest offset of lights along each axis, m.
        light_brightness: Share for each light's brightness.
        camera_position: Largest offset of cameras along each axis, m.
        camera_rotation: Largest rotation of cameras about each axis, rad.
        camera_fovy: Largest change of vertical fields of view, degrees.
        mass: Share for each body's mass, and its inertia by the same factor.
        inertia: Share for each body's inertia in addition.
        friction: Share for each shape's sliding, torsional and rolling friction.
        damping: Share for each joint's damping and dry friction.
        armature: Share for each joint's rotor inertia.
        gains: Share for each actuator's force.
        latency: Least and greatest delay of actions, s, constant in an episode; delayed
            actions wait in a queue.
        pushes: Pushes on the first link of each robot, such as the trunk of one that
            stands on its feet.
    """

    color: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    texture: bool = False
    light_position: NonNegativeFloat = 0.0
    light_brightness: Share = 0.0
    camera_position: NonNegativeFloat = 0.0
    camera_rotation: NonNegativeFloat = 0.0
    camera_fovy: NonNegativeFloat = 0.0
    mass: Share = 0.0
    inertia: Share = 0.0
    friction: Share = 0.0
    damping: Share = 0.0
    armature: Share = 0.0
    gains: Share = 0.0
    latency: tuple[NonNegativeFloat, NonNegativeFloat] = (0.0, 0.0)
    pushes: PushConfig | None = None

    @field_validator("latency")
    @classmethod
    def _least_first(cls, latency: tuple[float, float]) -> tuple[float, float]:
        if latency[0] > latency[1]:
            raise ValueError("the smallest latency must come first")
        return latency

    @classmethod
    def default(cls) -> "Randomisation":
        """Return moderate amounts of all properties, chosen by rule of thumb."""
        return cls(
            color=0.3,
            texture=True,
            light_position=0.5,
            light_brightness=0.3,
            camera_position=0.02,
            camera_rotation=0.05,
            camera_fovy=3.0,
            mass=0.05,
            inertia=0.05,
            friction=0.1,
            damping=0.1,
            armature=0.05,
            gains=0.03,
            latency=(0.0, 0.01),
        )

    def bind(self, env: "RobotEnv") -> "BoundRandomisation":
        """Bind to an environment, whose present model is the nominal one."""
        return BoundRandomisation(self, env)


class BoundRandomisation:
    """The randomisation of one environment; see `wbc_suite.envs.states.Randomiser`."""

    def __init__(self, amounts: Randomisation, env: "RobotEnv") -> None:
        self._amounts, self._env = amounts, env
        self._model: Any = env.simulation.model
        self._draws = [
            (getattr(amounts, name), names, draw)
            for name, (names, draw) in _DRAWS.items()
            if getattr(amounts, name)
        ]
        used = {name for _, names, _ in self._draws for name in names}
        self._nominal = {name: getattr(self._model, name).copy() for name in used}

    def restore(self) -> None:
        """Restore the nominal values."""
        for name, values in self._nominal.items():
            getattr(self._model, name)[:] = values
        self._env.latency, self._env.pushes = 0, ()
        self._upload_textures()

    def apply(self, rng: np.random.Generator) -> None:
        """Draw all values."""
        for amount, _, draw in self._draws:
            draw(self._model, amount, rng)
        least, most = self._amounts.latency
        if most:
            delay = rng.uniform(least, most)
            self._env.latency = round(delay / self._env.simulation.timestep)
        if self._amounts.pushes is not None:
            self._env.pushes = self._pushes(self._amounts.pushes, rng)
        self._upload_textures()

    def _pushes(self, config: PushConfig, rng: np.random.Generator) -> tuple[Push, ...]:
        until = self._env.horizon / self._env.config.control_freq
        pushes: list[Push] = []
        for state in self._env.simulation.robots:
            body = self._model.body(state.prefix + state.robot.links[0].name).id
            pushes += draw_pushes(config, rng, body=body, until=until)
        return tuple(pushes)

    def _upload_textures(self) -> None:
        if self._amounts.texture:
            self._env.cameras.upload_textures()


def _color(model: Any, share: float, rng: np.random.Generator) -> None:
    """Blend colours with random ones; geoms with a material keep the material's.

    Their own colour, other than MuJoCo's grey, would multiply their texture.
    """
    own = model.geom_matid < 0
    for colors, chosen in ((model.geom_rgba, own), (model.mat_rgba, slice(None))):
        new = rng.uniform(0.0, 1.0, (len(colors), 3))
        colors[chosen, :3] += share * (new - colors[:, :3])[chosen]


def _texture(model: Any, _: bool, rng: np.random.Generator) -> None:
    flat = int(mujoco.mjtTexture.mjTEXTURE_2D)
    for k in range(model.ntex):
        height, width = int(model.tex_height[k]), int(model.tex_width[k])
        channels, first = int(model.tex_nchannel[k]), int(model.tex_adr[k])
        if model.tex_type[k] != flat or channels < 3:
            continue
        pixels = model.tex_data[first : first + height * width * channels]
        picture = pixels.reshape(height, width, channels)
        picture[..., :3] = draw_pattern(height, width, rng)


def draw_pattern(
    height: int, width: int, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """Return a random pattern of two colours, shape (height, width, 3)."""
    first, second = rng.uniform(0.0, 255.0, (2, 3))
    y, x = np.mgrid[0.0 : 1.0 : height * 1j, 0.0 : 1.0 : width * 1j]
    kind = rng.integers(4)
    if kind == 0:
        mix = np.zeros_like(x)
    elif kind == 1:
        cells = rng.integers(2, 12)
        mix = (np.floor(x * cells) + np.floor(y * cells)) % 2.0
    elif kind == 2:
        angle = rng.uniform(0.0, 2.0 * np.pi)
        mix = 0.5 + 0.5 * np.sin(2.0 * np.pi * (x * np.cos(angle) + y * np.sin(angle)))
    else:
        coarse = rng.uniform(0.0, 1.0, (16, 16))
        rows = np.minimum((y * 16).astype(np.int64), 15)
        columns = np.minimum((x * 16).astype(np.int64), 15)
        mix = coarse[rows, columns]
    picture = first + mix[..., None] * (second - first)
    return picture.astype(np.uint8)


def _light_position(model: Any, size: float, rng: np.random.Generator) -> None:
    moved = rng.uniform(-size, size, model.light_pos.shape)
    model.light_pos[:] += moved
    model.light_dir[:] -= moved  # they keep their targets
    model.light_dir[:] /= np.linalg.norm(model.light_dir, axis=1, keepdims=True)


def _camera_position(model: Any, size: float, rng: np.random.Generator) -> None:
    model.cam_pos[:] += rng.uniform(-size, size, model.cam_pos.shape)


def _camera_rotation(model: Any, size: float, rng: np.random.Generator) -> None:
    turns = rng.uniform(-size, size, (model.ncam, 3))
    for quat, turn in zip(model.cam_quat, turns, strict=True):
        mujoco.mju_quatIntegrate(quat, turn, 1.0)


def _camera_fovy(model: Any, size: float, rng: np.random.Generator) -> None:
    model.cam_fovy[:] += rng.uniform(-size, size, model.ncam)
    np.clip(model.cam_fovy, 1.0, 175.0, out=model.cam_fovy)


def _mass(model: Any, share: float, rng: np.random.Generator) -> None:
    factors = rng.uniform(1.0 - share, 1.0 + share, model.nbody)
    model.body_mass[:] *= factors
    model.body_inertia[:] *= factors[:, None]
    _scale_simple_inertia(model, factors)
    model.body_subtreemass[:] = model.body_mass
    for body in range(model.nbody - 1, 0, -1):
        parent = model.body_parentid[body]
        model.body_subtreemass[parent] += model.body_subtreemass[body]


def _inertia(model: Any, share: float, rng: np.random.Generator) -> None:
    # One factor for all three axes: separate ones may break the triangle inequality.
    factors = rng.uniform(1.0 - share, 1.0 + share, (model.nbody, 1))
    model.body_inertia[:] *= factors
    _scale_simple_inertia(model, factors[:, 0], rotation_only=True)


def _armature(model: Any, share: float, rng: np.random.Generator) -> None:
    added = rng.uniform(-share, share, model.nv) * model.dof_armature
    model.dof_armature[:] += added
    model.dof_M0[:] += added


def _scale_simple_inertia(
    model: Any, factors: Array, *, rotation_only: bool = False
) -> None:
    """Scale the mass matrix of simple bodies, which MuJoCo takes from `dof_M0`."""
    scaled = model.dof_simplenum > 0
    if rotation_only:
        joint = model.dof_jntid
        free = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE
        slides = model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE
        along = free & (np.arange(model.nv) - model.jnt_dofadr[joint] < 3)
        scaled &= ~(slides | along)
    own = model.dof_M0 - model.dof_armature
    factors = factors[model.dof_bodyid]
    model.dof_M0[scaled] = (own * factors + model.dof_armature)[scaled]


Draw: TypeAlias = Callable[[Any, Any, np.random.Generator], None]


def _scales(*arrays: str) -> tuple[tuple[str, ...], Draw]:
    """Return a draw that multiplies every value of arrays by a factor of its own."""

    def draw(model: Any, share: float, rng: np.random.Generator) -> None:
        for name in arrays:
            values = getattr(model, name)
            values[:] *= rng.uniform(1.0 - share, 1.0 + share, values.shape)

    return arrays, draw


def _scales_rows(*arrays: str) -> tuple[tuple[str, ...], Draw]:
    """Return a draw that multiplies each row, the same in all arrays, by a factor."""

    def draw(model: Any, share: float, rng: np.random.Generator) -> None:
        rows = len(getattr(model, arrays[0])), 1
        factors = rng.uniform(1.0 - share, 1.0 + share, rows)
        for name in arrays:
            getattr(model, name)[:] *= factors

    return arrays, draw


_DRAWS: dict[str, tuple[tuple[str, ...], Draw]] = {
    "color": (("geom_rgba", "mat_rgba"), _color),
    "texture": (("tex_data",), _texture),
    "light_position": (("light_pos", "light_dir"), _light_position),
    "light_brightness": _scales_rows("light_diffuse"),
    "camera_position": (("cam_pos",), _camera_position),
    "camera_rotation": (("cam_quat",), _camera_rotation),
    "camera_fovy": (("cam_fovy",), _camera_fovy),
    "mass": (("body_mass", "body_inertia", "body_subtreemass", "dof_M0"), _mass),
    "inertia": (("body_inertia", "dof_M0"), _inertia),
    "friction": _scales("geom_friction"),
    "damping": _scales("dof_damping", "dof_frictionloss"),
    "armature": (("dof_armature", "dof_M0"), _armature),
    "gains": _scales_rows("actuator_gainprm", "actuator_biasprm"),
}
"""Arrays that each property writes, and the function that draws it."""
