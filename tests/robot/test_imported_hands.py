"""Grippers and hands of imported files: found by geometry, held to a simulated cube."""

import mujoco
import numpy as np
import pytest

import wbc_suite
from wbc_suite.errors import DescriptionError
from wbc_suite.robot.adopt.cube_hold import hand_alone, way_of_cube
from wbc_suite.robot.slab_hulls import slab_hulls

MASS = (
    '<inertial><mass value="0.1"/><inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" '
    'ixz="0" iyz="0"/></inertial>'
)


def link(name, *boxes):
    shapes = "".join(
        f'<{tag}><origin xyz="{at}"/><geometry><box size="{size}"/></geometry></{tag}>'
        for at, size in boxes
        for tag in ("visual", "collision")
    )
    return f'<link name="{name}">{MASS}{shapes}</link>'


def joint(name, parent, child, at, axis, limits, kind="revolute", extra=""):
    low, high = limits
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/>'
        f'<child link="{child}"/><origin xyz="{at}"/><axis xyz="{axis}"/>'
        f'<limit lower="{low}" upper="{high}" effort="3" velocity="3"/>{extra}</joint>'
    )


def chain(count):
    """Return an arm of joints a0, a1, ... along z, whose last link is `l{count}`."""
    text = link("l0", ("0 0 0.05", "0.06 0.06 0.1"))
    for k in range(count):
        axis = "0 0 1" if k % 2 == 0 else "0 1 0"
        text += joint(f"a{k}", f"l{k}", f"l{k + 1}", "0 0 0.12", axis, (-2, 2))
        if k + 1 < count:
            text += link(f"l{k + 1}", ("0 0 0.06", "0.05 0.05 0.1"))
    return text


def write(folder, text, name="robot.urdf"):
    path = folder / name
    path.write_text(f'<robot name="r">{text}</robot>', encoding="utf-8")
    return path


def jawed(limits=(-0.1, 1.4), axis="0 1 0", at="0 0 0.06", shape="0 0 0.04"):
    """Return an arm of four joints with a fixed jaw, and one that turns."""
    palm = ("0 0 0.03", "0.06 0.04 0.06"), ("-0.02 0 0.10", "0.01 0.03 0.08")
    jaw = link("last", (shape, "0.01 0.03 0.08"))
    return (
        chain(4) + link("l4", *palm) + jaw + joint("j", "l4", "last", at, axis, limits)
    )


def gap(robot, values):
    """Return the distance of the jaw's tip from the fixed jaw's, m."""
    model = robot.to_mjspec().compile()
    data = mujoco.MjData(model)
    for name, value in values.items():
        data.joint(name).qpos[0] = value
    mujoco.mj_forward(model, data)
    jaw = data.body("last")
    tip = jaw.xpos + jaw.xmat.reshape(3, 3) @ (0, 0, 0.08)
    palm = data.body("l4")
    return np.linalg.norm(tip - palm.xpos - palm.xmat.reshape(3, 3) @ (-0.02, 0, 0.14))


@pytest.mark.parametrize(
    ("axis", "limits", "opened"),
    [
        ("0 1 0", (-0.1, 1.4), 1.4),
        ("0 -1 0", (-1.0471975512, 0.1), -1.0471975512),  # more digits than 6
    ],
)
def test_one_jaw_against_a_fixed_one_is_a_gripper(tmp_path, axis, limits, opened):
    robot = wbc_suite.load_robot(write(tmp_path, jawed(limits, axis, "0.01 0 0.06")))
    assert robot.groups == {
        "right_arm": ("a0", "a1", "a2", "a3"),
        "right_gripper": ("j",),
    }
    (synergy,) = robot.synergies["right_gripper"]
    assert synergy.open == {"j": opened}
    assert gap(robot, synergy.open) > gap(robot, synergy.closed) + 0.05
    assert "is held in simulation" in synergy.reason
    assert robot.link_of(robot.hands["right"]) == "l4"
    x, y, z = robot.frame(robot.hands["right"]).pos
    assert -0.02 < x < 0.09
    assert abs(y) < 0.01
    assert 0.06 < z < 0.16
    assert robot.keyframe("ready")["j"] == opened
    action = wbc_suite.make("Lift", robots=str(tmp_path / "robot.urdf")).action_space
    assert action.shape[0] > 6


def test_a_jaw_without_limits_stops_where_it_is_open_and_closed(tmp_path, caplog):
    text = jawed(at="0.01 0 0.06")
    last = text.rindex("revolute")
    text = text[:last] + "continuous" + text[last + len("revolute") :]
    robot = wbc_suite.load_robot(write(tmp_path, text))
    (synergy,) = robot.synergies["right_gripper"]
    ends = sorted((synergy.open["j"], synergy.closed["j"]))
    assert robot.joint("j").range == tuple(ends)
    assert gap(robot, synergy.open) > gap(robot, synergy.closed) + 0.05
    assert "the jaw 'j' has no limits" in caplog.text


def test_a_link_that_folds_on_its_forearm_is_no_gripper(tmp_path):
    text = chain(4) + link("l4", ("0 0 0.05", "0.04 0.04 0.1"))
    text += link("last", ("0 0 0.05", "0.04 0.04 0.1"))
    text += joint("j", "l4", "last", "0 0 0.12", "0 1 0", (0, 2.9))
    robot = wbc_suite.load_robot(write(tmp_path, text))
    assert set(robot.groups) == {"right_arm"}
    assert not robot.synergies


