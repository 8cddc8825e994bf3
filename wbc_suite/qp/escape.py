"""Escape from local minima of differential inverse kinematics.

Differential inverse kinematics descends, and can end where every small step leads away
from the target: an arm stretched against its elbow's limit, with its target between
hand and shoulder, would have to reach out further before it can fold. Such a posture is
left by driving the joints concerned towards the middle of their ranges for a moment.
Whether that helps is simulated beforehand on a copy of the robot, a few steps per tick,
so that a robot whose target is out of reach stands still.
"""

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from wbc_suite.kinematics import Configuration
from wbc_suite.qp.frame_task import FrameTask
from wbc_suite.qp.level import Level
from wbc_suite.qp.lie import is_usable
from wbc_suite.qp.limit import JointBounds
from wbc_suite.qp.solution import Solution
from wbc_suite.typing import Indices, Vector

_STILL = 0.02  # rad/s or m/s; a slower robot stands
_STANDING_TIME = 0.25  # s of standing before a simulation
_FAR = 5e-3  # m (and rad / _ARM); a smaller error is accepted
_ARM = 0.3  # m; weighs angles against distances
_STEP = 0.02  # s, step of the simulation
_STEPS_PER_SECOND = 200.0  # simulated steps per second of the robot's time
_DRIVE_TIME = 2.5  # s, longest drive towards the middle
_SETTLE_TIME = 2.0  # s given to the tasks afterwards
_ARRIVED = 0.1  # of the range; this near to the middle the drive ends
_BETTER = 0.5  # of the error; what a drive must come under to be worth it
_DRIVE_COST = 3.0  # against the greatest cost of a watched task
_DRIVE_SPEED = 0.5  # of the velocity limit


class Stack(Protocol):
    """What an escape reads of a stack of tasks, and what it simulates with a copy."""

    configuration: Configuration
    bounds: JointBounds
    levels: list[Level]
    v_previous: Vector

    def pressed(self) -> Indices:
        """Return the velocity indices whose bounds hold the command back."""
        ...

    def copy(self) -> "Stack":
        """Return a stack of its own for a copy of the robot."""
        ...

    def solve(self, dt: float) -> Solution:
        """Return the command of the next `dt` seconds."""
        ...


@dataclass(slots=True)
class _Drive:
    """Joints on their way to the middle of their ranges."""

    joints: Indices  # velocity indices
    time: float = 0.0


