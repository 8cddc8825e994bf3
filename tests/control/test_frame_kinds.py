import numpy as np
import pinocchio as pin
import pytest

import wbc_suite
from wbc_suite.control import (
    FRAME_KINDS,
    FrameKind,
    SliceKind,
    register_frame_kind,
)
from wbc_suite.control.ik.frame_kinds import set_target
from wbc_suite.devices.action_ports import LimbKind, limb_ports
from wbc_suite.errors import ConfigError, UnknownNameError

LABELS = {
    "pose": ("x", "y", "z", "rx", "ry", "rz"),
    "position": ("x", "y", "z"),
    "orientation": ("rx", "ry", "rz"),
    "base": ("x", "y", "yaw"),
    "com": ("x", "y", "z"),
}


@pytest.fixture
def height(forget):
    """Register a kind of one's own for one test: the height of a frame."""

    class Height(FrameKind):
        name = "height"
        labels = ("z",)
        slice_kind = SliceKind.POSITION

    forget(FRAME_KINDS, "height")
    return register_frame_kind(Height)


def random_pose(rng):
    return pin.SE3(pin.exp3(rng.uniform(-1.5, 1.5, 3)), rng.normal(size=3))


def test_the_kinds_of_the_documentation_exist():
    assert {*LABELS} <= {*FRAME_KINDS}


@pytest.mark.parametrize("name", LABELS)
def test_values_of_a_pose_command_it_again(name):
    kind, rng = FRAME_KINDS[name], np.random.default_rng(0)
    assert kind.labels == LABELS[name]
    for _ in range(20):
        wanted, now = random_pose(rng), random_pose(rng)
        values = kind.values(wanted)
        found = kind.pose(values, now)
        np.testing.assert_allclose(kind.values(found), values, atol=1e-9)
        if name in ("pose", "position", "com"):
            np.testing.assert_allclose(found.translation, wanted.translation)
        if name in ("position", "com"):
            np.testing.assert_allclose(found.rotation, now.rotation)
        if name in ("pose", "orientation"):
            np.testing.assert_allclose(found.rotation, wanted.rotation, atol=1e-9)
        if name == "orientation":
            np.testing.assert_allclose(found.translation, now.translation)
        if name == "base":
            assert found.translation[2] == now.translation[2]
            np.testing.assert_allclose(found.rotation[2], [0, 0, 1], atol=1e-12)


@pytest.mark.parametrize("name", LABELS)
def test_steps_move_a_goal_in_the_given_axes(name):
    kind, rng = FRAME_KINDS[name], np.random.default_rng(1)
    for _ in range(20):
        goal, axes = random_pose(rng), pin.exp3(rng.uniform(-1.5, 1.5, 3))
        step = dict(
            zip(kind.labels, rng.uniform(-0.3, 0.3, len(kind.labels)), strict=True)
        )
        found = kind.moved(np.array([*step.values()]), goal, axes)
        shift = np.array([step.get(label, 0.0) for label in "xyz"])
        turn = np.array([step.get(label, 0.0) for label in ("rx", "ry", "rz")])
        turn[2] += step.get("yaw", 0.0)
        np.testing.assert_allclose(found.translation, goal.translation + axes @ shift)
        expected = pin.exp3(axes @ turn) @ goal.rotation
        np.testing.assert_allclose(found.rotation, expected, atol=1e-12)


@pytest.mark.parametrize("name", LABELS)
def test_the_task_costs_the_components_that_count(name):
    kind = FRAME_KINDS[name]
    config = wbc_suite.control.ik.config.ControlledFrame(
        name="a",
        frame="right_tcp" if kind.needs_frame else None,
        kind=name,
        position_cost=2.0,
        orientation_cost=3.0,
    )
    position, orientation = kind.costs(config)
    np.testing.assert_array_equal(position > 0.0, kind.counted[:3])
    np.testing.assert_array_equal(orientation > 0.0, kind.counted[3:])
    assert {*position} <= {0.0, 2.0}
    assert {*orientation} <= {0.0, 3.0}
    target = random_pose(np.random.default_rng(2))
    task = kind.task(config)
    set_target(task, target.homogeneous.ravel()[:12])
    place = task.target.translation if kind.needs_frame else task.target
    np.testing.assert_array_equal(place, target.translation)
    assert (task.gain, task.level) == (config.gain, config.level)


def test_a_kind_of_ones_own_moves_a_robot(height):
    config = wbc_suite.load_composite_controller_config("WHOLE_BODY_IK", robot="Panda")
    config["frame"] = [{"name": "hand", "frame": "right_tcp", "kind": "height"}]
    env = wbc_suite.make("Lift", robots="Panda", controller_configs=config)
    env.reset(seed=0)
    part = env.action_layout["hand"]
    assert (part.labels, part.kind) == (("z",), "position")
    assert [str(unit) for unit in part.units] == ["m"]
    goal = env.hold_action.copy()
    goal[part.start] += 0.1
    for _ in range(30):
        *_, info = env.step(goal)
    site = env.unwrapped.simulation.data.site("robot0_right_tcp")
    assert site.xpos[2] == pytest.approx(goal[part.start], abs=1e-3)
    report = info["ik"]["frames"]["hand"]
    assert report["reached"]
    assert report["orientation_error"] == 0.0
    port = limb_ports(env)["hand"]
    assert port.kind is LimbKind.POSITION
    np.testing.assert_allclose(port.encode(port.measure()), site.xpos[2:], atol=1e-12)
    env.close()


def test_an_unknown_kind_is_named_with_the_nearest():
    with pytest.raises(UnknownNameError, match="Did you mean 'pose'"):
        FRAME_KINDS["poze"]
    config = {"format": 1, "frame": [{"name": "a", "frame": "b", "kind": "poze"}]}
    with pytest.raises(ConfigError, match="Did you mean 'pose'"):
        wbc_suite.load_composite_controller_config(
            config | {"type": "WHOLE_BODY_IK"}, robot="Panda"
        )


def test_names_and_labels_of_kinds_are_checked(height):
    with pytest.raises(ConfigError, match="exists already"):
        register_frame_kind(height)

    class Wrong(FrameKind):
        name = "wrong"
        labels = ("w",)

    with pytest.raises(ConfigError, match="No component named 'w'"):
        register_frame_kind(Wrong)
    assert "wrong" not in FRAME_KINDS


def test_a_kind_without_labels_is_refused():
    kind = type("Nothing", (FrameKind,), {"name": "nothing"})
    with pytest.raises(ConfigError, match=r"Nothing: .* needs labels"):
        register_frame_kind(kind)
