"""Draw every benchmark while an expert solves it, and their page: `make gallery`."""

import argparse
from pathlib import Path

import numpy as np
from PIL import Image

import wbc_suite
from wbc_suite.benchmark import BENCHMARKS, ObjectBenchmark, load_benchmark
from wbc_suite.catalogue import Catalogue
from wbc_suite.config_files import read_toml
from wbc_suite.envs import RobotEnv
from wbc_suite.evaluation import make_policy
from wbc_suite.sensing.renderer import make_renderer
from wbc_suite.typing import Matrix
from wbc_suite.viewers.model_scene import subject_corners
from wbc_suite.viewers.offscreen import View, fit_camera

HERE = Path(__file__).parent
FOLDER = HERE / "images" / "benchmarks"
PAGE = HERE / "benchmark_gallery.md"
SIZE = (640, 480)  # pixels; drawn twice as large: smooth edges
VIEW = View(azimuth=142.0, elevation=-20.0, fov=34.0, margin=1.15)
VIEWS = {
    "Door": View(azimuth=200.0, elevation=-15.0, fov=34.0, margin=1.3),
    **dict.fromkeys(
        ("Stand", "Reach"), View(azimuth=142.0, elevation=-14.0, fov=34.0, margin=0.85)
    ),
}
"""Of benchmarks that are seen better from elsewhere."""
MOMENT = 0.6  # of the steps that the expert takes
MOMENTS = {
    **dict.fromkeys(("Lift", "TwoArmLift", "LocoLift"), 0.97),
    **dict.fromkeys(("Door", "NutAssemblySquare", "TwoArmPegInHole"), 0.9),
    **dict.fromkeys(("Stack", "ToolHang", "NutAssemblyRound", "Wipe"), 0.75),
    **{"Stand": 0.2, "Reach": 0.5, "Carry": 0.7},
}
SHADOWS = 0.6  # part of the scene that has shadows: small parts have sharp ones
ON_FEET = 2.5  # the same for robots on feet, whose floor has specks beyond it
NEAR = 0.5  # m; things so near to a hand are in the picture
SEED = 1
COLUMNS = 2
ROBOTS: dict[str, str | list[str]] = {
    "Lift": "GR1",
    "Stack": "Sawyer",
    "PickPlace": "IIWA",
    "PickPlaceSingle": "Jaco",
    "PickPlaceMilk": "Kinova3",
    "PickPlaceBread": "UR5e",
    "PickPlaceCereal": "XArm7",
    "PickPlaceCan": "IIWA14",
    "NutAssembly": "XArm7",
    "NutAssemblySingle": "PandaOmron",
    "NutAssemblySquare": "UR5e",
    "NutAssemblyRound": "SpotWithArm",
    "Door": "Panda",
    "Stand": "GR1FreeBody",
    "Reach": "GR1FreeBody",
    "WalkTo": "Spot",
    "Carry": "GR1FreeBody",
    "LocoLift": "SpotWithArm",
    "Wipe": "GR1FreeBody",
    "ToolHang": "Panda",
    "TwoArmLift": "Baxter",
    "TwoArmPegInHole": ["Panda", "Panda"],
    "TwoArmHandover": "Tiago",
    "TwoArmTransport": ["Panda", "Panda"],
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
    """Draw one benchmark while its expert solves it, from close."""
    env = wbc_suite.make(name, robots=robot_of(name))
    steps = round(MOMENTS.get(name, MOMENT) * solve(env, env.horizon))
    solve(env, steps)
    model, data = env.simulation.model, env.simulation.data
    camera = fit_camera(VIEWS.get(name, VIEW), subject(env), aspect=SIZE[0] / SIZE[1])
    on_feet = hasattr(env.benchmark, "standing")
    model.vis.map.shadowclip = ON_FEET if on_feet else SHADOWS
    view = {"width": 2 * SIZE[0], "height": 2 * SIZE[1]}
    with make_renderer(model, preset="quality", **view) as renderer:
        renderer.update_scene(data, camera)
        picture = Image.fromarray(renderer.render())
    env.close()
    small = picture.resize(SIZE, Image.Resampling.LANCZOS)
    small.save(picture_of(name), quality=85, optimize=True)


def solve(env: RobotEnv, most: int) -> int:
    """Let the expert act until it succeeds, or for some steps; return how many."""
    observation, _ = env.reset(seed=SEED)
    policy = make_policy("expert", env, SEED)
    for step in range(most):
        observation, *_, info = env.step(policy(observation))
        if info["success"]:
            return step + 1
    return most


def subject(env: RobotEnv) -> Matrix:
    """Return points that are in the picture: hands, things near them, or the robot."""
    model, data = env.simulation.model, env.simulation.data
    benchmark = env.benchmark
    assert isinstance(benchmark, ObjectBenchmark)
    states = [s for s in benchmark.states.values() if s.geoms]
    hands = [hand.position for hand in benchmark.hands]
    near = [
        state
        for state in states
        if min((np.linalg.norm(state.position - p) for p in hands), default=np.inf)
        < NEAR
    ]
    shown = {
        model.body(body).name
        for hand in benchmark.hands
        for body in hand.gripper_bodies
    }
    shown |= {
        model.body(model.geom_bodyid[g]).name
        for state in near or states
        for g in state.geoms
    }
    if hasattr(benchmark, "standing") or not benchmark.hands:
        shown |= {
            model.body(b).name
            for b in range(model.nbody)
            if model.body(b).name.startswith("robot0_")
        }
    return np.concatenate(
        [subject_corners(model, data, body) for body in sorted(shown)]
    )


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
