"""One robot alone on a floor, under one controller."""

from collections.abc import Callable, Mapping
from typing import Any

import mujoco
import pinocchio as pin

from wbc_suite.control import (
    RobotState,
    build_composite_controller,
    load_composite_controller_config,
)
from wbc_suite.envs.simulation import Simulation
from wbc_suite.robot import RobotDescription, load_robot
from wbc_suite.scene import attach_robot, empty_arena, robot_prefix

__all__ = ["Stand", "arms_config"]


class Stand:
    """A robot at `ready`, held by its controller.

    Args:
        name: The robot.
        controller: Composite controller: a name or a config.
        edit: Changes the scene before it is compiled.

    Attributes:
        robot: Its description.
        model: The scene.
        data: Its state.
        state: What controllers see.
        controller: The controller.
        simulation: Both together.
    """

    def __init__(
        self,
        name: str,
        controller: str | Mapping[str, Any],
        edit: Callable[[mujoco.MjSpec], None] | None = None,
    ) -> None:
        self.robot: RobotDescription = load_robot(name)
        spec = empty_arena()
        attach_robot(spec, self.robot, robot_prefix(0))
        if edit is not None:
            edit(spec)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.state = RobotState(
            self.model, self.data, self.robot, prefix=robot_prefix(0)
        )
        self.start()
        config = load_composite_controller_config(controller, self.robot)
        self.controller = build_composite_controller(config, self.state)
        pairs = [(self.state, self.controller)]
        self.simulation = Simulation(self.model, self.data, pairs)

    def start(self) -> None:
        """Stand at `ready`."""
        mujoco.mj_resetData(self.model, self.data)
        posture = self.robot.keyframe("ready")
        q, _ = self.state.joint_addresses(tuple(posture))
        self.data.qpos[q] = list(posture.values())
        if self.robot.root.kind == "free":
            at = self.model.joint(f"{self.state.prefix}root").qposadr[0]
            self.data.qpos[at : at + 7] = (*self.robot.root.pos, *self.robot.root.quat)
        mujoco.mj_forward(self.model, self.data)

    def reset(self) -> None:
        """Stand at `ready` with goals that hold."""
        self.start()
        self.simulation.start()

    def pose(self, frame: str) -> pin.SE3:
        """Return the pose of a frame in the world, of positions as they are now."""
        mujoco.mj_kinematics(self.model, self.data)
        site = self.data.site(self.state.prefix + frame)
        return pin.SE3(site.xmat.reshape(3, 3).copy(), site.xpos.copy())


def arms_config(robot: str | RobotDescription, kind: str, **options: Any) -> dict:
    """Return BASIC with one kind of part controller on every arm.

    Args:
        robot: The robot.
        kind: Part controller, such as `OSC_POSE`.
        options: Keys of its config.
    """
    config = load_composite_controller_config(controller="BASIC", robot=robot)
    parts = {**config["body_parts"]}
    for arm in {"right", "left"} & parts.keys():
        part = {"type": kind, **options}
        if "gripper" in parts[arm]:
            part["gripper"] = parts[arm]["gripper"]
        parts[arm] = part
    return {**config, "body_parts": parts}
