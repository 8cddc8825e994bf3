"""Draw the film of the README: teleoperation, a walk, and a benchmark, 10 s.

Needs Chromium and playwright, see `draw_teleop.py`.
"""

from collections.abc import Iterator
from pathlib import Path

import draw_benchmarks
import draw_teleop
from draw_walking import Walk, save_film
from PIL import Image

import wbc_suite
from wbc_suite.envs import RobotEnv
from wbc_suite.evaluation import make_policy
from wbc_suite.sensing.renderer import make_renderer
from wbc_suite.viewers.offscreen import fit_camera

FILE = Path(__file__).parent / "images" / "film.webp"
SIZE = (640, 400)
RATE = 10  # pictures a second
PART = 33  # pictures of each part
BENCHMARK, ROBOTS = "TwoArmTransport", ["Panda", "Panda"]


def teleoperation() -> Iterator[Image.Image]:
    """Yield pictures of the page while a cube is lifted."""
    pictures = [*draw_teleop.film()]
    for k in range(PART):
        yield pictures[min(round(k * len(pictures) / (PART - 5)), len(pictures) - 1)]


def walk() -> Iterator[Image.Image]:
    """Yield pictures of GR1, which is pushed from the side while it walks."""
    walker = Walk("GR1FreeBody", size=SIZE)
    walker.advance(1.2)
    for _ in range(PART):
        walker.advance(walker.data.time + 1.0 / RATE)
        yield walker.picture()


def benchmark() -> Iterator[Image.Image]:
    """Yield pictures of an expert that solves a benchmark, faster than in the world."""
    env = wbc_suite.make(BENCHMARK, robots=ROBOTS)
    assert isinstance(env, RobotEnv)
    steps = draw_benchmarks.solve(env, env.horizon)
    shown = {round(steps * (k + 1) / PART) for k in range(PART)}
    observation, _ = env.reset(seed=draw_benchmarks.SEED)
    policy = make_policy("expert", env, draw_benchmarks.SEED)
    model, data = env.simulation.model, env.simulation.data
    points, aspect = draw_benchmarks.subject(env), SIZE[0] / SIZE[1]
    camera = fit_camera(draw_benchmarks.VIEW, points, aspect=aspect)
    large = {"width": 2 * SIZE[0], "height": 2 * SIZE[1]}
    with make_renderer(model, preset="quality", **large) as renderer:
        for step in range(1, steps + 1):
            observation, *_ = env.step(policy(observation))
            if step in shown:
                renderer.update_scene(data, camera)
                yield Image.fromarray(renderer.render())
    env.close()


def main() -> None:
    """Draw the parts one after the other."""
    film = [
        picture.resize(SIZE, Image.Resampling.LANCZOS)
        for part in (teleoperation, walk, benchmark)
        for picture in part()
    ]
    save_film(FILE, film, rate=RATE, quality=75)


if __name__ == "__main__":
    main()
