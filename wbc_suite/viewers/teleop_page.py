"""The teleoperation page: a session, shown and driven in browsers."""

import logging
import threading
import time
from typing import TYPE_CHECKING

from wbc_suite.devices.limbs import LimbKind
from wbc_suite.viewers.drivable import Drivable
from wbc_suite.viewers.ghosts import Ghosts
from wbc_suite.viewers.gizmos import Gizmos
from wbc_suite.viewers.palette import limb_colours
from wbc_suite.viewers.scene_mirror import SceneMirror, robot_box
from wbc_suite.viewers.site import Site
from wbc_suite.viewers.stage import set_camera, set_stage
from wbc_suite.viewers.teleop_panel import TeleopPanel
from wbc_suite.viewers.words import explain

if TYPE_CHECKING:
    import viser

__all__ = ["TeleopPage"]

log = logging.getLogger(__name__)

PUSH_RATE = 25.0  # Hz; the eye wants no more, and every push costs the loop's processor
PANEL_EVERY = 5  # pushes
PLOT_EVERY = 7  # pushes; not a multiple, so that both seldom fall together
HAND_SCALE, OTHER_SCALE, BASE_SCALE = 0.22, 0.16, 0.4  # m


class TeleopPage:
    """Serve a session; everything that is sent is sent from a thread of its own.

    Args:
        session: Session to show; it need not run yet.
        label: What the panel is called.
        site: Where the page is served; the page closes it when it stops.
    """

    def __init__(self, session: Drivable, site: Site, *, label: str) -> None:
        self.session, self.site = session, site
        model, limbs = session.traits.model, session.traits.limbs
        self.server = site.server
        set_stage(self.server, label=label)
        snapshot = session.snapshot
        colours = limb_colours(limbs)
        self.mirror = SceneMirror(self.server, model)
        self.mirror.update(snapshot.body_positions, snapshot.body_quaternions)
        self.gizmos = Gizmos(
            session, {n: _scale(n, limb.kind) for n, limb in limbs.items()}
        )
        bodies = {name: limb.body for name, limb in limbs.items()}
        self.ghosts = Ghosts(self.server, model, bodies, snapshot, colours)
        box = robot_box(model, snapshot.body_positions, snapshot.body_quaternions)
        self.panel = TeleopPanel(self.server, session, self.gizmos, colours, box)
        set_camera(self.server, *box)
        self.push_times: list[float] = []
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="scene", daemon=True)
        self.server.on_client_connect(self._connect)
        self.server.on_client_disconnect(self._disconnect)

    def start(self) -> None:
        """Begin to send what moves."""
        self._thread.start()

    def stop(self) -> None:
        """Stop sending, and close the server."""
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join()
        self.site.stop()

    def push(self, count: int = 0) -> None:
        """Send what changed; panel and plots only at some counts."""
        snapshot = self.session.snapshot
        self.mirror.update(snapshot.body_positions, snapshot.body_quaternions)
        with self.server.atomic():
            notes = {
                name: explain(status, at_most=1)
                for name, status in snapshot.limbs.items()
                if status.holder is not None
            }
            self.ghosts.update(snapshot, notes)
        self.gizmos.update(snapshot)
        self.panel.note(snapshot)
        if count % PANEL_EVERY == 0:
            self.panel.update(snapshot)
        if count % PLOT_EVERY == 0:
            self.panel.update_plots()

    def _run(self) -> None:
        count = 0
        while not self._stopping.wait(1.0 / PUSH_RATE):
            begun = time.thread_time()
            try:
                self.push(count)
            except RuntimeError:
                # A client came or went while viser woke all of them. What was not sent
                # still differs from what is shown, and is sent next time.
                log.debug("The page missed a push", exc_info=True)
            self.push_times.append(time.thread_time() - begun)
            del self.push_times[:-1000]
            count += 1

    def _connect(self, client: "viser.ClientHandle") -> None:
        self.gizmos.add_client(client)
        self.panel.add_client(client)

    def _disconnect(self, client: "viser.ClientHandle") -> None:
        self.gizmos.remove_client(client.client_id)


def _scale(name: str, kind: LimbKind) -> float:
    if kind is LimbKind.PLANAR:
        return BASE_SCALE
    return HAND_SCALE if "hand" in name or "gripper" in name else OTHER_SCALE
