"""Define a benchmark: put a lemon into a bin."""

from collections.abc import Sequence

import mujoco
import numpy as np

import wbc_suite
from wbc_suite.benchmark import ObjectBenchmark, ObjectBenchmarkConfig
from wbc_suite.scene import TableConfig, add_camera, add_table
from wbc_suite.scene.objects import SceneObject, lemon, open_bin
from wbc_suite.scene.placement import Region, UniformSampler

TABLE = TableConfig(size=(0.8, 0.8, 0.05), center=(0.0, 0.0, 0.8))
BIN, PLACES = (0.1, 0.2, 0.8), {"default": (-0.56, 0.0)}
CONFIG = ObjectBenchmarkConfig(
    format=1, name="LemonInBin", title="Sort a lemon", horizon=400, places=PLACES
)


class LemonInBin(ObjectBenchmark):
    """The task is to put a lemon into the bin."""

    def __init__(self) -> None:
        super().__init__(CONFIG)
        region = Region(x=(-0.15, 0.0), y=(-0.2, 0.0))
        self.sampler = UniformSampler(
            names=["lemon"], region=region, origin=TABLE.center
        )

    def furnish(self, spec: mujoco.MjSpec) -> None:
        """Add fixed objects and cameras."""
        add_table(spec, TABLE)
        open_bin("bin", (0.2, 0.2, 0.08)).fixed(BIN).add_to(spec)
        add_camera(spec, "agentview", eye=(0.7, 0.0, 1.5), target=(0.0, 0.0, 0.85))

    def objects(self) -> Sequence[SceneObject]:
        """Return the movable objects."""
        return [lemon("lemon")]

    def success(self) -> bool:
        """Whether the released lemon is inside the bin."""
        x, y, z = self.states["lemon"].position - BIN
        inside = max(abs(x), abs(y)) < 0.1 and 0.0 < z < 0.08
        return inside and not self.scene.grasped("lemon")

    def progress(self) -> float:
        """Return the shaped reward before success."""
        near = 1.0 - np.tanh(5.0 * self.distance(self.states["lemon"].position))
        return 0.3 * near + 0.3 * self.scene.grasped("lemon")


env = wbc_suite.make(LemonInBin, robots="UR5e", reward_shaping=True)
observation, _ = env.reset(seed=1)
print("the lemon starts at", observation["lemon_pos"].round(3))
assert isinstance(env.benchmark, LemonInBin)
env.benchmark.states["lemon"].move((*BIN[:2], 0.9))  # place it above the bin
_, reward, *_, info = [env.step(env.hold_action) for _ in range(20)][-1]
print("reward", reward, "success", info["success"])
