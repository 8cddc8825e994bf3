"""Checks of hands that several tests share."""

import mujoco
import numpy as np
import pinocchio as pin

LANDMARKS = (
    *("index_tip", "middle_tip", "ring_tip", "pinky_tip", "thumb_tip"),
    *("tcp", "pinch", "wrap"),
)


def at_ready(robot):
    """Return MuJoCo's model and state at `ready`."""
    model = robot.to_mjspec().compile()
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("ready").id)
    mujoco.mj_forward(model, data)
    return model, data


def assert_links_agree(robot, data):
    """Compare the places of all links in MuJoCo's state with Pinocchio's."""
    other = robot.to_pinocchio()
    other_data, q = other.createData(), np.zeros(other.nq)
    for joint in robot.joints:
        index = other.joints[other.getJointId(joint.name)].idx_q
        q[index] = data.joint(joint.name).qpos[0]
    pin.framesForwardKinematics(other, other_data, q)
    for link in robot.links:
        pose = other_data.oMf[other.getFrameId(link.name, pin.FrameType.BODY)]
        place = data.body(link.name).xpos
        np.testing.assert_allclose(place, pose.translation, atol=1e-9)


def landmarks(data):
    """Return the places of fingertips and grasps, shape (8, 3)."""
    return np.array([data.site(name).xpos for name in LANDMARKS])
