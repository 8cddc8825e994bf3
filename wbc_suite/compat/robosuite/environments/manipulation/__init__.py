"""The tasks of the catalogue under robosuite's class names, and their bases."""

from functools import partialmethod
from typing import Any

import numpy as np

from wbc_suite.benchmark import BENCHMARKS
from wbc_suite.benchmark.wipe import MARK
from wbc_suite.compat.robosuite.environments.arguments import DEFAULT_WIPE_CONFIG
from wbc_suite.compat.robosuite.environments.robot_env import ManipulationEnv
from wbc_suite.compat.robosuite.environments.robot_env import RobotEnv as RobotEnv
from wbc_suite.compat.robosuite.models.objects.bodies import TaskObject
from wbc_suite.compat.robosuite.utils.transform_utils import mat2quat


class TwoArmEnv(ManipulationEnv):
    """An environment for one robot with two arms, or two with one each."""

    def _arm(self, k: int) -> tuple[Any, str]:
        """Return robot and arm of the k-th hand."""
        if len(self.robots) > 1:
            return self.robots[k], self.robots[k].arms[0]
        return self.robots[0], self.robots[0].arms[k]

    def _gripper_to(self, k: int, target: Any, kind: str = "body", **kw: Any) -> Any:
        robot, arm = self._arm(k)
        return self._gripper_to_target(robot.gripper[arm], target, kind, **kw)

    _gripper0_to_target = partialmethod(_gripper_to, 0)
    _gripper1_to_target = partialmethod(_gripper_to, 1)

    def _hand(self, k: int, field: str) -> Any:
        robot, arm = self._arm(k)
        return getattr(self.sim.data, field)[robot.eef_site_id[arm]].copy()

    _eef0_xpos = property(lambda self: self._hand(0, "site_xpos"))
    _eef1_xpos = property(lambda self: self._hand(1, "site_xpos"))
    _eef0_xmat = property(lambda self: self._hand(0, "site_xmat").reshape(3, 3))
    _eef1_xmat = property(lambda self: self._hand(1, "site_xmat").reshape(3, 3))
    _eef0_xquat = property(lambda self: mat2quat(self._eef0_xmat))
    _eef1_xquat = property(lambda self: mat2quat(self._eef1_xmat))


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


def _make(name: str, base: type) -> type:
    body = {
        "benchmark": name,
        "_setup_references": _setup_references,
        "__module__": __name__,
        "__doc__": f"Our benchmark {name}; see `tasks/`.",
    }
    if name == "Wipe":
        body["_reset_internal"] = _draw_height
    return type(name, (base,), body)


for _name in BENCHMARKS:
    _base = TwoArmEnv if _name.startswith("TwoArm") else ManipulationEnv
    globals()[_name] = _make(_name, _base)
