"""Targets of a tick, held to the formulas of the approach in plain NumPy."""

import numpy as np
import pinocchio as pin
import pytest
from textbook_approach import approach_pose, approach_posture

from wbc_suite.control.ik.config import WholeBodyIKConfig
from wbc_suite.control.ik.frame_targets import (
    ControlledFrames,
    posture_step,
    write_targets,
)
from wbc_suite.kinematics import Configuration
from wbc_suite.robot import load_robot

DT = 0.01
FRAMES = [
    {"name": "hand", "frame": "right_tcp"},
    {"name": "place", "frame": "left_tcp", "kind": "position", "gain": 0.3},
    {"name": "head", "frame": "head", "kind": "orientation", "level": 1},
    {"name": "com", "kind": "com", "level": 1},
    {"name": "base", "frame": "torso", "kind": "base", "max_linear_speed": 0.3},
]


@pytest.fixture(scope="module")
def standing():
    """Return config, configuration and controlled frames of GR1."""
    config = WholeBodyIKConfig.model_validate(
        {"type": "WHOLE_BODY_IK", "frame": FRAMES}
    )
    configuration = Configuration(load_robot("GR1").to_pinocchio())
    return config, configuration, ControlledFrames(config, configuration)


def pose_of(configuration, frame):
    if frame.frame is None:
        return pin.SE3(np.eye(3), configuration.com.copy())
    return configuration.frame_pose(frame.frame)


def draw(standing, rng):
    """Move the robot at random; return goals near and far."""
    config, configuration, _ = standing
    spread = 0.3 * rng.standard_normal(configuration.nv)
    configuration.update(
        pin.integrate(configuration.model, pin.neutral(configuration.model), spread)
    )
    size = 10.0 ** rng.uniform(-4, 0)
    return [
        pose_of(configuration, frame) * pin.exp6(size * rng.standard_normal(6))
        for frame in config.frames
    ]


def test_distances_count_what_the_kind_of_frame_says(standing):
    rng = np.random.default_rng(0)
    config, configuration, frames = standing
    for _ in range(100):
        goals = draw(standing, rng)
        for frame, goal, found in zip(
            config.frames, goals, frames.measure(goals), strict=True
        ):
            now = pose_of(configuration, frame)
            offset = goal.translation - now.translation
            turn = pin.log3(now.rotation.T @ goal.rotation)
            parts = {
                "pose": (offset, turn),
                "position": (offset, ()),
                "com": (offset, ()),
                "orientation": ((), turn),
                "base": (offset[:2], turn[2:]),
            }[frame.kind]
            expected = [np.linalg.norm(part) for part in parts]
            np.testing.assert_allclose(found, expected, atol=1e-10)


def test_targets_are_those_of_the_approach(standing):
    rng = np.random.default_rng(1)
    config, configuration, frames = standing
    for _ in range(100):
        goals, half = draw(standing, rng), rng.uniform(0.1, 9.0)
        rest = configuration.integrate(0.3 * rng.standard_normal(configuration.nv))
        frames.posture.goal[:] = rest
        frames.posture.max_speed[:] = rng.uniform(0.1, 3.0, configuration.nv)
        frames.posture.braking[:] = rng.uniform(1.0, 30.0, configuration.nv)
        error = frames.measure(goals)[[f.level == 0 for f in config.frames]]
        error = float((error / config.tolerance).max())
        rate = 1.0 / (1.0 + (error / half) ** 2)
        arguments = frames.argument, frames.posture_argument
        found = write_targets(configuration.robot, *arguments, DT, 2 * DT, half, True)
        assert found == pytest.approx(error)
        check_posture(frames.posture, configuration.q, 2 * DT, rate)
        for k, found in enumerate(frames.arrays.target):
            frame, now = config.frames[k], pose_of(configuration, config.frames[k])
            share = rate if frame.level else 1.0
            expected = approach_pose(
                now,
                goals[k],
                dt=DT,
                gain=frame.gain,
                speed=(
                    share * frame.max_linear_speed,
                    share * frame.max_angular_speed,
                ),
                acceleration=(frame.linear_braking, frame.angular_braking),
            )
            np.testing.assert_allclose(
                found.reshape(3, 4), expected.homogeneous[:3], atol=1e-10
            )
            np.testing.assert_allclose(
                frames.pose(k).homogeneous, now.homogeneous, atol=1e-12
            )


def check_posture(posture, q, settling, rate):
    """Compare with the formula; all joints here have one parameter."""
    difference = posture.goal - q
    velocity = approach_posture(
        difference,
        dt=settling,
        speed=rate * posture.max_speed,
        acceleration=posture.braking,
    )
    np.testing.assert_allclose(posture.target, q + settling * velocity, atol=1e-10)


def test_a_free_root_stays_in_the_posture():
    config = WholeBodyIKConfig.model_validate(
        {"type": "WHOLE_BODY_IK", "frame": [{"name": "a", "frame": "right_tcp"}]}
    )
    configuration = Configuration(load_robot("SpotWithArm").to_pinocchio())
    frames = ControlledFrames(config, configuration)
    frames.posture.goal[:] = configuration.q + 0.1
    frames.measure([frames.pose(0)])
    arguments = frames.argument, frames.posture_argument
    write_targets(configuration.robot, *arguments, DT, DT, 0.0, False)
    np.testing.assert_array_equal(frames.posture.target[:7], configuration.q[:7])
    assert (frames.posture.target[7:] > configuration.q[7:]).all()


def test_a_joint_settles_without_overshoot_and_brakes_within_its_limit():
    difference, speed, braking = 1.0, 2.0, 5.0
    steps = []
    for _ in range(400):
        steps.append(posture_step(difference, DT, speed, braking))
        difference -= steps[-1]
        assert difference >= 0.0
    assert difference < 1e-6
    velocities = np.array(steps) / DT
    assert velocities.max() <= speed
    assert -np.diff(velocities).min() <= braking * DT * (1.0 + 1e-9)
