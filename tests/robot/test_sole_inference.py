"""Soles and balls that are guessed from collision shapes."""

import pytest

from wbc_suite.control import load_composite_controller_config
from wbc_suite.robot import load_robot
from wbc_suite.robot.adopt.soles import ball_radius, guess_sole

CORNER = """<collision><origin xyz="{x} {y} -0.03"/>
<geometry><sphere radius="0.005"/></geometry></collision>"""
FOOT = """<robot name="foot"><link name="shank"><inertial><mass value="1"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="left_foot"><inertial><mass value="1"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
{shapes}</link>
<joint name="ankle" type="revolute"><parent link="shank"/><child link="left_foot"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="10" velocity="10"/></joint>
</robot>"""

WHEEL_TURN = '<origin rpy="1.5708 0 0"/><geometry>'  # its axis is that of the ankle


@pytest.fixture
def foot(tmp_path):
    """A robot that is one foot with the given collision shapes."""

    def load(shapes):
        file = tmp_path / "foot.urdf"
        file.write_text(FOOT.format(shapes=shapes))
        return load_robot(file)

    return load


def test_a_sole_is_the_rectangle_of_the_lowest_shapes(foot):
    corners = [(-0.05, 0.025), (-0.05, -0.025), (0.12, 0.03), (0.12, -0.03)]
    shapes = "".join(CORNER.format(x=x, y=y) for x, y in corners)
    high = CORNER.format(x=0.3, y=0.1).replace("-0.03", "0.05")
    robot = foot(shapes + high)
    frame = robot.frames[-1].name
    sole = guess_sole(robot, frame)
    assert sole.edges == pytest.approx((-0.05, 0.12, -0.03, 0.03))
    assert sole.height == pytest.approx(0.035)
    assert ball_radius(robot, frame) == 0.0


def test_a_sole_frame_on_a_fixed_link_takes_the_shapes_of_the_body(tmp_path):
    shapes = "".join(CORNER.format(x=x, y=y) for x, y in [(-0.05, 0.03), (0.12, -0.03)])
    text = FOOT.format(shapes=shapes).replace('"left_foot"', '"left_ankle"')
    fixed = """<link name="left_foot"><inertial><mass value="0.01"/><inertia ixx="1e-4"
iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="fixed" type="fixed">
<parent link="left_ankle"/><child link="left_foot"/><origin xyz="0.01 0 -0.035"/>
</joint>
</robot>"""
    file = tmp_path / "fixed.urdf"
    file.write_text(text.replace("</robot>", fixed))
    robot = load_robot(file)
    frame = next(frame for frame in robot.frames if frame.link == "left_foot")
    sole = guess_sole(robot, frame.name)
    assert sole.edges == pytest.approx((-0.06, 0.11, -0.03, 0.03))
    assert sole.height == pytest.approx(0.0, abs=1e-9)


def test_a_single_ball_about_the_frame_has_a_radius_and_no_sole(foot):
    ball = CORNER.format(x=0.0, y=0.0).replace("-0.03", "0.0")
    robot = foot(ball.replace("0.005", "0.02"))
    frame = robot.frames[-1].name
    assert ball_radius(robot, frame) == pytest.approx(0.02)
    assert guess_sole(robot, frame) is None


def test_a_foot_without_shapes_has_neither(foot):
    robot = foot("")
    frame = robot.frames[-1].name
    assert (guess_sole(robot, frame), ball_radius(robot, frame)) == (None, 0.0)


def test_the_guessed_soles_of_gr1_are_those_of_its_file():
    config = load_composite_controller_config("WHOLE_BODY_ID", "GR1FreeBody")
    robot = load_robot("GR1FreeBody")
    for told in config["foot"]:
        sole = guess_sole(robot, told["frame"])
        assert sole.edges == pytest.approx(told["sole"], abs=0.01)
        assert sole.height == pytest.approx(0.0, abs=0.01)


def test_the_balls_of_spot_are_those_of_its_file():
    config = load_composite_controller_config("WHOLE_BODY_ID", "Spot")
    robot = load_robot("Spot")
    for told in config["foot"]:
        assert ball_radius(robot, told["frame"]) == pytest.approx(told["radius"])


def test_a_wheel_rolls_and_a_foot_with_limits_does_not(foot, tmp_path):
    shape = '<collision><geometry><cylinder radius="0.08" length="0.1"/></geometry>'
    wheel = f"{shape.replace('<geometry>', WHEEL_TURN)}</collision>"
    robot = foot(wheel)
    name = next(frame.name for frame in robot.frames if frame.role == "foot")
    assert ball_radius(robot, name) == 0.0
    limit = '<limit lower="-1" upper="1" effort="10" velocity="10"/>'
    text = FOOT.format(shapes=wheel).replace(limit, limit.replace('upper="1"', ""))
    text = text.replace('lower="-1" ', "").replace("revolute", "continuous")
    file = tmp_path / "wheel.urdf"
    file.write_text(text)
    assert ball_radius(load_robot(file), name) == pytest.approx(0.08, rel=1e-3)
