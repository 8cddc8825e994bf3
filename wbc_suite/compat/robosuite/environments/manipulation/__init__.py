"""The tasks of the catalogue under robosuite's class names, and their bases."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from wbc_suite.benchmark import BENCHMARKS
from wbc_suite.benchmark.wipe import MARK
from wbc_suite.compat.robosuite.environments.robot_env import ManipulationEnv, RobotEnv
from wbc_suite.compat.robosuite.environments.task_numbers import DEFAULT_WIPE_CONFIG
from wbc_suite.compat.robosuite.environments.two_arm_env import TwoArmEnv
from wbc_suite.compat.robosuite.models.objects.scene import TaskObject

__all__ = ["DEFAULT_WIPE_CONFIG", "ManipulationEnv", "RobotEnv", "TwoArmEnv"]


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
        self.table_full_size = np.array(table.size)
        self.table_offset = np.array(table.center)


def _draw_height(self: Any) -> None:
    """Lower Wipe's table by `table_height` of `task_config`, spread by its `_std`."""
    config = DEFAULT_WIPE_CONFIG | dict(self.arguments.get("task_config") or {})
    mean, spread = config["table_height"], config["table_height_std"]
    task, model = self.env.benchmark, self.sim.model
    self.table_offset = np.array(task.config.table.center, np.float64)
    self.table_offset[2] += min(0.0, self.rng.normal(mean, spread))
    model.body_pos[model.body_name2id("table")] = self.table_offset
    task.marks[:, 2] = self.table_offset[2]
    for k, place in enumerate(task.marks):
        model.geom_pos[model.geom_name2id(f"{MARK}{k}")] = place
    task.wipe(np.zeros(len(task.marks), dtype=np.bool_))


def _make(name: str, bases: Sequence[type]) -> type:
    body = {
        "benchmark": name,
        "_setup_references": _setup_references,
        "__module__": __name__,
        "__doc__": f"Our benchmark {name}; see `tasks/`.",
    }
    if name == "Wipe":
        body["_reset_internal"] = _draw_height
    return type(name, tuple(bases), body)


for _name in BENCHMARKS:
    _base = TwoArmEnv if _name.startswith("TwoArm") else ManipulationEnv
    globals()[_name] = _make(_name, [_base])
