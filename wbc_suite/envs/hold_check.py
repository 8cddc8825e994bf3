"""Simulate a robot for a second at `ready`, and name what moves and why."""

from collections.abc import Iterator, Sequence
from typing import Any

import mujoco
import numpy as np

from wbc_suite.benchmark import (
    Benchmark,
    ObjectBenchmark,
    ObjectBenchmarkConfig,
    load_benchmark,
)
from wbc_suite.benchmark.stand import Stand
from wbc_suite.envs.env import RobotEnv
from wbc_suite.errors import WbcError
from wbc_suite.robot import RobotDescription
from wbc_suite.scene import robot_prefix
from wbc_suite.scene.objects import SceneObject
from wbc_suite.typing import Vector

SECONDS = 1.0
GREATEST_DRIFT = 0.1
"""Largest displacement of a joint, rad or m, that counts as standing still."""
LIGHT = 1e-4
"""kg m^2; a joint with less inertia and no armature oscillates at a step of 2 ms."""
SHOWN = 4  # joints that are named


class _Floor(ObjectBenchmark):
    """A robot alone on the floor."""

    needs_gripper = False

    def __init__(self) -> None:
        places = {"default": (0.0, 0.0)}
        super().__init__(
            ObjectBenchmarkConfig(
                format=1, name="Floor", title="Floor", horizon=1000, places=places
            )
        )

    def furnish(self, spec: mujoco.MjSpec) -> None:
        """Add nothing to the floor."""

    def objects(self) -> Sequence[SceneObject]:
        """Return no object."""
        return ()

    def success(self) -> bool:
        """Return False; there is nothing to do."""
        return False

    def progress(self) -> float:
        """Return no reward."""
        return 0.0


def _unpushed() -> Benchmark:
    """Return Stand without pushes."""
    stand = load_benchmark("Stand")
    assert isinstance(stand, Stand)
    stand.config = stand.config.model_copy(update={"until": 0.0})
    return stand


def alone(robot: RobotDescription, **options: Any) -> RobotEnv:
    """Return an environment with one robot on a floor, on its feet if it is free.

    Raises:
        WbcError: If it cannot be controlled, or an option of `make` is wrong.
    """
    feet = any(frame.role == "foot" for frame in robot.frames)
    benchmark = _unpushed if feet and robot.root.kind == "free" else _Floor
    options.setdefault("horizon", 100_000)
    return RobotEnv(benchmark, robots=robot, **options)


def hold_faults(
    robot: RobotDescription, *, seconds: float = SECONDS, controller: str | None = None
) -> list[str]:
    """Return one sentence for each fault of a robot that holds `ready` in simulation.

    The robot is alone on the floor, with its default controller or that of a file.
    Faults are a fall, divergence, and joints that move away, each with its likely
    cause. The list is empty if the robot stays where it is.
    """
    try:
        env = alone(robot, controller_configs=controller)
    except WbcError as error:
        return [f"It cannot be controlled: {error}"]
    env.reset(seed=0)
    m, data = env.simulation.model, env.simulation.data
    start, weight = data.qpos.copy(), np.abs(data.qfrc_bias)
    failure = ""
    while data.time < seconds and not failure and np.isfinite(data.qpos).all():
        *_, info = env.step(env.hold_action)
        failure = info.get("failure") or info.get("physics_error") or ""
    faults = [failure[0].upper() + failure[1:]] if failure else []
    faults += _divergence(data)
    faults += _moved(robot, m, np.abs(data.qpos - start), weight)
    env.close()
    return faults


def _divergence(data: mujoco.MjData) -> Iterator[str]:
    bad = mujoco.mjtWarning
    if any(data.warning[w].number for w in (bad.mjWARN_BADQPOS, bad.mjWARN_BADQACC)):
        yield (
            "The simulation diverges: give light joints an armature, or take a smaller "
            "time step."
        )


def _moved(
    robot: RobotDescription, m: mujoco.MjModel, away: Vector, weight: Vector
) -> Iterator[str]:
    """Name the joints that have moved most."""
    rows: list[tuple[float, str]] = []
    for joint in robot.joints:
        own = m.joint(f"{robot_prefix(0)}{joint.name}")
        moved = float(away[own.qposadr[0]])
        if not moved <= GREATEST_DRIFT:
            v = int(own.dofadr[0])
            cause = _cause(robot, joint.name, m.dof_M0[v], weight[v])
            unit = "rad" if joint.type == "hinge" else "m"
            text = f"Joint '{joint.name}' moves by {moved:.2f} {unit}{cause}"
            rows.append((moved, text))
    rows.sort(reverse=True)
    yield from (text for _, text in rows[:SHOWN])
    if len(rows) > SHOWN:
        yield f"{len(rows) - SHOWN} more joints move."


def _cause(robot: RobotDescription, name: str, inertia: float, weight: float) -> str:
    joint = robot.joint(name)
    if joint.mimic is not None:
        return f"; it follows '{joint.mimic.joint}'."
    if joint.effort is None and name not in {a.joint for a in robot.actuators}:
        return "; it has no motor, since the file gives it no effort."
    if joint.effort is not None and weight > joint.effort:
        return (
            f"; its effort of {joint.effort:.3g} is less than the {weight:.3g} that "
            "its weight needs."
        )
    if joint.armature == 0.0 and inertia < LIGHT:
        return "; it is light and has no armature."
    return "."
