"""Another process compiles what is needed later, and its code is what is used."""

import os
import subprocess
import sys
from typing import Any

import pytest

pytestmark = pytest.mark.slow

CALL = """
import os, subprocess
from wbc_suite.compiling_ahead import _signature, compile_ahead
from wbc_suite.control.composite.frames import _approach

os.cpu_count = lambda: {processors}
begin, begun = subprocess.Popen, []


def counted(*args, **options):
    begun.append(begin(*args, **options))
    return begun[-1]


subprocess.Popen = counted
for _ in range({controllers}):
    compile_ahead(_approach)
_approach.compile(_signature(_approach.py_func))
compile_ahead(_approach)  # there is code by now
stats = _approach.stats
hits, misses = sum(stats.cache_hits.values()), sum(stats.cache_misses.values())
print(len(begun), hits, misses)
"""


@pytest.mark.parametrize(
    ("controllers", "processors", "told"),
    [(0, 2, "0 0 1"), (1, 1, "0 0 1"), (3, 2, "1 1 0")],
)
def test_code_of_the_other_process_is_waited_for_and_read(
    tmp_path, controllers, processors, told
):
    """One process for several controllers; none with one processor."""
    call = CALL.format(controllers=controllers, processors=processors)
    output = subprocess.run(
        [sys.executable, "-c", call],
        capture_output=True,
        text=True,
        timeout=300,
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)},
    )
    assert output.returncode == 0, output.stderr
    assert output.stdout.split() == told.split()


def test_signatures_are_those_of_the_calls():
    """What is compiled ahead is what a humanoid's ticks ask for."""
    import wbc_suite
    from wbc_suite.compiling_ahead import _signature
    from wbc_suite.qp.lower_levels import lower_tick
    from wbc_suite.qp.tick import tick

    env = wbc_suite.make("Lift", robots="GR1", controller_configs="WHOLE_BODY_IK")
    env.reset(seed=0)
    env.step(env.unwrapped.hold_action)
    env.close()
    entries: tuple[Any, ...] = tick, lower_tick
    for entry in entries:
        assert _signature(entry.py_func) in entry.signatures
