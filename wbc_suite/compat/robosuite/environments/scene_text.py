"""Scenes as MJCF text: written as they are now, and read back."""

from dataclasses import dataclass

import mujoco
import numpy as np

from wbc_suite.benchmark import load_benchmark
from wbc_suite.envs import RobotEnv
from wbc_suite.envs.building import compose
from wbc_suite.envs.physics_states import WORDS, Origin, generator_of
from wbc_suite.envs.states import write_scene
from wbc_suite.errors import ConfigError, DatasetError
from wbc_suite.robot.mjcf_compile import compile_text

WRITTEN = (
    *("body_pos", "body_quat", "body_mass", "body_inertia", "body_ipos", "body_iquat"),
    *("body_subtreemass", "body_invweight0", "dof_invweight0", "dof_M0"),
    *("dof_damping", "dof_armature", "dof_frictionloss", "jnt_range", "jnt_pos"),
    *("jnt_axis", "geom_pos", "geom_quat", "geom_size", "geom_aabb", "geom_rgba"),
    *("geom_friction", "geom_solref", "geom_solimp", "site_pos", "site_quat"),
    *("site_size", "site_rgba", "cam_pos", "cam_quat", "cam_fovy", "light_pos"),
    *("light_dir", "light_diffuse", "mat_rgba", "bvh_aabb", "mesh_vert", "qpos0"),
)
"""Arrays of a model that a scene's text decides."""

ORIGIN = "wbc_suite_drawn_with"
"""Name of the custom text with the state of the generator that drew the scene."""

PRINTED = 1e-4
"""Relative; larger differences from the environment's values were edited, as the text
has six digits."""

COUNTED = ("nq", "nv", "nu", "nbody", "ngeom", "nsite", "njnt", "ncam", "nmesh")


@dataclass(frozen=True)
class Scene:
    """A scene that was read from a text, with the elements of the environment's."""

    model: mujoco.MjModel

    def begin(self, env: RobotEnv) -> None:
        """Start an episode whose scene is drawn as that of the text, if it says how."""
        generator = _drawn_with(self.model)
        if generator is None:
            env.begin(None)
        else:
            env.begin_at(generator.bit_generator.state)

    def write(self, model: mujoco.MjModel) -> None:
        """Write sizes, places, masses and looks into the environment's model.

        Values that the text has only printed stay as they were drawn.
        """
        for field in WRITTEN:
            given, own = getattr(self.model, field), getattr(model, field)
            if given.shape == own.shape:
                same = np.isclose(given, own, rtol=PRINTED, atol=PRINTED**2)
                own[...] = np.where(same, own, given)
        collides = (model.geom_contype | model.geom_conaffinity) > 0
        model.geom_rbound[collides] = self.model.geom_rbound[collides]


def load_scene(text: str, model: mujoco.MjModel) -> Scene:
    """Read a scene with the elements of a model.

    Raises:
        DatasetError: If it is no MJCF, or has other elements.
    """
    try:
        found = compile_text(text, source="The recording's scene")
    except ConfigError as error:
        raise DatasetError(f"{error} Actions do not need it.") from error
    same = all(getattr(found, n) == getattr(model, n) for n in COUNTED)
    names = found.names.replace(ORIGIN.encode() + b"\0", b"")
    if not same or names != model.names:
        raise DatasetError(
            "The recording's scene is not this environment's: states of other scenes "
            "do not fit. Actions do: play those."
        )
    return Scene(found)


def scene_as_it_is(env: RobotEnv) -> str:
    """Return the scene as MJCF text with the present sizes and places."""
    benchmark = load_benchmark(env.made_of[0], arena=env.config.arena)
    spec = compose(benchmark, env.robots, env.config)
    model = env.simulation.model
    for geom in (g for g in spec.geoms if g.name):
        index = model.geom(geom.name).id
        geom.rgba = model.geom_rgba[index]
        geom.friction = model.geom_friction[index]
        if geom.type != mujoco.mjtGeom.mjGEOM_MESH:
            geom.pos, geom.quat = model.geom_pos[index], model.geom_quat[index]
            geom.size = model.geom_size[index]
            geom.fromto = np.full(6, np.nan)
    for site in (s for s in spec.sites if s.name):
        site.pos = model.site_pos[model.site(site.name).id]
    for body in (b for b in spec.bodies if b.name and b.name != "world"):
        index = model.body(body.name).id
        body.pos, body.quat = model.body_pos[index], model.body_quat[index]
        if model.body_mass[index] > 0.0:  # not of the sizes that geoms have now
            body.explicitinertial, body.mass = True, model.body_mass[index]
            body.ipos, body.iquat = model.body_ipos[index], model.body_iquat[index]
            body.inertia = model.body_inertia[index]
            body.fullinertia = np.full(6, np.nan)
    for camera in (c for c in spec.cameras if c.name):
        index = model.camera(camera.name).id
        camera.pos, camera.quat = model.cam_pos[index], model.cam_quat[index]
    words = Origin.parse(env.physics_state).scene_generator
    spec.add_text(name=ORIGIN, data=" ".join(map(str, words)))
    return write_scene(spec)


def _drawn_with(model: mujoco.MjModel) -> np.random.Generator | None:
    """Return the generator that a text names, or None."""
    place = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TEXT, ORIGIN)
    if place < 0:
        return None
    first = int(model.text_adr[place])
    words = bytes(model.text_data[first:]).split(b"\0", 1)[0].split()
    usable = len(words) == WORDS and all(word.isdigit() for word in words)
    numbers = [int(word) for word in words] if usable else []
    if not usable or max(numbers) >= 1 << 32:
        raise DatasetError(f"The recording's scene: '{ORIGIN}' is not what we wrote.")
    return generator_of(numbers)
