"""Targets far out of reach, and the way back."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.control.ik.frame_kinds import FRAME_KINDS

HANDS = ("right_hand", "left_hand")


def random_pose(rng):
    """Return a pose anywhere in a ball of 5 m about the origin."""
    direction = rng.normal(size=3)
    direction *= 5.0 * rng.uniform() ** (1 / 3) / np.linalg.norm(direction)
    turn = pin.Quaternion(rng.normal(size=4)).normalized()
    return pin.SE3(turn.matrix(), direction)


def send(scene, poses):
    layout = scene.controller.layout
    values = {name: FRAME_KINDS["pose"].values(pose) for name, pose in poses.items()}
    action = layout.pack(values, base=scene.controller.hold_action)
    scene.controller.set_goal(layout.clip(action)[0])


def run(scene, seconds):
    """Advance; return how far the worst hinge was outside its range, rad."""
    model, data = scene.state.model, scene.state.data
    hinges = model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE
    limited = np.flatnonzero((model.jnt_limited > 0) & hinges)
    low, high = model.jnt_range[limited].T
    worst = 0.0
    for _ in range(round(seconds / scene.simulation.timestep)):
        scene.simulation.tick(1)
        q = data.qpos[model.jnt_qposadr[limited]]
        worst = max(worst, float(np.maximum(low - q, q - high).max()))
    return worst


# Hands in each other's way, and arms on their way out when they are called back.
@pytest.mark.sample(6)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("robot", "trial"),
    [
        ("Tiago", 264),
        ("Tiago", 653),
        ("GR1", 564),
        pytest.param("Tiago", 441, marks=pytest.mark.slow),
        pytest.param("Tiago", 445, marks=pytest.mark.slow),
        pytest.param("Tiago", 470, marks=pytest.mark.slow),
        pytest.param("Tiago", 540, marks=pytest.mark.slow),
        pytest.param("Tiago", 717, marks=pytest.mark.slow),
        pytest.param("GR1", 300, marks=pytest.mark.slow),
        # Braked before it could turn round, by what it was about to run into.
        pytest.param("Tiago", 15, marks=pytest.mark.slow),
        # The waist shot past while it caught up, and had nothing left to brake with.
        pytest.param("GR1", 95, marks=pytest.mark.slow),
        # The waist's motors would have been asked for 1.2 of what they have.
        pytest.param("GR1", 88, marks=pytest.mark.slow),
        # Below the floor, which the hand must not lean on.
        ("SpotWithArm", 41),
        # A finger leant on the floor, a foot lifted, and the robot fell.
        ("SpotWithArm", 396),
        pytest.param("SpotWithArm", 256, marks=pytest.mark.slow),
        # The waist, slow to speed up, stayed behind to the end of the way.
        pytest.param("GR1", 574, marks=pytest.mark.slow),
    ],
)
def test_hands_are_back_two_seconds_after_a_goal_out_of_reach(alone, robot, trial):
    scene = alone(robot)
    rng = np.random.default_rng((0, 1, trial))
    goals = scene.controller.goals_in_world
    home = {name: goals[name].copy() for name in HANDS if name in goals}
    send(scene, {name: random_pose(rng) for name in home})
    outside = run(scene, 1.0)
    assert not scene.controller.info(scene.state)["ik"]["reached"]
    send(scene, home)
    outside = max(outside, run(scene, 2.0))
    frames = scene.controller.info(scene.state)["ik"]["frames"]
    assert max(frames[name]["position_error"] for name in home) < 1e-3
    assert outside < 1e-3
