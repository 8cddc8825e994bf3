"""Absolute rotations are wrapped: all values of one rotation command the same pose."""

import numpy as np
import pinocchio as pin
import pytest

import wbc_suite.compat.robosuite.controllers.uncoupled_osc  # noqa: F401 - registers
from wbc_suite.control import ActionLayout, ActionPart, SliceKind, Unit
from wbc_suite.control.action import FULL_TURN, LONGEST_VALUE
from wbc_suite.wrappers import Flat

ABSOLUTE = {"input_type": "absolute"}
ROTATION = ("rx", "ry", "rz")
CASES = [
    ("Panda", "BASIC", {"type": "OSC_POSE", **ABSOLUTE}),
    ("Panda", "BASIC", {"type": "OSC_POSE", "input_ref_frame": "world", **ABSOLUTE}),
    ("Panda", "BASIC", {"type": "UNCOUPLED_OSC_POSE", **ABSOLUTE}),
    (
        "Panda",
        "BASIC",
        {"type": "OSC_POSE", "orientation_limits": (-0.2, 0.3), **ABSOLUTE},
    ),
    ("PandaOmron", "HYBRID_MOBILE_BASE", {"type": "OSC_POSE", **ABSOLUTE}),
    ("Panda", "WHOLE_BODY_IK", {}),
    ("Panda", "WHOLE_BODY_MINK_IK", {}),
    ("Panda", "WHOLE_BODY_ID", {"input_ref_frame": "base"}),
    ("Tiago", "WHOLE_BODY_IK", {"input_ref_frame": "base"}),
]


def other(r):
    """Return the other rotation vector of a rotation, shorter than a full turn."""
    return r - FULL_TURN * r / np.linalg.norm(r)


def rotations(rng, count):
    """Return rotation vectors: of any angle, and of nearly half a turn."""
    axes = rng.normal(size=(count, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    angles = np.where(rng.random(count) < 0.5, rng.uniform(0.01, np.pi, count), np.pi)
    return (angles - rng.choice([0.0, 1e-9, 1e-3], count))[:, None] * axes


def goals(controller, action):
    """Return the goals of all frames after an action, checked as `step` does."""
    taken, clipped = controller.layout.take(action)
    controller.set_goal(taken)
    assert clipped == 0
    if hasattr(controller, "parts"):
        return [controller.parts["right"].goal.homogeneous]
    return [goal.homogeneous for goal in controller._goals.poses]


@pytest.mark.parametrize(("robot", "kind", "changes"), CASES)
def test_both_vectors_of_a_rotation_command_the_same_pose(alone, robot, kind, changes):
    if "type" in changes:
        config = {"body_parts": {"right": changes}}
        if kind == "HYBRID_MOBILE_BASE":
            config["body_parts"]["base"] = {"type": "BASE_VELOCITY"}
        changes = config
    controller = alone(robot, kind, **changes).controller
    layout, rng = controller.layout, np.random.default_rng(0)
    found = [s for s in layout.slices if s.wraps]
    assert found
    for r in rotations(rng, 30):
        actions = []
        for values in (r, other(r), other(r) + 2 * FULL_TURN * r / np.linalg.norm(r)):
            action = controller.hold_action
            for part in found:
                for k, label in enumerate(part.labels):
                    if label in ROTATION:
                        action[part.start + k] = values[ROTATION.index(label)]
                    elif label == "yaw":
                        turns = round((values[2] - r[2]) / FULL_TURN + 0.1)
                        action[part.start + k] = r[2] + turns * FULL_TURN
            actions.append(action)
        poses = [goals(controller, action) for action in actions]
        np.testing.assert_allclose(poses[1], poses[0], atol=1e-7)
        np.testing.assert_allclose(poses[2], poses[0], atol=1e-7)


def test_a_quaternion_is_normalised_not_clipped(alone):
    """Its values beyond 1 were clipped one by one, which is another rotation."""
    part = {"type": "IK_POSE", **ABSOLUTE}
    controller = alone("Panda", "BASIC", body_parts={"right": part}).controller
    rng = np.random.default_rng(0)
    for _ in range(20):
        quaternion, action = rng.normal(size=4), controller.hold_action
        quaternion /= np.linalg.norm(quaternion)
        action[3:7] = rng.choice([-7.0, 2.5, 1e-3]) * quaternion
        (pose,) = goals(controller, action)
        wanted = pin.Quaternion(*quaternion[[3, 0, 1, 2]]).matrix()
        np.testing.assert_allclose(pose[:3, :3], wanted, atol=1e-9)


def layout(**changes):
    values = {
        "name": "hand",
        "kind": SliceKind.POSE,
        "labels": ("x", *ROTATION),
        "units": (Unit("m"), *(Unit("rad"),) * 3),
        "low": (-1.0, *(-FULL_TURN,) * 3),
        "high": (1.0, *(FULL_TURN,) * 3),
        "wraps": True,
    }
    return ActionLayout([ActionPart(**values | changes)])


def test_only_what_is_beyond_the_bounds_is_changed():
    rng, taken = np.random.default_rng(0), layout()
    for _ in range(100):
        action = rng.uniform(taken.low, taken.high)
        found, clipped = taken.take(action)
        np.testing.assert_array_equal(found, action)
        assert clipped == 0
    found, clipped = taken.take([3.0, 0.0, 4.0 * np.pi + 0.5, 0.0])
    np.testing.assert_allclose(found, [1.0, 0.0, 0.5, 0.0], atol=1e-12)
    assert clipped == 1  # the position


@pytest.mark.parametrize("value", [1e10, LONGEST_VALUE, 1e308])
def test_a_huge_rotation_stays_a_rotation(value):
    found, _ = layout().take([0.0, value, -value, value])
    assert np.linalg.norm(found) <= np.pi + 1e-9


def test_slices_that_do_not_wrap_are_clipped():
    found, clipped = layout(wraps=False).take([0.0, 7.0, 0.0, -7.0])
    np.testing.assert_allclose(found, [0.0, FULL_TURN, 0.0, -FULL_TURN])
    assert clipped == 2


def test_a_normalised_space_holds_both_vectors_of_a_rotation():
    import wbc_suite

    part = {"type": "OSC_POSE", **ABSOLUTE}
    config = {"type": "BASIC", "format": 1, "body_parts": {"right": part}}
    env = wbc_suite.make("Lift", robots="Panda", controller_configs=config)
    flat, r = Flat(env), np.array([3.0, -0.5, 0.7])
    ends = []
    for values in (r, other(r), r + 3.0 * FULL_TURN * r / np.linalg.norm(r)):
        flat.reset(seed=0)
        action = env.unwrapped.hold_action
        action[3:6] = values
        scaled = flat.scaled(action)
        assert flat.action_space.contains(scaled)
        flat.step(scaled)
        ends.append(env.unwrapped.controllers[0].parts["right"].goal.homogeneous)
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-5)  # float32
    np.testing.assert_allclose(ends[2], ends[0], atol=1e-5)
    env.close()
