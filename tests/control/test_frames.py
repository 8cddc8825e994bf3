"""Kernels of controlled frames, held to their readable forms."""

import copy
import pickle

import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.control.composite.config import WholeBodyIKConfig
from wbc_suite.control.composite.frames import (
    ControlledFrames,
    JointField,
    approach_joints,
)
from wbc_suite.control.part.approach import approach_pose, approach_posture
from wbc_suite.control.reasons import Reasons
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.array_table import ArrayTable
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


def few_joints():
    rng = np.random.default_rng(3)
    return ArrayTable(JointField, {f: rng.uniform(0.1, 2.0, 4) for f in JointField})


def test_targets_are_those_of_the_readable_approach(standing):
    rng = np.random.default_rng(1)
    config, configuration, frames = standing
    for _ in range(100):
        goals, stray, joints = draw(standing, rng), rng.uniform(0.1, 9.0), few_joints()
        off = frames.measure(goals)[[f.level == 0 for f in config.frames]]
        off = float((off / config.tolerance).max())
        pace = 1.0 / (1.0 + (off / stray) ** 2)
        targets = frames.lead(
            goals, joints.table, DT, settling=DT, stray=stray, arrived=True
        )
        assert frames.off == pytest.approx(off)
        expected = approach_posture(
            joints[JointField.DIFFERENCE],
            dt=DT,
            speed=pace * joints[JointField.SPEED],
            acceleration=joints[JointField.BRAKING],
        )
        np.testing.assert_allclose(joints[JointField.STEP], DT * expected, atol=1e-10)
        for k, found in enumerate(targets):
            frame = config.frames[k]
            share = pace if frame.level else 1.0
            expected = approach_pose(
                pose_of(configuration, frame),
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
                frames.pose(k).homogeneous,
                pose_of(configuration, frame).homogeneous,
                atol=1e-12,
            )


def test_joint_steps_are_those_of_the_readable_approach():
    rng = np.random.default_rng(2)
    for _ in range(100):
        difference = 10.0 ** rng.uniform(-6, 0) * rng.standard_normal(9)
        speed, braking = rng.uniform(0.1, 3.0, 9), rng.uniform(1.0, 30.0, 9)
        pace, out = rng.uniform(), np.zeros(9)
        approach_joints(difference, DT, pace, speed, braking, out)
        expected = approach_posture(
            difference, dt=DT, speed=pace * speed, acceleration=braking
        )
        np.testing.assert_allclose(out, DT * expected, atol=1e-10)


def test_reasons_are_sought_once_and_copied_as_lists():
    asked = []

    def tell():
        asked.append(True)
        return ["moving", "out of reach"]

    reasons = Reasons(tell)
    assert not asked
    assert reasons == ["moving", "out of reach"]
    assert (len(reasons), reasons[0], reasons[-1:]) == (2, "moving", ["out of reach"])
    assert repr(reasons) == "['moving', 'out of reach']"
    assert len(asked) == 1
    for twin in (pickle.loads(pickle.dumps(reasons)), copy.deepcopy(reasons)):
        assert type(twin) is list
        assert twin == reasons
