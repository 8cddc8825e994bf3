"""The page of `wbc-suite adopt`: guesses of an import, to be corrected and written."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast, get_args

import numpy as np

from wbc_suite.atomic_files import check_folder, write_bytes
from wbc_suite.config_files import parse_model
from wbc_suite.control.ik.config import default_whole_body_config
from wbc_suite.control.walking.config import (
    default_dynamics_config,
)
from wbc_suite.envs.hold_check import hold_faults
from wbc_suite.errors import WbcError
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.adopt.importing import with_soles
from wbc_suite.robot.adopt.missing_data import with_rotor
from wbc_suite.robot.adopt.soles import guess_sole
from wbc_suite.robot.elements import Frame, Root
from wbc_suite.robot.toml_export import toml_text
from wbc_suite.viewers.page_server import PageServer
from wbc_suite.viewers.robot_page import RobotPage
from wbc_suite.viewers.session_state import plain

if TYPE_CHECKING:
    import viser

ROLES: list[str] = [*get_args(Frame.model_fields["role"].annotation)]
ROOTS: list[str] = [*get_args(Root.model_fields["kind"].annotation)]
LIMBS = {"tcp": "gripper", "eef": "arm", "foot": "leg", "head": "head"}
EDGES = ("Heel", "Toes", "Right", "Left")
HANDLE = 0.12  # m, of a frame that can be dragged


class AdoptPage:
    """Serve a page that shows an imported robot, its guesses and its notes.

    Args:
        robot: The imported robot.
        site: Server of the page.
        notes: What the import said.
        folder: Where `write` puts `robots/` and `controllers/`.
        say: Is called with what was written and how the check ended.

    Attributes:
        frames: Frames as they are set on the page, by name.
        synergies: How grippers open and close, by group.
        handles: What drags the frames that have a role.
    """

    def __init__(
        self,
        robot: RobotDescription,
        site: PageServer,
        *,
        notes: Sequence[str],
        folder: Path,
        say: Callable[[str], None],
    ) -> None:
        self._folder, self._say = folder, say
        self.robot = robot
        self.page = RobotPage(self.robot, site)
        self.site, self._gui = site, site.server.gui
        self.frames = {frame.name: frame for frame in self.robot.frames}
        self.synergies = {name: own[0] for name, own in robot.synergies.items()}
        self.handles: dict[str, viser.TransformControlsHandle] = {}
        self._soles: dict[str, list[viser.GuiInputHandle[float]]] = {}
        with self._gui.add_folder("Notes", expand_by_default=False):
            pairs = len(robot.contacts.exclude)
            lines = [*notes, f"{pairs} pairs of links are not checked for collision."]
            self._gui.add_markdown("\n".join(f"- {line}" for line in lines))
        with self._gui.add_folder("Frames"):
            for name in [n for n, f in self.frames.items() if f.role != "other"]:
                self._add_frame(name)
        with self._gui.add_folder("Hands"):
            for group in self.synergies:
                self._add_gripper(group)
        feet = [name for name, frame in self.frames.items() if frame.role == "foot"]
        with self._gui.add_folder("Feet", visible=bool(feet)):
            for name in feet:
                self._add_sole(name)
        self._add_writing()

    def _add_frame(self, name: str) -> None:
        frame = self.frames[name]
        role = self._gui.add_dropdown(
            plain(name),
            ROLES,
            initial_value=str(frame.role),
            hint=f"Role of the frame on '{frame.link}'.",
        )
        self._gui.add_markdown(f"*{_reason(self.robot, frame)}*")
        handle = self.handles[name] = self.site.server.scene.add_transform_controls(
            f"{self.page.follow(frame.link)}/{name}",
            scale=HANDLE,
            depth_test=False,
            position=frame.pos,
            wxyz=frame.quat,
            visible=frame.role == "foot" or name in self.robot.hands.values(),
        )

        @role.on_update
        def _(_: object) -> None:
            self._update_frame(name, role=role.value)
            handle.visible = role.value in ("tcp", "eef", "foot")

        @handle.on_update
        def _(_: object) -> None:
            quat = np.asarray(handle.wxyz) / np.linalg.norm(handle.wxyz)
            pos = tuple(np.round(handle.position, 4).tolist())
            self._update_frame(name, pos=pos, quat=tuple(quat.tolist()))

    def _update_frame(self, name: str, **changes: Any) -> None:
        self.frames[name] = self.frames[name].model_copy(update=changes)

    def _add_gripper(self, group: str) -> None:
        self._gui.add_markdown(f"**{plain(group)}**: {self.synergies[group].reason}.")
        buttons = self._gui.add_button_group(plain(group), ("open", "closed", "swap"))

        @buttons.on_click
        def _(_: object) -> None:
            own = self.synergies[group]
            if buttons.value == "swap":
                update = {"open": own.closed, "closed": own.open}
                self.synergies[group] = own = own.model_copy(update=update)
            values = own.closed if buttons.value == "closed" else own.open
            self.page.set_joints(values)

    def _add_sole(self, name: str) -> None:
        sole = guess_sole(self.robot, name)
        edges = sole.edges if sole else (0.0, 0.0, 0.0, 0.0)
        self._gui.add_markdown(
            f"**{plain(name)}**: "
            + (
                "the lowest 5 mm of its shapes."
                if sole
                else "a point, without an area."
            )
        )
        if sole:
            hint = "Edge of the sole in the axes of the frame, m."
            self._soles[name] = [
                self._gui.add_number(label, edge, step=0.001, hint=hint)
                for label, edge in zip(EDGES, edges, strict=True)
            ]

    def _add_writing(self) -> None:
        feet = any(frame.role == "foot" for frame in self.frames.values())
        rotors = self.robot.root.kind == "free" or feet
        bare = not any(joint.armature for joint in self.robot.joints)
        with self._gui.add_folder("Write"):
            self._name = self._gui.add_text("Name", self.robot.name)
            self._root = self._gui.add_dropdown(
                "Root", ROOTS, initial_value=str(self.robot.root.kind)
            )
            self._rotors = self._gui.add_checkbox(
                "Estimate armature",
                rotors and bare,
                hint="2e-4 kg m^2 per N m of effort.",
            )
            button = self._gui.add_button("Write")
            self._answer = self._gui.add_markdown("")

        @button.on_click
        def _(_: object) -> None:
            button.disabled = True
            self._answer.content = "Writing and checking ..."
            try:
                text = self.write()
            except WbcError as error:
                text = f"Not written: {error}"
            self._answer.content = text.replace("\n", "  \n")
            self._say(text)
            button.disabled = False

    def adopted(self) -> RobotDescription:
        """Return the robot with all that is set on the page; at `ready` hands are open.

        Raises:
            WbcError: If it is not consistent.
        """
        own = [joint for joint in self.robot.joints if joint.mimic is None]
        ready = {joint.name: self.page.position(joint.name) for joint in own}
        for joint in own:
            if joint.range:
                ready[joint.name] = float(np.clip(ready[joint.name], *joint.range))
        for synergy in self.synergies.values():
            ready |= synergy.open
        links = self.robot.links
        if self._rotors.value:
            links = tuple(map(with_rotor, links))
        robot = _changed(
            self.robot,
            name=self._name.value,
            frames=tuple(self.frames.values()),
            links=links,
            keyframes=self.robot.keyframes | {"ready": ready},
            synergies={group: (own,) for group, own in self.synergies.items()},
        )
        root = cast(Literal["fixed", "planar", "free"], self._root.value)
        robot = robot.with_root(root)
        return with_soles(robot) if root == "free" else robot

    def write(self) -> str:
        """Write the description and the controllers; return what to do next.

        Raises:
            WbcError: If the robot is not consistent, or a file cannot be written.
        """
        robot = self.adopted()
        stem = robot.name.lower()
        files = {f"robots/{stem}.toml": robot.to_toml()}
        files[f"controllers/{stem}_whole_body_ik.toml"] = toml_text(
            default_whole_body_config(robot)
        )
        if gait := self._gait(robot):
            files[f"controllers/{stem}_whole_body_id.toml"] = toml_text(gait)
        for name, text in files.items():
            check_folder((self._folder / name).parent)
            write_bytes(self._folder / name, text.encode())
        faults = hold_faults(robot, controller=str(self._folder / [*files][1]))
        return "\n".join(
            [
                *(f"Wrote {self._folder / name}." for name in files),
                *(f"Check: {fault}" for fault in faults or ["it holds `ready`."]),
                f"Next: wbc-suite teleop --robots {robot.name} "
                f"--catalogue {self._folder}",
            ]
        )

    def _gait(self, robot: RobotDescription) -> dict[str, Any] | None:
        """Return the config of WHOLE_BODY_ID of a robot that can walk, or None."""
        feet = [frame.name for frame in robot.frames if frame.role == "foot"]
        if robot.root.kind != "free" or len(feet) not in (2, 4):
            return None
        if len(feet) == 4:
            return default_dynamics_config(robot)
        feet.sort(key=lambda name: "left" not in name.lower())
        if not all(name in self._soles for name in feet):
            return None
        soles = {name: guess_sole(robot, name) for name in feet}
        return {
            "format": 1,
            "frame": [
                {"name": x["name"], "frame": x["frame"]}
                for x in default_whole_body_config(robot)["frame"]
                if x["frame"] in robot.hands.values()
            ],
            "foot": [
                {
                    "frame": name,
                    "sole": [edge.value for edge in self._soles[name]],
                    "height": sole.height,
                }
                for name, sole in soles.items()
                if sole is not None
            ],
            "gait": {"type": "walk"},
            "upright": [{"frame": robot.links[0].name}],
        }


def _changed(robot: RobotDescription, **changes: Any) -> RobotDescription:
    """Return the robot with some fields changed, and checked."""
    data = {key: getattr(robot, key) for key in type(robot).model_fields}
    return parse_model(RobotDescription, data | changes, source=robot.name)


def _reason(robot: RobotDescription, frame: Frame) -> str:
    """Return why a frame has its role and its place."""
    if any(frame.name == group.replace("gripper", "tcp") for group in robot.synergies):
        return f"On '{frame.link}', between the fingers."
    kind = LIMBS.get(frame.role)
    groups = [g for g in robot.groups if kind and (kind in g or g == kind + "s")]
    if not groups:
        return f"On '{frame.link}', by its name."
    return f"On '{frame.link}', the end of {' or '.join(map(plain, groups))}."
