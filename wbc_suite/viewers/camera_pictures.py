"""Pictures of the scene's cameras on the page: what the robot sees."""

import threading
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from wbc_suite.errors import DeviceError
from wbc_suite.sensing.cameras import Cameras
from wbc_suite.viewers.session_state import Snapshot

if TYPE_CHECKING:
    import viser

NONE = "none"
WIDTH, HEIGHT = 320, 240  # pixels
PERIOD = 0.2  # s
QUALITY = 80  # of JPEG
HINT = "What a camera of the scene sees, 5 times a second."


class CameraPictures:
    """Draw the cameras that clients have chosen, in a thread that does nothing else.

    Args:
        model: The scene; a renderer changes it while it draws.
        snapshot: State that is drawn until `update` gives a newer one.
    """

    def __init__(self, model: mujoco.MjModel, snapshot: Snapshot) -> None:
        self._model, self._data = model, mujoco.MjData(model)
        self._cameras = Cameras(model, self._data, ())
        self._snapshot = snapshot
        self._chosen: dict[int, tuple[str, viser.GuiImageHandle]] = {}
        self._wanted, self._stopping = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="pictures", daemon=True)
        self._thread.start()

    def add_client(self, client: "viser.ClientHandle") -> None:
        """Add the choice of a camera, and its picture, to the present folder."""
        if not self._cameras.names:
            return
        choice = client.gui.add_dropdown(
            "Camera", (NONE, *self._cameras.names), initial_value=NONE, hint=HINT
        )
        image = client.gui.add_image(
            np.zeros((HEIGHT, WIDTH, 3), dtype=np.uint8),
            format="jpeg",
            jpeg_quality=QUALITY,
            visible=False,
        )

        @choice.on_update
        def _(_: object) -> None:
            image.visible = choice.value != NONE
            if not image.visible:
                self.remove_client(client.client_id)
            elif choice.value in self._cameras.names:
                self._chosen[client.client_id] = choice.value, image
                self._wanted.set()

    def remove_client(self, client: int) -> None:
        """Draw nothing more for a client."""
        self._chosen.pop(client, None)

    def update(self, snapshot: Snapshot) -> None:
        """Draw this state next."""
        self._snapshot = snapshot

    def stop(self) -> None:
        """End the thread."""
        self._stopping.set()
        self._wanted.set()
        self._thread.join()

    def _run(self) -> None:
        while self._wanted.wait() and not self._stopping.wait(PERIOD):
            if not self._chosen:
                self._wanted.clear()
                self._cameras.close()
                continue
            try:
                self._draw()
            except DeviceError as error:  # it is said beside the pictures
                for _, image in self._chosen.values():
                    image.label, image.visible = str(error), True
                self._chosen.clear()

    def _draw(self) -> None:
        """Send each chosen picture of the newest state."""
        self._data.qpos[:] = self._snapshot.positions
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_comPos(self._model, self._data)
        pictures = {}
        for name, image in [*self._chosen.values()]:
            if name not in pictures:
                pictures[name] = self._cameras.image(name, width=WIDTH, height=HEIGHT)
            image.image = pictures[name]
