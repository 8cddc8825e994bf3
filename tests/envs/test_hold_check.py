"""What `wbc-suite check` says about an imported robot that holds `ready`."""

import pytest

from wbc_suite.envs.hold_check import hold_faults
from wbc_suite.robot import load_robot

ARM = """<robot name="arm">
  <link name="base"><inertial><mass value="5"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <joint name="shoulder" type="revolute"><origin xyz="0 0 1"/>
    <parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="{effort}" velocity="3"/></joint>
  <link name="upper"><inertial><origin xyz="0.3 0 0"/><mass value="2"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.06" iyz="0" izz="0.06"/></inertial>
    <collision><origin xyz="0.3 0 0"/><geometry><box size="0.6 0.1 0.1"/></geometry>
    </collision></link>
</robot>"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effort", "cause"),
    [
        (40, None),
        (2, "its effort of 2 is less than the 5.89 that its weight needs"),
        (0, "it has no motor, since the file gives it no effort"),
    ],
)
def test_a_joint_that_falls_is_named_with_its_cause(tmp_path, effort, cause):
    path = tmp_path / "arm.urdf"
    path.write_text(ARM.format(effort=effort or 40), encoding="utf-8")
    robot = load_robot(path)
    if effort == 0:
        text = robot.to_toml().replace(", effort = 40", "")
        path = tmp_path / "arm.toml"
        path.write_text(text, encoding="utf-8")
        robot = load_robot(path)
    faults = hold_faults(robot)
    if cause is None:
        assert faults == []
    else:
        assert faults[0].startswith("Joint 'shoulder' moves by")
        assert cause in faults[0]
