"""MJGUI: targets that are dragged in MuJoCo's window."""

import time
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.devices.action_ports import LimbKind, LimbPort, limb_ports
from wbc_suite.devices.state import DeviceState, LimbInput
from wbc_suite.errors import DeviceError

SIZE = 0.03  # m, half size of a target
COLOURS = ((0.9, 0.3, 0.2, 0.5), (0.2, 0.5, 0.9, 0.5), (0.3, 0.7, 0.3, 0.5))


class MjGui:
    """Boxes at the robot's limbs that are dragged: double click, then Ctrl and drag.

    The window displays a copy of the scene with the boxes added. `launch` opens a
    window on a model and its data, by default MuJoCo's passive viewer.
    """

    help = "MuJoCo's window: double click a box, then Ctrl and drag.\n"

    def __init__(
        self,
        env: Any,
        launch: Callable[[mujoco.MjModel, mujoco.MjData], Any] | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._env, self._clock = env.unwrapped, clock
        self._launch = launch or open_window
        movable = (LimbKind.POSE, LimbKind.POSITION)
        self._ports = [p for p in limb_ports(env).values() if p.kind in movable]
        self._viewer: Any = None

    def start(self) -> None:
        """Open the window; raises DeviceError if there is no display."""
        self._model = _with_targets(self._env.scene_xml, self._ports)
        self._data = mujoco.MjData(self._model)
        self._copy()
        for k, port in enumerate(self._ports):
            T = port.measure()
            self._data.mocap_pos[k] = T.translation
            self._data.mocap_quat[k] = np.roll(pin.Quaternion(T.rotation).coeffs(), 1)
        mujoco.mj_forward(self._model, self._data)
        self._viewer = self._launch(self._model, self._data)

    def read(self) -> DeviceState:
        """Return the poses of the boxes; the button `quit` if the window is closed."""
        if not self._viewer.is_running():
            return DeviceState(time=self._clock(), buttons=frozenset({"quit"}))
        with self._viewer.lock():
            self._copy()
            mujoco.mj_kinematics(self._model, self._data)
            limbs = {}
            for k, port in enumerate(self._ports):
                turn = pin.Quaternion(*self._data.mocap_quat[k]).normalized()
                pose = pin.SE3(turn, self._data.mocap_pos[k])
                limbs[port.name] = LimbInput(pose=pose)
        self._viewer.sync()
        return DeviceState(time=self._clock(), limbs=limbs)

    def stop(self) -> None:
        """Close the window."""
        if self._viewer is not None:
            self._viewer.close()
        self._viewer = None

    def _copy(self) -> None:
        self._data.qpos[:] = self._env.simulation.data.qpos
        self._data.time = self._env.simulation.data.time


def _with_targets(scene: str, ports: list[LimbPort]) -> mujoco.MjModel:
    spec = mujoco.MjSpec.from_string(scene)
    for k, port in enumerate(ports):
        body = spec.worldbody.add_body(name=f"target_{port.name}", mocap=True)
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[SIZE] * 3,
            rgba=COLOURS[k % len(COLOURS)],
            contype=0,
            conaffinity=0,
        )
    return spec.compile()


def open_window(model: mujoco.MjModel, data: mujoco.MjData, **options: Any) -> Any:
    """Open MuJoCo's passive viewer; for options see `mujoco.viewer.launch_passive`.

    Raises:
        DeviceError: If there is no display.
    """
    from mujoco import viewer

    try:
        return viewer.launch_passive(model, data, **options)
    except Exception as error:  # GLFW raises many kinds
        raise DeviceError(
            f"MuJoCo's window does not open: {error}. It needs a display; on macOS run "
            "with mjpython. The pages in the browser need neither."
        ) from error
