"""Models of robots: those of the catalogue under robosuite's class names.

A class of a user derives from `ManipulatorModel` and gives the path of its MJCF file.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pinocchio as pin

from wbc_suite import logs
from wbc_suite.catalogue import Catalogue
from wbc_suite.compat.robosuite.models.base import (
    SECTIONS,
    DescribedModel,
    choices_of,
    shown_names,
)
from wbc_suite.compat.robosuite.models.own_files import arm_file, changed, gripper_file
from wbc_suite.compat.robosuite.models.robots.passive import with_passive_joints
from wbc_suite.compat.robosuite.utils.transform_utils import euler2mat
from wbc_suite.errors import UnknownNameError
from wbc_suite.robot import RobotDescription, load_robot
from wbc_suite.robot.poses import pose_fields
from wbc_suite.sensing.hands import gripper_links
from wbc_suite.typing import Vector

log = logs.logger(__name__)

REGISTERED_ROBOTS: dict[str, type["RobotModel"]] = {}
"""Classes of robot models by name."""

_NO_MODELS = ("RobotModel", "ManipulatorModel", "LeggedManipulatorModel")

BASE_X = {"default": -0.16, "GR1": -0.15, "Spot": -0.5}
"""Place of a robot before a table of no length, m, by the begin of its name."""


class RobotModel(DescribedModel):
    """A robot before it is in a scene.

    Attributes:
        robot: Catalogue name, or path of an MJCF or URDF file.
        idn: Number of the robot in its scene; `robot0_` starts its names.
        description: Our description of it, with its place.
        as_there: Whether arms have robosuite's passive values; `load` reads it.
    """

    robot: str = ""
    arms: Any = ()
    _base_name: str | None = None
    as_there = True

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if cls.__name__ not in _NO_MODELS:
            register_robot(cls)

    def __init__(self, fname: str | None = None, idn: int = 0) -> None:
        self.idn = idn
        name = fname or self.robot
        own = load_robot(name)
        if name.endswith((".xml", ".mjcf")):  # a user's
            self.own_file = name
            self.description = own
            self.robot = arm_file(self, own)
            self.description = load_robot(self.robot)
        else:
            self.description: RobotDescription = with_passive_joints(own)
        self.base: Any = None
        self.grippers: dict[str, Any] = {}

    def load(self, gripper: Any, base: str | None) -> None:
        """Load the robot again with other grippers, or another base."""
        root, own = self.description.root, self._source()
        if gripper == "default" and _is_overridden(self, "default_gripper"):
            gripper = self.default_gripper
        if base is None and self.own_file is None:
            own_base = _is_overridden(self, "default_base")
            base = self.default_base if own_base else None
        if own and (not self.as_there or gripper not in (None, "default") or base):
            chosen = self._choice(gripper)
            loaded = load_robot(own, gripper=chosen, base=base)
            if self.own_file is None and self.as_there:
                loaded = with_passive_joints(loaded)
            kind = root.kind if base is None else loaded.root.kind
            self.description = loaded.with_root(kind, pos=root.pos, quat=root.quat)

    def _choice(self, gripper: Any) -> Any:
        """Return our choice of grippers: files of users' classes, hands of the side."""
        if isinstance(gripper, Mapping):
            own = {arm: self._choice_of(g, arm) for arm, g in gripper.items()}
            return {arm: g for arm, g in own.items() if g is not None}
        if gripper in (None, "default", "none"):
            return None if gripper == "default" else gripper
        arms = self.description.hands
        return {arm: self._choice_of(gripper, arm) for arm in arms} or gripper

    def _choice_of(self, gripper: Any, arm: str) -> Any:
        from wbc_suite.compat.robosuite.models.grippers import GRIPPER_MAPPING

        if gripper in (None, "default"):
            return "none" if gripper is None else None
        cls = GRIPPER_MAPPING.get(gripper)
        if cls is not None and not cls.__module__.startswith("wbc_suite."):
            return gripper_file(cls())
        other = "Left" if arm == "right" else "Right"
        mirrored = gripper.replace(other, arm.capitalize())
        if mirrored != gripper and mirrored in GRIPPER_MAPPING:
            log.warning("'%s' is of the other side; its mirror image is used.", gripper)
            return mirrored
        return gripper

    name: Any = property(
        lambda self: f"{type(self).__name__}{self.idn}",
        doc="Name of its class and its number.",
    )
    naming_prefix: Any = property(
        lambda self: f"robot{self.idn}_", doc="Text before the names of its elements."
    )
    dof: Any = property(
        lambda self: len(self.own_joints),
        doc="Number of its driven joints, without grippers.",
    )
    joints = all_joints = shown_names(
        "joint", "own_joints", "Names of its joints in the scene, without grippers'."
    )
    arm_joints = shown_names(
        "joint", "own_arm_joints", "Names of the joints of its arms in the scene."
    )
    actuators = shown_names(
        "actuator", "own_joints", "Names of the actuators of its joints."
    )
    root_body: Any = property(
        lambda self: self.bodies[0], doc="Name of its first body."
    )
    contact_geoms = _contact_geoms = property(
        lambda self: self._geoms("collision"), doc="Names of its geoms that collide."
    )
    visual_geoms = property(
        lambda self: self._geoms("visual"), doc="Names of its geoms that are drawn."
    )

    @property
    def own_joints(self) -> list[str]:
        """Names of its joints in our model, without those of grippers."""
        prefix, robot = self.naming_prefix, self.description
        fingers = set(self._fingers())
        own = [j.name for j in robot.joints if j.mimic is None]
        return [prefix + name for name in own if name not in fingers]

    @property
    def own_arm_joints(self) -> list[str]:
        """Names of the joints of its arms in our model."""
        groups = self.description.groups
        names = [j for g, js in groups.items() if g.endswith("arm") for j in js]
        return [self.naming_prefix + name for name in names]

    @property
    def own_links(self) -> list[Any]:
        """Links of our model without those of grippers."""
        robot, known = self.description, self.description.synergies
        hands = [h for h in robot.hands.items() if f"{h[0]}_gripper" in known]
        held = {name for hand in hands for name in gripper_links(robot, *hand)}
        return [link for link in robot.links if link.name not in held]

    @property
    def bodies(self) -> list[str]:
        """Names of its bodies."""
        links = self.own_links
        return self.shown("body", [self.naming_prefix + link.name for link in links])

    @property
    def sites(self) -> list[str]:
        """Names of its sites."""
        return [self.naming_prefix + frame.name for frame in self.description.frames]

    def set_joint_attribute(self, attrib: str, values: Any, force: bool = True) -> None:
        """Write armature, damping or frictionloss of its joints, one value or each.

        Without `force` values other than 0 stay. Other attributes have no effect.
        """
        if attrib not in ("armature", "damping", "frictionloss"):
            return
        fingers, links = set(self._fingers()), self.description.links
        joined = [x for x in links if x.joint and x.joint.mimic is None]
        moved = [x for x in joined if x.joint and x.joint.name not in fingers]
        each = np.broadcast_to(values, len(moved))
        given = {x.name: float(v) for x, v in zip(moved, each, strict=True)}
        changes = {link.name: link for link in links}
        for link in moved:
            if link.joint and (force or not getattr(link.joint, attrib)):
                value = {attrib: given[link.name]}
                update = {"joint": link.joint.model_copy(update=value)}
                changes[link.name] = link.model_copy(update=update)
        self.description = changed(self.description, links=tuple(changes.values()))

    def _fingers(self) -> list[str]:
        groups = self.description.groups.items()
        return [j for g, js in groups if g.endswith("gripper") for j in js]

    def _geoms(self, kind: str) -> list[str]:
        own = ((link.name, len(getattr(link, kind))) for link in self.own_links)
        names = (f"{name}_{kind}{k}" for name, count in own for k in range(count))
        return self.shown("geom", (self.naming_prefix + name for name in names))

    @property
    def init_qpos(self) -> Vector:
        """Positions of its joints at the start, without grippers."""
        ready = self.description.keyframe("ready")
        prefix = len(self.naming_prefix)
        return np.array([ready[name[prefix:]] for name in self.own_joints])

    @property
    def base_xpos_offset(self) -> dict[str, Any]:
        """Place of the robot, m, before a table of a length, in bins, or alone."""
        starts = (k for k in BASE_X if self.name.startswith(k))
        x = BASE_X[next(starts, "default")]

        def table(length: float) -> tuple[float, float, float]:
            return x - length / 2, 0.0, 0.0

        return {"bins": (-0.5, -0.1, 0.0), "empty": (-0.6, 0.0, 0.0), "table": table}

    def set_base_xpos(self, pos: Any) -> None:
        """Place the robot: x, y, and the height of the floor that it stands on, m."""
        root, own = self.description.root, load_robot(self._source()).root
        x, y, z = (float(p) for p in pos)
        place = (x, y, own.pos[2] + z)
        self.description = self.description.with_root(root.kind, pos=place)

    def set_base_ori(self, rot: Any) -> None:
        """Turn the robot by roll, pitch, yaw, rad."""
        root = self.description.root
        turn = pose_fields(pin.SE3(euler2mat(rot), np.zeros(3)))
        self.description = self.description.with_root(root.kind, quat=turn["quat"])

    def _source(self) -> str:
        return self.robot or self.description.source or self.description.name

    @property
    def default_base(self) -> str:
        """Name of its base."""
        return choices_of(self.robot).get("base", "RethinkMount")

    @property
    def default_gripper(self) -> dict[str, str]:
        """Name of the gripper of each arm."""
        own, hands = choices_of(self.robot), self.description.hands
        return {arm: own.get(f"{arm}_gripper", "default") for arm in hands}

    @property
    def default_controller_config(self) -> dict[str, str]:
        """Name of the default config of each arm."""
        name = type(self).__name__.lower()
        return {arm: f"default_{name}" for arm in self.description.hands}


