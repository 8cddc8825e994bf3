"""Grippers and bases that scripts mount on a robot's model before it is in a scene."""

from typing import Any

from wbc_suite.compat.robosuite.models.base import SECTIONS
from wbc_suite.errors import UnknownNameError


class Mounting:
    """What a model with `load` needs to take other grippers and another base."""

    eef_name: Any
    grippers: dict[str, Any]
    load: Any
    _base_name: str | None = None

    def add_gripper(self, gripper: Any, arm_name: str | None = None) -> None:
        """Mount a gripper on an arm: `right`, or the body at its end; else the first.

        Raises:
            UnknownNameError: If there is no such arm.
        """
        arms = {body: arm for arm, body in self.eef_name.items()}
        arm = arms.get(arm_name or "", arm_name or next(iter(self.eef_name)))
        if arm not in self.eef_name:
            raise UnknownNameError("arm", arm_name, (*self.eef_name, *arms))
        self.grippers[arm] = gripper
        self._mount()

    def add_base(self, base: Any) -> None:
        """Put the robot on a base."""
        self._base_name = type(base).__name__
        self._mount()

    def _mount(self) -> None:
        chosen = {arm: type(item).__name__ for arm, item in self.grippers.items()}
        self.load(chosen or "default", self._base_name)
        for name in (*SECTIONS, "root", "tree", "folder"):
            self.__dict__.pop(name, None)  # they are written again when asked for
