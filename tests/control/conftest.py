import mujoco
import pytest

from wbc_suite.control import (
    RobotState,
    build_composite_controller,
    load_composite_controller_config,
)
from wbc_suite.envs import Simulation
from wbc_suite.robot import load_robot
from wbc_suite.scene import attach_robot, empty_arena


class Alone:
    """One robot on an empty floor, at `ready`, under one controller."""

    def __init__(self, name, controller="WHOLE_BODY_IK", **changes):
        self.robot = load_robot(name) if isinstance(name, str) else name
        spec = empty_arena()
        attach_robot(spec, self.robot, "robot0_")
        model = spec.compile()
        data = mujoco.MjData(model)
        self.state = RobotState(model, data, self.robot, prefix="robot0_")
        posture = self.robot.keyframe("ready")
        q, _ = self.state.joint_addresses(tuple(posture))
        data.qpos[q] = list(posture.values())
        if self.robot.root.kind == "free":
            data.qpos[:7] = (*self.robot.root.pos, *self.robot.root.quat)
        mujoco.mj_forward(model, data)
        config = load_composite_controller_config(controller, self.robot) | changes
        self.controller = build_composite_controller(config, self.state)
        self.simulation = Simulation(model, data, [(self.state, self.controller)])

    def act(self, changes, seconds):
        """Add to the hold action by slice, and run; return the report."""
        layout = self.controller.layout
        action = self.controller.hold_action
        for name, change in changes.items():
            part = layout[name]
            action[part.start : part.stop] += change
        self.controller.set_goal(layout.clip(layout.check(action))[0])
        self.simulation.tick(round(seconds / self.simulation.timestep))
        return self.controller.info(self.state)["ik"]

    def site(self, name):
        """Return a frame's position in the simulation, a copy."""
        mujoco.mj_kinematics(self.state.model, self.state.data)
        return self.state.data.site(f"robot0_{name}").xpos.copy()


@pytest.fixture(scope="session")
def alone():
    return Alone
