"""`env.robots[0]` under robosuite's names: arms, grippers, parts of the action."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from wbc_suite.control import CompositeController, RobotState
from wbc_suite.typing import Indices, Vector

__all__ = ["GripperView", "RobotModelView", "RobotView"]


@dataclass(frozen=True, kw_only=True, slots=True)
class RobotModelView:
    """What scripts ask a robot's model: its name, and the text before its names."""

    name: str
    naming_prefix: str


@dataclass(frozen=True, kw_only=True, slots=True)
class GripperView:
    """What scripts ask a gripper: how many values of an action it takes."""

    dof: int


class RobotView:
    """One robot; what is not of robosuite's names is its description's.

    Args:
        state: The robot in the simulation.
        controller: Its controller.

    Attributes:
        name: Name of the robot.
        robot_model: Its name and prefix.
        composite_controller: Its controller.
        arms: `right`, `left`, or the names of its hands.
        gripper: The gripper of each arm.
    """

    def __init__(self, state: RobotState, controller: CompositeController) -> None:
        robot, layout = state.robot, controller.layout
        self._state, self._slices = state, {s.name: s for s in layout.slices}
        self.name = robot.name
        self.robot_model = RobotModelView(name=robot.name, naming_prefix=state.prefix)
        self.composite_controller = controller
        self.arms = tuple(robot.hands)
        self.gripper = {
            arm: GripperView(dof=self._size(f"{arm}_gripper")) for arm in self.arms
        }

    def __getattr__(self, name: str) -> Any:
        return getattr(self._state.robot, name)

    @property
    def action_dim(self) -> int:
        """Length of this robot's part of an action."""
        return self.composite_controller.layout.size

    @property
    def action_limits(self) -> tuple[Vector, Vector]:
        """Least and greatest values of this robot's part of an action."""
        layout = self.composite_controller.layout
        return layout.low.copy(), layout.high.copy()

    @property
    def _action_split_indexes(self) -> dict[str, tuple[int, int]]:
        """First and last place of each part of the action."""
        return {name: (part.start, part.stop) for name, part in self._slices.items()}

    @property
    def is_mobile(self) -> bool:
        """Whether the robot drives or walks."""
        return self._state.robot.root.kind != "fixed"

    @property
    def _ref_joint_pos_indexes(self) -> Indices:
        """Places of the robot's joints in qpos, without those of grippers."""
        robot, model = self._state.robot, self._state.model
        joints = [
            joint
            for group, names in robot.groups.items()
            if not group.endswith("gripper")
            for joint in names
        ]
        places = [model.joint(self._state.prefix + j).qposadr[0] for j in joints]
        return np.array(places, dtype=np.int64)

    def create_action_vector(self, parts: Mapping[str, ArrayLike]) -> Vector:
        """Return an action from values of parts; those that are not told get zeros.

        Raises:
            UnknownNameError: If there is no such part.
            ActionError: If a part has a wrong size.
        """
        zeros = {name: np.zeros(self._size(name)) for name in self._slices}
        return self.composite_controller.layout.pack(
            zeros | {name: np.atleast_1d(values) for name, values in parts.items()}
        )

    def _size(self, part: str) -> int:
        found = self._slices.get(part)
        return 0 if found is None else found.stop - found.start
