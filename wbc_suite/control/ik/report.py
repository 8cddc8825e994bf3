"""Reports of a whole-body controller: errors of its frames, and why they remain."""

from collections import defaultdict
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cache, partial
from typing import Any, NamedTuple

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.control.ik.backend import IkStep
from wbc_suite.control.ik.config import WholeBodyIKConfig
from wbc_suite.control.ik.frame_targets import ControlledFrames
from wbc_suite.control.reasons import (
    Contact,
    InMotion,
    LazyReasons,
    Reason,
    TorqueLimit,
    TrackingError,
    free_axes,
)
from wbc_suite.control.state import RobotState
from wbc_suite.kinematics import Configuration, Conversion
from wbc_suite.qp import ActiveLimit, Conflict, OutOfReach
from wbc_suite.typing import Matrix, Vector

COMMAND_STANDSTILL = 1e-3
"""rad/s or m/s; a command slower than that stands."""

BODY_STANDSTILL = 0.02
"""rad/s or m/s; a robot slower than that stands."""

CONTACT_SPEED = 0.1
"""rad/s or m/s; a robot that presses on something may still move this fast."""

MIN_FORCE = 1.0
"""N; lighter contacts hold nothing back."""

Reasons = Sequence[Sequence[Reason]]
"""Reasons of each controlled frame."""


class Commanded(NamedTuple):
    """What a robot follows: configuration, goals in its world, targets of joints."""

    q: Vector
    goals: Sequence[pin.SE3]
    joints: Mapping[str, float]


class IkReport:
    """Compares poses with goals, and finds the reasons of remaining errors.

    The configuration is for the report's own use. Contacts of feet hold nothing back.
    `few` has the hands whose arms have few joints.
    """

    def __init__(
        self,
        config: WholeBodyIKConfig,
        configuration: Configuration,
        conversion: Conversion,
        *,
        feet: Collection[str],
        few: Collection[str],
    ) -> None:
        self._config, self._configuration = config, configuration
        self._conversion, self._feet, self._few = conversion, feet, few
        self._frames = ControlledFrames(config, configuration)
        self._support = [self._joints_of(frame.frame) for frame in config.frames]

    def frames(
        self,
        state: RobotState,
        goals: Sequence[pin.SE3],
        answer: IkStep,
        commanded: Commanded,
    ) -> dict[str, dict[str, Any]]:
        """Return what `info["ik"]["frames"]` holds; goals are poses in the world.

        Reasons are those of this moment, and are computed when they are read.
        """
        q = self._conversion.q_to_pinocchio(state.data.qpos)
        errors, reached = self._compare(q, goals)
        reasons: Callable[[], Reasons] = tuple
        if not all(reached):
            turning = {
                k: self._configuration.frame_jacobian(str(frame.frame))
                for k, frame in enumerate(self._config.frames)
                if frame.frame in self._few
                and errors[k][0] <= self._config.tolerance[0]
            }
            reasons = cache(
                self._reasons(state, reached, answer, commanded, turning=turning)
            )
        return {
            frame.name: {
                "reached": is_reached,
                "position_error": position,
                "orientation_error": angle,
                "reasons": []
                if is_reached
                else LazyReasons(lambda k=k: list(dict.fromkeys(reasons()[k]))),
            }
            for k, (frame, is_reached, (position, angle)) in enumerate(
                zip(self._config.frames, reached, errors, strict=True)
            )
        }

    def _compare(
        self, q: Vector, goals: Sequence[pin.SE3]
    ) -> tuple[list[list[float]], list[bool]]:
        """Return each frame's distances, and whether they are within tolerance."""
        self._configuration.update(q)
        errors = self._frames.measure(goals).tolist()
        linear, angular = self._config.tolerance
        return errors, [p <= linear and r <= angular for p, r in errors]

    def _reasons(
        self,
        state: RobotState,
        reached: Sequence[bool],
        answer: IkStep,
        commanded: Commanded,
        *,
        turning: Mapping[int, Matrix],
    ) -> Callable[[], Reasons]:
        """Return a function that finds each frame's reasons, now or later.

        `turning` has the Jacobians of hands in place whose arms have few joints.

        Where the commanded robot is at its goal, the reason is why the body is not;
        else it is the solver's, or the limits where the solver has none.
        """
        standing = float(np.abs(answer.v).max(initial=0.0)) < COMMAND_STANDSTILL
        explain = answer.explain or dict
        held_back: Reasons = [()] * len(reached)
        compare = cache(partial(self._compare, commanded.q, commanded.goals))
        if standing and any(compare()[1]):
            held_back = self._held_back(state, commanded.joints)

        def find() -> Reasons:
            solver, arrived = explain(), compare()[1]
            found: list[Sequence[Reason]] = []
            for k, frame in enumerate(self._config.frames):
                if arrived[k]:
                    why: Sequence[Reason] = held_back[k]
                elif frame.name in solver:
                    why = solver[frame.name]
                else:
                    why = self._from_limits(k, reached, answer)
                if k in turning:
                    why = [free_axes(turning[k]), *why]
                elif not why and standing and not arrived[k]:
                    why = [OutOfReach()]
                found.append(why or [InMotion()])
            return found

        return find

    def _held_back(self, state: RobotState, targets: Mapping[str, float]) -> Reasons:
        """Return what each frame's limb presses on, or else the joint that lags."""
        v = self._conversion.v_to_pinocchio(state.data.qpos, state.data.qvel)
        speed = float(np.abs(v).max(initial=0.0))
        if speed > CONTACT_SPEED:
            return [()] * len(self._support)
        found = contacts_of(state, except_links=self._feet)
        contacts = [(self._joints_of(x.link), x) for x in found]
        lagging: list[Reason] = []
        if speed < BODY_STANDSTILL:
            aims = np.fromiter(targets.values(), float)
            lagging.append(lagging_joint(state, tuple(targets), aims))
        return [
            [contact for joints, contact in contacts if support & joints] or lagging
            for support in self._support
        ]

    def _joints_of(self, frame: str | None) -> set[str]:
        """Return the joints that move a frame; all without one."""
        names = self._configuration.velocity_names()
        if frame is None:
            return set(names)
        return {names[i] for i in self._configuration.support(frame)}

    def _from_limits(
        self, k: int, reached: Sequence[bool], answer: IkStep
    ) -> Sequence[Reason]:
        """Return the limits on the frame's joints, or else the frames in conflict."""
        support = self._support[k]
        limits = [
            reason
            for reason in answer.limits()
            if not (isinstance(reason, ActiveLimit) and reason.is_joint)
            or reason.name in support
        ]
        return limits or [
            Conflict(other.name)
            for i, other in enumerate(self._config.frames)
            if i != k
            and not reached[i]
            and other.level <= self._config.frames[k].level
            and support & self._support[i]
        ]


