"""The handles that people drag: one set for every client, one handle per limb.

Each client has handles of its own. A handle that all clients shared would carry one
client's drag back to the others in the middle of theirs, and could not be shown in one
mode here and in another there.
"""

import threading
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from wbc_suite.devices.limbs import LimbKind
from wbc_suite.viewers.drivable import Drivable, LimbTraits
from wbc_suite.viewers.ghosts import place
from wbc_suite.viewers.snapshot import LimbStatus, Snapshot

if TYPE_CHECKING:
    import viser

__all__ = ["GizmoMode", "Gizmos"]


class GizmoMode(StrEnum):
    """What the handles offer; arrows and arcs overlap, so one at a time by default."""

    MOVE = "Move"
    TURN = "Turn"
    BOTH = "Both"

    def next(self) -> "GizmoMode":
        """Return the mode that a key press goes on to: move and turn alternate."""
        return GizmoMode.TURN if self is GizmoMode.MOVE else GizmoMode.MOVE


@dataclass(slots=True)
class _Gizmo:
    """One client's handle of one limb.

    Attributes:
        handle: The handle in that client's scene.
        dragging: Whether the client drags it now; then nobody else may place it.
        apart: Whether the client put it elsewhere while the clutch was out; it then
            stays where the client leaves it.
    """

    handle: "viser.TransformControlsHandle"
    dragging: bool = False
    apart: bool = False


class Gizmos:
    """All clients' handles, kept at their targets.

    Args:
        session: Session that the drags go to.
        scales: Size of each limb's handle, in m.
    """

    def __init__(self, session: Drivable, scales: Mapping[str, float]) -> None:
        self._session, self._limbs = session, session.traits.limbs
        self._scales = scales
        self._lock = threading.Lock()
        self._sets: dict[int, dict[str, _Gizmo]] = {}
        self._modes: dict[int, GizmoMode] = {}
        self._hidden: dict[int, set[str]] = {}
        self._seen = session.snapshot

    def add_client(self, client: "viser.ClientHandle") -> None:
        """Give a new client its handles."""
        limbs = self._session.snapshot.limbs
        gizmos = {
            name: self._add(client, limb, limbs[name])
            for name, limb in self._limbs.items()
        }
        with self._lock:
            self._sets[client.client_id] = gizmos
            self._modes[client.client_id] = GizmoMode.MOVE
            self._hidden[client.client_id] = set()

    def remove_client(self, client: int) -> None:
        """Forget a client, and release what it held."""
        with self._lock:
            self._sets.pop(client, None)
            self._modes.pop(client, None)
            self._hidden.pop(client, None)
        self._session.leave(client)

    def handle(self, client: int, name: str) -> "viser.TransformControlsHandle":
        """Return one client's handle of one limb."""
        with self._lock:
            return self._sets[client][name].handle

    def mode(self, client: int) -> GizmoMode:
        """Return what one client's handles offer."""
        with self._lock:
            return self._modes.get(client, GizmoMode.MOVE)

    def set_mode(self, client: int, mode: GizmoMode) -> None:
        """Offer arrows, arcs or both to one client."""
        with self._lock:
            self._modes[client] = mode
            gizmos = dict(self._sets.get(client, {}))
        for name, gizmo in gizmos.items():
            moves, turns = _offers(self._limbs[name].kind, mode)
            gizmo.handle.disable_axes = gizmo.handle.disable_sliders = not moves
            gizmo.handle.disable_rotations = not turns

    def show(self, client: int, name: str, *, shown: bool) -> None:
        """Show or hide one limb's handle to one client."""
        with self._lock:
            hidden = self._hidden.get(client, set())
            (hidden.discard if shown else hidden.add)(name)

    def recall(self, client: int) -> None:
        """Bring a client's handles back to their targets."""
        with self._lock:
            for gizmo in self._sets.get(client, {}).values():
                gizmo.apart = False

    def update(self, snapshot: Snapshot) -> None:
        """Put every handle that nobody drags at its target."""
        fresh, self._seen = snapshot.epoch != self._seen.epoch, snapshot
        with self._lock:
            sets = list(self._sets.items())
        for client, gizmos in sets:
            for name, gizmo in gizmos.items():
                self._update_one(client, name, gizmo, snapshot, fresh)

    def _update_one(
        self, client: int, name: str, gizmo: _Gizmo, snapshot: Snapshot, fresh: bool
    ) -> None:
        status = snapshot.limbs[name]
        if fresh:
            gizmo.apart = False
        taken = status.holder not in (None, client)
        hidden = name in self._hidden.get(client, ())
        gizmo.handle.visible = not (taken or hidden)
        gizmo.handle.opacity = 1.0 if status.enabled else 0.4
        if not gizmo.dragging and not gizmo.apart:
            place(gizmo.handle, status.target)

    def _add(
        self, client: "viser.ClientHandle", limb: LimbTraits, status: LimbStatus
    ) -> _Gizmo:
        moves, turns = _offers(limb.kind, GizmoMode.MOVE)
        handle = client.scene.add_transform_controls(
            f"/gizmos/{limb.name}",
            scale=self._scales[limb.name],
            line_width=3.0,
            depth_test=False,
            disable_axes=not moves,
            disable_sliders=not moves,
            disable_rotations=not turns,
            active_axes=(True, True, limb.kind is not LimbKind.PLANAR),
        )
        place(handle, status.target)
        gizmo = _Gizmo(handle)

        @handle.on_update
        async def _(event: "viser.TransformControlsEvent") -> None:
            self._on_event(client, limb, gizmo, event)

        return gizmo

    def _on_event(
        self,
        client: "viser.ClientHandle",
        limb: LimbTraits,
        gizmo: _Gizmo,
        event: "viser.TransformControlsEvent",
    ) -> None:
        name, number = limb.name, client.client_id
        T_input = _pose(event.target)
        if event.phase == "start":
            gizmo.dragging = self._session.grab(name, number, T_input)
            if not gizmo.dragging:
                client.add_notification(
                    f"{limb.title} is taken",
                    "Somebody else holds it. It is free again once they let go.",
                    auto_close_seconds=4.0,
                )
        elif event.phase == "update" and gizmo.dragging:
            self._session.drag(name, number, T_input)
            gizmo.apart |= not self._seen.limbs[name].enabled
        elif event.phase == "end":
            self._session.release(name, number)
            gizmo.dragging = False


def _offers(kind: LimbKind, mode: GizmoMode) -> tuple[bool, bool]:
    """Return whether a handle has arrows, and whether it has arcs."""
    if kind in (LimbKind.POSITION, LimbKind.ORIENTATION):
        return kind is LimbKind.POSITION, kind is LimbKind.ORIENTATION
    return mode is not GizmoMode.TURN, mode is not GizmoMode.MOVE


def _pose(handle: "viser.TransformControlsHandle") -> pin.SE3:
    return pin.XYZQUATToSE3(np.concatenate([handle.position, np.roll(handle.wxyz, -1)]))
