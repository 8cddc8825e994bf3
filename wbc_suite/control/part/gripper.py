"""GRIP: one value per synergy moves joints together from open to closed."""

from collections.abc import Iterable, Sequence

import mujoco
import numpy as np

from wbc_suite.control.action import ActionPart, SliceKind, Unit
from wbc_suite.control.law.law import ServoLaw
from wbc_suite.control.memory import Parts
from wbc_suite.control.part.controller import PartController
from wbc_suite.control.part.part_settings import GripConfig
from wbc_suite.control.state import RobotState
from wbc_suite.errors import ConfigError
from wbc_suite.robot.elements import Synergy
from wbc_suite.typing import Indices, Vector

SAMPLES = 41


class GripperController(PartController[ServoLaw]):
    """Setpoints of a gripper's servos from its synergies.

    The action has one value per synergy, -1 open to 1 closed:
    `q* = open + (a + 1) / 2 (closed - open)`, the setpoint of the joint's servo. With
    the input `width` it is the width between the fingers of a parallel gripper.

    The name is that of its action slice as well. The frame `grasp` between the fingers
    is needed for widths.

    Attributes:
        goal: Present action, shape (number of synergies,).

    Raises:
        ConfigError: If the input is `width`, and it has no two fingers opposite each
            other.
    """

    def __init__(
        self,
        name: str,
        synergies: Sequence[Synergy],
        state: RobotState,
        config: GripConfig | None = None,
        grasp: str | None = None,
    ) -> None:
        self.config = config or GripConfig()
        self.name, count = name, len(synergies)
        self._table: OpeningTable | None = None
        if self.config.input == "width":
            if count != 1 or grasp is None:
                raise ConfigError(
                    f"key 'input': '{name}' has {count} synergies; 'width' is for "
                    "parallel grippers, which have one. Use 'synergy'."
                )
            self._table = OpeningTable(synergies[0], grasp, state)
        self.slices = (self._part(synergies),)
        driven = [
            (k, joint)
            for k, synergy in enumerate(synergies)
            for joint in synergy.open
            if joint in state.actuators
        ]
        self.law = ServoLaw(state, [joint for _, joint in driven])
        self._synergy: Indices = np.array([k for k, _ in driven], dtype=np.int64)
        self._open = np.array([synergies[k].open[j] for k, j in driven])
        self._span = np.array([synergies[k].closed[j] for k, j in driven]) - self._open
        # of each synergy the joint that moves most: others may not move at all
        moves = np.where(self._synergy == np.arange(count)[:, None], self._span, 0.0)
        self._leading = np.abs(moves).argmax(axis=1)
        self.goal: Vector = np.zeros(count)

    @property
    def memory(self) -> Parts:
        """The goal, a view."""
        return (self.goal,)

    def reset(self, state: RobotState) -> None:
        """Take the present opening as the goal."""
        positions = state.data.qpos[self.law.drives["qpos"]]
        command = np.clip(self._commands(positions), -1.0, 1.0)
        if self._table is not None:
            self.goal[:] = self._table.width(float(command[0]))
        else:
            self.goal[:] = command
        self.law.aim(self._setpoints(command))

    def set_goal(self, values: Vector, period: float) -> None:
        """Take the slice's values, shape (number of synergies,)."""
        self.goal[:] = values
        command, duration = self.goal, 0.0
        if self._table is not None:
            command = np.array([self._table.command(float(values[0]))])
        if self.config.speed is not None:
            duration = self._distance(command) / self.config.speed
        self.law.move(self._setpoints(command), duration)

    @property
    def hold_action(self) -> Vector:
        """The present goal."""
        return self.goal.copy()

    def _setpoints(self, command: Vector) -> Vector:
        """Return setpoints of the joints for commands of the synergies."""
        closed = 0.5 * (command[self._synergy] + 1.0)
        return self._open + closed * self._span

    def _commands(self, positions: Vector) -> Vector:
        """Return the commands of the synergies whose setpoints are these."""
        lead = self._leading
        span = np.where(self._span[lead] == 0.0, np.inf, self._span[lead])
        return 2.0 * (positions[lead] - self._open[lead]) / span - 1.0

    def _distance(self, command: Vector) -> float:
        """Return how far commands are from the present setpoints, in values or m."""
        before = self._commands(self.law.target()[0])
        if self._table is not None:
            width = self._table.width
            return abs(width(float(command[0])) - width(float(before[0])))
        return float(np.abs(command - before).max())

    def _part(self, synergies: Sequence[Synergy]) -> ActionPart:
        count = len(synergies)
        labels = tuple(s.name for s in synergies)
        units = (Unit("-1 open .. 1 closed"),) * count
        low, high = (-1.0,) * count, (1.0,) * count
        if self._table is not None:
            labels, units = ("width",), (Unit("m"),)
            low, high = (self._table.least,), (self._table.greatest,)
        return ActionPart(
            name=self.name,
            kind=SliceKind.GRIPPER,
            labels=labels,
            units=units,
            low=low,
            high=high,
        )


