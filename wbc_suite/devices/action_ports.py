"""Ports: the slices of an action that a device can command, and their encoding."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.control import FrameKind
from wbc_suite.control.action import ActionSlice, Axis, SliceKind
from wbc_suite.errors import ConfigError
from wbc_suite.typing import Vector

_VELOCITY_AXES = (Axis.FORWARD, Axis.SIDEWAYS, Axis.TURN)


class LimbKind(StrEnum):
    """Components of a pose that a limb's target commands."""

    POSE = "pose"
    POSITION = "position"
    ORIENTATION = "orientation"
    PLANAR = "planar"


@dataclass(frozen=True, slots=True, kw_only=True)
class LimbPort:
    """A slice that commands the pose of a frame.

    Attributes:
        body: Body that the frame is fixed to; -1 for none.
        measure: Returns the pose of the simulated frame in the world.
        encode: Returns the values of the slice for a target in the world.
        ground: Returns the pose of the base that targets move with; None if they are
            fixed in the world.
    """

    name: str
    kind: LimbKind
    body: int
    measure: Callable[[], pin.SE3]
    encode: Callable[[pin.SE3], Vector]
    ground: Callable[[], pin.SE3] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedPort:
    """A slice that commands the velocity of a base.

    Attributes:
        axes: Indices of its values in forward, left, turn.
        unit: Velocity of a value of 1, m/s or rad/s.
    """

    name: str
    axes: tuple[int, ...]
    unit: Vector

    def encode(self, velocity: Vector) -> Vector:
        """Return the values of the slice for a velocity, shape (3,)."""
        return velocity[list(self.axes)] / self.unit


@dataclass(frozen=True, slots=True, kw_only=True)
class JointPort:
    """A slice that commands joint positions, or steps of them.

    `measure` returns the positions of the joints, rad or m, and `encode` the values of
    the slice for target positions.
    """

    name: str
    joints: tuple[str, ...]
    measure: Callable[[], Vector]
    encode: Callable[[Vector], Vector]


def limb_ports(env: Any) -> dict[str, LimbPort]:
    """Return the limbs of all robots by slice, in the order of the action.

    Raises:
        ConfigError: If a whole-body controller has no targets in the world.
    """
    ports = {}
    for index, controller, slices in _robots(env):
        is_whole_body = hasattr(getattr(controller, "config", None), "frames")
        make = _whole_body if is_whole_body else _parts
        ports |= {p.name: p for p in make(env, controller, index, slices)}
    return ports


def speed_ports(env: Any) -> dict[str, SpeedPort]:
    """Return the slices that command velocities of a base, by name."""
    ports = {}
    for part in env.unwrapped.action_layout.slices:
        if part.kind is SliceKind.BASE and {*part.labels} <= {*_VELOCITY_AXES}:
            axes = tuple(_VELOCITY_AXES.index(Axis(label)) for label in part.labels)
            ports[part.name] = SpeedPort(name=part.name, axes=axes, unit=_unit(part))
    return ports


def joint_ports(env: Any) -> dict[str, JointPort]:
    """Return the slices that command joint positions, by name."""
    data, ports = env.unwrapped.simulation.data, {}
    for index, _, slices in _robots(env):
        for part in slices.values():
            if part.kind is SliceKind.POSTURE:
                names = [f"robot{index}_{joint}" for joint in part.labels]
                places = [data.joint(name).qpos for name in names]
                ports[part.name] = _joint_port(part, places)
    return ports


def side_of(name: str) -> str:
    """Return `right` or `left` if a limb's name contains it, else the name."""
    return next((side for side in ("right", "left") if side in name.split("_")), name)


def robot_of(name: str) -> str:
    """Return the prefix of a slice's robot if there are several robots, else ``''``."""
    first = name.split("_")[0]
    return first + "_" if first[:5] == "robot" and first[5:].isdigit() else ""


def _joint_port(part: ActionSlice, places: list[Any]) -> JointPort:
    def measure() -> Vector:
        return np.array([place[0] for place in places])

    def encode(target: Vector) -> Vector:
        if part.units[0].scale is not None:  # values are steps
            return np.clip((target - measure()) / _unit(part), part.low, part.high)
        return np.clip(target, part.low, part.high)

    return JointPort(name=part.name, joints=part.labels, measure=measure, encode=encode)


def _robots(env: Any) -> Iterator[tuple[int, Any, dict[str, ActionSlice]]]:
    """Yield each robot's number, controller, and slices by the controller's names."""
    controllers, layout = env.unwrapped.controllers, env.unwrapped.action_layout
    for index, controller in enumerate(controllers):
        several = f"robot{index}_" if len(controllers) > 1 else ""
        slices = {
            part.name.removeprefix(several): part
            for part in layout.slices
            if part.name.startswith(several)
        }
        yield index, controller, slices


def _whole_body(
    env: Any, controller: Any, index: int, slices: dict[str, ActionSlice]
) -> Iterator[LimbPort]:
    config = controller.config
    if (config.input_type, config.input_ref_frame) != ("absolute", "world"):
        raise ConfigError(
            "Teleoperation needs a whole-body controller with input_type 'absolute' "
            f"and input_ref_frame 'world', not {type(controller).__name__} with "
            f"{config.input_type!r} and {config.input_ref_frame!r}."
        )
    for frame in config.frames:
        kind = frame.behaviour
        body, measure = _reader(env.unwrapped.simulation, frame.frame, f"robot{index}_")
        yield LimbPort(
            name=slices[frame.name].name,
            kind=_limb_kind(kind),
            body=body,
            measure=measure,
            encode=kind.values,
        )


def _limb_kind(kind: FrameKind) -> LimbKind:
    """Return the components of a pose that frames of a kind command."""
    if "yaw" in kind.labels:
        return LimbKind.PLANAR
    if not any(kind.counted[3:]):
        return LimbKind.POSITION
    return LimbKind.POSE if any(kind.counted[:3]) else LimbKind.ORIENTATION


def _reader(
    simulation: Any, frame: str | None, prefix: str
) -> tuple[int, Callable[[], pin.SE3]]:
    """Return a frame's body and a function of its pose; None: centre of mass."""
    model, data = simulation.model, simulation.data
    if frame is None:
        names = [model.body(b).name for b in range(model.nbody)]
        root = next(b for b, name in enumerate(names) if name.startswith(prefix))
        return -1, lambda: pin.SE3(np.eye(3), data.subtree_com[root].copy())
    site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, prefix + frame)
    if site < 0:
        body = model.body(prefix + frame).id
        return body, lambda: _pose(data.xmat[body], data.xpos[body])
    body = int(model.site_bodyid[site])
    return body, lambda: _pose(data.site_xmat[site], data.site_xpos[site])


def _parts(
    env: Any, controller: Any, index: int, slices: dict[str, ActionSlice]
) -> Iterator[LimbPort]:
    for given in getattr(controller, "pose_inputs", tuple)():
        if given.action.name in slices:
            yield LimbPort(
                name=slices[given.action.name].name,
                kind=LimbKind(given.action.kind),
                body=given.body,
                measure=given.measure,
                encode=given.encode,
                ground=given.reference,
            )


def _pose(R: Vector, p: Vector) -> pin.SE3:
    return pin.SE3(R.reshape(3, 3).copy(), p.copy())


def _unit(part: ActionSlice) -> Vector:
    """Return the quantity of a value of 1."""
    return np.array([1.0 if u.scale is None else u.scale for u in part.units])
