"""Grippers; the catalogue's are known under robosuite's class names."""

from typing import Any

import numpy as np

from wbc_suite.catalogue import Catalogue
from wbc_suite.compat.robosuite.models.base import DescribedModel, shown_names
from wbc_suite.compat.robosuite.models.grippers.fingers import (
    finger_sides,
    moved_links,
    pads,
)
from wbc_suite.compat.robosuite.models.own_files import changed, collision_names
from wbc_suite.compat.robosuite.utils.mjcf_utils import array_to_string
from wbc_suite.robot import RobotDescription, load_robot
from wbc_suite.sensing.hands import gripper_links
from wbc_suite.typing import Vector

__all__ = [
    "ALL_GRIPPERS",
    "GRIPPER_MAPPING",
    "GripperModel",
    "NullGripper",
    "gripper_factory",
    "register_gripper",
]

SPEEDS = {"JacoThreeFingerGripper": 0.01, "JacoThreeFingerDexterousGripper": 0.01}
"""Change of the grasp at a full action in a control period; 0.2 for all others."""

STILL = 1e-9
"""Least width of an actuator's range, rad or m, for joints that a grasp holds still."""

SITE_ROLES = ("grip_site", "grip_cylinder", "ee", "ee_x", "ee_y", "ee_z")


class GripperModel(DescribedModel):
    """A gripper, alone or at the end of a robot's arm.

    Names in the scene are those of the robot's description. A class of a user gives
    the path of its MJCF file, and is mounted by `gripper_types=` under its name; its
    actuators are position servos, and `format_action` says where they go.

    Attributes:
        dof: Number of its action values.
    """

    gripper = ""

    def __init__(
        self,
        fname: str | None = None,
        idn: Any = 0,
        *,
        robot: RobotDescription | None = None,
        prefix: str = "",
        arm: str = "right",
    ) -> None:
        self.idn, self.own_file, self.prefix = idn, fname, prefix
        if robot is None:
            robot_alone = load_robot(fname or f"gripper/{self.gripper}")
            self.description = _with_own_motors(robot_alone)
            self.prefix = self.naming_prefix
        else:
            self.description = robot
        own = self.description.synergies
        alone = () if robot is not None else tuple(own.values())
        self._synergies = own.get(f"{arm}_gripper", sum(alone, ()))
        self.current_action = np.zeros(self.dof)
        self._arm = arm
        if robot is None:
            self._frame = next(iter(self.description.hands.values()), "")
            self._links = [link.name for link in self.description.links]
        else:
            self._frame = robot.hands[arm]
            self._links = gripper_links(robot, arm, self._frame)

    name: Any = property(lambda self: type(self).__name__, doc="Name of its class.")
    naming_prefix: Any = property(
        lambda self: f"gripper{self.idn}_",
        doc="Text before the names of robosuite's elements, which are understood too.",
    )
    dof: Any = property(
        lambda self: len(self._synergies), doc="Number of its action values."
    )
    joints = shown_names("joint", "own_joints", "Names of its joints in the scene.")
    actuators = shown_names(
        "actuator", "own_actuators", "Names of its actuators in the scene."
    )
    contact_geoms = shown_names(
        "geom", "own_contact_geoms", "Names of its geoms that collide."
    )

    @property
    def speed(self) -> float:
        """Change of the grasp at a full action in a control period."""
        return SPEEDS.get(self.name, 0.2)

    def format_action(self, action: Any) -> Vector:
        """Return the position of each actuator in its range, -1 to 1.

        The grasp moves by `speed` towards the sign of each action value.
        """
        step = self.speed * np.sign(np.asarray(action, np.float64))
        self.current_action = np.clip(self.current_action + step, -1.0, 1.0)
        grasp: dict[str, float] = {}
        for synergy, value in zip(self._synergies, self.current_action, strict=True):
            for joint, opened in synergy.open.items():
                closes = synergy.closed[joint] > opened
                grasp[joint] = value if closes else -value
        return np.array([grasp.get(name, 0.0) for name in self._driven()])

    def _driven(self) -> tuple[str, ...]:
        groups = self.description.groups
        return groups.get(f"{self._arm}_gripper", groups.get("gripper", ()))

    def _write(self) -> None:
        super()._write()
        if self.own_file is not None:
            return
        ends = {
            self.prefix + joint: sorted((opened, synergy.closed[joint] + STILL))
            for synergy in self._synergies
            for joint, opened in synergy.open.items()
        }
        for actuator in self.actuator:
            if actuator.get("joint") in ends:
                text = array_to_string(ends[actuator.get("joint", "")])
                actuator.attrib |= {"ctrlrange": text, "ctrllimited": "true"}

    @property
    def own_joints(self) -> list[str]:
        """Names of its joints in our model."""
        links = map(self.description.link, self._moved())
        return [self.prefix + link.joint.name for link in links if link.joint]

    def _moved(self) -> list[str]:
        groups = self.description.groups.items()
        alone = self.prefix == self.naming_prefix
        arms = {j for g, js in groups if g.endswith("arm") and not alone for j in js}
        return moved_links(self.description, self._links, arms)

    @property
    def own_actuators(self) -> list[str]:
        """Names of its actuators in our model, which are called like joints."""
        return [self.prefix + name for name in self._driven()]

    @property
    def sites(self) -> list[str]:
        """Names of its sites."""
        return [self.prefix + self._frame] if self._frame else []

    @property
    def own_contact_geoms(self) -> list[str]:
        """Names of its geoms that collide in our model."""
        return [name for link in self._links for name in self._geoms(link)]

    def _geoms(self, name: str) -> list[str]:
        count = len(self.description.link(name).collision)
        return [f"{self.prefix}{name}_collision{k}" for k in range(count)]

    @property
    def _important_geoms(self) -> dict[str, list[str]]:
        """Names of geoms in a user's file, by role; by default none."""
        return {}

    @property
    def important_geoms(self) -> dict[str, list[str]]:
        """Geoms of the fingers, and of what touches objects, by side."""
        found = self.own_important_geoms.items()
        return {role: self.shown("geom", names) for role, names in found}

    @property
    def own_important_geoms(self) -> dict[str, list[str]]:
        """Names of `important_geoms` in our model."""
        if self._important_geoms:
            own = self.geom_names
            return {
                role: [own[name] for name in names if name in own]
                for role, names in self._important_geoms.items()
            }
        fingers = self._moved()
        solid = [name for name in self._links if self._geoms(name)]
        sides = finger_sides(fingers, solid if fingers else (), self._arm)
        found = {k: [g for f in v for g in self._geoms(f)] for k, v in sides.items()}
        touching = {
            f"{side}pad": [g for f in pads(links) for g in self._geoms(f)[-1:]]
            for side, links in sides.items()
        }
        return found | touching

    @property
    def geom_names(self) -> dict[str, str]:
        """Names in the scene of the geoms of a user's file."""
        if self.own_file is None:
            return {}
        names = collision_names(self.own_file)
        return {name: self.prefix + own for name, own in names.items()}

    @property
    def important_sites(self) -> dict[str, str]:
        """Robosuite's names of the site between its fingers, by role."""
        return {role: self.naming_prefix + role for role in SITE_ROLES}

    @property
    def site(self) -> str:
        """Name of the site between its fingers in the scene."""
        return self.prefix + self._frame

    @property
    def important_sensors(self) -> dict[str, str]:
        """Robosuite's names of force and torque at the wrist, by role."""
        return {role: self.naming_prefix + role for role in ("force_ee", "torque_ee")}

    def sensor(self, role: str) -> str:
        """Return the name of a sensor in the scene."""
        return f"{self.prefix}{self._arm}_wrist_{role.removesuffix('_ee')}"

    @property
    def init_qpos(self) -> Vector:
        """Positions of its joints at the start."""
        robot = self.description
        ready = robot.keyframe("ready") if robot.keyframes.get("ready") else {}
        names = [name.removeprefix(self.prefix) for name in self.own_joints]
        return np.array([ready.get(name, 0.0) for name in names])


