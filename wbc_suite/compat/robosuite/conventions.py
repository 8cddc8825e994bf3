"""Where robosuite has grip sites, fingers and cameras that ours has elsewhere."""

from typing import Any

import mujoco
import numpy as np

from wbc_suite.compat.robosuite.models.own_files import changed
from wbc_suite.errors import ConfigError
from wbc_suite.robot import RobotDescription

OURS, THEIRS = "wbc_suite", "robosuite"

GRIP_SITES = {
    "panda_hand": 0.097,
    "gripper_base": 0.109,
    "robotiq_85_flange": 0.145,
    "robotiq_140_base_link": 0.2075,
    "jaco_3f_flange": 0.1775,
    "xarm_gripper_base_link": 0.147,
}
"""Distance of robosuite's `grip_site` from the gripper's base along z, m, by our link
without the arm's name; measured in 1.5.2 with the default grippers."""
TURNED = (0.5**0.5, 0.0, 0.0, -(0.5**0.5))
"""Its orientation there, but for XArm7's, which is not turned: fingers move along x."""

FINGER_START = 0.020833
"""Position of a Panda's fingers at the start, m; ours start open."""

_TOWARDS = (0.653, 0.271, 0.271, 0.653)
_OVER_TWO = {"agentview": ((0.88943544, 0.0, 1.73838131), _TOWARDS)}
_BINS = {"agentview": ((1.0, 0.0, 1.75), _TOWARDS)}
_HUNG = 0.3971329, 0.27807528, 0.50166124, 0.71644646
CAMERAS = {
    "frontview": ((1.6, 0.0, 1.45), (0.56, 0.43, 0.43, 0.56)),
    "birdview": ((-0.2, 0.0, 3.0), (0.7071, 0.0, 0.0, 0.7071)),
    "sideview": ((-0.056518, 1.276122, 1.487957), (0.0099, 0.0069, 0.5912, 0.8064)),
    "agentview": ((0.5, 0.0, 1.35), _TOWARDS),
}
"""Position in the world, m, and orientation, w x y z, of robosuite's cameras."""
OF_TASK = {
    "PickPlace": _BINS,
    "PickPlaceSingle": _BINS,
    "PickPlaceMilk": _BINS,
    "PickPlaceBread": _BINS,
    "PickPlaceCereal": _BINS,
    "PickPlaceCan": _BINS,
    "Door": {
        "agentview": ((0.598613, 0.0, 1.59035), (0.638018, 0.30485, 0.30485, 0.638018))
    },
    "ToolHang": {
        "agentview": ((0.48372753, 0.25055791, 1.26393791), _HUNG),
        "sideview": ((0.48372753, 0.25055791, 1.21393791), _HUNG),
    },
    "TwoArmHandover": _OVER_TWO,
    "TwoArmTransport": _OVER_TWO,
    "TwoArmPegInHole": {"agentview": ((1.06664322, 0.0, 2.0563395), _TOWARDS)},
}
"""Those that a task places elsewhere."""


def check_conventions(name: str) -> str:
    """Return a name of conventions; raises ConfigError."""
    if name not in (OURS, THEIRS):
        raise ConfigError(f"`conventions` is '{OURS}' or '{THEIRS}', not {name!r}.")
    return name


def with_their_hands(robot: RobotDescription) -> RobotDescription:
    """Return a robot with robosuite's grip sites, and a Panda's fingers as there.

    There the right finger counts down from the closed hand.
    """
    sides = {frame: side for side, frame in robot.hands.items()}
    frames = []
    for frame in robot.frames:
        link = frame.link.removeprefix(f"{sides.get(frame.name)}_")
        if frame.name in sides and link in GRIP_SITES:
            quat = (1.0, 0.0, 0.0, 0.0) if link.startswith("xarm") else TURNED
            place = {"pos": (0.0, 0.0, GRIP_SITES[link]), "quat": quat}
            frame = frame.model_copy(update=place)  # noqa: PLW2901 - the changed one
        frames.append(frame)
    links = [
        _mirrored(k) if k.name.endswith("panda_rightfinger") else k for k in robot.links
    ]
    keyframes = {
        name: {
            joint: FINGER_START if joint.endswith("panda_finger_joint1") else value
            for joint, value in positions.items()
        }
        for name, positions in robot.keyframes.items()
    }
    return changed(robot, links=tuple(links), frames=tuple(frames), keyframes=keyframes)


def _mirrored(link: Any) -> Any:
    """Return a link with its joint turned round."""
    joint = link.joint
    low, high = joint.range
    update = {
        "axis": tuple(-x for x in joint.axis),
        "range": (-high, -low),
        "mimic": joint.mimic.model_copy(update={"ratio": -joint.mimic.ratio}),
    }
    return link.model_copy(update={"joint": joint.model_copy(update=update)})


def place_cameras(model: mujoco.MjModel, task: str) -> None:
    """Move the cameras of one of robosuite's tasks to where they are there."""
    for name, (pos, quat) in (CAMERAS | OF_TASK.get(task, {})).items():
        camera = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_CAMERA, name)
        if camera >= 0:
            model.cam_pos[camera] = pos
            model.cam_quat[camera] = np.array(quat) / np.linalg.norm(quat)
