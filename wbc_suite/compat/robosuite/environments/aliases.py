"""robosuite's names of elements in a scene, and ours."""

from collections.abc import Iterable
from typing import Any

import mujoco

KINDS = ("body", "joint", "geom", "site", "camera", "actuator", "sensor")

JOINTS = {"Panda": "joint{}", "IIWA": "joint_{}", "Kinova3": "Actuator{}"}
"""robosuite's names of the joints of an arm, counted from 1, where ours are others; by
the begin of the robot's name."""

FINGERS = {
    "panda_finger_joint": "finger_joint",
    "gripper_l_finger_joint": "l_finger_joint",
    "gripper_r_finger_joint": "r_finger_joint",
    "drive_joint": "left_driver_joint",
    "right_outer_knuckle_joint": "right_driver_joint",
}
"""Begins of names of gripper joints, without the robot's and arm's, and robosuite's."""

PADS = {
    "panda_leftfinger": "finger1_pad_collision",
    "panda_rightfinger": "finger2_pad_collision",
    "gripper_l_finger_tip": "l_fingerpad_g0",
    "gripper_r_finger_tip": "r_fingerpad_g0",
    "left_pad": "left_fingerpad_collision",
    "right_pad": "right_fingerpad_collision",
    "left_inner_finger_pad": "left_fingerpad_collision",
    "right_inner_finger_pad": "right_fingerpad_collision",
}
"""Links of grippers without the robot's and arm's names, and robosuite's names of the
geoms that touch objects."""