class Escape:
    """Monitors frame tasks of a stack, and drives joints with two position limits."""

    def __init__(self, stack: Stack, tasks: Sequence[FrameTask]) -> None:
        self._stack, self._tasks = stack, tuple(tasks)
        self._configuration, self._bounds = stack.configuration, stack.bounds
        self._range = self._bounds.q_upper - self._bounds.q_lower
        limited = np.isfinite(self._range) & (self._bounds.q_index >= 0)
        self._limited = np.flatnonzero(limited)
        self._supports = [self._configuration.support(t.frame) for t in self._tasks]
        self.reset()

    def reset(self) -> None:
        """Discard all state."""
        self._still = 0.0
        self._drive: _Drive | None = None
        self._search: Generator[None, None, _Drive | None] | None = None
        self._targets: Vector | None = None  # of the search or drive
        self._simulated: Vector | None = None  # targets that have been simulated

    @property
    def driven(self) -> Sequence[int]:
        """Velocity indices that are driven now."""
        return () if self._drive is None else self._drive.joints.tolist()

    def update(self, dt: float) -> None:
        """Write the bias of the next tick to the tasks of the stack's first level."""
        v = self._stack.v_previous
        self._still = self._still + dt if max(v.max(), -v.min()) < _STILL else 0.0
        self._stack.levels[0].arrays.bias[:] = 0.0
        if self._drive is None and self._search is None:
            if self._still < _STANDING_TIME or not self._is_stuck():
                return
            self._targets = self._present_targets()
            self._search = self._simulate(self._stack.pressed())
        if self._targets_moved(self._targets, 1e-2):
            self._drive, self._search = None, None
        if self._search is not None:
            self._advance(max(1, round(_STEPS_PER_SECOND * dt)))
        if self._drive is not None and self._is_over(self._drive, self._stack):
            self._drive = None
        if self._drive is not None:
            self._push(self._drive, self._stack, dt)

    def _advance(self, steps: int) -> None:
        """Simulate some more steps; begin the drive that was found."""
        assert self._search is not None
        try:
            for _ in range(steps):
                next(self._search)
        except StopIteration as end:
            self._search, self._drive = None, end.value
            self._simulated = self._present_targets()

    def _simulate(self, pressed: Indices) -> Generator[None, None, _Drive | None]:
        """Try drives on a copy of the robot; return the first that helps."""
        far = [e > _FAR for e in self._errors(self._configuration)]
        chains = [s for s, is_far in zip(self._supports, far, strict=True) if is_far]
        chain = np.intersect1d(np.unique(np.concatenate(chains)), self._limited)
        before = np.linalg.norm(self._errors(self._configuration))
        for joints in (np.intersect1d(pressed, chain), chain):
            if not len(joints):
                continue
            copy, drive = self._stack.copy(), _Drive(joints)
            robot = copy.configuration
            while not self._is_over(drive, copy):
                self._push(drive, copy, _STEP)
                robot.update(robot.integrate(copy.solve(_STEP).dq))
                yield
            copy.levels[0].arrays.bias[:] = 0.0
            for _ in range(round(_SETTLE_TIME / _STEP)):
                robot.update(robot.integrate(copy.solve(_STEP).dq))
                yield
            if np.linalg.norm(self._errors(robot)) < _BETTER * before:
                return _Drive(joints)
        return None

    def _is_over(self, drive: _Drive, stack: Stack) -> bool:
        left = np.abs(self._to_middle(drive.joints, stack))
        arrived = bool((left < _ARRIVED * self._range[drive.joints]).all())
        return arrived or drive.time > _DRIVE_TIME

    def _push(self, drive: _Drive, stack: Stack, dt: float) -> None:
        """Write the bias of a drive: squared costs and weighted steps."""
        joints, bias = drive.joints, stack.levels[0].arrays.bias
        cost = _DRIVE_COST * max(float(t.cost.max()) for t in self._tasks)
        speed = np.minimum(self._bounds.v_max[joints], 3.0) * _DRIVE_SPEED * dt
        step = np.clip(self._to_middle(joints, stack), -speed, speed)
        bias[:] = 0.0
        bias[0, joints], bias[1, joints] = cost**2, cost**2 * step
        drive.time += dt

    def _to_middle(self, joints: Indices, stack: Stack) -> Vector:
        bounds, q = self._bounds, stack.configuration.q
        middle = 0.5 * (bounds.q_upper[joints] + bounds.q_lower[joints])
        return middle - q[bounds.q_index[joints]]

    def _is_stuck(self) -> bool:
        tried = self._simulated
        if tried is not None and not self._targets_moved(tried, 1e-3):
            return False
        return any(e > _FAR for e in self._errors(self._configuration))

    def _errors(self, configuration: Configuration) -> list[float]:
        """Return each task's weighted distance; rows without cost do not count."""
        errors: list[float] = []
        for task in self._tasks:
            error = task.error(configuration)
            counts = (task.cost > 0.0) & np.isfinite(error).all()
            kept = np.where(counts, error, 0.0)
            kept[3:] *= _ARM
            errors.append(float(np.linalg.norm(kept)))
        return errors

    def _present_targets(self) -> Vector:
        return np.concatenate([t.target_row.values for t in self._tasks])

    def _targets_moved(self, since: Vector | None, tolerance: float) -> bool:
        present = self._present_targets()
        if since is None or not (is_usable(present) and is_usable(since)):
            return True
        return bool(np.abs(present - since).max() > tolerance)
