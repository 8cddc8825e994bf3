"""A hand follows a moving target closely, and joints accelerate smoothly."""

import numpy as np
import pytest

PERIOD = 0.01  # s; targets are sent 100 times a second
WIDTH = 0.16  # m
RAMP = 2.0  # s; in which the target gathers speed, as the limits of devices do


def figure_eight(phase):
    return 0.5 * WIDTH * np.array([0.0, np.sin(phase), 0.5 * np.sin(2.0 * phase)])


def targets(speed, seconds):
    """Return positions of a target on a curve, at a greatest speed, m/s."""
    times = np.arange(0.0, seconds, PERIOD)
    rate = speed / (0.5 * WIDTH * np.sqrt(2.0))
    phases = rate * np.where(times < RAMP, 0.5 * times**2 / RAMP, times - 0.5 * RAMP)
    return np.array([figure_eight(phase) for phase in phases])


def follow(scene, places):
    """Send targets; return the hand's positions and all joint velocities."""
    controller, state = scene.controller, scene.state
    part = controller.layout["right_hand"]
    start, action = scene.site("right_tcp"), controller.hold_action
    home = action[part.start : part.start + 3].copy()
    joints = tuple(controller.joint_targets)
    _, index = state.joint_addresses(joints)
    hands, velocities = [], []
    for place in places:
        action[part.start : part.start + 3] = home + place
        controller.set_goal(action, PERIOD)
        scene.simulation.tick(round(PERIOD / scene.simulation.timestep))
        hands.append(scene.site("right_tcp") - start)
        velocities.append(state.data.qvel[index].copy())
    return np.array(hands), np.array(velocities)


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["GR1", "SpotWithArm", "Panda", "Tiago"])
@pytest.mark.parametrize("speed", [0.3, 0.8])
def test_a_hand_follows_a_moving_target_smoothly(alone, robot, speed):
    places = targets(speed, 4.0)
    hands, velocities = follow(alone(robot), places)
    lag = np.linalg.norm(hands - places, axis=1)
    aside = [
        np.linalg.norm(places[: k + 1] - hand, axis=1).min()
        for k, hand in enumerate(hands)
    ]
    accelerations = np.diff(velocities, axis=0) / PERIOD
    changes = np.abs(np.diff(accelerations, axis=0))
    assert max(aside) < 0.06
    if speed < 0.5:
        assert lag.max() < 0.06
    assert changes.max() < 10.0
