"""Hands keep off the robot with their fingers where they are, open or closed."""

import numpy as np
import pytest

import wbc_suite
from wbc_suite.control.ik.commanded_scene import CommandedScene
from wbc_suite.control.ik.finger_capsules import FingerCapsules
from wbc_suite.kinematics import Configuration

CLOSED = 40  # steps until fingers are closed


class Hands:
    """A robot in Lift, and its self-collision limit."""

    def __init__(self, name):
        self.env = wbc_suite.make(
            "Lift", robots=name, controller_configs="WHOLE_BODY_IK"
        )
        self.env.reset(seed=0)
        self.state, self.controller = self.env.simulation.pairs[0]
        self.limit = self.controller._backend.self_collision

    def close(self):
        action = self.env.hold_action
        for part in self.env.action_layout.slices:
            if part.name.endswith("gripper"):
                action[part.start : part.stop] = 1.0
        for _ in range(CLOSED):
            self.env.step(action)

    def errors(self):
        """Return how far the ends of capsules are from those of their bodies, m."""
        state, limit = self.state, self.limit
        robot = wbc_suite.load_robot(state.robot.name).to_pinocchio()
        measured = Configuration(robot, state.q)
        reduced = self.controller._configuration.model
        errors = {}
        for k, capsule in enumerate(limit.capsules):
            joint = reduced.names[int(limit.placed["joint"][k])]
            carrier = measured.model.getJointId(joint)
            if not limit.placed["joint"][k]:
                continue
            T = measured.data.oMi[carrier]
            link = measured.frame_pose(capsule.link)
            for end, at in zip((capsule.start, capsule.end), (0, 1), strict=True):
                placed = T * limit.placed["ends"][k, at]
                error = np.linalg.norm(placed - link * np.asarray(end))
                errors[capsule.link] = max(errors.get(capsule.link, 0.0), error)
        return errors


@pytest.mark.slow
@pytest.mark.parametrize("name", ["GR1", "Panda"])
def test_capsules_move_with_the_measured_fingers(name):
    hands = Hands(name)
    hands.close()
    controller = hands.controller
    configuration = controller._configuration
    commanded = CommandedScene(hands.state, configuration)
    fingers = FingerCapsules(hands.state, configuration, commanded, hands.limit)
    commanded.place()
    fingers.place()
    errors = hands.errors()
    assert any("finger" in link or "thumb" in link for link in errors)
    assert max(errors.values()) < 1e-6


@pytest.mark.slow
def test_ticks_place_the_fingers():
    hands = Hands("GR1")
    before = hands.limit.placed["ends"].copy()
    hands.close()
    moved = np.abs(hands.limit.placed["ends"] - before).max(axis=(1, 2)) > 5e-3
    links = {hands.limit.capsules[k].link for k in np.flatnonzero(moved)}
    assert "R_index_intermediate_link" in links
    assert len(links) >= 10
    assert max(hands.errors().values()) < 2e-3  # of the last tick
