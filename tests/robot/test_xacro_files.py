"""xacro files: expanded with packages beside them, or refused with what to do."""

import importlib.util

import pytest

from wbc_suite.errors import ConfigError
from wbc_suite.robot import load_robot, xacro_files

HEAD = '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="arm">'
MACRO = f"""{HEAD}<xacro:macro name="body" params="name mass"><link name="${{name}}">
<inertial><mass value="${{2 * mass}}"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1"
iyz="0" izz="0.1"/></inertial></link></xacro:macro></robot>"""
ARM = f"""{HEAD}<xacro:include filename="$(find parts)/urdf/body.xacro"/>
<xacro:arg name="reach" default="0.7"/><link name="base"/>
<xacro:body name="upper" mass="1.5"/>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
<origin xyz="0 0 $(arg reach)"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="${{pi / 2}}" effort="9" velocity="1"/></joint></robot>"""


@pytest.fixture
def arm(tmp_path):
    """A template that includes a macro of a package beside its own."""
    for package, name, text in (
        ("parts", "body.xacro", MACRO),
        ("arm", "arm.urdf.xacro", ARM),
    ):
        folder = tmp_path / package
        (folder / "urdf").mkdir(parents=True)
        (folder / "package.xml").write_text("<package/>")
        (folder / "urdf" / name).write_text(text)
    return tmp_path / "arm" / "urdf" / "arm.urdf.xacro"


@pytest.mark.slow
def test_a_template_is_expanded_with_the_packages_beside_it(arm):
    pytest.importorskip("xacro")
    robot = load_robot(arm)
    assert robot.name == "arm"
    assert robot.link("upper").mass == 3.0
    assert robot.link("upper").pos == (0.0, 0.0, 0.7)
    assert robot.joint("shoulder").range == pytest.approx((-1.0, 1.5707963))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("find parts", "find gone", "No package 'gone' .* ROS_PACKAGE_PATH"),
        ("<xacro:body name", "<xacro:bdy name", "xacro cannot expand it.*bdy"),
        ("$(arg reach)", "$(arg rach)", "(?s)cannot expand it.*NAME:=VALUE > robot"),
    ],
)
def test_what_cannot_be_expanded_is_one_error(arm, old, new, message):
    pytest.importorskip("xacro")
    arm.write_text(ARM.replace(old, new))
    with pytest.raises(ConfigError, match=message):
        load_robot(arm)


@pytest.mark.slow
def test_a_template_without_end_is_stopped(arm, monkeypatch):
    pytest.importorskip("xacro")
    monkeypatch.setattr(xacro_files, "SECONDS", 0.01)
    with pytest.raises(ConfigError, match=r"has not expanded it in 0.01 s"):
        load_robot(arm)


def test_without_the_package_the_command_is_named(arm, monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(ConfigError, match=r"pip install 'wbc-suite\[xacro\]'"):
        load_robot(arm)
