"""Stacks of QP tasks: what a robot should do, under limits, solved once per tick.

```python
stack = TaskStack(configuration, [FrameTask("right_hand"), PostureTask(1e-2)])
solution = stack.solve(dt)
configuration.update(configuration.integrate(solution.dq))
```
"""

from wbc_suite.compiling import record_type
from wbc_suite.qp.com_task import ComTask
from wbc_suite.qp.equality import Equality, FrameEquality, LinearEquality
from wbc_suite.qp.frame_task import FrameTask, RelativeFrameTask
from wbc_suite.qp.joint_limits import AccelerationLimit, PositionLimit, VelocityLimit
from wbc_suite.qp.joint_tasks import DampingTask, JointCouplingTask, PostureTask
from wbc_suite.qp.limit import BoxLimit, JointBounds, Limit, LimitKind, RowLimit
from wbc_suite.qp.look_at_task import LookAtTask
from wbc_suite.qp.motion_reasons import Approach, Escaping, Motion, Overshoot, Relaxed
from wbc_suite.qp.part import SharedRow
from wbc_suite.qp.plane_limits import FloorLimit, ObstacleLimit
from wbc_suite.qp.problem import Problem
from wbc_suite.qp.registry import LIMITS, TASKS, register_limit, register_task
from wbc_suite.qp.report import (
    ActiveLimit,
    Conflict,
    OutOfReach,
    Reason,
    TargetNotFinite,
    TaskReport,
    TickRecord,
)
from wbc_suite.qp.self_collision_limit import LinkPair, SelfCollisionLimit
from wbc_suite.qp.solution import Fallback, Solution
from wbc_suite.qp.solver import make_solver
from wbc_suite.qp.stack import TaskStack
from wbc_suite.qp.standing_limits import Sole, SupportLimit, WeightLimit
from wbc_suite.qp.task import JointTask, RowTask, Task

__all__ = [
    "LIMITS",
    "TASKS",
    "AccelerationLimit",
    "ActiveLimit",
    "Approach",
    "BoxLimit",
    "ComTask",
    "Conflict",
    "DampingTask",
    "Equality",
    "Escaping",
    "Fallback",
    "FloorLimit",
    "FrameEquality",
    "FrameTask",
    "JointBounds",
    "JointCouplingTask",
    "JointTask",
    "Limit",
    "LimitKind",
    "LinearEquality",
    "LinkPair",
    "LookAtTask",
    "Motion",
    "ObstacleLimit",
    "OutOfReach",
    "Overshoot",
    "PositionLimit",
    "PostureTask",
    "Problem",
    "Reason",
    "RelativeFrameTask",
    "Relaxed",
    "RowLimit",
    "RowTask",
    "SelfCollisionLimit",
    "SharedRow",
    "Sole",
    "Solution",
    "SupportLimit",
    "TargetNotFinite",
    "Task",
    "TaskReport",
    "TaskStack",
    "TickRecord",
    "VelocityLimit",
    "WeightLimit",
    "make_solver",
    "record_type",
    "register_limit",
    "register_task",
]
