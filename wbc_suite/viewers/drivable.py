"""The seam between a session and its page: what is shown, what may be asked for."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Protocol

import mujoco
import pinocchio as pin

from wbc_suite.control.action import ActionLayout
from wbc_suite.devices.limbs import LimbKind, LimbPort
from wbc_suite.recording.desk import Wish
from wbc_suite.viewers.snapshot import Snapshot

__all__ = ["Drivable", "LimbTraits", "SessionTraits"]


@dataclass(frozen=True, slots=True, kw_only=True)
class LimbTraits:
    """What stays as it is of a limb.

    Attributes:
        name: Name of its slice of the action.
        kind: Which part of a pose is commanded.
        body: Body that carries it; -1 for none.
    """

    name: str
    kind: LimbKind
    body: int

    @property
    def title(self) -> str:
        """The name as a person writes it: `right_hand` becomes `Right hand`."""
        if self.name == "com":
            return "Centre of mass"
        return self.name.replace("_", " ").capitalize()


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionTraits:
    """What stays as it is of a session.

    Attributes:
        model: What is simulated.
        limbs: What people can hold, by name.
        grippers: Names of each gripper's synergies, by the gripper's name.
        records: Whether wishes to record are heard.
    """

    model: mujoco.MjModel
    limbs: Mapping[str, LimbTraits]
    grippers: Mapping[str, tuple[str, ...]]
    records: bool

    @classmethod
    def of(
        cls,
        model: mujoco.MjModel,
        layout: ActionLayout,
        ports: Iterable[LimbPort],
        *,
        records: bool,
    ) -> "SessionTraits":
        """Say them of what actions of this layout, through these ports, move."""
        limbs = {
            port.name: LimbTraits(name=port.name, kind=port.kind, body=port.body)
            for port in ports
        }
        grippers = {
            part.name: tuple(part.labels)
            for part in layout.slices
            if part.kind == "gripper"
        }
        return cls(model=model, limbs=limbs, grippers=grippers, records=records)


class Drivable(Protocol):
    """A session as its page knows it; every method may be called from any thread.

    Clients are numbers, one for each open page.
    """

    @property
    def traits(self) -> SessionTraits:
        """What stays as it is."""
        ...

    @property
    def snapshot(self) -> Snapshot:
        """How things stand."""
        ...

    def grab(self, name: str, client: int, T_world_input: pin.SE3) -> bool:
        """Take a limb and latch the input to it; False when another holds it."""
        ...

    def drag(self, name: str, client: int, T_world_input: pin.SE3) -> bool | None:
        """Move a limb's target with the input.

        Returns:
            False when another holds it; None where that is not known at once.
        """
        ...

    def release(self, name: str, client: int) -> None:
        """Let a limb go."""
        ...

    def leave(self, client: int) -> None:
        """Release everything that a client held."""
        ...

    def enable(self, name: str, enabled: bool) -> None:
        """Put a limb's clutch in or out."""
        ...

    def set_gripper(self, name: str, index: int, value: float) -> None:
        """Set one synergy of a gripper, from -1 (open) to 1 (closed)."""
        ...

    def pause(self, paused: bool) -> None:
        """Let time stand still, or go on."""
        ...

    def reset(self) -> None:
        """Begin again from the start posture."""
        ...

    def wish(self, wish: Wish) -> None:
        """Ask something of the recording."""
        ...
