"""Grippers and arms of users' MJCF files, as files of our catalogue's format.

They are written into a temporary folder, from which robots are assembled.
"""

import atexit
import shutil
import tempfile
from collections.abc import Iterable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from wbc_suite.catalogue import Catalogue
from wbc_suite.errors import ConfigError
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.elements import Camera, Frame, Mount, Sensor, Synergy
from wbc_suite.robot.mjcf_compile import compile_mjcf
from wbc_suite.robot.toml_export import write_toml
from wbc_suite.scene.compose import ROBOT_VIEW
from wbc_suite.typing import Vector

GRASP_SITES = ("grip_site", "ee", "ee_site")
"""Names of the site between the fingers, the first that there is."""
SETTLED = 100
"""Calls of `format_action` after which a gripper's command stays."""


def changed(robot: RobotDescription, **fields: Any) -> RobotDescription:
    """Return a description with other values of some fields."""
    data = {key: getattr(robot, key) for key in type(robot).model_fields}
    return type(robot).model_validate(data | fields)


def gripper_file(gripper: Any) -> str:
    """Write the component of a gripper of a user; return its path.

    Each of its `dof` action values opens at -1 and closes at 1: joints move to where
    `format_action` leads their position actuators.

    Raises:
        ConfigError: If no joint has a position actuator.
    """
    robot, name = gripper.description, type(gripper).__name__
    model, _ = compile_mjcf(Path(gripper.own_file))
    ranges = {
        model.joint(model.actuator_trnid[a, 0]).name: model.actuator_ctrlrange[a]
        for a in range(model.nu)
        if model.actuator_biastype[a] != mujoco.mjtBias.mjBIAS_NONE
    }
    if not ranges:
        raise ConfigError(f"{gripper.own_file}: a gripper needs position actuators.")
    joints = tuple(ranges)
    first = robot.links[0].name
    named = {frame.name: frame for frame in robot.frames}
    site = next((named[n] for n in GRASP_SITES if n in named), None)
    pose = {} if site is None else {"link": site.link, "pos": site.pos}
    pose |= {} if site is None else {"quat": site.quat}
    tcp = Frame.model_validate({"name": "tcp", "role": "tcp", "link": first} | pose)
    at = zip(gripper.joints, gripper.init_qpos, strict=True)
    ready = {n.removeprefix(gripper.prefix): float(q) for n, q in at}
    eye = Camera.model_validate(
        {"name": "eye_in_hand", "link": first, "pos": (0.05, 0, 0), "fovy": 75}
        | {"quat": (0, 0.5**0.5, 0.5**0.5, 0)}
    )
    own = changed(
        robot,
        name=name,
        frames=(tcp,),
        cameras=(eye,),
        sensors=(),  # those of the wrist are the arm's
        groups={"gripper": joints},
        synergies={"gripper": _synergies(gripper, ranges)},
        keyframes={"ready": ready},
    )
    return _written(name, write_toml(own), "gripper")


@lru_cache
def collision_names(path: str) -> dict[str, str]:
    """Return the names that colliding geoms of a file get in our scenes."""
    (model, _), counts, found = compile_mjcf(Path(path)), {}, {}
    for index in range(model.ngeom):
        if not model.geom_contype[index] and not model.geom_conaffinity[index]:
            continue
        body = model.body(model.geom_bodyid[index]).name
        counts[body] = counts.get(body, -1) + 1
        if model.geom(index).name:
            found[model.geom(index).name] = f"{body}_collision{counts[body]}"
    return found


def _synergies(gripper: Any, ranges: Mapping[str, Vector]) -> tuple[Synergy, ...]:
    """Return one for each action value, of the joints that it moves."""

    def reached(action: Vector) -> Vector:
        low, high = np.array(list(ranges.values())).T
        gripper.current_action = share = np.zeros(len(ranges))
        for _ in range(SETTLED):
            share = np.asarray(gripper.format_action(action), np.float64)
        return low + (high - low) * (np.clip(share, -1, 1) + 1.0) / 2.0

    opened = reached(np.full(gripper.dof, -1.0))
    found: list[Synergy] = []
    for k in range(gripper.dof):
        action = np.full(gripper.dof, -1.0)
        action[k] = 1.0
        closed = reached(action)
        moved = [
            (joint, float(a), float(b))
            for joint, a, b in zip(ranges, opened, closed, strict=True)
            if a != b
        ]
        fields = {"name": "grasp" if gripper.dof == 1 else f"action{k}"}
        fields |= {"open": {j: a for j, a, _ in moved}}
        found.append(
            Synergy.model_validate(fields | {"closed": {j: b for j, _, b in moved}})
        )
    return tuple(found)


def arm_file(model: Any, robot: RobotDescription) -> str:
    """Write the assembly of a robot of a user: base, robot and grippers; return it."""
    name = type(model).__name__
    ends = {arm: str(body) for arm, body in model._eef_name.items()}
    ends = {arm: body for arm, body in ends.items() if arm in _listed(model.arms)}
    frames, sensors = [f for f in robot.frames if f.role != "eef"], list(robot.sensors)
    for arm, body in ends.items():
        robot.link(body)  # raises if there is none
        for role in ("eef", "wrist"):
            frames.append(Frame(name=f"{arm}_{role}", link=body, role=role))
        for kind in ("force", "torque"):
            at = {"name": f"{arm}_wrist_{kind}", "frame": f"{arm}_wrist"}
            sensors.append(Sensor.model_validate(at | {"kind": kind}))
    moved = [j.name for j in robot.joints if j.mimic is None]
    ready = robot.keyframes["ready"]
    if type(model).init_qpos is not _base_of(model).init_qpos:
        given = [float(q) for q in model.init_qpos]
        ready = ready | dict(zip(moved, given, strict=True))
    own = changed(
        robot,
        frames=tuple(frames),
        sensors=tuple(sensors),
        cameras=tuple(c for c in robot.cameras if c.name != ROBOT_VIEW),
        keyframes={"ready": ready},
        mounts=tuple(Mount(name=arm, link=body) for arm, body in ends.items()),
    )
    parts = [{"name": "base", "component": _base(model), "choice": "base"}]
    body = _written(f"{name}_body", write_toml(own), "body")
    parts.append({"name": "body", "component": body, "on": "base.arm"})
    for arm in ends:
        part = {"name": f"{arm}_gripper", "component": "gripper/PandaGripper"}
        part |= {"on": f"body.{arm}", "side": arm, "choice": "gripper"}
        parts.append(part)
    tables = [f'format = 1\n\n[assembly]\nname = "{name}"\n']
    for part in parts:
        rows = [f'{key} = "{value}"' for key, value in part.items()]
        tables.append("[[part]]\n" + "\n".join(rows) + "\n")
    return _written(name, "\n".join(tables))


def _base_of(model: Any) -> Any:
    """Return the class of ours that a user's class derives from."""
    return next(c for c in type(model).__mro__ if c.__module__.startswith("wbc_suite."))


def _base(model: Any) -> str:
    name = str(model.default_base)
    known = Catalogue().holds("robots/base", name)
    return f"base/{name}" if known else "base/NullMount"


def _listed(given: Iterable[str]) -> list[str]:
    return list(given)


@lru_cache(maxsize=1)
def _folder() -> Path:
    folder = Path(tempfile.mkdtemp(prefix="wbc_suite_"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def _written(name: str, text: str, kind: str | None = None) -> str:
    """Write a file; return its path."""
    if kind is not None:
        text = text.replace('kind = "body"', f'kind = "{kind}"', 1)
    path = _folder() / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return str(path)
