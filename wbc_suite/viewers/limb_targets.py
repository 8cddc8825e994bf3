"""Targets of the limbs that clients drag: who holds them, clutch, and release."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from wbc_suite.devices.action_ports import LimbKind
from wbc_suite.devices.pipeline.limb_pipeline import LimbPipeline
from wbc_suite.devices.state import LimbInput
from wbc_suite.viewers.session_state import LimbInfo, LimbStatus

HOLD_TIMEOUT = 20.0  # s; a client that sends nothing for so long loses its limb
MAX_POSITION_ERROR = 0.03  # m; a released target further than this from its limb ...
MAX_ORIENTATION_ERROR = 0.2  # rad; ... or turned by more, moves back to the limb ...
REST_SPEED = 0.02  # m/s; ... after the limb has been slower than this ...
REST_TIME = 0.4  # s; ... for so long
MAX_COORDINATE = 1e3  # m; inputs beyond it are invalid


@dataclass(slots=True)
class LimbTarget:
    """A limb of the pipeline that several clients may drag; a session locks the calls.

    The first client to grab it holds it until it releases it, or has sent nothing for
    `hold_timeout`, s.

    Attributes:
        enabled: Whether the clutch is engaged.
        rest: Number of ticks that the limb has rested since its release; None if it
            was not released lately.
        reported: Whether the controller reports on the limb, as of the last status.
    """

    stages: LimbPipeline
    hold_timeout: float = HOLD_TIMEOUT
    enabled: bool = True
    rest: int | None = None
    reported: bool = False
    _holder: int | None = None
    _heard: float = 0.0

    @property
    def info(self) -> LimbInfo:
        """Constant properties of the limb."""
        port = self.stages.port
        return LimbInfo(name=port.name, kind=port.kind, body=port.body)

    def status(self, report: Mapping[str, Any], *, now: float) -> LimbStatus:
        """Return the state at wall time `now`, s.

        `report` is the controller's report of the frame; empty before a solve, or where
        it reports none: then errors are those of the shown target.
        """
        self.reported = bool(report)
        measured = self.stages.port.measure()
        target = self.shown_target(measured)
        away = float(np.linalg.norm(target.translation - measured.translation))
        turn = float(np.linalg.norm(pin.log3(target.rotation @ measured.rotation.T)))
        return LimbStatus(
            measured=measured,
            target=target,
            position_error=float(report.get("position_error", away)),
            orientation_error=float(report.get("orientation_error", turn)),
            reached=bool(report.get("reached", True)),
            reasons=tuple(report.get("reasons", ())),
            holder=self.holder(now),
            enabled=self.enabled,
            acting=self.stages.acting,
            moved=self.stages.moved,
        )

    def shown_target(self, measured: pin.SE3) -> pin.SE3:
        """Return the requested pose; components that are not commanded as measured."""
        target = self.stages.clutch.target
        match self.stages.port.kind:
            case LimbKind.POSE:
                return target
            case LimbKind.POSITION:
                return pin.SE3(measured.rotation, target.translation)
            case LimbKind.ORIENTATION:
                return pin.SE3(target.rotation, measured.translation)
            case LimbKind.PLANAR:
                position = np.append(target.translation[:2], measured.translation[2])
                return pin.SE3(target.rotation, position)

    def drag(
        self, client: int, T_world_input: pin.SE3, *, now: float, grab: bool = False
    ) -> bool:
        """Move the target with the input of the client that holds it, at `now`, s.

        With `grab` the client takes the limb, and the input is latched first; the
        target does not move then. False if another client holds the limb, the client
        has lost it by its silence, or the pose is invalid.
        """
        holder, near = self.holder(now), np.abs(T_world_input.translation)
        if (
            not (near < MAX_COORDINATE).all()
            or not np.isfinite(T_world_input.rotation).all()
        ):
            return False
        if holder != client and not (grab and holder is None):
            return False
        self._holder, self._heard = client, now
        if self.enabled:
            if grab:
                self.stages.release()
            self.stages.follow(LimbInput(pose=T_world_input), by_hand=True)
        return True

    def holder(self, now: float) -> int | None:
        """Return the client that holds the limb; one that went silent releases it."""
        if self._holder is not None and now - self._heard > self.hold_timeout:
            self.release(self._holder)
        return self._holder

    def release(self, client: int) -> None:
        """Release the limb; its target stays, and the limb goes on towards it."""
        if self._holder == client:
            self._holder, self.rest = None, 0
            self.stages.release()

    def enable(self, enabled: bool) -> None:
        """Engage or disengage the clutch; the target does not move."""
        self.enabled = enabled
        self.stages.release()

    def settle(self, before: LimbStatus, *, period: float, now: float) -> None:
        """Move a released target back to the limb once the limb rests short of it.

        Otherwise a target that was dragged far out of reach would have to be dragged
        all the way back before the limb moves again. The target of a limb that was not
        released lately stays. `before` is the status one period, s, ago.
        """
        if self.rest is None:
            return
        measured = self.stages.port.measure()
        step = np.linalg.norm(measured.translation - before.measured.translation)
        self.rest = self.rest + 1 if step < REST_SPEED * period else 0
        is_near = (
            before.position_error < MAX_POSITION_ERROR
            and before.orientation_error < MAX_ORIENTATION_ERROR
        )
        reached = before.reached if self.reported else is_near
        if self.holder(now) is not None or reached:
            self.rest = None
        elif self.rest * period > REST_TIME:
            self.rest = None
            if not is_near:
                self.stages.place(measured)