class OpeningTable:
    """Width between two fingers against the synergy's command.

    The width is measured along the y axis of the grasp frame, from its origin to the
    fingers on both sides, by their collision shapes; linkages follow their drives by
    the ratios of the description. Between samples it is interpolated linearly. The
    state of the simulation is not changed.

    Attributes:
        least: Width when closed, m.
        greatest: Width when open, m.

    Raises:
        ConfigError: If there are no two fingers opposite each other.
    """

    def __init__(self, synergy: Synergy, grasp: str, state: RobotState) -> None:
        self._state, self._grasp = state, state.prefix + grasp
        self._data = mujoco.MjData(state.model)
        self._commands = np.linspace(-1.0, 1.0, SAMPLES)
        self._moving = self._moving_shapes(_joint_values(synergy, -1.0, state))
        sides = self._hits(synergy, -1.0)
        if None in [body for _, body in sides]:
            raise ConfigError(
                f"key 'input': gripper '{synergy.gripper}' has no two fingers opposite "
                f"each other at frame '{grasp}', so it has no width. Use "
                "'synergy'."
            )
        # Fingers that overlap when closed would meet each other's inside.
        widths = [
            sum(
                distance
                for (distance, body), (_, own) in zip(
                    self._hits(synergy, float(command)), sides, strict=True
                )
                if body == own
            )
            for command in self._commands
        ]
        self._widths: Vector = np.minimum.accumulate(widths)
        self.greatest, self.least = float(self._widths[0]), float(self._widths[-1])

    def command(self, width: float) -> float:
        """Return the synergy's command that opens the gripper so wide, m."""
        return float(np.interp(width, self._widths[::-1], self._commands[::-1]))

    def width(self, command: float) -> float:
        """Return the width, m, of a synergy's command."""
        return float(np.interp(command, self._commands, self._widths))

    def _hits(self, synergy: Synergy, command: float) -> list[tuple[float, int | None]]:
        """Return distance and body of the nearest shape along y, and along -y."""
        model, data = self._state.model, self._data
        for name, value in _joint_values(synergy, command, self._state).items():
            joint = model.joint(self._state.prefix + name)
            data.qpos[joint.qposadr[0]] = value
        mujoco.mj_kinematics(model, data)
        frame = data.site(self._grasp)
        y = frame.xmat.reshape(3, 3)[:, 1].copy()
        return [self._nearest(frame.xpos, sign * y) for sign in (1.0, -1.0)]

    def _nearest(self, start: Vector, direction: Vector) -> tuple[float, int | None]:
        model, data = self._state.model, self._data
        found: tuple[float, int | None] = (np.inf, None)
        for geom in self._moving:
            if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
                distance = mujoco.mj_rayMesh(model, data, geom, start, direction)
            else:
                distance = mujoco.mju_rayGeom(
                    data.geom_xpos[geom],
                    data.geom_xmat[geom],
                    model.geom_size[geom],
                    start,
                    direction,
                    int(model.geom_type[geom]),
                )
            if 0.0 <= distance < found[0]:
                found = distance, int(model.geom_bodyid[geom])
        return found

    def _moving_shapes(self, joints: Iterable[str]) -> list[int]:
        """Return the collision shapes that some joints move."""
        model, prefix = self._state.model, self._state.prefix
        bodies = {int(model.jnt_bodyid[model.joint(prefix + j).id]) for j in joints}
        for body in range(model.nbody):
            if int(model.body_parentid[body]) in bodies:
                bodies.add(body)
        return [
            geom
            for geom in range(model.ngeom)
            if int(model.geom_bodyid[geom]) in bodies and model.geom_contype[geom]
        ]


def _joint_values(
    synergy: Synergy, command: float, state: RobotState
) -> dict[str, float]:
    """Return positions of the synergy's joints and of those that follow them."""
    closed = 0.5 * (command + 1.0)
    values = {
        joint: (1.0 - closed) * value + closed * synergy.closed[joint]
        for joint, value in synergy.open.items()
    }
    for joint in state.robot.joints:
        mimic = joint.mimic
        if mimic is not None and mimic.joint in values:
            values[joint.name] = mimic.ratio * values[mimic.joint] + mimic.offset
    return values
