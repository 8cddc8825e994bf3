"""Estimated masses and motors of files that state none."""

from itertools import pairwise

import numpy as np
import pytest

from wbc_suite.errors import DescriptionError
from wbc_suite.robot import load_robot
from wbc_suite.robot.adopt.missing_data import (
    DENSITY,
    GRAVITY,
    HEAVIEST_BASE,
    LEAST,
    RESERVE,
    ROTOR,
    STRETCHED,
)

BALL = '<geometry><sphere radius="0.1"/></geometry>'
ARM = """<robot name="arm"><link name="base"/>
<link name="upper"><inertial><mass value="2"/><origin xyz="0.3 0 0"/>
 <inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="lower"><inertial><mass value="1"/><origin xyz="0 0 0.2"/>
 <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
 <limit lower="-1" upper="1" effort="{effort}" velocity="1"/><axis xyz="0 1 0"/></joint>
<joint name="slide" type="prismatic"><parent link="upper"/><child link="lower"/>
 <origin xyz="0.5 0 0"/><limit lower="0" upper="1" effort="0" velocity="1"/>
 <axis xyz="0 0 1"/></joint></robot>"""


def read(tmp_path, text):
    path = tmp_path / "robot.urdf"
    path.write_text(text)
    return load_robot(path)


def test_estimated_motors_hold_twice_the_weight_of_a_stretched_limb(tmp_path, caplog):
    robot = read(tmp_path, ARM.format(effort=0))
    moment = 2.0 * 0.3 + 1.0 * (0.5 + 0.2)
    shoulder, slide = robot.joints
    assert shoulder.effort == pytest.approx(RESERVE * GRAVITY * moment, abs=0.01)
    assert slide.effort == pytest.approx(RESERVE * GRAVITY * 1.0, abs=0.01)
    assert shoulder.armature == pytest.approx(ROTOR * (shoulder.effort or 0.0))
    assert "estimated" in caplog.text
    assert "estimated" in robot.deviations[0]


LIFT = """<robot name="lift"><link name="base"/>
<link name="column"><inertial><mass value="20"/>
 <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="slide" type="prismatic"><parent link="base"/><child link="column"/>
 <limit lower="0" upper="1" effort="{effort}" velocity="1"/>
 <axis xyz="{axis}"/></joint></robot>"""


@pytest.mark.parametrize(
    ("effort", "axis", "estimated"),
    [(100, "0 0 1", True), (100, "1 0 0", False), (200, "0 0 1", False)],
)
def test_a_lift_that_cannot_carry_its_load_gets_another_motor(
    tmp_path, caplog, effort, axis, estimated
):
    robot = read(tmp_path, LIFT.format(effort=effort, axis=axis))
    wanted = RESERVE * GRAVITY * 20.0 if estimated else effort
    assert robot.joint("slide").effort == pytest.approx(wanted)
    message = "efforts of lifts are estimated"
    assert (message in caplog.text, message in " ".join(robot.deviations)) == (
        estimated,
        estimated,
    )


def test_a_base_of_joints_without_motors_gets_them(tmp_path):
    body = ARM[ARM.index("<inertial>") : ARM.index("</link>")]
    names = ("ground", "x", "y", "theta", *(f"arm{i}" for i in range(1, 7)))
    limit = '<limit lower="-2" upper="2" effort="{}" velocity="1"/>'
    text = "".join(f"<link name={name!r}>{body}</link>" for name in names[1:])
    text += '<link name="ground"/>'
    for above, name in pairwise(names):
        kind = "prismatic" if name in ("x", "y") else "revolute"
        axis = {"x": "1 0 0", "y": "0 1 0", "theta": "0 0 1"}.get(name, "0 1 0")
        text += f'<joint name="j_{name}" type="{kind}"><parent link="{above}"/>'
        text += f'<child link="{name}"/><axis xyz="{axis}"/><origin xyz="0 0 .2"/>'
        text += limit.format(9 if "arm" in name else 0) + "</joint>"
    robot = read(tmp_path, f'<robot name="mobile">{text}</robot>')
    assert robot.groups["base"] == ("j_x", "j_y", "j_theta")
    assert all(robot.joint(name).effort for name in robot.groups["base"])
    assert robot.joint("j_arm1").effort == 9.0


def test_a_file_with_half_of_the_motors_gets_no_others(tmp_path):
    shoulder, slide = read(tmp_path, ARM.format(effort=7)).joints
    assert (shoulder.effort, slide.effort, slide.armature) == (7.0, None, 0.0)


def test_motors_of_a_urdf_get_armatures_and_those_of_mjcf_keep_theirs(tmp_path):
    robot = read(tmp_path, ARM.format(effort=7))
    assert robot.joint("shoulder").armature == pytest.approx(7.0 * ROTOR)
    assert robot.deviations == (
        "armatures are estimated from efforts: the file has none",
    )
    path = tmp_path / "arm.xml"
    path.write_text("""<mujoco><worldbody><body name="upper"><joint name="shoulder"/>
    <geom size="0.1"/></body></worldbody>
    <actuator><motor joint="shoulder" ctrlrange="-7 7"/></actuator></mujoco>""")
    robot = load_robot(path)
    assert (robot.joint("shoulder").armature, robot.deviations) == (0.0, ())


