"""HYBRID_MOBILE_BASE: what goals of hands move with while the base drives."""

import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.control import load_composite_controller_config
from wbc_suite.errors import ConfigError

HYBRID = "HYBRID_MOBILE_BASE"


def pose(one, side="right"):
    site = one.state.data.site(one.state.prefix + one.robot.hands[side])
    return pin.SE3(site.xmat.reshape(3, 3).copy(), site.xpos.copy())


def drive(one, count, mode, base=(), **others):
    """Drive for a number of actions; return how far the hand strays from its goal."""
    controller, strays = one.controller, []
    for _ in range(count):
        values = {"base_mode": mode, **others}
        if len(base):
            values["base"] = base
        action = controller.layout.pack(values, base=controller.hold_action)
        controller.set_goal(action)
        one.simulation.tick(25)
    return strays


@pytest.mark.parametrize("name", ["PandaOmron", "TiagoDifferential", "GR1FloatingBody"])
def test_hands_ride_on_the_base_or_stay_in_the_world(name, alone):
    one = alone(name, HYBRID)
    size = len(one.controller.layout["base"].labels)
    speed = [0.3] + [0.0] * (size - 2) + [0.2]
    start, base = pose(one), one.state.root_pose
    drive(one, 30, -1.0, speed)
    drive(one, 10, -1.0)
    moved = one.state.root_pose
    assert np.linalg.norm(moved.translation - base.translation) > 0.1
    ridden = moved * base.actInv(start)
    assert np.linalg.norm(pin.log6(ridden.actInv(pose(one))).vector) < 2e-3
    # The world next, driving back: hands stay where they are.
    before = pose(one)
    drive(one, 15, 1.0, [-0.6 * x for x in speed])
    drive(one, 20, 1.0)
    assert np.linalg.norm(one.state.root_pose.translation - moved.translation) > 0.03
    assert np.linalg.norm(pin.log6(before.actInv(pose(one))).vector) < 2e-3


def test_the_default_is_that_goals_ride_and_zeros_hold(alone):
    one = alone("PandaOmron", HYBRID)
    layout = one.controller.layout
    assert layout.slices[-1].name == "base_mode"
    assert layout.size == 12
    assert one.controller.hold_action[-1] == -1.0
    start = pose(one)
    one.controller.set_goal(np.zeros(12))
    one.simulation.tick(1000)
    assert np.linalg.norm(pose(one).translation - start.translation) < 1e-4


@pytest.mark.parametrize("frame", ["base", "world", "eef"])
def test_changing_the_mode_never_moves_the_target(frame, alone):
    config = load_composite_controller_config(HYBRID, "PandaOmron")
    config["body_parts"]["right"] |= {"input_ref_frame": frame}
    config["body_parts"]["right"] |= {"interpolation": "linear", "ramp_ratio": 1.0}
    one = alone("PandaOmron", config)
    hand = one.controller.parts["right"]

    def target():
        law = hand.law
        reference = int(law.record["reference"][0])
        data = one.state.data
        R = data.xmat[reference].reshape(3, 3)
        return pin.SE3(R, data.xpos[reference]) * law.target_pose()[0]

    drive(one, 10, -1.0, [0.5, 0.2, 0.4])
    modes = np.random.default_rng(0).choice([-1.0, 1.0], 30)
    for k, mode in enumerate(modes):
        before = target()
        turn = 0.5 if k % 2 else 0.0
        drive(one, 0, mode)
        action = one.controller.hold_action
        action[-1] = mode
        action[one.controller.layout["right"].start + 3] = turn
        one.controller.set_goal(action)
        after = target()
        assert np.linalg.norm(before.translation - after.translation) < 1e-12
        drive(one, 1, mode, [0.5, 0.2, 0.4])


@pytest.mark.slow
def test_steps_keep_their_axes_in_both_modes(alone):
    """A step forward is the base's forward, also after the base has turned."""
    for mode in (-1.0, 1.0):
        one = alone("PandaOmron", HYBRID)
        drive(one, 30, -1.0, [0.0, 0.0, 0.5])
        drive(one, 10, -1.0)
        start, R = pose(one), one.state.root_pose.rotation.copy()
        assert abs(R[1, 0]) > 0.3
        drive(one, 1, mode, right=[1.0, 0, 0, 0, 0, 0])
        drive(one, 30, mode)
        moved = R.T @ (pose(one).translation - start.translation)
        np.testing.assert_allclose(moved, [0.05, 0.0, 0.0], atol=1e-3)


def test_a_robot_without_wheels_is_refused_in_words():
    with pytest.raises(ConfigError, match="Panda has no base that drives"):
        load_composite_controller_config(HYBRID, "Panda")