def hand(flipped=()):
    """Return a palm with four fingers along z and a thumb opposite, y to the palm."""
    text = link("palm", ("0 0 0.04", "0.09 0.02 0.08"))
    for k in range(4):
        x, turned = -0.033 + 0.022 * k, k in flipped
        axis, limits = ("1 0 0", (-1.6, 0.1)) if turned else ("-1 0 0", (-0.1, 1.6))
        at = f"{x} 0.005 0.08"
        text += link(f"p{k}", ("0 0 0.02", "0.016 0.014 0.038"))
        text += link(f"d{k}", ("0 0 0.018", "0.016 0.014 0.034"))
        text += joint(f"b{k}", "palm", f"p{k}", at, axis, limits)
        text += joint(f"c{k}", f"p{k}", f"d{k}", "0 0 0.04", axis, limits)
    text += link("t0") + link("t1", ("0 0 0.03", "0.016 0.014 0.06"))
    text += joint("roll", "palm", "t0", "0.02 0.012 0.02", "0 0 1", (-1.2, 0.0))
    text += joint("bend", "t0", "t1", "0 0.02 0", "1 0 0.2", (-1.2, 0.0))
    return text


@pytest.mark.parametrize("flipped", [(), (1, 2)])
def test_all_fingers_of_a_hand_bend_the_same_way(tmp_path, flipped):
    robot = wbc_suite.load_robot(write(tmp_path, hand(flipped)))
    assert set(robot.groups) == set(robot.synergies) == {"gripper"}
    assert set(robot.hands) == {"tcp"}
    (synergy,) = robot.synergies["gripper"]
    for k in range(4):
        sign = -1.0 if k in flipped else 1.0
        for name in (f"b{k}", f"c{k}"):
            assert synergy.open[name] == 0.0
            assert sign * synergy.closed[name] > 0.5
    assert synergy.open["roll"] == synergy.closed["roll"]


def parallel():
    text = link("palm", ("0 0 0.02", "0.12 0.05 0.04"))
    for name, sign in (("one", 1), ("two", -1)):
        text += link(name, (f"{0.005 * sign} 0 0.03", "0.01 0.03 0.06"))
        axis = f"{sign} 0 0"
        text += joint(
            f"s_{name}", "palm", name, "0 0 0.04", axis, (0, 0.04), "prismatic"
        )
    return text.replace('effort="3"', 'effort="30"')


def test_a_hand_alone_is_a_gripper_of_any_arm(tmp_path):
    path = write(tmp_path, parallel(), "hand.urdf")
    alone = wbc_suite.load_robot(path)
    assert set(alone.groups) == {"gripper"}
    assert alone.frame("tcp").pos == pytest.approx((0, 0, 0.09), abs=2e-3)
    robot = wbc_suite.load_robot("UR5e", gripper=str(path))
    (synergy,) = robot.synergies["right_gripper"]
    assert synergy.open == {"s_one": 0.04, "s_two": 0.04}
    assert synergy.closed == {"s_one": 0.0, "s_two": 0.0}
    own = wbc_suite.load_robot("UR5e")
    assert robot.groups["right_arm"] == own.groups["right_arm"]
    assert robot.frame("right_tcp").link == "palm"


def test_a_hand_that_lies_across_is_turned_to_the_flange(tmp_path):
    lying = 'type="fixed"><parent link="base"/><child link="palm"/>'
    text = link("base", ("0 0 0", "0.02 0.02 0.02"))
    text += f'<joint name="f" {lying}<origin rpy="1.5708 0 0"/></joint>{parallel()}'
    path = write(tmp_path, text, "hand.urdf")
    robot = wbc_suite.load_robot("UR5e", gripper=str(path))
    straight = wbc_suite.load_robot(
        "UR5e", gripper=str(write(tmp_path, parallel(), "straight.urdf"))
    )

    def place(robot):
        model = robot.to_mjspec().compile()
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        return data.site("right_tcp").xpos

    np.testing.assert_allclose(place(robot), place(straight), atol=0.012)


def test_a_robot_is_no_gripper(tmp_path):
    with pytest.raises(
        DescriptionError, match="only a hand; found the groups right_arm"
    ):
        wbc_suite.load_robot("UR5e", gripper=str(write(tmp_path, jawed())))


def test_a_cube_is_held_between_fingers_only(tmp_path):
    robot = wbc_suite.load_robot(write(tmp_path, parallel()))
    (synergy,), tcp = robot.synergies["gripper"], robot.frame("tcp")
    alone = hand_alone(robot, "palm", ["one", "two"])
    assert way_of_cube(alone, synergy, tcp) < 0.01
    beside = tcp.model_copy(update={"pos": (0.0, 0.0, 0.15)})
    assert way_of_cube(alone, synergy, beside) == np.inf
    swapped = {"open": synergy.closed, "closed": synergy.open}
    assert way_of_cube(alone, synergy.model_copy(update=swapped), tcp) > 0.02


def test_slabs_follow_a_hook_that_one_hull_fills():
    import trimesh  # an independent volume

    legs = [
        trimesh.creation.box((0.1, 0.02, 0.02)),
        trimesh.creation.box((0.02, 0.02, 0.1)),
    ]
    legs[0].apply_translation((0.04, 0, 0))
    legs[1].apply_translation((0, 0, 0.06))
    volume = sum(leg.volume for leg in legs)
    hook = trimesh.util.concatenate(legs)
    hulls = slab_hulls(np.asarray(hook.vertices), np.asarray(hook.faces))
    total = sum(
        trimesh.PointCloud(np.array(x["spheres"])[:, :3]).convex_hull.volume
        for x in hulls
    )
    assert len(hulls) > 1
    assert hook.convex_hull.volume > 1.9 * volume
    assert volume < total < 1.5 * volume
