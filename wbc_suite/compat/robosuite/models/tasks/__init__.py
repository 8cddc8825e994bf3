"""Tasks: an arena, robots and objects in one scene."""

from collections.abc import Sequence
from typing import Any

import mujoco

from wbc_suite.compat.robosuite.forwarding import does_nothing
from wbc_suite.compat.robosuite.models.base import MujocoXML
from wbc_suite.errors import ConfigError
from wbc_suite.robot import RobotDescription
from wbc_suite.scene import ArenaConfig, Push
from wbc_suite.sensing.reading import Reading


class MujocoWorldBase(MujocoXML):
    """An empty world."""

    def __init__(self) -> None:
        super().__init__('<mujoco model="scene"><compiler angle="radian"/></mujoco>')


class Task(MujocoWorldBase):
    """A scene; robots stand at the places of their models.

    Attributes:
        mujoco_arena: The arena.
        mujoco_robots: Models of the robots, which our engine adds to the scene.
        mujoco_objects: The objects.
    """

    def __init__(
        self, mujoco_arena: Any, mujoco_robots: Any, mujoco_objects: Any = None
    ) -> None:
        super().__init__()
        self.mujoco_arena = mujoco_arena
        self.mujoco_robots = _listed(mujoco_robots)
        self.mujoco_objects = _listed(mujoco_objects)
        self.merge_arena(mujoco_arena)
        self.merge_objects(self.mujoco_objects)

    def merge_arena(self, mujoco_arena: Any) -> None:
        """Add an arena."""
        self.merge(mujoco_arena)

    def merge_objects(self, mujoco_objects: Any) -> None:
        """Add objects."""
        for item in _listed(mujoco_objects):
            self.merge_assets(item)
            self.worldbody.append(item.get_obj())


class ManipulationTask(Task):
    """A scene with objects that robots move."""


def _listed(given: Any) -> list[Any]:
    if given is None:
        return []
    return list(given) if isinstance(given, list | tuple) else [given]


class TaskBenchmark:
    """The scene of a `Task` as a benchmark of ours; reward and success are the env's.

    Raises:
        ConfigError: If the environment has set no `model`.
    """

    gripper: str | None = None
    pushes: Sequence[Push] = ()
    arena: ArenaConfig | None = None
    robots: Sequence[str] = ("Panda",)

    def __init__(self, env: Any) -> None:
        if not isinstance(env.model, Task):
            raise ConfigError(
                f"{type(env).__name__}._load_model must set self.model to a "
                "ManipulationTask, or the class must derive from one of our tasks."
            )
        self._env, self._task = env, env.model
        self.name = self.title = type(env).__name__
        self.horizon = 1000

    def arrange(
        self, robots: Sequence[RobotDescription], configuration: str
    ) -> tuple[RobotDescription, ...]:
        """Return the robots, which are at the places of their models."""
        return tuple(robots)

    def build(self, spec: mujoco.MjSpec) -> None:
        """Add arena and objects; the arena brings its own floor and lights."""
        own = mujoco.MjSpec.from_string(self._task.get_xml())
        for element in (*spec.worldbody.geoms, *spec.worldbody.lights):
            spec.delete(element)
        for texture in (t for t in own.textures if t.name == "sky"):
            own.delete(texture)
        taken = {m.name for m in own.materials} | {t.name for t in own.textures}
        for element in (*spec.materials, *spec.textures):
            if element.name in taken:
                spec.delete(element)
        spec.attach(own, prefix="", frame=spec.worldbody.add_frame())

    equip = does_nothing("robots stay as they are")
    bind = does_nothing("the environment looks elements up")
    reset = does_nothing("`env._reset_internal` moves objects")
    after_step = does_nothing("there is no state of its own")
    failure = does_nothing("no state is a failure")

    def observables(self) -> dict[str, Reading]:
        """Return none; those of the environment are `Observable`s."""
        return {}

    def robot_observables(self) -> dict[str, dict[str, Reading]]:
        """Return none."""
        return {}

    def success(self) -> bool:
        """Return False; the environment's `_check_success` decides."""
        return False

    def reward(self, *, shaped: bool, success: bool | None = None) -> float:
        """Return 0; the environment's `reward` decides."""
        return 0.0
