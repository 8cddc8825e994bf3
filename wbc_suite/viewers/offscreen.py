"""Offscreen pictures of robots and models, with a fitted camera and studio lights."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Self, TypeAlias

import mujoco
import numpy as np
from numpy.typing import NDArray

from wbc_suite.errors import UnknownNameError
from wbc_suite.sensing.renderer import RenderPreset, make_renderer
from wbc_suite.typing import Matrix, Vector
from wbc_suite.viewers.model_scene import subject_corners

if TYPE_CHECKING:
    from wbc_suite.robot import RobotDescription

Image: TypeAlias = NDArray[np.uint8]
"""Picture, shape (height, width, 3), RGB."""


ViewName: TypeAlias = Literal["three_quarter", "front", "side", "back"]


@dataclass(frozen=True, kw_only=True, slots=True)
class View:
    """The direction of a camera, degrees; its distance follows from the subject.

    Attributes:
        azimuth: About the world's z axis; 180 is along -x, into the face of a robot
            that faces +x.
        elevation: Above the horizon; negative looks down.
        fov: Vertical field of view.
        margin: Size of the picture over that of the subject.
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


@dataclass(frozen=True, kw_only=True, slots=True)
class Mark:
    """A sphere that is drawn but not simulated; position in the world and radius, m."""

    position: Vector
    rgba: tuple[float, float, float, float] = (0.10, 0.55, 0.95, 0.6)
    radius: float = 0.025


def render_robot(
    robot: "RobotDescription",
    *,
    view: View | ViewName = "three_quarter",
    keyframe: str = "ready",
    size: tuple[int, int] = (800, 800),
    preset: RenderPreset | str = RenderPreset.QUALITY,
) -> Image:
    """Return a picture of a robot at one of its keyframes, in the studio.

    `view` is a view or its name in `VIEWS`, `size` the width and height in pixels; for
    `preset` see `make_renderer`, and for errors `Camera`.
    """
    posture = robot.keyframe(keyframe)
    spec = robot.to_mjspec()
    ground = float(subject_corners(*_pose(spec, posture))[:, 2].min())
    add_studio(spec, ground=ground)
    width, height = size
    return render_model(
        *_pose(spec, posture), width=width, height=height, camera=view, preset=preset
    )


def _pose(
    spec: mujoco.MjSpec, posture: Mapping[str, float]
) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Compile a robot and set its joints to a posture."""
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
    """Return a picture of a model; for arguments and errors see `Camera`."""
    with Camera(
        model, data, view=camera, width=width, height=height, preset=preset
    ) as shot:
        return shot.take(data)


class Camera:
    """A fixed camera for a sequence of pictures.

    The size of the pictures is in pixels; for `preset` see `make_renderer`.

    Args:
        model: Model to draw.
        data: State at which the camera is fitted to the subject; positions are those of
            the last `mujoco.mj_forward`.
        view: A `View`, its name in `VIEWS`, or the name of a camera of the model.
        subject: Prefix of the bodies that the picture has to contain; all by default.

    Raises:
        UnknownNameError: If there is no such view or camera.
        DeviceError: If this machine has no renderer.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        *,
        view: View | str = "three_quarter",
        width: int = 800,
        height: int = 800,
        preset: RenderPreset | str | None = None,
        subject: str = "",
    ) -> None:
        self._view = _find_view(model, view)
        self._camera: mujoco.MjvCamera | str = str(view)
        if self._view is not None:
            corners = subject_corners(model, data, subject)
            self._camera = fit_camera(self._view, corners, aspect=width / height)
        self._fov = float(model.vis.global_.fovy)
        self._renderer = make_renderer(model, width=width, height=height, preset=preset)

    def take(self, data: mujoco.MjData, marks: Sequence[Mark] = ()) -> Image:
        """Return a picture of a state after `mujoco.mj_forward`, with marks added."""
        self._renderer.update_scene(data, self._camera)
        scene = self._renderer.scene
        if self._view is not None:  # of a free camera it is otherwise the model's
            half = np.radians([self._view.fov, self._fov]) / 2.0
            for camera in scene.camera:
                camera.frustum_top *= np.tan(half[0]) / np.tan(half[1])
                camera.frustum_bottom *= np.tan(half[0]) / np.tan(half[1])
        for mark in marks:
            mujoco.mjv_initGeom(
                scene.geoms[scene.ngeom],
                mujoco.mjtGeom.mjGEOM_SPHERE,
                np.full(3, mark.radius),
                np.asarray(mark.position, dtype=np.float64),
                np.eye(3).ravel(),
                np.asarray(mark.rgba, dtype=np.float32),
            )
            scene.ngeom += 1
        return self._renderer.render()

    def close(self) -> None:
        """Free the renderer."""
        self._renderer.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def add_studio(spec: mujoco.MjSpec, *, ground: float = 0.0) -> None:
    """Add background, ground, and key, fill and rim light to a scene.

    Compile it afterwards. `ground` is the height of the floor, m.
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
    for name, toward, diffuse in (
        ("key", [-0.55, 0.45, -1.2], 0.50),
        ("fill", [-0.9, -0.9, -0.5], 0.22),
        ("rim", [1.0, 0.3, -0.6], 0.18),
    ):
        spec.worldbody.add_light(
            name=f"studio_{name}",
            type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
            pos=[-3 * x for x in toward],
            dir=toward,
            diffuse=[diffuse] * 3,
            ambient=[0, 0, 0],
            specular=[0.25 * diffuse] * 3,
            castshadow=name == "key",
        )


def fit_camera(view: View, points: Matrix, *, aspect: float) -> mujoco.MjvCamera:
    """Return a free camera that has all points, m, shape (n, 3), in its picture.

    In camera axes a point at offset (r, u, f) to the right, up and forward of the
    look-at point is inside when ``|u| <= (d + f) tan(fov / 2)`` and ``|r| <= aspect
    (d + f) tan(fov / 2)``; d is the smallest distance at which all are. `aspect` is the
    width of the picture over its height.
    """
    azimuth, elevation = np.radians([view.azimuth, view.elevation])
    right = np.array([np.sin(azimuth), -np.cos(azimuth), 0.0])
    level = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    forward = np.append(np.cos(elevation) * level[:2], np.sin(elevation))
    axes = np.array([right, np.cross(right, forward), forward])
    local = points @ axes.T
    middle = (local.min(axis=0) + local.max(axis=0)) / 2.0
    offset = local - middle
    tangent = np.tan(np.radians(view.fov) / 2.0) / view.margin
    reach = np.maximum(np.abs(offset[:, 1]), np.abs(offset[:, 0]) / aspect)
    camera = mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_FREE
    camera.lookat[:] = middle @ axes
    camera.azimuth, camera.elevation = view.azimuth, view.elevation
    camera.distance = float(np.max(reach / tangent - offset[:, 2]))
    return camera


def _find_view(model: mujoco.MjModel, view: View | str) -> View | None:
    """Return a view, or None for the name of a camera of the model."""
    if isinstance(view, View) or view in VIEWS:
        return view if isinstance(view, View) else VIEWS[view]
    cameras = [model.camera(i).name for i in range(model.ncam)]
    if view not in cameras:
        raise UnknownNameError("view or camera", view, [*VIEWS, *cameras])
    return None
