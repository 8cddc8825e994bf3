"""Load a robot, and compare its MuJoCo model with its Pinocchio model."""

import mujoco
import numpy as np
import pinocchio as pin

import wbc_suite

robot = wbc_suite.load_robot("Panda")
print(f"{robot.title}: {robot.dof} degrees of freedom, {robot.mass:.1f} kg")
print("groups:", ", ".join(robot.groups))

# MuJoCo model: simulation
model = robot.to_mjspec().compile()
data = mujoco.MjData(model)
for joint, value in robot.keyframe("ready").items():
    data.joint(joint).qpos[:] = value
mujoco.mj_forward(model, data)

# Pinocchio model: kinematics and dynamics, with the same joints in the same order
pin_model = robot.to_pinocchio()
pin_data = pin_model.createData()
q = pin_model.referenceConfigurations["ready"]
pin.framesForwardKinematics(pin_model, pin_data, q)
hand = pin_data.oMf[pin_model.getFrameId("right_eef")].translation

difference = np.abs(data.site("right_eef").xpos - hand).max()
print(f"the hand is at {np.round(hand, 3)} m; the engines differ by {difference:.0e} m")