def _is_overridden(model: RobotModel, name: str) -> bool:
    """Whether a class of a user defines a property of ours anew."""
    return getattr(type(model), name) is not getattr(RobotModel, name)


class ManipulatorModel(RobotModel):
    """A robot with arms; for a user's, `init_qpos` of the MJCF's first key counts."""

    @property
    def arms(self) -> tuple[str, ...]:  # pyright: ignore[reportIncompatibleVariableOverride] - read from the description
        """Its arms: `right`, `left`."""
        return tuple(self.description.hands)

    @property
    def arm_type(self) -> str:
        """`bimanual` or `single`."""
        return "bimanual" if len(self.description.hands) > 1 else "single"

    @property
    def _eef_name(self) -> dict[str, str]:
        """Bodies that grippers are mounted on; in a user's file the default is this."""
        if self.own_file is not None:
            return {"right": "right_hand", "left": "left_hand"}
        robot = self.description
        return {arm: robot.link_of(frame) for arm, frame in robot.hands.items()}

    @property
    def eef_name(self) -> dict[str, str]:
        """Name of the body at the end of each arm in the scene."""
        own = self.own_eef_name
        return dict(zip(own, self.shown("body", own.values()), strict=True))

    @property
    def own_eef_name(self) -> dict[str, str]:
        """Name of the body at the end of each arm in our model."""
        ends, prefix = self._eef_name, self.naming_prefix
        return {arm: prefix + ends[arm] for arm in self.description.hands}

    def add_gripper(self, gripper: Any, arm_name: str | None = None) -> None:
        """Mount a gripper on an arm: `right`, or the body at its end; else the first.

        Raises:
            UnknownNameError: If there is no such arm.
        """
        arms = {body: arm for arm, body in self.eef_name.items()}
        arm = arms.get(arm_name or "", arm_name or next(iter(self.eef_name)))
        if arm not in self.eef_name:
            raise UnknownNameError("arm", arm_name, (*self.eef_name, *arms))
        self.grippers[arm] = gripper
        self._mount()

    def add_base(self, base: Any) -> None:
        """Put the robot on a base."""
        self._base_name = type(base).__name__
        self._mount()

    def _mount(self) -> None:
        chosen = {arm: type(item).__name__ for arm, item in self.grippers.items()}
        self.load(chosen or "default", self._base_name)
        for name in (*SECTIONS, "root", "tree", "folder"):
            self.__dict__.pop(name, None)  # they are written again when asked for


def register_robot(target_class: type[RobotModel]) -> type[RobotModel]:
    """Make a class known by its name."""
    REGISTERED_ROBOTS[target_class.__name__] = target_class
    return target_class


def create_robot(robot_name: str, *args: Any, **kwargs: Any) -> RobotModel:
    """Make a robot's model by the name of its class; raises UnknownNameError."""
    if robot_name not in REGISTERED_ROBOTS:
        raise UnknownNameError("robot", robot_name, REGISTERED_ROBOTS)
    return REGISTERED_ROBOTS[robot_name](*args, **kwargs)


def is_robosuite_robot(robot: str) -> bool:
    """Whether a robot is one of the catalogue's."""
    return robot in REGISTERED_ROBOTS


def _make(catalogue_name: str) -> type[RobotModel]:
    def __init__(self: Any, idn: int = 0) -> None:
        ManipulatorModel.__init__(self, catalogue_name, idn=idn)

    body = {"robot": catalogue_name, "__init__": __init__, "__module__": __name__}
    return type(catalogue_name, (ManipulatorModel,), body)


for _name in Catalogue().called("robots"):
    if _name not in globals():
        globals()[_name] = _make(_name)
