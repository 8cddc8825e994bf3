"""Cost of one physics step in Lift, with and without merged visual shapes.

Both models hold the same robot at its ready posture without gravity, for no controller
holds it, and the cube just above the table. They step in turns in one run. Times are
CPU times of the process, per step; `geoms` and `MB` say how many geoms the model has
and how much memory it holds, which each environment does.

Usage: python benchmarks/physics_step.py [--quick] [--json FILE]
"""

import time

from harness.report import Report, options

import mujoco  # isort: skip  (after harness: it sets the number of BLAS threads)
import wbc_suite
from wbc_suite.benchmark import load_benchmark
from wbc_suite.robot.mjcf_export import build_mjspec
from wbc_suite.scene import compile_scene, empty_arena, robot_prefix

ROBOTS = ("Panda", "UR5e", "Baxter", "PandaOmron", "Tiago", "SpotWithArm", "GR1")
STEPS, SETTLE = 25, 50
COLUMNS = ("case", "side", "median_us", "p99_us", "geoms", "MB", "n")


class Scene:
    """Lift with one robot, stepped without a controller from its ready posture."""

    def __init__(self, name: str, *, lean: bool) -> None:
        benchmark, spec = load_benchmark("Lift"), empty_arena()
        (robot,) = benchmark.arrange([wbc_suite.load_robot(name)], "default")
        benchmark.build(spec)
        own = build_mjspec(robot, merged=lean)
        for key in list(own.keys):
            own.delete(key)
        spec.attach(own, prefix=robot_prefix(0), frame=spec.worldbody.add_frame())
        self.model = compile_scene(spec) if lean else spec.compile()
        self.model.opt.gravity[:] = 0.0
        self.data = mujoco.MjData(self.model)
        for joint, value in robot.keyframe("ready").items():
            self.data.joint(robot_prefix(0) + joint).qpos[0] = value
        self.data.joint("cube_joint").qpos[2] = benchmark.config.table.center[2] + 0.021
        mujoco.mj_step(self.model, self.data, SETTLE)

    def block(self) -> float:
        """Step, and return the time of a step, us."""
        begin = time.process_time_ns()
        mujoco.mj_step(self.model, self.data, STEPS)
        return (time.process_time_ns() - begin) / STEPS / 1e3


def main() -> None:
    arguments = options(__doc__, "40 blocks of 25 steps, not 400").parse_args()
    report = Report()
    for name in ROBOTS:
        scenes = {
            "lean": Scene(name, lean=True),
            "every shape": Scene(name, lean=False),
        }
        found: dict[str, list[float]] = {side: [] for side in scenes}
        for _ in range(40 if arguments.quick else 400):
            for side, scene in scenes.items():
                found[side].append(scene.block())
        rows = {}
        for side, scene in scenes.items():
            rows[side] = report.add(name, side, found[side], geoms=scene.model.ngeom)
            rows[side]["MB"] = scene.model.nbuffer / 1e6
        report.compare(f"{name}/every_shape", rows["lean"], rows["every shape"])
    report.show("A step of physics in Lift, us of CPU time", COLUMNS)
    report.show_ratios()
    report.write(arguments.json)


if __name__ == "__main__":
    main()
