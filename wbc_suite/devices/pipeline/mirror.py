"""Mirrored operation: a person who faces the robot moves it as in a mirror."""

import numpy as np
import pinocchio as pin

from wbc_suite.devices.state import DeviceState, LimbInput

__all__ = ["mirrored"]

_FLIP = np.diag([1.0, -1.0, 1.0])  # left and right change places
_TWIST = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])  # a rotation is a pseudovector


def mirrored(state: DeviceState) -> DeviceState:
    """Return what a mirror between left and right makes of a state."""
    return DeviceState(
        time=state.time,
        limbs={_swapped(name): _mirror(said) for name, said in state.limbs.items()},
        joints=state.joints,
        base=None if state.base is None else state.base * _TWIST[[0, 1, 5]],
        height=state.height,
        buttons=state.buttons,
    )


def _swapped(name: str) -> str:
    other = {"left": "right", "right": "left"}
    return "_".join(other.get(word, word) for word in name.split("_"))


def _mirror(said: LimbInput) -> LimbInput:
    pose = said.pose
    if pose is not None:
        pose = pin.SE3(_FLIP @ pose.rotation @ _FLIP, _FLIP @ pose.translation)
    return LimbInput(
        pose=pose,
        twist=None if said.twist is None else said.twist * _TWIST,
        engaged=said.engaged,
        grip=said.grip,
        fingers=said.fingers,
    )
