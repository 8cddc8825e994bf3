"""Arms whose actuators are position servos track as if these were torque motors."""

import numpy as np
import pytest

from wbc_suite.envs.hold_check import alone
from wbc_suite.robot import load_robot

KP = 40.0  # N m/rad; the upper joint carries 7 N m, and would sag by 0.18 rad
ARM = f"""<mujoco><compiler angle="radian"/>
<default><joint damping="10"/></default><worldbody>
<body name="base" pos="0 0 1"><geom size="0.02" mass="1"/>
<body name="upper"><joint name="shoulder" axis="0 1 0" range="-3 3"/>
<geom type="capsule" fromto="0 0 0 0.4 0 0" size="0.03" mass="2"/>
<body name="lower" pos="0.4 0 0"><joint name="elbow" axis="0 1 0" range="-3 3"/>
<geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.02" mass="0.6"/>
<site name="tcp" pos="0.3 0 0"/></body></body></body></worldbody><actuator>
<position joint="shoulder" kp="{KP}" forcerange="-60 60"/>
<position joint="elbow" kp="{KP}" forcerange="-60 60"/></actuator>
<keyframe><key name="home" qpos="0.1 0.3"/></keyframe></mujoco>"""


@pytest.mark.slow
def test_a_weak_servo_holds_a_posture_without_sag(tmp_path):
    path = tmp_path / "arm.xml"
    path.write_text(ARM)
    robot = load_robot(path)
    assert [a.kind for a in robot.actuators] == ["position", "position"]
    env = alone(robot, controller_configs="WHOLE_BODY_IK")
    env.reset(seed=0)
    data = env.simulation.data
    for _ in range(20):
        env.step(env.hold_action)
    assert np.abs(data.qfrc_actuator).max() > 5.0
    # At rest the torque is the weight; the goal moves while the first torque builds up.
    assert data.qfrc_actuator == pytest.approx(data.qfrc_bias, abs=1e-6)
    assert data.qpos == pytest.approx([0.1, 0.3], abs=5e-3)
    env.close()