class SceneNames:
    """Names of robosuite in a scene: of objects, tables, arms and grippers.

    Objects: bodies `{name}_main`, joints `{name}_joint0`, geoms `{name}_g0`, ...
    Robots: `robot0_joint1`, `robot0_link1`, `robot0_base`, `robot0_right_hand`,
    `robot0_eye_in_hand`, `robot0_torq_j1`; grippers: `gripper0_right_grip_site`,
    `gripper0_right_finger_joint1`, `gripper0_right_force_ee`.

    Attributes:
        ours: By kind and robosuite's name, ours.
        theirs: By kind and our name, the one of robosuite's that is shown.
    """

    def __init__(self, model: mujoco.MjModel, robots: Iterable[Any]) -> None:
        self.ours: dict[str, dict[str, str]] = {kind: {} for kind in KINDS}
        self.theirs: dict[str, dict[str, str]] = {kind: {} for kind in KINDS}
        for index in range(model.nbody):
            self._object(model, index)
        for robot in robots:
            self._robot(robot)
            for arm in robot.arms:
                self._gripper(robot, arm)

    def _show(self, kind: str, theirs: str, own: str) -> None:
        """Add a name, and show it unless the element has one that is shown."""
        self.ours[kind][theirs] = own
        self.theirs[kind].setdefault(own, theirs)

    def _object(self, model: mujoco.MjModel, index: int) -> None:
        body = model.body(index)
        if not body.name or body.name.startswith("robot"):
            return
        name, aliases = body.name, self.ours
        joints = [model.joint(int(body.jntadr[0]) + k) for k in range(body.jntnum[0])]
        geoms = [model.geom(int(body.geomadr[0]) + k) for k in range(body.geomnum[0])]
        free = [j for j in joints if j.type[0] == mujoco.mjtJoint.mjJNT_FREE]
        aliases["body"][f"{name}_main"] = name
        for k, joint in enumerate(joints):
            aliases["joint"][f"{name}_joint{k}"] = joint.name
        for k, geom in enumerate(geoms):
            aliases["geom"][f"{name}_g{k}"] = geom.name
            aliases["geom"][f"{name}_g{k}_vis"] = geom.name
            if free:
                self._show("geom", f"{name}_g{k}", geom.name)
        if free:
            self._show("body", f"{name}_main", name)
            self._show("joint", f"{name}_joint0", free[0].name)
        for role in ("collision", "visual") if geoms else ():
            aliases["geom"][f"{name}_{role}"] = geoms[0].name
        if geoms and name == "table":
            self._show("geom", "table_collision", geoms[0].name)

    def _robot(self, robot: Any) -> None:
        model, prefix = robot.robot_model, robot.robot_model.naming_prefix
        own, aliases = model.description, self.ours
        aliases["body"][f"{prefix}base"] = prefix + own.links[0].name
        pattern = next((JOINTS[k] for k in JOINTS if own.name.startswith(k)), None)
        numbers: dict[str, int] = {}
        several = len(own.hands) > 1
        for name in model.own_arm_joints:
            joint = name.removeprefix(prefix)
            arm = next((g for g, js in own.groups.items() if joint in js), "")
            side = f"{arm.removesuffix('_arm')}_" if several else ""
            k = numbers[side] = numbers.get(side, 0) + 1
            link = next(x.name for x in own.links if x.joint == own.joint(joint))
            aliases["joint"][f"{prefix}{side}joint{k}"] = name
            aliases["body"][f"{prefix}{side}link{k}"] = prefix + link
            aliases["actuator"][f"{prefix}{side}torq_j{k}"] = name
            if pattern is not None and not several:
                self._show("joint", prefix + pattern.format(k), name)
            if model.own_file is None:
                self._show("actuator", prefix + _motor(own.name, joint, side, k), name)
            if own.name.startswith("Panda"):
                self._show("body", f"{prefix}link{k}", prefix + link)
        for arm, frame in own.hands.items():
            self._show("body", f"{prefix}{arm}_hand", prefix + own.link_of(frame))
            camera = f"{prefix}{arm}_eye_in_hand"
            aliases["camera"][f"{prefix}eye_in_hand"] = camera
            if not several:
                self._show("camera", f"{prefix}eye_in_hand", camera)
        for frame in own.frames:
            aliases["site"][f"{prefix}{frame.name}"] = prefix + frame.name

    def _gripper(self, robot: Any, arm: str) -> None:
        gripper, aliases = robot.gripper[arm], self.ours
        start = f"gripper{robot.idn}_{arm}_"
        for name in gripper.important_sites.values():
            aliases["site"][name] = gripper.site
        self._show("site", f"{start}grip_site", gripper.site)
        for role, name in gripper.important_sensors.items():
            self._show("sensor", name, gripper.sensor(role))
        for k, joint in enumerate(gripper.own_joints, 1):
            aliases["joint"][f"{start}finger_joint{k}"] = joint
            aliases["actuator"][f"{start}gripper_finger_joint{k}"] = joint
            name = _without_arm(joint.removeprefix(gripper.prefix), arm)
            for begin, theirs in FINGERS.items():
                name = theirs + name[len(begin) :] if name.startswith(begin) else name
            self._show("joint", start + name, joint)
            if joint in gripper.own_actuators:
                motor = "gripper_" if name.endswith(("joint1", "r_joint")) else ""
                self._show("actuator", start + motor + name, joint)
        aliases["body"][f"{start}eef"] = robot.robot_model.own_eef_name[arm]
        self._gripper_geoms(gripper, start, arm)

    def _gripper_geoms(self, gripper: Any, start: str, arm: str) -> None:
        aliases = self.ours
        for name, geom in gripper.geom_names.items():
            self._show("geom", start + name, geom)
        for role, geoms in gripper.own_important_geoms.items():
            for k, geom in enumerate(geoms):
                side = role.replace("_finger", "finger").replace("fingerpad", "_pad")
                aliases["geom"][f"{start}{side}_collision"] = geom
                aliases["geom"][f"{start}{role}_g{k}"] = geom
                link = geom.removeprefix(gripper.prefix).rpartition("_collision")[0]
                theirs = PADS.get(_without_arm(link, arm))
                if role.endswith("pad") and theirs is not None:
                    self._show("geom", start + theirs, geom)
        for geom in gripper.own_contact_geoms:
            name = _without_arm(geom.removeprefix(gripper.prefix), arm)
            self._show("geom", start + name.removeprefix("panda_"), geom)


def _motor(robot: str, joint: str, side: str, k: int) -> str:
    """Return robosuite's name of the motor of the k-th joint of an arm."""
    if robot.startswith("Spot"):
        return joint
    if robot.startswith(("Sawyer", "Baxter")):
        return f"torq_{side or 'right_'}j{k - 1}"
    return f"torq_{side}j{k}"


def _without_arm(name: str, arm: str) -> str:
    """Return the name of a gripper's element without its arm's."""
    return name.removeprefix(f"{arm}_") if name.startswith(f"{arm}_gripper") else name