def contacts_of(
    state: RobotState, *, except_links: Collection[str] = ()
) -> list[Contact]:
    """Return what the robot presses on but for some links, greatest force first."""
    forces: dict[tuple[str, str], float] = defaultdict(float)
    wrench = np.zeros(6)
    for i, geoms in enumerate(state.data.contact.geom):
        links = [_link(state, int(geom)) for geom in geoms]
        if (links[0] is None) == (links[1] is None):
            continue
        own = 0 if links[0] is not None else 1
        link = str(links[own])
        if link not in except_links:
            mujoco.mj_contactForce(state.model, state.data, i, wrench)
            forces[link, _object(state, int(geoms[1 - own]))] += float(wrench[0])
    found = [Contact(link=a, other=b, force=f) for (a, b), f in forces.items()]
    return sorted((x for x in found if x.force > MIN_FORCE), key=lambda x: -x.force)


def lagging_joint(
    state: RobotState, joints: tuple[str, ...], targets: Vector
) -> TorqueLimit | TrackingError:
    """Return which joint is farthest from its target, shape (n,), and why."""
    addresses, _ = state.joint_addresses(joints)
    errors = np.abs(targets - state.data.qpos[addresses])
    worst = int(np.argmax(errors))
    actuator = state.actuator_ids[state.actuators.index(joints[worst])]
    low, high = state.model.actuator_ctrlrange[actuator]
    saturated = not low < state.data.ctrl[actuator] < high
    reason = TorqueLimit if saturated else TrackingError
    return reason(joints[worst], float(errors[worst]))


def _link(state: RobotState, geom: int) -> str | None:
    name = state.model.body(int(state.model.geom_bodyid[geom])).name
    own = state.prefix and name.startswith(state.prefix)
    return name.removeprefix(state.prefix) if own else None


def _object(state: RobotState, geom: int) -> str:
    body = int(state.model.geom_bodyid[geom])
    names = state.model.body(body).name, state.model.geom(geom).name
    return names[0] if body else names[1] or "world"
