"""A part controller of your own: an arm in cylindrical coordinates about its base.

One class, one config and one line of registration: after that, the name works in
`make`, in controller files, and in teleoperation, since `pose_input` gives devices a
hand to move. The law is a built-in one, in the compiled loop like all others.
"""

from typing import Literal

import numpy as np
import pinocchio as pin
from pydantic import PositiveFloat

import wbc_suite
from wbc_suite.control import (
    ActionPart,
    OscLaw,
    PartController,
    PartSettings,
    PoseInput,
    RobotPart,
    RobotState,
    SliceKind,
    Unit,
    register_part_controller,
)
from wbc_suite.devices.action_ports import limb_ports


class CylinderConfig(PartSettings):
    """The hand follows radius, angle and height about the base.

    Attributes:
        kp: Stiffness, 1/s^2, critically damped.
    """

    type: Literal["CYLINDER"] = "CYLINDER"
    kp: PositiveFloat = 150.0


class CylinderController(PartController[OscLaw]):
    """Turns radius, angle and height into a goal of the hand."""

    needs_hand = True

    def __init__(
        self, part: RobotPart, config: CylinderConfig, state: RobotState
    ) -> None:
        assert part.hand is not None
        self.config, self.state = config, state
        self.law = OscLaw(state, part.joints, part.hand)
        self.law.keep_limits(state)
        self.law.record["kp"], self.law.record["kd"] = config.kp, 2.0 * config.kp**0.5
        base = state.model.body(state.prefix + state.robot.links[0].name).id
        self.law.record["reference"] = base
        self.slices = (
            ActionPart(
                name=part.name,
                kind=SliceKind.POSITION,
                labels=("radius", "angle", "height"),
                units=(Unit("m"), Unit("rad"), Unit("m")),
                low=(0.1, -np.pi, -1.0),
                high=(1.0, np.pi, 1.5),
            ),
        )

        self.values, self.grasp = np.zeros(3), np.eye(3)

    @property
    def memory(self) -> tuple[np.ndarray, ...]:
        """What saved states hold of it, beside the law's records."""
        return self.values, self.grasp

    def reset(self, state: RobotState) -> None:
        """Hold the hand where it is, and the posture that the arm has."""
        self.law.drives["position"] = state.data.qpos[self.law.drives["qpos"]]
        pose = self.law.site_pose(state)
        self.values[:] = cylindrical(pose.translation)
        self.grasp[:] = pin.exp3(np.array([0, 0, -self.values[1]])) @ pose.rotation
        self.law.set_goal(pose)

    def set_goal(self, values: np.ndarray, period: float) -> None:
        """Move the goal evenly in the time until the next action."""
        self.values[:] = values
        goal = self.pose(values)
        self.law.set_goal(goal, start=self.law.target_pose()[0], duration=period)

    def pose(self, values: np.ndarray) -> pin.SE3:
        """Return the hand's pose in the base for values of the action."""
        radius, angle, height = values
        place = np.array([radius * np.cos(angle), radius * np.sin(angle), height])
        return pin.SE3(pin.exp3(np.array([0, 0, angle])) @ self.grasp, place)

    @property
    def hold_action(self) -> np.ndarray:
        """The values that keep the goal."""
        return self.values.copy()

    def pose_input(self) -> PoseInput:
        """Return how devices send the hand to a place in the world."""
        R_wb, p_wb, R_wh, p_wh = self.law.frames(self.state)

        def encode(target: pin.SE3) -> np.ndarray:
            values = cylindrical(R_wb.reshape(3, 3).T @ (target.translation - p_wb))
            return np.clip(values, self.slices[0].low, self.slices[0].high)

        return PoseInput(
            action=self.slices[0],
            body=int(self.state.model.site_bodyid[int(self.law.record["site"][0])]),
            measure=lambda: pin.SE3(R_wh.reshape(3, 3).copy(), p_wh.copy()),
            encode=encode,
            decode=lambda values: (
                pin.SE3(R_wb.reshape(3, 3).copy(), p_wb.copy()) * self.pose(values)
            ),
        )


def cylindrical(place: np.ndarray) -> np.ndarray:
    """Return radius, angle and height of a place."""
    return np.array([np.hypot(*place[:2]), np.arctan2(place[1], place[0]), place[2]])


register_part_controller("CYLINDER", CylinderController, CylinderConfig)


def main() -> None:
    """Swing the hand about the base, then send it to a place as a device would."""
    env = wbc_suite.make("Lift", robots="Panda", controller_configs="CYLINDER")
    env.reset(seed=0)
    layout, hand = env.action_layout, limb_ports(env)["right"]
    print(layout)
    goal = layout.unpack(env.hold_action)["right"]
    for _ in range(20):
        goal[1] += 0.04
        env.step(layout.pack({"right": goal}, base=env.hold_action))
    print("the hand is at", np.round(hand.measure().translation, 3))
    target = hand.measure()
    target.translation += np.array([0.1, 0.0, 0.1])
    for _ in range(20):
        env.step(layout.pack({"right": hand.encode(target)}, base=env.hold_action))
    print("it was sent to", np.round(target.translation, 3))
    print("and went to   ", np.round(hand.measure().translation, 3))
    env.close()


if __name__ == "__main__":
    main()
