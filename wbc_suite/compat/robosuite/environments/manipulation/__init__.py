"""The tasks of the catalogue under robosuite's class names, and their bases."""

from collections.abc import Sequence
from typing import Any

from wbc_suite.benchmark import benchmark_names
from wbc_suite.compat.robosuite.environments.robot_env import (
    ManipulationEnv,
    RobotEnv,
    TwoArmEnv,
)
from wbc_suite.compat.robosuite.models.objects.scene import TaskObject

__all__ = ["ManipulationEnv", "RobotEnv", "TwoArmEnv"]


def _setup_references(self: Any) -> None:
    """Let `env.cube`, ... be the objects of the benchmark, by name."""
    states = getattr(self.env.benchmark, "states", {})
    self.objects = [TaskObject(state) for state in states.values()]
    for item in self.objects:
        if not hasattr(self, item.name):
            setattr(self, item.name, item)
        setattr(self, f"{item.name}_body_id", states[item.name].body)
    self.obj_body_id = {name: state.body for name, state in states.items()}
    self.obj_geom_id = {name: sorted(state.geoms) for name, state in states.items()}
    table = getattr(getattr(self.env.benchmark, "config", None), "table", None)
    if table is not None:
        self.table_full_size, self.table_offset = table.size, table.center


def _make(name: str, bases: Sequence[type]) -> type:
    body = {
        "benchmark": name,
        "_setup_references": _setup_references,
        "__module__": __name__,
        "__doc__": f"Our benchmark {name}; see `tasks/`.",
    }
    return type(name, tuple(bases), body)


for _name in benchmark_names():
    _base = TwoArmEnv if _name.startswith("TwoArm") else ManipulationEnv
    globals()[_name] = _make(_name, [_base])
