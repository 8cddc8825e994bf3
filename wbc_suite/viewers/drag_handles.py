"""Handles that users drag in the browser; every drag is received here.

Each client has its own set, one handle per limb. A handle shared by all clients would
send one client's drag back to the others, and could not have a mode for each.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from wbc_suite.devices.action_ports import LimbKind
from wbc_suite.viewers.scene_setup import place
from wbc_suite.viewers.session_state import LimbInfo, LimbStatus, Snapshot

if TYPE_CHECKING:
    import viser

    from wbc_suite.viewers.remote_session import Session


class HandleMode(StrEnum):
    """Which controls the handles have; arrows and arcs overlap near the middle."""

    MOVE = "Move"
    TURN = "Turn"
    BOTH = "Both"

    def next(self) -> "HandleMode":
        """Return the next mode on a key press: move and turn alternate."""
        return HandleMode.TURN if self is HandleMode.MOVE else HandleMode.MOVE


@dataclass(slots=True)
class _Handle:
    """One client's handle of one limb; `node` is in that client's scene.

    Attributes:
        apart: Whether the client moved it with the clutch disengaged; it then stays
            where it is.
    """

    node: "viser.TransformControlsHandle"
    dragging: bool = False
    apart: bool = False
    hidden: bool = False


@dataclass(slots=True)
class _Client:
    """One client's handles, by limb, and their mode."""

    handles: dict[str, _Handle]
    mode: HandleMode = HandleMode.MOVE


class DragHandles:
    """The handles of all clients, kept at the targets of their limbs.

    `scales` is the size of each limb's handle, m.
    """

    def __init__(self, session: "Session", scales: Mapping[str, float]) -> None:
        self._session, self._limbs = session, session.info.limbs
        self._scales = scales
        self._clients: dict[int, _Client] = {}
        self._last = session.snapshot

    def add_client(self, client: "viser.ClientHandle") -> None:
        """Create the handles of a new client."""
        status = self._session.snapshot.limbs
        handles = {n: self._add(client, k, status[n]) for n, k in self._limbs.items()}
        self._clients[client.client_id] = _Client(handles)

    def remove_client(self, client: int) -> None:
        """Forget a client, and release what it held."""
        self._clients.pop(client, None)
        self._session.leave(client)

    def handle(self, client: int, name: str) -> "viser.TransformControlsHandle":
        """Return one client's handle of one limb."""
        return self._clients[client].handles[name].node

    def mode(self, client: int) -> HandleMode:
        """Return the mode of one client's handles."""
        return self._clients[client].mode

    def set_mode(self, client: int, mode: HandleMode) -> None:
        """Show arrows, arcs or both to one client."""
        self._clients[client].mode = mode
        for name, handle in self._clients[client].handles.items():
            moves, turns = _controls(self._limbs[name].kind, mode)
            handle.node.disable_axes = handle.node.disable_sliders = not moves
            handle.node.disable_rotations = not turns

    def show(self, client: int, name: str, shown: bool) -> None:
        """Show or hide one limb's handle to one client."""
        self._clients[client].handles[name].hidden = not shown

    def recall(self, client: int) -> None:
        """Move a client's handles back to their targets."""
        for handle in self._clients[client].handles.values():
            handle.apart = False

    def update(self, snapshot: Snapshot) -> None:
        """Move every handle that is not dragged to its target."""
        was_reset, self._last = snapshot.epoch != self._last.epoch, snapshot
        for number, client in self._clients.copy().items():  # others may come or leave
            for name, handle in client.handles.items():
                status = snapshot.limbs[name]
                if was_reset:
                    handle.apart = False
                taken = status.holder not in (None, number)
                handle.node.visible = not (taken or handle.hidden)
                handle.node.opacity = 1.0 if status.enabled else 0.4
                if not handle.dragging and not handle.apart:
                    place(handle.node, status.target)

    def _add(
        self, client: "viser.ClientHandle", limb: LimbInfo, status: LimbStatus
    ) -> _Handle:
        moves, turns = _controls(limb.kind, HandleMode.MOVE)
        node = client.scene.add_transform_controls(
            f"/gizmos/{limb.name}",
            scale=self._scales[limb.name],
            line_width=3.0,
            depth_test=False,
            disable_axes=not moves,
            disable_sliders=not moves,
            disable_rotations=not turns,
            active_axes=(True, True, limb.kind is not LimbKind.PLANAR),
        )
        place(node, status.target)
        handle = _Handle(node)

        @node.on_update
        async def _(event: "viser.TransformControlsEvent") -> None:
            self._receive(client, limb, handle, event)

        return handle

    def _receive(
        self,
        client: "viser.ClientHandle",
        limb: LimbInfo,
        handle: _Handle,
        event: "viser.TransformControlsEvent",
    ) -> None:
        """Pass a client's drag on to the session."""
        name, number = limb.name, client.client_id
        T_input = _pose(event.target)
        if event.phase == "start":
            handle.dragging = self._session.grab(name, number, T_input)
            if not handle.dragging:
                client.add_notification(
                    f"{limb.title} is in use",
                    "Another viewer holds it until they release it.",
                    auto_close_seconds=4.0,
                )
        elif event.phase == "update" and handle.dragging:
            self._session.drag(name, number, T_input)
            handle.apart |= not self._last.limbs[name].enabled
        elif event.phase == "end":
            self._session.release(name, number)
            handle.dragging = False


def _controls(kind: LimbKind, mode: HandleMode) -> tuple[bool, bool]:
    """Return whether a handle has arrows, and whether it has arcs."""
    if kind in (LimbKind.POSITION, LimbKind.ORIENTATION):
        return kind is LimbKind.POSITION, kind is LimbKind.ORIENTATION
    return mode is not HandleMode.TURN, mode is not HandleMode.MOVE


def _pose(node: "viser.TransformControlsHandle") -> pin.SE3:
    w, x, y, z = node.wxyz  # as the browser sent it, of any length
    return pin.SE3(pin.Quaternion(w, x, y, z).normalized(), np.array(node.position))
