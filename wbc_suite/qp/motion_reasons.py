"""Why a stack moves, though its targets may rest."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from wbc_suite.qp.part import STATE
from wbc_suite.qp.report import TickRecord
from wbc_suite.qp.tick import turned
from wbc_suite.typing import Vector

AT_REST = 0.005
"""rad/s or m/s; slower joints stand, and change speed by less than twice that."""


@dataclass(frozen=True, slots=True)
class Approach:
    """A task nears its target, or as near as it gets.

    Attributes:
        task: The task that the step serves most; "limits and equalities" if none.
        joint: The joint that is or was the fastest.
        speed: Its speed; 0 if it has stopped with this tick.
        unit: Unit of that.
    """

    task: str
    joint: str
    speed: float
    unit: str

    def __str__(self) -> str:
        return f"approach: {self.task} ({self.joint}: {self.speed:.2g} {self.unit})"


@dataclass(frozen=True, slots=True)
class Overshoot:
    """A joint turns back from tick to tick; damping grows until it does no more.

    Attributes:
        joint: The joint whose speed changes most.
        damping: What the stack has added, [cost]^2/rad^2.
    """

    joint: str
    damping: float

    def __str__(self) -> str:
        return f"overshoot: {self.joint} (damping {self.damping:.2g})"


@dataclass(frozen=True, slots=True)
class Escaping:
    """Joints leave a posture from which no small step leads on; see `escape`."""

    joints: tuple[str, ...]

    def __str__(self) -> str:
        return f"escape by {', '.join(self.joints)}"


@dataclass(frozen=True, slots=True)
class Relaxed:
    """Rows cannot be kept, and are approached as well as may be."""

    names: tuple[str, ...]

    def __str__(self) -> str:
        return f"cannot be kept: {', '.join(self.names)}"


Motion: TypeAlias = Approach | Overshoot | Escaping | Relaxed
"""Why a stack moves."""


def reasons_to_move(record: TickRecord, conflicts: tuple[str, ...]) -> Iterator[Motion]:
    """Yield why a joint is faster than `AT_REST`, or was at the tick before."""
    results, joints = record.layout.results(record.buffer), record.layout.joints
    v, past = results["v"], results["before"]
    speeds = np.maximum(np.abs(v), np.abs(past[0]))
    if speeds.max(initial=0.0) <= AT_REST:
        return
    if conflicts:
        yield Relaxed(conflicts)
    if len(record.driven):
        yield Escaping(tuple(joints[i] for i in record.driven))
    change = np.abs(v - past[0])
    back = [i for i in range(len(v)) if turned(v[i], past[0, i], past[1, i])]
    if back:
        worst = max(back, key=lambda i: float(change[i]))
        yield Overshoot(
            joints[worst], float(results["state"].view(STATE)["overshoot_damping"][0])
        )
    k = int(np.argmax(speeds))
    unit = f"{record.layout.units[k]}/s"
    yield Approach(_served(record, results["x"]), joints[k], abs(float(v[k])), unit)


def _served(record: TickRecord, x: Vector) -> str:
    """Return the name of the task that a step serves most, by its part of the cost."""
    best, name = 0.0, "limits and equalities"
    for level in record.levels:
        served = [
            (float(level.e[rows] @ (level.W[rows] @ x)), task.name)
            for task, rows in level.tasks
        ]
        for value, task in [*served, (float(level.diagonal[1] @ x), "posture")]:
            if value > best:
                best, name = value, task
        if best > 0.0:
            break
    return name
