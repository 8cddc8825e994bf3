"""Grippers; the catalogue's are known under robosuite's class names."""

from typing import Any

import numpy as np

from wbc_suite.catalogue import Catalogue
from wbc_suite.compat.robosuite.models.base import MujocoModel
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

SITE_ROLES = ("grip_site", "grip_cylinder", "ee", "ee_x", "ee_y", "ee_z")


class GripperModel(MujocoModel):
    """A gripper, alone or at the end of a robot's arm.

    Names in the scene are those of the robot's description. A class of a user gives
    the path of its MJCF file, and is mounted by `gripper_types=` under its name.

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
        self.idn, self.file, self.prefix = idn, fname, prefix
        name = fname or f"gripper/{self.gripper}"
        self.description = load_robot(name) if robot is None else robot
        self.current_action = np.zeros(self.dof)
        frame = next(iter(self.description.hands.values()), "")
        if robot is not None:
            frame = robot.hands[arm]
        self._frame, self._arm = frame, arm
        own = self.description
        every = [] if robot is not None else [link.name for link in own.links]
        self._links = gripper_links(own, arm, frame) if frame else every

    @property
    def name(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride] - its class's
        """Name of its class."""
        return type(self).__name__

    @property
    def naming_prefix(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride] - its arm's
        """Text before the names of robosuite's elements, which are understood too."""
        return f"gripper{self.idn}_"

    @property
    def speed(self) -> float:
        """Change of the grasp at a full action in a control period."""
        return SPEEDS.get(self.name, 0.2)

    @property
    def dof(self) -> int:
        """Number of its action values."""
        synergies = self.description.synergies
        return sum(len(s) for s in synergies.values()) if synergies else 0

    def format_action(self, action: Any) -> Vector:
        """Return the action within -1 and 1."""
        return np.clip(np.asarray(action, np.float64), -1.0, 1.0)

    @property
    def joints(self) -> list[str]:
        """Names of its joints in the scene."""
        robot, links = self.description, set(self._links)
        return [
            self.prefix + link.joint.name
            for link in robot.links
            if link.joint is not None and link.name in links and self._moves(link)
        ]

    def _moves(self, link: Any) -> bool:
        """Whether a link is moved by the gripper, not by the arm."""
        robot = self.description
        arms = {j for g, js in robot.groups.items() if g.endswith("arm") for j in js}
        return link.joint.name not in arms

    @property
    def actuators(self) -> list[str]:
        """Names of its actuators, which are called like joints."""
        group = self.description.groups.get(f"{self._arm}_gripper", ())
        return [self.prefix + name for name in group]

    @property
    def sites(self) -> list[str]:
        """Names of its sites."""
        return [self.prefix + self._frame] if self._frame else []

    @property
    def contact_geoms(self) -> list[str]:
        """Names of its geoms that collide."""
        return [name for link in self._links for name in self._geoms(link)]

    def _geoms(self, name: str) -> list[str]:
        count = len(self.description.link(name).collision)
        return [f"{self.prefix}{name}_collision{k}" for k in range(count)]

    @property
    def important_geoms(self) -> dict[str, list[str]]:
        """Geoms of the fingers by side; by default the first half is left."""
        fingers = [
            link.name
            for link in self.description.links
            if link.name in self._links and link.joint and self._moves(link)
        ]
        if not fingers:
            return {k: [] for k in ("left_finger", "right_finger")}
        lefts = [f for f in fingers if "left" in f] or fingers[: len(fingers) // 2]
        rights = [f for f in fingers if f not in lefts]
        sides = {"left_finger": lefts, "right_finger": rights}
        found = {k: [g for f in v for g in self._geoms(f)] for k, v in sides.items()}
        pads = {f"{k}pad": geoms[-1:] for k, geoms in found.items()}
        return found | pads

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
        ready = self.description.keyframes.get("ready") and self.description.keyframe(
            "ready"
        )
        names = [name.removeprefix(self.prefix) for name in self.joints]
        return np.array([ready[n] if ready else 0.0 for n in names])


def _make(name: str) -> type[GripperModel]:
    def __init__(self: Any, idn: Any = 0, **kwargs: Any) -> None:
        GripperModel.__init__(self, None, idn, **kwargs)

    body = {"gripper": name, "__init__": __init__, "__module__": __name__}
    return type(name, (GripperModel,), body)


class NullGripper(GripperModel):
    """No gripper."""

    @property
    def dof(self) -> int:
        """0."""
        return 0

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
