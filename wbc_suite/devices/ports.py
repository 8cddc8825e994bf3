"""Ports: what of an environment's action a person can move, and how to write it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.control import ActionLayout
from wbc_suite.control.action import ActionSlice
from wbc_suite.control.part.osc_controller import OscController
from wbc_suite.control.state import RobotState
from wbc_suite.devices.limbs import LimbKind, LimbPort, command
from wbc_suite.errors import ConfigError
from wbc_suite.typing import Vector

__all__ = ["JointPort", "SpeedPort", "joint_ports", "limb_ports", "speed_ports"]

_KINDS = {
    "pose": LimbKind.POSE,
    "position": LimbKind.POSITION,
    "orientation": LimbKind.ORIENTATION,
    "com": LimbKind.POSITION,
    "base": LimbKind.PLANAR,
}
_SPEEDS = ("forward", "sideways", "turn")


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedPort:
    """A slice that takes a base's velocity.

    Attributes:
        name: Name of the slice.
        axes: Which of forward, left and turn its values are.
        unit: What a value of 1 means, m/s or rad/s.
    """

    name: str
    axes: tuple[int, ...]
    unit: Vector

    def encode(self, velocity: Vector) -> Vector:
        """Return the values for a velocity, shape (3,)."""
        return velocity[list(self.axes)] / self.unit


@dataclass(frozen=True, slots=True, kw_only=True)
class JointPort:
    """A slice that takes joint positions, or steps of them.

    Attributes:
        name: Name of the slice.
        joints: Names of the joints.
        measure: Gives their positions, rad or m.
        encode: Turns target positions into the values of the slice.
    """

    name: str
    joints: tuple[str, ...]
    measure: Callable[[], Vector]
    encode: Callable[[Vector], Vector]


def limb_ports(env: Any) -> dict[str, LimbPort]:
    """Return the limbs of all robots by slice, in the order of the action.

    Raises:
        ConfigError: If a whole-body controller takes no targets in the world.
    """
    ports = {}
    for index, controller, slices in _robots(env):
        make = _whole_body if _is_whole_body(controller) else _parts
        found = make(env, controller, index, slices)
        ports |= {port.name: port for port in found}
    return ports


def speed_ports(env: Any) -> dict[str, SpeedPort]:
    """Return the slices that take velocities of a base, by name."""
    ports = {}
    for part in _layout(env).slices:
        if part.kind == "base" and part.labels and set(part.labels) <= {*_SPEEDS}:
            axes = tuple(_SPEEDS.index(label) for label in part.labels)
            ports[part.name] = SpeedPort(name=part.name, axes=axes, unit=_unit(part))
    return ports


def joint_ports(env: Any) -> dict[str, JointPort]:
    """Return the slices that take joint positions, by name."""
    data, ports = env.unwrapped.simulation.data, {}
    for index, _, slices in _robots(env):
        for part in slices.values():
            if part.kind == "posture":
                names = [f"robot{index}_{joint}" for joint in part.labels]
                places = [data.joint(name).qpos for name in names]
                ports[part.name] = _joint_port(part, places)
    return ports


def _joint_port(part: ActionSlice, places: list[Any]) -> JointPort:
    def measure() -> Vector:
        return np.array([place[0] for place in places])

    def encode(target: Vector) -> Vector:
        if _is_step(part):
            return np.clip((target - measure()) / _unit(part), part.low, part.high)
        return np.clip(target, part.low, part.high)

    return JointPort(name=part.name, joints=part.labels, measure=measure, encode=encode)


def _robots(env: Any) -> Iterator[tuple[int, Any, dict[str, ActionSlice]]]:
    """Yield each robot's number, controller, and slices by the controller's names."""
    controllers, layout = env.unwrapped.controllers, _layout(env)
    for index, controller in enumerate(controllers):
        several = f"robot{index}_" if len(controllers) > 1 else ""
        slices = {
            part.name.removeprefix(several): part
            for part in layout.slices
            if part.name.startswith(several)
        }
        yield index, controller, slices


def _layout(env: Any) -> ActionLayout:
    return env.unwrapped.action_layout


def _is_whole_body(controller: Any) -> bool:
    return hasattr(getattr(controller, "config", None), "frames")


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
    simulation = env.unwrapped.simulation
    for frame in config.frames:
        kind = _KINDS[frame.kind]
        body, measure = _reader(
            simulation.model, simulation.data, frame.frame, f"robot{index}_"
        )
        yield LimbPort(
            name=slices[frame.name].name,
            kind=kind,
            body=body,
            measure=measure,
            encode=lambda T, kind=kind: command(kind, T),
        )


def _reader(
    model: mujoco.MjModel, data: mujoco.MjData, frame: str | None, prefix: str
) -> tuple[int, Callable[[], pin.SE3]]:
    """Return a frame's body and what measures its pose; no frame: centre of mass."""
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
    for name, part in getattr(controller, "parts", {}).items():
        if isinstance(part, OscController):
            yield _OscPort(
                part, slices[name], env.unwrapped.simulation.robots[index]
            ).port


class _OscPort:
    """A hand that is moved in operational space, by steps or to places.

    Steps are counted as the controller does, so that its goal is the target whenever
    that is within a full step.
    """

    def __init__(
        self, part: OscController, own: ActionSlice, state: RobotState
    ) -> None:
        self._part, self._slice = part, own
        self._frames = part.law.frames(state)
        site = int(part.law.record["site"][0])
        self.port = LimbPort(
            name=own.name,
            kind=LimbKind.POSE if len(own.labels) == 6 else LimbKind.POSITION,
            body=int(state.model.site_bodyid[site]),
            measure=lambda: _pose(*self._frames[2:]),
            encode=self._encode,
            ground=None if state.robot.root.kind == "fixed" else self._reference,
        )

    def _reference(self) -> pin.SE3:
        return _pose(*self._frames[:2])

    def _encode(self, target: pin.SE3) -> Vector:
        size, config = len(self._slice.labels), self._part.config
        T_world_reference = self._reference()
        wanted = T_world_reference.actInv(target)
        if config.input_type == "absolute":
            values = np.concatenate([wanted.translation, pin.log3(wanted.rotation)])
            return np.clip(values[:size], self._slice.low, self._slice.high)
        start = self._part.goal
        if config.goal_update_mode == "achieved":
            start = T_world_reference.actInv(self.port.measure())
        axes = np.eye(3)
        if config.input_ref_frame == "eef":
            axes = self._part.goal.rotation
        step = axes.T @ (wanted.translation - start.translation)
        turn = axes.T @ pin.log3(wanted.rotation @ start.rotation.T)
        values = np.concatenate([step, turn])[:size] / _unit(self._slice)
        return np.clip(values, self._slice.low, self._slice.high)


def _pose(R: Vector, p: Vector) -> pin.SE3:
    return pin.SE3(R.reshape(3, 3).copy(), p.copy())


def _is_step(part: ActionSlice) -> bool:
    """Whether values are steps: their unit is a size, such as `0.05 rad`."""
    return part.units[0][:1].isdigit()


def _unit(part: ActionSlice) -> Vector:
    """Return what a value of 1 means: `0.05 m` is 0.05, `m` is 1."""
    words = [unit.split()[0] for unit in part.units]
    return np.array([float(w) if w[:1].isdigit() else 1.0 for w in words])
