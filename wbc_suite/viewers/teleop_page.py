"""The teleoperation page: scene, handles, target markers and panel in browsers."""

from typing import TYPE_CHECKING

import mujoco

from wbc_suite.devices.action_ports import LimbKind
from wbc_suite.viewers.balance_overlay import BalanceOverlays
from wbc_suite.viewers.camera_follower import CameraFollower
from wbc_suite.viewers.camera_pictures import CameraPictures
from wbc_suite.viewers.drag_handles import DragHandles
from wbc_suite.viewers.model_scene import ModelScene, robot_box
from wbc_suite.viewers.page_server import PageServer
from wbc_suite.viewers.scene_setup import (
    Box,
    limb_colours,
    set_camera,
    set_up_scene,
)
from wbc_suite.viewers.status_text import explain
from wbc_suite.viewers.target_markers import TargetMarkers
from wbc_suite.viewers.teleop_panel import TeleopPanel

if TYPE_CHECKING:
    import viser

    from wbc_suite.viewers.remote_session import Session

PANEL_EVERY = 5  # updates
PLOT_EVERY = 7  # updates; not a multiple, so that both seldom coincide
HAND_SCALE, OTHER_SCALE, BASE_SCALE = 0.22, 0.16, 0.4  # m


class TeleopPage:
    """Serve a session; updates are sent by a thread of their own.

    The session need not run yet. `site`, the server, is stopped with the page.
    """

    def __init__(self, session: "Session", site: PageServer, *, label: str) -> None:
        self.session, self.site = session, site
        model, limbs = session.info.model, session.info.limbs
        self.server = site.server
        set_up_scene(site, label=label)
        snapshot = session.snapshot
        self.colours = limb_colours(limbs)
        self.scene = ModelScene(self.server, model)
        self.scene.update(snapshot.body_positions, snapshot.body_quaternions)
        self.handles = DragHandles(
            session, {n: _scale(n, limb.kind) for n, limb in limbs.items()}
        )
        self.markers = TargetMarkers(self.server, session.info, snapshot, self.colours)
        data = mujoco.MjData(model)
        data.qpos[:] = snapshot.positions
        mujoco.mj_kinematics(model, data)
        self._box = low, high = robot_box(model, data)
        self.cameras = CameraFollower(
            model, snapshot.body_positions, (low + high) / 2.0
        )
        self.overlays = BalanceOverlays(session)
        self.pictures = CameraPictures(model, snapshot)
        self.panel = TeleopPanel(self)
        if self.panel.drive is not None:
            site.keys.listen(self.panel.drive.receive)
        several = any(name.startswith("robot1_") for name in limbs)
        self._names = {n: k.title for n, k in limbs.items()} if several else {}
        self._epoch = snapshot.epoch
        set_camera(self.server, self._box)
        self.server.on_client_connect(self._connect)
        self.server.on_client_disconnect(self._disconnect)

    @property
    def box(self) -> Box:
        """Corners of a box around the robot, m."""
        low, high = self._box
        return low + self.cameras.moved, high + self.cameras.moved

    def start(self) -> None:
        """Start the updates."""
        self.site.start_updates(self.update)

    def stop(self) -> None:
        """Stop the updates, and close the server."""
        self.pictures.stop()
        self.site.stop()

    def update(self, count: int = 0) -> None:
        """Send what changed; panel and plots only at some counts."""
        snapshot = self.session.snapshot
        self.scene.update(snapshot.body_positions, snapshot.body_quaternions)
        with self.server.atomic():
            reasons = {
                name: text
                for name, status in snapshot.limbs.items()
                if status.holder is not None and (text := explain(status, at_most=1))
            }
            self.markers.update(snapshot, self._names | reasons)
        self.handles.update(snapshot)
        self.overlays.update(snapshot.balance)
        self.pictures.update(snapshot)
        was_reset, self._epoch = snapshot.epoch != self._epoch, snapshot.epoch
        self.cameras.update(snapshot.body_positions, jump=was_reset)
        self.panel.plots.record(snapshot)
        if count % PANEL_EVERY == 0:
            self.panel.update(snapshot)
        if count % PLOT_EVERY == 0:
            self.panel.plots.update()

    def _connect(self, client: "viser.ClientHandle") -> None:
        self.handles.add_client(client)
        self.panel.add_client(client)

    def _disconnect(self, client: "viser.ClientHandle") -> None:
        parts = self.handles, self.cameras, self.overlays, self.pictures, self.panel
        for part in parts:
            part.remove_client(client.client_id)


def _scale(name: str, kind: LimbKind) -> float:
    if kind is LimbKind.PLANAR:
        return BASE_SCALE
    return HAND_SCALE if "hand" in name or "gripper" in name else OTHER_SCALE
