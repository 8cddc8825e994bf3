"""A robot on an empty floor whose arms follow in operational space."""

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.control import load_composite_controller_config

RATE = 20.0  # actions per second


class OscRig:
    """One robot; `right` is what is asked and looked at.

    Args:
        alone: The fixture.
        name: The robot.
        settings: Of OSC_POSE, for all hands.
    """

    def __init__(self, alone, name, **settings):
        from wbc_suite.robot import load_robot

        robot = load_robot(name)
        parts = load_composite_controller_config("BASIC", robot)["body_parts"]
        for side in robot.hands:
            parts[side] = {"type": "OSC_POSE"} | settings
        self.one = alone(robot, "BASIC", body_parts=parts)
        self.one.simulation.start()
        self.state, self.simulation = self.one.state, self.one.simulation
        self.controller = self.one.controller
        self.part = self.controller.parts["right"]
        self.law, self.data = self.part.law, self.state.data

    @property
    def pose(self):
        """The hand in the reference's axes."""
        return self.law.site_pose(self.state)

    @property
    def position(self):
        return self.pose.translation.copy()

    def action(self, values, **more):
        """Return an action: the hand's values, others hold."""
        hold = self.controller.hold_action
        return self.controller.layout.pack({"right": values} | more, base=hold)

    def act(self, values, count=1, period=1.0 / RATE, **more):
        """Give an action a number of times, and run."""
        for _ in range(count):
            self.controller.set_goal(self.action(values, **more), period)
            self.simulation.tick(round(period / self.simulation.timestep))

    def run(self, seconds, each=lambda: None):
        """Run under the present goals; return the hand's pose after each step."""
        poses = []
        for _ in range(round(seconds / self.simulation.timestep)):
            each()
            self.simulation.tick(1)
            poses.append(self.pose)
        return poses

    def values(self, pose):
        """Return the absolute action of a pose."""
        return np.concatenate([pose.translation, pin.log3(pose.rotation)])

    def push(self, force):
        """Push on the hand's site, world axes, N, from now on."""
        site = int(self.law.record["site"][0])
        body = int(self.state.model.site_bodyid[site])
        lever = self.data.site_xpos[site] - self.data.xipos[body]
        self.data.xfrc_applied[body] = [*force, *np.cross(lever, force)]

    def dynamics(self):
        """Return M, J and `J M^-1 J^T` of the arm where it is now."""
        model, data, dofs = self.state.model, self.data, self.law.drives["dof"]
        mujoco.mj_forward(model, data)
        J = np.zeros((6, model.nv))
        mujoco.mj_jacSite(model, data, J[:3], J[3:], int(self.law.record["site"][0]))
        M, J = self.state.mass_matrix()[np.ix_(dofs, dofs)], J[:, dofs]
        return M, J, J @ np.linalg.solve(M, J.T)
