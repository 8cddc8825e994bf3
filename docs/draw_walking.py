"""Draw the film and the strip of the page on walking: `make pictures`.

GR1 walks, is pushed from the side, and goes on; so does Spot with its arm.
"""

from pathlib import Path

import mujoco
import numpy as np
from PIL import Image

from wbc_suite.control import (
    RobotState,
    build_composite_controller,
    load_composite_controller_config,
)
from wbc_suite.envs import Simulation
from wbc_suite.robot import load_robot
from wbc_suite.scene import attach_robot, empty_arena
from wbc_suite.sensing.renderer import make_renderer

IMAGES = Path(__file__).parent / "images"
PERIOD = 0.02  # s between two actions
RATE = 12.5  # pictures a second
SECONDS = 7.0
PUSHED = (3.0, 3.1)  # s
SIZE = (400, 400)
SHOWN = (1.04, 2.64, 3.2, 3.52, 4.24, 6.0)  # s; moments of the strip
FIELD, FIELDS, ASIDE = 0.5, 20, 0.55  # m, number and m, of the rulers on the floor
ROBOTS = {"GR1FreeBody": (0.3, 200.0, 3.0), "SpotWithArm": (0.6, 450.0, 2.8)}
"""Speed, m/s; push from the right, N; distance of the camera, m."""


class Walk:
    """One robot that walks in the studio."""

    def __init__(self, name: str, *, size: tuple[int, int] = SIZE) -> None:
        self._size = size
        self.speed, self.force, distance = ROBOTS[name]
        robot = load_robot(name)
        spec = empty_arena()
        mark_floor(spec)
        attach_robot(spec, robot, "robot0_")
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        state = RobotState(self.model, self.data, robot, prefix="robot0_")
        posture = robot.keyframe("ready")
        places, _ = state.joint_addresses(tuple(posture))
        self.data.qpos[places] = list(posture.values())
        self.data.qpos[:7] = (*robot.root.pos, *robot.root.quat)
        mujoco.mj_forward(self.model, self.data)
        config = load_composite_controller_config("WHOLE_BODY_ID", robot)
        self.controller = build_composite_controller(config, state)
        pairs = [(state, self.controller)]
        self.simulation = Simulation(self.model, self.data, pairs)
        self.simulation.start()
        self.trunk = self.data.body("robot0_" + robot.links[0].name)
        self.camera = mujoco.MjvCamera()
        self.camera.azimuth, self.camera.elevation = 150.0, -8.0
        self.camera.distance = distance
        self.height = 0.8 * self.trunk.xpos[2]
        width, height = size
        self.renderer = make_renderer(
            self.model, width=2 * width, height=2 * height, preset="quality"
        )

    def advance(self, time: float) -> None:
        """Simulate until a time, s."""
        layout = self.controller.layout
        hold = self.controller.hold_action
        action = layout.pack({"walk": [self.speed, 0.0, 0.0]}, base=hold)
        while self.data.time < time:
            pushed = PUSHED[0] <= self.data.time < PUSHED[1]
            self.trunk.xfrc_applied[1] = self.force if pushed else 0.0
            self.controller.set_goal(action if self.data.time > 0.3 else hold, PERIOD)
            self.simulation.tick(round(PERIOD / self.simulation.timestep))

    def picture(self) -> Image.Image:
        """Return what the camera, which follows the trunk, sees."""
        self.camera.lookat[:] = self.trunk.xpos
        self.camera.lookat[2] = self.height
        self.renderer.update_scene(self.data, self.camera)
        large = Image.fromarray(self.renderer.render())
        return large.resize(self._size, Image.Resampling.LANCZOS)


def mark_floor(spec: mujoco.MjSpec) -> None:
    """Draw rulers of fields of half a metre on both sides of the way."""
    for side in (-ASIDE, ASIDE):
        for k in range(FIELDS):
            spec.worldbody.add_geom(
                type=mujoco.mjtGeom.mjGEOM_BOX,
                size=[FIELD / 2, 0.04, 0.001],
                pos=[(k - 2) * FIELD, side, 0.0],
                rgba=[0.16, 0.35, 0.55, 1.0] if k % 2 else [0.95, 0.95, 0.95, 1.0],
                contype=0,
                conaffinity=0,
            )


def side_by_side(pictures: list[Image.Image]) -> Image.Image:
    """Return pictures of one height in a row."""
    return Image.fromarray(np.concatenate([np.asarray(p) for p in pictures], axis=1))


def save_film(
    path: Path, film: list[Image.Image], *, rate: float, quality: int
) -> None:
    """Write pictures as a film that repeats, so many of them a second."""
    duration = round(1000 / rate)  # ms
    others = {"save_all": True, "append_images": film[1:], "loop": 0, "method": 6}
    film[0].save(path, duration=duration, quality=quality, **others)


def main() -> None:
    """Draw the film and the strip."""
    walks = [Walk(name) for name in ROBOTS]
    film: list[Image.Image] = []
    strips: list[list[Image.Image]] = [[] for _ in walks]
    for k in range(round(SECONDS * RATE)):
        time = (k + 1) / RATE
        for walk in walks:
            walk.advance(time)
        pictures = [walk.picture() for walk in walks]
        film.append(side_by_side(pictures))
        if any(abs(time - moment) < 0.5 / RATE for moment in SHOWN):
            for strip, picture in zip(strips, pictures, strict=True):
                strip.append(picture.resize((200, 200), Image.Resampling.LANCZOS))
    rows = [np.asarray(side_by_side(strip)) for strip in strips]
    Image.fromarray(np.concatenate(rows)).save(
        IMAGES / "walking.jpg", quality=85, optimize=True
    )
    save_film(IMAGES / "walking.webp", film, rate=RATE, quality=45)


if __name__ == "__main__":
    main()
