"""Ports: the slices of an action that a device can command, and their encoding."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
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
        decode: Returns the target of values of the slice in the present state.
        ground: Returns the pose of the base that targets move with; None if there is
            none.
    """

    name: str
    kind: LimbKind
    body: int
    measure: Callable[[], pin.SE3]
    encode: Callable[[pin.SE3], Vector]
    decode: Callable[[Vector], pin.SE3]
    ground: Callable[[], pin.SE3] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedPort:
    """A slice that commands the velocity of a base, or of a robot that walks.

    Attributes:
        axes: Indices of its values in forward, left, turn.
        unit: Velocity of a value of 1, m/s or rad/s.
        low: Least values.
        high: Greatest values.
    """

    name: str
    axes: tuple[int, ...]
    unit: Vector
    low: Vector
    high: Vector

    @property
    def limits(self) -> Vector:
        """Greatest speed forward, left (m/s), and turn (rad/s); 0 for a missing one."""
        limits = np.zeros(3)
        limits[list(self.axes)] = np.minimum(-self.low, self.high) * self.unit
        return limits

    def encode(self, velocity: Vector) -> Vector:
        """Return the values of the slice for a velocity, shape (3,)."""
        values = velocity[list(self.axes)] / self.unit
        return np.clip(values, self.low, self.high)


@dataclass(frozen=True, slots=True, kw_only=True)
class JointPort:
    """A slice that commands joint positions, or steps of them.

    `measure` returns the positions of the joints, rad or m, and `encode` the values of
    the slice for target positions; `lifting` are the joints that lift the torso.
    """

    name: str
    joints: tuple[str, ...]
    lifting: tuple[int, ...]
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
    """Return the slices that command velocities of a base or a walk, by name."""
    ports = {}
    for part in env.unwrapped.action_layout.slices:
        moves = part.kind in (SliceKind.BASE, SliceKind.VELOCITY)
        if moves and {*part.labels} <= {*_VELOCITY_AXES}:
            ports[part.name] = SpeedPort(
                name=part.name,
                axes=tuple(_VELOCITY_AXES.index(Axis(label)) for label in part.labels),
                unit=_unit(part),
                low=np.array(part.low),
                high=np.array(part.high),
            )
    return ports


def height_slices(env: Any) -> dict[str, ActionSlice]:
    """Return the slices that command the height of a robot that walks, by name."""
    return {
        part.name: part
        for _, _, slices in _robots(env)
        for name, part in slices.items()
        if name == "height" and part.labels == (Axis.Z,)
    }


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

    return JointPort(
        name=part.name,
        joints=part.labels,
        lifting=tuple(
            k
            for k, (joint, unit) in enumerate(zip(part.labels, part.units, strict=True))
            if unit.symbol == "m" and ("torso" in joint or "lift" in joint)
        ),
        measure=measure,
        encode=encode,
    )


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
    walks = hasattr(controller, "heading")
    in_base = walks and config.input_ref_frame == "base"
    if config.input_type != "absolute" or not (
        in_base or config.input_ref_frame == "world"
    ):
        raise ConfigError(
            "Teleoperation needs a whole-body controller with input_type 'absolute' "
            "and input_ref_frame 'world', or 'base' of WHOLE_BODY_ID, not "
            f"{type(controller).__name__} with {config.input_type!r} and "
            f"{config.input_ref_frame!r}."
        )

    def heading() -> pin.SE3:
        return controller.heading

    for frame in config.frames:
        kind = frame.behaviour
        body, measure = _reader(env.unwrapped.simulation, frame.frame, f"robot{index}_")
        yield LimbPort(
            name=slices[frame.name].name,
            kind=_limb_kind(kind),
            body=body,
            measure=measure,
            encode=partial(_encode_in_base, kind, heading) if in_base else kind.values,
            decode=partial(_decode, kind, measure, heading if in_base else None),
            ground=heading if walks else None,
        )


def _encode_in_base(
    kind: FrameKind, base: Callable[[], pin.SE3], T_world_target: pin.SE3
) -> Vector:
    """Return the values of a slice whose targets are given in a moving base."""
    return kind.values(base().actInv(T_world_target))


def _decode(
    kind: FrameKind,
    measure: Callable[[], pin.SE3],
    base: Callable[[], pin.SE3] | None,
    values: Vector,
) -> pin.SE3:
    """Return the target of a slice's values; the frame has the other components."""
    T_wb = pin.SE3.Identity() if base is None else base()
    return T_wb * kind.pose(values, T_wb.actInv(measure()))


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
                decode=given.decode,
                ground=given.reference,
            )


def _pose(R: Vector, p: Vector) -> pin.SE3:
    return pin.SE3(R.reshape(3, 3).copy(), p.copy())


def _unit(part: ActionSlice) -> Vector:
    """Return the quantity of a value of 1."""
    return np.array([1.0 if u.scale is None else u.scale for u in part.units])
