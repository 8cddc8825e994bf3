"""Feet, capture point, next footstep and contact forces in a client's scene."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pinocchio as pin

from wbc_suite.typing import Matrix, Vector
from wbc_suite.viewers.balance_status import BalanceStatus
from wbc_suite.viewers.scene_setup import Colour, css, place

if TYPE_CHECKING:
    import viser

    from wbc_suite.viewers.remote_session import Session

# Colours: red, green and blue, 0 to 255.
STANDING, LIFTED, FOOTSTEP = (48, 150, 84), (120, 130, 145), (232, 140, 30)
CAPTURE_POINT, FORCE = (190, 50, 150), (190, 25, 20)
ABOVE = 0.006  # m, of what is drawn on the ground
LINE = 0.008  # m, thickness of outlines
CROSS = 0.09  # m, arms of the cross at the capture point
RADIUS = 0.035  # m, of the circle that stands for a foot without a sole
ARROW = 0.5  # m, length of a force that is the robot's weight
LEAST = 0.01  # of the weight; smaller forces are not drawn
VISIBLE = 0.01  # m; an arrow that changes by less keeps its geometry


class BalanceOverlays:
    """Draw the balance of the robot for those clients that ask for it."""

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

    Nodes are moved where possible: new geometry takes a browser longer than a new pose.
    """

    def __init__(self, client: "viser.ClientHandle") -> None:
        self._scene = client.scene
        self._lines: dict[str, viser.LineSegmentsHandle] = {}
        self._arrows: list[viser.ArrowsHandle] = []

    def update(self, balance: BalanceStatus | None) -> None:
        """Draw a state; nothing for None."""
        marks = {} if balance is None else marks_of(balance)
        for name, mark in marks.items():
            if name not in self._lines:
                self._lines[name] = self._scene.add_line_segments(
                    f"/balance/{name}",
                    mark.segments,
                    colors=mark.colour,
                    thickness=LINE,
                )
            place(self._lines[name], mark.pose)
        for name, node in self._lines.items():
            node.visible = name in marks
        points, vectors = force_arrows(balance)
        while len(self._arrows) < len(points):
            self._arrows.append(self._add_arrow(len(self._arrows)))
        for k, arrow in enumerate(self._arrows):
            arrow.visible = k < len(points)
            if arrow.visible:
                arrow.position = tuple(points[k])
                if np.linalg.norm(arrow.points[0, 1] - vectors[k]) > VISIBLE:
                    ends = np.stack([np.zeros(3), vectors[k]])
                    arrow.points = ends[None].astype(np.float32)

    def _add_arrow(self, number: int) -> "viser.ArrowsHandle":
        return self._scene.add_arrows(
            f"/balance/force_{number}",
            np.array([[np.zeros(3), [0.0, 0.0, ARROW]]], dtype=np.float32),
            FORCE,
            shaft_radius=0.008,
            head_radius=0.02,
            head_length=0.05,
        )


class Mark(NamedTuple):
    """Lines on the ground.

    Attributes:
        colour: Their colour.
        segments: Lines about the pose, m, shape (n, 2, 3).
        pose: Where they are, in the world.
    """

    colour: Colour
    segments: Matrix
    pose: pin.SE3


def marks_of(balance: BalanceStatus) -> dict[str, Mark]:
    """Return the marks of feet, next footstep and capture point, by a name for each."""
    marks = {}
    for foot in balance.feet:
        kind, colour = ("standing", STANDING) if foot.stands else ("lifted", LIFTED)
        outline, pose = _outline(foot.sole), _pose(foot.position, foot.yaw)
        marks[f"{kind}/{foot.name}"] = Mark(colour, outline, pose)
    lifted = next((foot for foot in balance.feet if not foot.stands), None)
    if lifted is not None and balance.footstep is not None:
        outline, pose = _outline(lifted.sole), _pose(balance.footstep, lifted.yaw)
        marks[f"footstep/{lifted.name}"] = Mark(FOOTSTEP, outline, pose)
    arms = CROSS * np.array([[[-1, -1, 0], [1, 1, 0]], [[-1, 1, 0], [1, -1, 0]]])
    pose = _pose(balance.capture_point, 0.0)
    marks["capture_point"] = Mark(CAPTURE_POINT, arms.astype(np.float32), pose)
    return marks


def force_arrows(balance: BalanceStatus | None) -> tuple[Matrix, Matrix]:
    """Return start and vector of an arrow for each contact force, m, shape (n, 3)."""
    if balance is None:
        return np.zeros((0, 3)), np.zeros((0, 3))
    strong = np.linalg.norm(balance.forces, axis=1) > LEAST * balance.weight
    return balance.points[strong], ARROW / balance.weight * balance.forces[strong]


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


def _outline(sole: Vector) -> Matrix:
    """Return the segments around a sole, or a circle for a ball, m, (n, 2, 3)."""
    heel, toes, right, left = sole
    if heel < toes:
        x, y = np.array([heel, toes, toes, heel]), np.array([right, right, left, left])
    else:
        angle = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
        x, y = RADIUS * np.cos(angle), RADIUS * np.sin(angle)
    around = np.column_stack([x, y, np.zeros_like(x)])
    lines = np.stack([around, np.roll(around, -1, axis=0)], axis=1)
    return lines.astype(np.float32)


def _pose(position: Vector, yaw: float) -> pin.SE3:
    above = position + np.array([0.0, 0.0, ABOVE])
    return pin.SE3(pin.utils.rotate("z", yaw), above)
