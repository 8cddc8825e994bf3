"""Readings: the values of the simulation that an observation consists of.

An observation is a `Reading`, made by one of the functions below; `computed` takes any
other function. A new kind of reading is one function that returns a `Reading`.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from wbc_suite.typing import Vector

Read: TypeAlias = Callable[[], Any]
"""Returns the present values, shape (size,); may be a view."""

XYZW = np.array([1, 2, 3, 0])
"""Order of MuJoCo's w x y z entries in x y z w."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Reading:
    """Some values of the simulation.

    `bind` returns the function that reads them from one simulation's data.
    """

    size: int
    bind: Callable[[mujoco.MjData], Read]


def joint_positions(addresses: Iterable[int]) -> Reading:
    """Read entries of qpos, rad or m."""
    return _entries("qpos", addresses)


def joint_cosines(addresses: Iterable[int]) -> Reading:
    """Read cosines of entries of qpos."""
    return _entries("qpos", addresses, np.cos)


def joint_sines(addresses: Iterable[int]) -> Reading:
    """Read sines of entries of qpos."""
    return _entries("qpos", addresses, np.sin)


def joint_velocities(addresses: Iterable[int]) -> Reading:
    """Read entries of qvel, rad/s or m/s."""
    return _entries("qvel", addresses)


def sensor_values(addresses: Iterable[int], *, negated: bool = False) -> Reading:
    """Read entries of sensordata, of MuJoCo's last step, or their negatives."""
    return _entries("sensordata", addresses, np.negative if negated else None)


def actuator_forces(addresses: Iterable[int]) -> Reading:
    """Read the actuators' forces along degrees of freedom, N m or N."""
    return _entries("qfrc_actuator", addresses)


def user_values(addresses: Iterable[int]) -> Reading:
    """Read entries of userdata, where benchmarks keep their own state."""
    return _entries("userdata", addresses)


def body_position(body: int) -> Reading:
    """Read the position of a body in the world, m."""
    return Reading(size=3, bind=lambda data: _view(data.xpos[body]))


def body_quat(body: int) -> Reading:
    """Read the orientation of a body in the world, x y z w."""

    def bind(data: mujoco.MjData) -> Read:
        quat = data.xquat[body]
        return lambda: quat[XYZW]

    return Reading(size=4, bind=bind)


def site_position(site: int) -> Reading:
    """Read the position of a site in the world, m."""
    return Reading(size=3, bind=lambda data: _view(data.site_xpos[site]))


def site_quat(site: int) -> Reading:
    """Read the orientation of a site in the world, x y z w, largest entry positive."""
    return _quat_of(lambda data: _view(data.site_xmat[site]))


def offset(to: Reading, start: Reading) -> Reading:
    """Read the difference of two positions, `to - start`, m."""

    def bind(data: mujoco.MjData) -> Read:
        end, begin = to.bind(data), start.bind(data)
        return lambda: np.subtract(end(), begin())

    return Reading(size=to.size, bind=bind)


def relative_position(body: int, site: int) -> Reading:
    """Read the position of a body in the frame of a site, R_ws^T (p_wb - p_ws), m."""

    def bind(data: mujoco.MjData) -> Read:
        p_wb, p_ws = data.xpos[body], data.site_xpos[site]
        R_ws = data.site_xmat[site].reshape(3, 3)
        return lambda: (p_wb - p_ws) @ R_ws

    return Reading(size=3, bind=bind)


def relative_quat(body: int, site: int) -> Reading:
    """Read the orientation of a body in the frame of a site, x y z w.

    The largest entry is positive.
    """

    def bind(data: mujoco.MjData) -> Read:
        R_wb = data.xmat[body].reshape(3, 3)
        R_sw = data.site_xmat[site].reshape(3, 3).T
        return lambda: np.reshape(R_sw @ R_wb, 9)

    return _quat_of(bind)


def constant(value: float) -> Reading:
    """Read always the same value."""
    return computed(1, lambda: value)


def selected(options: Sequence[Reading], index: Callable[[], int]) -> Reading:
    """Read one of several readings of equal size; `index` returns which one."""

    def bind(data: mujoco.MjData) -> Read:
        reads = [option.bind(data) for option in options]

        def read() -> Any:
            return reads[index()]()

        return read

    return Reading(size=options[0].size, bind=bind)


def computed(size: int, function: Callable[[], ArrayLike]) -> Reading:
    """Read the values that a function computes, shape (size,)."""
    return Reading(size=size, bind=lambda data: function)


def _entries(
    field: str,
    addresses: Iterable[int],
    function: Callable[[Vector], Any] | None = None,
) -> Reading:
    """Read entries of one of MuJoCo's vectors, or a function of them."""
    index: Any = np.array([*addresses], dtype=np.int64)
    size = len(index)
    if size and (np.diff(index) == 1).all():
        index = slice(index[0], index[-1] + 1)  # a view, where one can be had

    def bind(data: mujoco.MjData) -> Read:
        values = getattr(data, field)
        return lambda: function(values[index]) if function else values[index]

    return Reading(size=size, bind=bind)


def _view(values: Vector) -> Read:
    return lambda: values


def _quat_of(bind_matrix: Callable[[mujoco.MjData], Read]) -> Reading:
    """Read a rotation matrix as x y z w; `bind_matrix` binds its nine entries."""

    def bind(data: mujoco.MjData) -> Read:
        matrix, quat = bind_matrix(data), np.empty(4)

        def read() -> Vector:
            mujoco.mju_mat2Quat(quat, matrix())
            return quat[XYZW]

        return read

    return Reading(size=4, bind=bind)
