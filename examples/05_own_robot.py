"""Load a robot from a URDF and control its hand."""

import logging
import tempfile
from pathlib import Path

import wbc_suite

ARM = """
<robot name="planar_arm">
  <link name="base"/>
  {links}
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/><origin xyz="0 0 0.9"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" velocity="3" effort="80"/>
  </joint>
  <joint name="elbow" type="revolute">
    <parent link="upper"/><child link="fore"/><origin xyz="0 0 0.4"/>
    <axis xyz="0 1 0"/><limit lower="-2.5" upper="2.5" velocity="3" effort="80"/>
  </joint>
  <joint name="wrist" type="revolute">
    <parent link="fore"/><child link="hand"/><origin xyz="0 0 0.4"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" velocity="3" effort="20"/>
  </joint>
</robot>
"""
LINK = """
  <link name="{name}">
    <inertial><origin xyz="0 0 {middle}"/><mass value="{mass}"/>
      <inertia ixx="{i}" iyy="{i}" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><origin xyz="0 0 {middle}"/>
      <geometry><cylinder radius="0.04" length="{length}"/></geometry></visual>
  </link>"""


def link(name: str, length: float, mass: float) -> str:
    """Return the link of a rod, with inertia mass length^2 / 12 about its middle."""
    i = mass * length**2 / 12 + 0.001
    return LINK.format(name=name, middle=length / 2, length=length, mass=mass, i=i)


links = link("upper", 0.4, 3.0) + link("fore", 0.4, 2.0) + link("hand", 0.15, 0.5)
with tempfile.TemporaryDirectory() as folder:
    file = Path(folder) / "planar_arm.urdf"
    file.write_text(ARM.format(links=links))
    robot = wbc_suite.load_robot(file)

print(f"{robot.name}: {robot.dof} dof, groups: {', '.join(robot.groups)}")

logging.getLogger("wbc_suite.benchmark").setLevel("ERROR")  # no gripper for the cube
env = wbc_suite.make("Lift", robots=robot, controller_configs="WHOLE_BODY_IK")
env.reset(seed=0)
print(env.action_layout)


def move_for(seconds: float, goals: dict) -> dict:
    """Apply the goals for some time; return the report on the hand."""
    action = env.action_layout.pack(goals)
    info = {}
    for _ in range(round(20 * seconds)):
        *_, info = env.step(action)
    return info["ik"]["frames"]["right_hand"]


goals = env.action_layout.unpack(env.hold_action)
goals["right_hand"][:3] += [0.10, 0.0, -0.15]  # m, within the plane of motion
hand = move_for(3.0, goals)
print(f"the hand is {1e3 * hand['position_error']:.2f} mm from its goal")

goals["right_hand"][1] += 0.10  # out of the plane
hand = move_for(3.0, goals)
reasons = "; ".join(map(str, hand["reasons"]))
print(f"a step to the side: {1e3 * hand['position_error']:.0f} mm short; {reasons}")
