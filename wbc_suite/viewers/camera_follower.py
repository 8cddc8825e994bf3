"""Cameras that move with a robot that drives or walks."""

from typing import TYPE_CHECKING

import mujoco
import numpy as np

from wbc_suite.typing import Matrix, Vector

if TYPE_CHECKING:
    import viser

SMOOTHING = 0.15  # part of the way to the robot in one update
STEP = 1e-3  # m; shorter motions are collected


class CameraFollower:
    """Move the cameras of clients so that they look at the robot; height is theirs.

    A camera keeps its direction and distance. Its error is measured, not summed up:
    what a client tells of its camera is old.

    Args:
        model: The scene.
        positions: Positions of its bodies at the start, m, shape (nbody, 3).
        middle: Point at the robot that cameras look at, at the start, m, shape (3,).
    """

    def __init__(
        self, model: mujoco.MjModel, positions: Matrix, middle: Vector
    ) -> None:
        self._body = next(
            body
            for body in range(model.nbody)
            if model.body_weldid[body] and model.body(body).name.startswith("robot0_")
        )
        self._start = self._place(positions)
        self._followed, self._smooth = self._start.copy(), self._start.copy()
        self._middle = middle
        self._clients: dict[int, viser.ClientHandle] = {}

    @property
    def moved(self) -> Vector:
        """How far cameras have moved since the start, m, shape (3,)."""
        return self._followed - self._start

    def follow(self, client: "viser.ClientHandle", follows: bool) -> None:
        """Let a client's camera follow, or stay."""
        if follows:
            self._clients[client.client_id] = client
        else:
            self._clients.pop(client.client_id, None)

    def remove_client(self, client: int) -> None:
        """Forget a client."""
        self._clients.pop(client, None)

    def update(self, positions: Matrix, *, jump: bool) -> None:
        """Move the cameras towards the robot, or with `jump` all of the way."""
        away = self._place(positions) - self._smooth
        self._smooth = self._smooth + (1.0 if jump else SMOOTHING) * away
        if np.linalg.norm(self._smooth - self._followed) < STEP:
            return
        self._followed = self._smooth
        for client in [*self._clients.values()]:
            step = self._middle + self.moved - client.camera.look_at
            step[2] = 0.0
            client.camera.position = client.camera.position + step

    def _place(self, positions: Matrix) -> Vector:
        return positions[self._body] * [1.0, 1.0, 0.0]
