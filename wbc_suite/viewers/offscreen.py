"""Pictures of a robot in a studio: neutral ground, soft light, a camera that fits."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

import mujoco
import numpy as np
from numpy.typing import NDArray

from wbc_suite.errors import UnknownNameError
from wbc_suite.sensing.renderer import RenderPreset, make_renderer
from wbc_suite.typing import Matrix, Vector

if TYPE_CHECKING:
    from wbc_suite.robot import RobotDescription

__all__ = ["VIEWS", "Image", "View", "add_studio", "render_model", "render_robot"]

Image: TypeAlias = NDArray[np.uint8]
"""Picture, shape (height, width, 3), RGB."""

ViewName: TypeAlias = Literal["three_quarter", "front", "side", "back"]


@dataclass(frozen=True, kw_only=True, slots=True)
class View:
    """A direction to look along; the distance follows from what is to be seen.

    Attributes:
        azimuth: Degrees about the world's z axis, of the direction in which the camera
            looks: 180 looks back along -x, into the face of a robot that faces +x.
        elevation: Degrees above the horizon of the direction in which the camera
            looks; negative looks down.
        fov: Vertical field of view in degrees.
        margin: How many times larger than the subject the picture is.
    """

    azimuth: float
    elevation: float
    fov: float = 28.0
    margin: float = 1.08


VIEWS: dict[ViewName, View] = {
    "three_quarter": View(azimuth=145.0, elevation=-14.0),
    "front": View(azimuth=180.0, elevation=-6.0),
    "side": View(azimuth=90.0, elevation=-6.0),
    "back": View(azimuth=0.0, elevation=-6.0),
}


def render_robot(
    robot: "RobotDescription",
    *,
    view: View | ViewName = "three_quarter",
    keyframe: str = "ready",
    size: tuple[int, int] = (800, 800),
    preset: RenderPreset | str = RenderPreset.QUALITY,
) -> Image:
    """Draw a robot at one of its keyframes, standing in the studio.

    Args:
        robot: What to draw.
        view: A name out of `VIEWS`, or a direction of your own.
        keyframe: A key of ``robot.keyframes``.
        size: Width and height in pixels.
        preset: How much work goes into the picture.

    Raises:
        UnknownNameError: If the robot has no such keyframe, or the view is unknown.
        DeviceError: If nothing on this machine can draw.
    """
    posture = robot.keyframe(keyframe)
    spec = robot.to_mjspec()
    ground = float(_corners(*_pose(spec, posture))[:, 2].min())
    add_studio(spec, ground=ground)
    model, data = _pose(spec, posture)
    width, height = size
    return render_model(
        model, data, width=width, height=height, camera=view, preset=preset
    )


def _pose(
    spec: mujoco.MjSpec, posture: Mapping[str, float]
) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Compile a robot and put its joints where the posture has them."""
    model = spec.compile()
    data = mujoco.MjData(model)
    for joint, value in posture.items():
        data.joint(joint).qpos[:] = value
    mujoco.mj_forward(model, data)
    return model, data


def render_model(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    *,
    width: int = 800,
    height: int = 800,
    camera: View | str = "three_quarter",
    preset: RenderPreset | str | None = None,
) -> Image:
    """Draw a model as it is lit and furnished.

    Args:
        model: What to draw.
        data: Its state; positions are those of the last `mujoco.mj_forward`.
        width: Of the picture, in pixels.
        height: Of the picture, in pixels.
        camera: A `View`, a name out of `VIEWS`, or the name of a camera of the model.
        preset: See `make_renderer`.

    Raises:
        UnknownNameError: If neither a view nor a camera has this name.
        DeviceError: If nothing on this machine can draw.
    """
    with make_renderer(model, width=width, height=height, preset=preset) as renderer:
        view = _find_view(model, camera)
        if isinstance(view, str):
            renderer.update_scene(data, view)
        else:
            free = fit_camera(view, _corners(model, data), aspect=width / height)
            renderer.update_scene(data, free)
            _set_field_of_view(renderer.scene, model.vis.global_.fovy, view.fov)
        return renderer.render()