def _with_own_motors(robot: RobotDescription) -> RobotDescription:
    """Return a gripper whose sliding fingers have one motor each, as robosuite's."""
    kinds = {actuator.joint: actuator for actuator in robot.actuators}
    links, groups = list(robot.links), {k: list(v) for k, v in robot.groups.items()}
    synergies = {k: list(v) for k, v in robot.synergies.items()}
    for k, link in enumerate(links):
        joint = link.joint
        mimic = None if joint is None else joint.mimic
        if joint is None or mimic is None or joint.type != "slide":
            continue
        leader = kinds.get(mimic.joint)
        group = next((g for g, js in groups.items() if mimic.joint in js), None)
        if leader is None or group is None:
            continue
        free = joint.model_copy(update={"mimic": None})
        links[k] = link.model_copy(update={"joint": free})
        kinds[joint.name] = leader.model_copy(update={"joint": joint.name})
        groups[group].append(joint.name)
        synergies[group] = [_with_follower(s, joint) for s in synergies[group]]
    fields = {"links": links, "actuators": tuple(kinds.values()), "groups": groups}
    return changed(robot, **fields, synergies=synergies)


def _with_follower(synergy: Any, joint: Any) -> Any:
    """Return a synergy that moves a follower as its leader did."""
    own, mimic = {}, joint.mimic
    for end in ("open", "closed"):
        values = getattr(synergy, end)
        if mimic.joint not in values:
            return synergy
        value = mimic.ratio * values[mimic.joint] + mimic.offset
        own[end] = values | {joint.name: value}
    return synergy.model_copy(update=own)


def _make(name: str) -> type[GripperModel]:
    def __init__(self: Any, idn: Any = 0, **kwargs: Any) -> None:
        GripperModel.__init__(self, None, idn, **kwargs)

    body = {"gripper": name, "__init__": __init__, "__module__": __name__}
    return type(name, (GripperModel,), body)


class NullGripper(GripperModel):
    """No gripper."""

    dof: Any = 0

    def __init__(self, idn: Any = 0, **kwargs: Any) -> None:
        kwargs.setdefault("robot", load_robot("Panda", gripper="none"))
        super().__init__(None, idn, **kwargs)


GRIPPER_MAPPING: dict[str | None, type[GripperModel]] = {
    name: _make(name) for name in Catalogue().called("robots/gripper")
}
globals().update({str(name): found for name, found in GRIPPER_MAPPING.items()})
GRIPPER_MAPPING[None] = NullGripper
ALL_GRIPPERS = GRIPPER_MAPPING.keys()


def register_gripper(target_class: type[GripperModel]) -> type[GripperModel]:
    """Make a class known by its name."""
    GRIPPER_MAPPING[target_class.__name__] = target_class
    return target_class


def gripper_factory(name: str | None, idn: Any = 0) -> GripperModel:
    """Make a gripper by the name of its class; None is NullGripper."""
    return GRIPPER_MAPPING[name](idn=idn)


def __getattr__(name: str) -> Any:
    if name == "GripperTester":  # imports grippers
        from wbc_suite.compat.robosuite.models.grippers.tester import GripperTester

        return GripperTester
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
