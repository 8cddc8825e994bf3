"""Kernels compile with named records as arguments, and run as plain Python."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from wbc_suite.compiling import (
    as_argument,
    by_address,
    compiled,
    inner,
    is_compiling,
    plain,
    struct,
)
from wbc_suite.typing import Matrix, Vector


@struct
class Spring(NamedTuple):
    """Arrays and a number."""

    position: Vector
    stiffness: Matrix
    rest: float


@compiled
def push(spring: Spring, force: Vector) -> float:
    """Write the force of a spring, and move its end."""
    energy = 0.0
    for i in range(force.shape[0]):
        force[i] = 0.0
        for j in range(force.shape[0]):
            force[i] -= spring.stiffness[i, j] * (spring.position[j] - spring.rest)
        energy -= 0.5 * force[i] * (spring.position[i] - spring.rest)
    spring.position[0] += 1.0
    return energy


@inner
def halved(force: Vector) -> float:
    """Halve a force; return its first component, or -1 where it is none."""
    if force.shape[0] == 0:
        return -1.0
    for i in range(force.shape[0]):
        force[i] *= 0.5
    return force[0]


@compiled
def halved_twice(force: Vector) -> float:
    """Halve a force twice; return the sum of what is returned."""
    return halved(force) + halved(force)


@struct
class Change(NamedTuple):
    """A kernel as a value."""

    apply: Any


@compiled
def change(kernels: Change, force: Vector) -> float:
    """Apply the change that a value holds."""
    return kernels.apply(force)


def make():
    return Spring(np.array([1.0, 2.0]), np.array([[2.0, 0.5], [0.5, 3.0]]), 0.25)


def test_records_share_their_arrays_with_kernels():
    spring, force = make(), np.zeros(2)
    x = spring.position - 0.25
    energy = push(as_argument(spring), force)
    assert energy == pytest.approx(0.5 * x @ spring.stiffness @ x)
    np.testing.assert_allclose(force, -spring.stiffness @ x)
    assert spring.position[0] == 2.0


def test_inner_kernels_are_compiled_with_their_callers_alone():
    for kernel in (halved_twice, plain(halved_twice), halved):
        force = np.array([8.0, 4.0])
        assert kernel(force) == (4.0 if kernel is halved else 6.0)
        assert kernel(np.zeros(0)) == (-1.0 if kernel is halved else -2.0)


def test_a_kernel_in_a_field_is_called_by_its_address():
    """What calls it is compiled once, whichever kernel it is."""
    force = np.array([8.0, 4.0])
    for kernel, first in ((halved, 4.0), (halved_twice, 3.0)):
        address = by_address(kernel, force)
        assert change(as_argument(Change(address)), force) == first
    if is_compiling():
        kernels: Any = change
        assert len(kernels.signatures) == 1


@pytest.mark.slow
def test_kernels_run_as_plain_python():
    """The same statements hold where numba compiles nothing."""
    command = [sys.executable, "-m", "pytest", "-q", __file__, "-k", "share"]
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    result = subprocess.run(
        command, env=environment, capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stdout + result.stderr
    assert "1 passed" in result.stdout


@pytest.mark.slow
def test_a_record_of_a_module_that_is_gone_does_not_spoil_the_cache(tmp_path):
    """Other processes read the machine code of other records."""
    module = """
from typing import NamedTuple
import numpy as np
from wbc_suite.compiling import as_argument, struct
from wbc_suite.control.run.state_checks import CheckedState

@struct
class Lost(NamedTuple):
    values: np.ndarray

as_argument(Lost(np.zeros(3)))
"""
    (tmp_path / "lost_module.py").write_text(module)
    use = """
import mujoco
from wbc_suite.compiling import as_argument
from wbc_suite.control.run.state_checks import CheckedState, checked_state
model = mujoco.MjSpec().compile()
as_argument(checked_state(model, mujoco.MjData(model)))
"""
    root = str(Path(__file__).parent.parent)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    for code, path in (
        (use, root),
        (f"import lost_module\n{use}", tmp_path),
        (use, ""),
    ):
        environment["PYTHONPATH"] = os.pathsep.join([root, str(path)])
        subprocess.run([sys.executable, "-c", code], env=environment, check=True)