def add_studio(spec: mujoco.MjSpec, *, ground: float = 0.0) -> None:
    """Furnish a scene for a picture: background, ground, key, fill and rim light.

    Args:
        spec: Changed in place; compile it afterwards.
        ground: Height of the floor in m.
    """
    spec.add_texture(
        name="studio_sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.73, 0.75, 0.78],
        rgb2=[0.62, 0.65, 0.70],
        width=256,
        height=1536,
    )
    spec.add_material(
        name="studio_ground", rgba=[0.70, 0.72, 0.75, 1], specular=0, shininess=0
    )
    spec.visual.rgba.haze = [0.73, 0.75, 0.78, 1]
    spec.visual.map.haze = 0.6
    spec.visual.headlight.ambient = [0.42, 0.42, 0.42]
    spec.visual.headlight.diffuse = [0.12, 0.12, 0.12]
    spec.visual.headlight.specular = [0, 0, 0]
    spec.visual.map.shadowclip = 1.5
    spec.worldbody.add_geom(
        name="studio_ground",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        pos=[0, 0, ground],
        size=[0, 0, 0.1],
        material="studio_ground",
        contype=0,
        conaffinity=0,
    )
    key, fill, rim = 0.50, 0.22, 0.18
    _add_sun(spec, "studio_key", toward=[-0.55, 0.45, -1.2], diffuse=key, shadow=True)
    _add_sun(spec, "studio_fill", toward=[-0.9, -0.9, -0.5], diffuse=fill)
    _add_sun(spec, "studio_rim", toward=[1.0, 0.3, -0.6], diffuse=rim)


def _add_sun(
    spec: mujoco.MjSpec,
    name: str,
    *,
    toward: list[float],
    diffuse: float,
    shadow: bool = False,
) -> None:
    spec.worldbody.add_light(
        name=name,
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        pos=[-3 * x for x in toward],
        dir=toward,
        diffuse=[diffuse] * 3,
        ambient=[0, 0, 0],
        specular=[0.25 * diffuse] * 3,
        castshadow=shadow,
    )


def fit_camera(view: View, points: Matrix, *, aspect: float) -> mujoco.MjvCamera:
    """Place a free camera so that all points fit into the picture.

    In camera axes a point at offset (r, u, f) to the right, up and forward of the
    look-at point is inside when ``|u| <= (d + f) tan(fov / 2)`` and ``|r| <= aspect
    (d + f) tan(fov / 2)``; d is the smallest distance at which all are.

    Args:
        view: The direction.
        points: What has to be seen, shape (n, 3), m, world axes.
        aspect: Width over height of the picture.
    """
    right, up, forward = _camera_axes(view)
    local = points @ np.column_stack([right, up, forward])
    middle = (local.min(axis=0) + local.max(axis=0)) / 2.0
    offset = local - middle
    tangent = np.tan(np.radians(view.fov) / 2.0) / view.margin
    reach = np.maximum(np.abs(offset[:, 1]), np.abs(offset[:, 0]) / aspect)
    camera = mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_FREE
    camera.lookat[:] = middle @ np.vstack([right, up, forward])
    camera.azimuth, camera.elevation = view.azimuth, view.elevation
    camera.distance = float(np.max(reach / tangent - offset[:, 2]))
    return camera


def _camera_axes(view: View) -> tuple[Vector, Vector, Vector]:
    azimuth, elevation = np.radians([view.azimuth, view.elevation])
    forward = np.array(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ]
    )
    right = np.array([np.sin(azimuth), -np.cos(azimuth), 0.0])
    return right, np.cross(right, forward), forward


def _corners(model: mujoco.MjModel, data: mujoco.MjData) -> Matrix:
    """Return the corners of all geoms' boxes in the world, shape (n, 3); no planes."""
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T
    seen = model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE
    seen &= model.geom_group < 3  # what MuJoCo's viewers hide by default
    centre, half = model.geom_aabb[seen, :3], model.geom_aabb[seen, 3:]
    local = centre[:, None] + signs * half[:, None]
    rotation = data.geom_xmat[seen].reshape(-1, 3, 3)
    world = data.geom_xpos[seen, None] + local @ rotation.transpose(0, 2, 1)
    return world.reshape(-1, 3)


def _find_view(model: mujoco.MjModel, camera: View | str) -> View | str:
    if isinstance(camera, View):
        return camera
    for name, view in VIEWS.items():
        if name == camera:
            return view
    cameras = [model.camera(i).name for i in range(model.ncam)]
    if camera not in cameras:
        raise UnknownNameError("view or camera", camera, [*VIEWS, *cameras])
    return camera


def _set_field_of_view(scene: mujoco.MjvScene, old: float, new: float) -> None:
    """Narrow the lens of a free camera, whose angle is otherwise the model's."""
    ratio = np.tan(np.radians(new) / 2.0) / np.tan(np.radians(old) / 2.0)
    for camera in scene.camera:
        camera.frustum_top *= ratio
        camera.frustum_bottom *= ratio
