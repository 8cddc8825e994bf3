"""Feet, capture point, next footstep and contact forces in a client's scene."""

from typing import TYPE_CHECKING

import numpy as np

from wbc_suite.typing import Matrix, Vector
from wbc_suite.viewers.balance_status import BalanceStatus
from wbc_suite.viewers.scene_setup import Colour, css

if TYPE_CHECKING:
    import viser

    from wbc_suite.viewers.page_process import Session

STANDING, LIFTED, FOOTSTEP = (48, 150, 84), (120, 130, 145), (232, 140, 30)
CAPTURE_POINT, FORCE = (190, 50, 150), (190, 25, 20)
ABOVE = 0.006  # m, of what is drawn on the ground
LINE = 0.008  # m, thickness of outlines
CROSS = 0.09  # m, arms of the cross at the capture point
RADIUS = 0.035  # m, of the circle that stands for a foot without a sole
ARROW = 0.5  # m, length of a force that is the robot's weight
LEAST = 0.01  # of the weight; smaller forces are not drawn


class BalanceOverlays:
    """Draw the balance of the robot for those clients that ask for it.

    Args:
        session: Session that reports it.
    """

    def __init__(self, session: "Session") -> None:
        self._session = session
        self._shown: dict[int, _Overlay] = {}

    def show(self, client: "viser.ClientHandle", shown: bool) -> None:
        """Draw the balance for a client, or stop."""
        number = client.client_id
        if shown:
            self._shown[number] = _Overlay(client)
        elif number in self._shown:
            self._shown.pop(number).update(None)
        self._session.watch_balance(number, shown)

    def remove_client(self, client: int) -> None:
        """Forget a client."""
        self._shown.pop(client, None)

    def update(self, balance: BalanceStatus | None) -> None:
        """Draw a state."""
        for overlay in [*self._shown.values()]:
            overlay.update(balance)


class _Overlay:
    """Draw the balance of a robot for one client.

    Args:
        client: The client.
    """

    def __init__(self, client: "viser.ClientHandle") -> None:
        scene, none = client.scene, np.zeros((1, 2, 3), dtype=np.float32)
        self._outlines = {
            colour: scene.add_line_segments(
                f"/balance/{name}", none, colors=colour, thickness=LINE, visible=False
            )
            for name, colour in (
                ("standing", STANDING),
                ("lifted", LIFTED),
                ("footstep", FOOTSTEP),
                ("capture_point", CAPTURE_POINT),
            )
        }
        self._forces = scene.add_arrows(
            "/balance/forces",
            none,
            FORCE,
            shaft_radius=0.008,
            head_radius=0.02,
            head_length=0.05,
            visible=False,
        )

    def update(self, balance: BalanceStatus | None) -> None:
        """Draw a state; nothing for None."""
        lines, arrows = outlines(balance), force_arrows(balance)
        for colour, node in self._outlines.items():
            node.visible = colour in lines
            if colour in lines:
                node.points = lines[colour]
        self._forces.visible = len(arrows) > 0
        if len(arrows):
            self._forces.points = arrows


def outlines(balance: BalanceStatus | None) -> dict[Colour, Matrix]:
    """Return segments of feet, next footstep and capture point by their colour.

    Returns:
        Segments, m, shape (n, 2, 3) each; only colours that have any.
    """
    found: dict[Colour, list[Matrix]] = {}
    if balance is None:
        return {}
    for foot in balance.feet:
        colour = STANDING if foot.stands else LIFTED
        found.setdefault(colour, []).append(_outline(foot.corners))
    lifted = next((foot for foot in balance.feet if not foot.stands), None)
    if lifted is not None and balance.footstep is not None:
        moved = lifted.corners - lifted.corners.mean(axis=0) + balance.footstep
        found[FOOTSTEP] = [_outline(moved)]
    arms = CROSS * np.array([[[-1, -1, 0], [1, 1, 0]], [[-1, 1, 0], [1, -1, 0]]])
    found[CAPTURE_POINT] = [balance.capture_point + arms + np.array([0.0, 0.0, ABOVE])]
    return {
        colour: np.concatenate(parts).astype(np.float32)
        for colour, parts in found.items()
    }


def force_arrows(balance: BalanceStatus | None) -> Matrix:
    """Return start and end of an arrow for each contact force, m, shape (n, 2, 3)."""
    if balance is None:
        return np.zeros((0, 2, 3), dtype=np.float32)
    strong = np.linalg.norm(balance.forces, axis=1) > LEAST * balance.weight
    start = balance.points[strong]
    end = start + ARROW / balance.weight * balance.forces[strong]
    return np.stack([start, end], axis=1).astype(np.float32)


def legend_html() -> str:
    """Return what the colours mean."""
    marks = (
        ("&#9645;", STANDING, "foot that stands"),
        ("&#9645;", LIFTED, "lifted foot"),
        ("&#9645;", FOOTSTEP, "next footstep"),
        ("&#10005;", CAPTURE_POINT, "capture point"),
        ("&#8593;", FORCE, f"contact force, {100 * ARROW:.0f} cm for the weight"),
    )
    rows = "".join(
        f"<div><span style='color:{css(colour)};display:inline-block;width:1.4em;"
        f"font-weight:700'>{mark}</span>{text}</div>"
        for mark, colour, text in marks
    )
    return f"<div style='padding:.2em .9em .4em;font-size:.82em'>{rows}</div>"


def _outline(corners: Matrix) -> Matrix:
    """Return the segments around a sole or a ball, above the ground, (n, 2, 3)."""
    around = corners if len(corners) > 1 else _circle(corners[0])
    around = around + np.array([0.0, 0.0, ABOVE])
    return np.stack([around, np.roll(around, -1, axis=0)], axis=1)


def _circle(middle: Vector) -> Matrix:
    angle = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
    around = np.column_stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)])
    return middle + RADIUS * around