def chain(folder, rows):
    """Read joints of (name, parent, child, effort)."""

    def row(name, parent, child, effort):
        return (
            f'<joint name="{name}" type="revolute"><parent link="{parent}"/>'
            f'<child link="{child}"/><axis xyz="0 1 0"/>'
            f'<limit lower="-1" upper="1" effort="{effort}" velocity="1"/></joint>'
        )

    body = (
        '<inertial><mass value="1"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1"'
        ' iyz="0" izz="0.1"/></inertial>'
    )
    links = "".join(f'<link name="{child}">{body}</link>' for _, _, child, _ in rows)
    joints = "".join(row(*own) for own in rows)
    return read(folder, f'<robot name="r"><link name="base"/>{links}{joints}</robot>')


@pytest.mark.parametrize(("count", "driven"), [(2, False), (6, True)])
def test_the_first_joint_of_a_long_arm_has_a_motor(tmp_path, count, driven):
    names = ["base", *(f"a{k}" for k in range(count))]
    rows = [(f"arm_{k}", names[k], names[k + 1], 50 * (k > 0)) for k in range(count)]
    robot = chain(tmp_path, rows)
    assert bool(robot.joint("arm_0").effort) is driven
    assert robot.joint("arm_1").effort == 50.0


def test_an_arm_with_few_motors_gets_them_beside_a_driven_hand(tmp_path):
    rows = [("arm_1", "base", "a1", 0), ("arm_2", "a1", "a2", 0)]
    rows += [(f"finger_{k}", "a2", f"f{k}", 1) for k in range(3)]
    robot = chain(tmp_path, rows)
    assert all((robot.joint(f"arm_{k}").effort or 0.0) >= 1.0 for k in (1, 2))
    assert [robot.joint(f"finger_{k}").effort for k in range(3)] == [1.0, 1.0, 1.0]


ROUND = 0.03  # part of its volume that the mesh of a ball of 0.1 m lacks, at most
SOLID = DENSITY * 4.0 / 3.0 * np.pi * 0.1**3


def ball_on_a_hinge(folder, *, base="", limit="", visual=""):
    collision = f'<collision><origin xyz="0 0 0.5"/>{BALL}</collision>'
    return read(
        folder,
        f"""<robot name="ball"><link name="base">{base}</link><link name="ball">
        {visual}{collision}</link>
        <joint name="hinge" type="revolute"><parent link="base"/><child link="ball"/>
        <limit lower="-1" upper="1" velocity="1" {limit}/></joint></robot>""",
    )


def test_a_ball_without_mass_gets_that_of_its_volume(tmp_path, caplog):
    robot = ball_on_a_hinge(tmp_path, limit='effort="0"')
    ball = robot.link("ball")
    assert ball.mass == pytest.approx(SOLID, rel=ROUND)
    assert ball.com == pytest.approx((0.0, 0.0, 0.5))
    assert ball.inertia[:3] == pytest.approx((0.4 * SOLID * 0.1**2,) * 3, rel=2 * ROUND)
    assert robot.joints[0].effort == pytest.approx(
        RESERVE * GRAVITY * ball.mass / 2, abs=0.01
    )
    assert f"mended: {robot.mass:.3g} kg in all" in caplog.text


@pytest.mark.parametrize("share", [0.6, 0.01, 3.0])
def test_missing_masses_are_what_motors_can_hold(tmp_path, share):
    effort = share * STRETCHED * GRAVITY * SOLID * 0.5
    robot = ball_on_a_hinge(tmp_path, limit=f'effort="{effort}"')
    wanted = SOLID * min(max(share, LEAST), 1.0)
    assert robot.mass == pytest.approx(wanted, rel=ROUND)


def test_a_table_below_an_arm_is_no_block(tmp_path):
    """A box of 1 x 2 x 1 m would have two tons."""
    box = '<collision><geometry><box size="1 2 1"/></geometry></collision>'
    robot = ball_on_a_hinge(tmp_path, base=box, limit='effort="100"')
    ball, table = robot.link("ball"), robot.link("base")
    assert table.mass == pytest.approx(HEAVIEST_BASE * ball.mass)
    x, y, z = table.inertia[:3]
    assert (x, y, z) == pytest.approx(
        (table.mass / 12 * 5, table.mass / 12 * 2, table.mass / 12 * 5)
    )


def test_padded_collision_shapes_and_overlaps_have_no_mass(tmp_path):
    visual = '<visual><geometry><box size="0.1 0.1 0.2"/></geometry></visual>'
    robot = ball_on_a_hinge(tmp_path, limit='effort="100"', visual=2 * visual)
    assert robot.mass == pytest.approx(DENSITY * 0.1 * 0.1 * 0.2)


@pytest.mark.parametrize(
    ("moment", "fault"),
    [
        ("1e4", "a radius of gyration of 122 m is impossible in 0.346 m"),
        ("1e-8", "a radius of gyration of 0.000122 m is impossible in 0.346 m"),
    ],
)
def test_an_inertia_that_no_body_of_its_size_has_is_mended(
    tmp_path, caplog, moment, fault
):
    tensor = f'ixx="{moment}" iyy="{moment}" izz="{moment}"'
    text = ARM.format(effort=1).replace('ixx="0.01" iyy="0.01" izz="0.01"', tensor)
    shape = f"<collision>{BALL}</collision></link>"
    text = text.replace(
        f'izz="{moment}" ixy="0" ixz="0" iyz="0"/></inertial></link>',
        f'izz="{moment}" ixy="0" ixz="0" iyz="0"/></inertial>{shape}',
    )
    lower = read(tmp_path, text).link("lower")
    assert lower.inertia == pytest.approx((0.4 * 0.1**2,) * 3 + (0.0,) * 3)
    assert lower.com == (0.0, 0.0, 0.2)
    assert fault in caplog.text
    with pytest.raises(DescriptionError, match="is impossible in"):
        load_robot(tmp_path / "robot.urdf", strict=True)
