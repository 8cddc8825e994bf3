"""Draw the pictures of the README: `make pictures`."""

from pathlib import Path

import mujoco
from PIL import Image

from wbc_suite.robot import RobotDescription, load_robot
from wbc_suite.scene import attach_robot, place_robot, robot_prefix
from wbc_suite.viewers.offscreen import View, add_studio, render_model

IMAGES = Path(__file__).parent / "images"
PLACES = {
    "SpotWithArm": (-0.3, -1.9),
    "Tiago": (0.0, -0.85),
    "GR1": (0.0, 0.25),
    "Panda": (-0.1, 1.4),
}
VIEW = View(azimuth=171.0, elevation=-9.0, fov=22.0, margin=1.04)
SIZE = (1200, 560)


def main() -> None:
    """Put the robots side by side in the studio and draw them."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    for i, (name, place) in enumerate(PLACES.items()):
        attach_robot(spec, place_robot(load_robot(name), place, 0.0), robot_prefix(i))
    add_studio(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    for i, name in enumerate(PLACES):
        _take_posture(data, load_robot(name), robot_prefix(i))
    mujoco.mj_forward(model, data)
    width, height = 2 * SIZE[0], 2 * SIZE[1]  # drawn twice as large: smooth edges
    picture = render_model(
        model, data, width=width, height=height, camera=VIEW, preset="quality"
    )
    IMAGES.mkdir(exist_ok=True)
    smooth = Image.fromarray(picture).resize(SIZE, Image.Resampling.LANCZOS)
    smooth.save(IMAGES / "robots.png", optimize=True)


def _take_posture(data: mujoco.MjData, robot: RobotDescription, prefix: str) -> None:
    for joint, value in robot.keyframe("ready").items():
        data.joint(prefix + joint).qpos[:] = value


if __name__ == "__main__":
    main()
