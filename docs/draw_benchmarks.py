"""Draw every benchmark, each with another robot, and their page: `make gallery`."""

import argparse
from pathlib import Path

import mujoco
import numpy as np
from PIL import Image

import wbc_suite
from wbc_suite.benchmark import BENCHMARKS, load_benchmark
from wbc_suite.catalogue import Catalogue
from wbc_suite.sensing.renderer import make_renderer
from wbc_suite.tomlfile import read_toml

HERE = Path(__file__).parent
FOLDER = HERE / "images" / "benchmarks"
PAGE = HERE / "benchmark_gallery.md"
AZIMUTH, ELEVATION = 142.0, -20.0  # degrees; 180 looks the robot in the face
ROOM, NEAR = 4.0, 2.5  # m
KNEE = 0.45  # m; below stand legs of tables
SPREAD = 1.5  # m; wider scenes with tables come nearer to the camera than their middle
SIZE = (320, 240)  # pixels; drawn twice as large: smooth edges
COLUMNS = 3
ROBOTS: dict[str, str | list[str]] = {
    "Lift": "GR1",
    "Stack": "Sawyer",
    "PickPlace": "IIWA",
    "PickPlaceSingle": "Jaco",
    "PickPlaceMilk": "Kinova3",
    "PickPlaceBread": "UR5e",
    "PickPlaceCereal": "XArm7",
    "PickPlaceCan": "IIWA14",
    "NutAssembly": "GR1FixedLowerBody",
    "NutAssemblySingle": "PandaOmron",
    "NutAssemblySquare": "TiagoDifferential",
    "NutAssemblyRound": "SpotWithArm",
    "Door": "Panda",
    "Stand": "GR1FreeBody",
    "Reach": "GR1FreeBody",
    "WalkTo": "Spot",
    "Carry": "GR1FreeBody",
    "LocoLift": "SpotWithArm",
    "Wipe": "GR1FreeBody",
    "ToolHang": "SpotWithArmFloating",
    "TwoArmLift": "Baxter",
    "TwoArmPegInHole": ["Panda", "Panda"],
    "TwoArmHandover": "Tiago",
    "TwoArmTransport": ["PandaDexRH", "PandaDexLH"],
}
"""Robots that are drawn at each benchmark."""

HEAD = """# Benchmarks

Each is `wbc_suite.make(NAME, robots=...)`, or an
[id](environments.md#the-benchmarks) for gymnasium, and works with every robot that has
enough hands, or feet where it walks. Parameters are in `tasks/`, formulas of success
and reward in `wbc_suite/benchmark/`. Written by `make gallery`.
"""


def robot_of(name: str) -> str | list[str]:
    """Return the robots that are drawn at a benchmark."""
    return ROBOTS.get(name, list(load_benchmark(name).robots))


def title_of(name: str) -> str:
    """Return the title of a benchmark."""
    path = Catalogue().find("tasks", name, kind="benchmark file")
    return str(read_toml(path)["title"])


def picture_of(name: str) -> Path:
    """Return where the picture of a benchmark lies."""
    return FOLDER / f"{name.casefold()}.jpg"


def draw(name: str) -> None:
    """Draw one benchmark as an episode begins, from the front and a little aside."""
    width, height = SIZE
    env = wbc_suite.make(name, robots=robot_of(name), compiled=False)
    env.reset(seed=1)
    model, data = env.simulation.model, env.simulation.data
    view = {"width": 2 * width, "height": 2 * height}
    with make_renderer(model, preset="quality", **view) as renderer:
        renderer.update_scene(data, viewpoint(model, data))
        picture = Image.fromarray(renderer.render())
    env.close()
    small = picture.resize(SIZE, Image.Resampling.LANCZOS)
    small.save(picture_of(name), quality=88, optimize=True)


def viewpoint(model: mujoco.MjModel, data: mujoco.MjData) -> mujoco.MjvCamera:
    """Return a camera that sees everything, and tall scenes from knee height up."""
    shown = (model.geom_group < 3) & (model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE)
    centers, half = np.split(model.geom_aabb[shown], 2, axis=1)
    turns = data.geom_xmat[shown].reshape(-1, 3, 3)
    middles = data.geom_xpos[shown] + np.einsum("gij,gj->gi", turns, centers)
    reach = np.einsum("gij,gj->gi", np.abs(turns), half)
    here = np.linalg.norm(middles, axis=1) < ROOM  # what is not used stands far off
    low, high = (middles - reach)[here].min(0), (middles + reach)[here].max(0)
    flat = high[2] < 2 * KNEE
    low[2] = 0.0 if flat else KNEE
    camera = mujoco.MjvCamera()
    camera.lookat[:] = 0.5 * (low + high)
    camera.azimuth, camera.elevation = AZIMUTH, ELEVATION
    right = np.array([np.sin(np.radians(AZIMUTH)), -np.cos(np.radians(AZIMUTH)), 0.0])
    wide = float(np.abs(right) @ (high - low)) * SIZE[1] / SIZE[0]
    tall = float(high[2] - low[2]) + 0.3 * float(
        np.abs(right[:2][::-1]) @ (high - low)[:2]
    )
    fitting = 0.48 * max(wide, tall) / np.tan(np.radians(22.5)) + 0.3
    near = high[:2] - low[:2] - (0.0 if flat else SPREAD)
    camera.distance = max(fitting, NEAR) + 0.35 * max(*near, 0.0)
    return camera


def cell(name: str) -> tuple[str, str]:
    """Return a benchmark's picture and its words."""
    robots = robot_of(name)
    shown = robots if isinstance(robots, str) else " and ".join(robots)
    image = picture_of(name).relative_to(HERE)
    return f"![{name}]({image})", f"`{name}`: {title_of(name)} ({shown})"


def page() -> str:
    """Write the page."""
    lines, names = [HEAD], sorted(BENCHMARKS)
    for k in range(0, len(names), COLUMNS):
        cells = [cell(name) for name in names[k : k + COLUMNS]]
        images, words = zip(*cells, strict=True)
        rule = [["---"] * len(cells)] if k == 0 else []
        rows = [images, *rule, words]
        lines += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("only", nargs="*", help="names to draw; all by default")
    only = {name.casefold() for name in parser.parse_args().only}
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name in sorted(BENCHMARKS):
        if not only or name.casefold() in only:
            print(f"drawing {name}", flush=True)
            draw(name)
    PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
