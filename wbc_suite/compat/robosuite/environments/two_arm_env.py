"""Environments for two hands, of one robot or of two."""

from typing import Any

from wbc_suite.compat.robosuite.environments.robot_env import ManipulationEnv
from wbc_suite.compat.robosuite.utils.transform_utils import mat2quat
from wbc_suite.typing import Vector


class TwoArmEnv(ManipulationEnv):
    """An environment for one robot with two arms, or two with one each."""

    def _arm(self, k: int) -> tuple[Any, str]:
        """Return robot and arm of the k-th hand."""
        if len(self.robots) > 1:
            return self.robots[k], self.robots[k].arms[0]
        return self.robots[0], self.robots[0].arms[k]

    def _gripper0_to_target(self, target: Any, target_type: str = "body", **kw: Any):  # noqa: ANN202 - as `_gripper_to_target`
        robot, arm = self._arm(0)
        return self._gripper_to_target(robot.gripper[arm], target, target_type, **kw)

    def _gripper1_to_target(self, target: Any, target_type: str = "body", **kw: Any):  # noqa: ANN202 - as `_gripper_to_target`
        robot, arm = self._arm(1)
        return self._gripper_to_target(robot.gripper[arm], target, target_type, **kw)

    def _hand(self, k: int, field: str) -> Any:
        robot, arm = self._arm(k)
        return getattr(self.sim.data, field)[robot.eef_site_id[arm]].copy()

    @property
    def _eef0_xpos(self) -> Vector:
        return self._hand(0, "site_xpos")

    @property
    def _eef1_xpos(self) -> Vector:
        return self._hand(1, "site_xpos")

    @property
    def _eef0_xmat(self) -> Any:
        return self._hand(0, "site_xmat").reshape(3, 3)

    @property
    def _eef1_xmat(self) -> Any:
        return self._hand(1, "site_xmat").reshape(3, 3)

    @property
    def _eef0_xquat(self) -> Vector:
        return mat2quat(self._eef0_xmat)

    @property
    def _eef1_xquat(self) -> Vector:
        return mat2quat(self._eef1_xmat)
