"""CPU times of environment steps, of plain physics steps, and of rendered images.

Benchmarks of other packages import this module, so it needs only MuJoCo and NumPy.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import mujoco
import numpy as np

clock = time.process_time_ns
_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)


def times(count: int, run: Callable[[], object]) -> list[float]:
    """Return the CPU time of each of several runs, us."""
    found: list[float] = []
    for _ in range(count):
        start = clock()
        run()
        found.append((clock() - start) / 1e3)
    return found


@dataclass(kw_only=True)
class Block:
    """CPU times of environment steps, and of equally long plain physics, us."""

    step: list[float] = field(default_factory=list)
    raw: list[float] = field(default_factory=list)

    def extend(self, other: "Block") -> None:
        """Add another block's times."""
        self.step += other.step
        self.raw += other.raw


@dataclass(kw_only=True)
class Frames:
    """Times of rendered images, us: CPU time of all threads, and wall time."""

    cpu: list[float] = field(default_factory=list)
    wall: list[float] = field(default_factory=list)

    def extend(self, other: "Frames") -> None:
        """Add the times of other images."""
        self.cpu += other.cpu
        self.wall += other.wall

    @property
    def per_second(self) -> float:
        """Images per second of wall time."""
        return 1e6 / float(np.median(self.wall))


def time_frames(count: int, draw: Callable[[], object]) -> Frames:
    """Time the rendering of images in sequence."""
    frames = Frames()
    for _ in range(count):
        start = time.perf_counter_ns()
        frames.cpu += times(1, draw)
        frames.wall.append((time.perf_counter_ns() - start) / 1e3)
    return frames


def time_block(
    step: Callable[[np.ndarray], object],
    actions: Sequence[np.ndarray],
    *,
    model: mujoco.MjModel,
    data: mujoco.MjData,
    substeps: int,
) -> Block:
    """Time steps, then `mj_step` from their initial states with constant controls.

    Model and data are those of the environment; each of its steps takes an action and
    makes so many substeps.
    """
    size = mujoco.mj_stateSize(model, _STATE)
    starts, controls = np.zeros((len(actions), size)), []
    block = Block()
    for action, start in zip(actions, starts, strict=True):
        mujoco.mj_getState(model, data, start, _STATE)
        block.step += times(1, lambda: step(action))  # noqa: B023
        controls.append(data.ctrl.copy())
    scratch = mujoco.MjData(model)
    for start, control in zip(starts, controls, strict=True):
        mujoco.mj_setState(model, scratch, start, _STATE)
        scratch.ctrl[:] = control
        block.raw += times(1, lambda: mujoco.mj_step(model, scratch, nstep=substeps))
    return block
