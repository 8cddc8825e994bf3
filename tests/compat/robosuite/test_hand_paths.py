"""The hand's path under robosuite's part controllers, beside robosuite's own."""

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

HERE = Path(__file__).with_name("hand_paths.py")
PEER = Path(__file__).parents[3] / ".venv-robosuite" / "bin" / "python"

_spec = importlib.util.spec_from_file_location("hand_paths", HERE)
hand_paths = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(hand_paths)

AWAY = 0.04
"""Greatest distance of the two paths, as a share of their length; measured: 1.4 % for
torques in operational space and of joints, 3.0 % for positions of joints."""


def run(python, *arguments, **environment):
    done = subprocess.run(
        [str(python), str(HERE), *arguments],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, **environment},
    )
    lines = [x for x in done.stdout.splitlines() if x.startswith("FOUND")]
    assert lines, done.stderr[-2000:]
    found = json.loads(lines[0].removeprefix("FOUND"))
    return {case: np.array(path) - path[0] for case, path in found.items()}


@pytest.fixture(scope="module")
def ours():
    return run(sys.executable, "--here")


@pytest.fixture(scope="module")
def theirs():
    if not PEER.exists():
        pytest.skip("there is no .venv-robosuite")
    return run(PEER, PYTHONPATH="")


@pytest.mark.sample(2)
@pytest.mark.peer
@pytest.mark.parametrize("case", hand_paths.CASES)
def test_path_is_that_of_robosuite(ours, theirs, case):
    length = np.linalg.norm(np.diff(theirs[case], axis=0), axis=1).sum()
    away = np.linalg.norm(ours[case] - theirs[case], axis=1).max()
    assert away / length < AWAY


@pytest.mark.slow
def test_paths_move_as_the_actions_say(ours):
    one = ours["OSC_POSE one axis"]
    assert one[-1, 1] > 0.08  # 20 steps of 0.5 * 0.05 m, less the lag of kp = 150
    assert np.abs(one[:, [0, 2]]).max() < 0.01
    sides = ours["OSC_POSE coupled"][-1]
    assert np.sign(sides).tolist() == [1.0, -1.0, 1.0]


@pytest.mark.slow
def test_uncoupled_motion_is_disturbed_more_by_rotation_than_coupled(ours):
    wanted = np.array(hand_paths.ARM[:3])
    wanted /= np.linalg.norm(wanted)

    def aside(case):
        end = ours[case][-1]
        return np.linalg.norm(end - (end @ wanted) * wanted) / np.linalg.norm(end)

    assert aside("OSC_POSITION") < aside("OSC_POSE coupled") < aside("OSC_POSE")
