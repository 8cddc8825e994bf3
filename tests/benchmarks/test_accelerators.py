"""mujoco_warp and MJX take exported models and step them as MuJoCo does, on the CPU."""

import pytest
from harness.engines import PYTHON, step_in, write_models

import wbc_suite
from wbc_suite.registration import WITH_ID

CONTACT = 1e-2
"""Greatest difference of positions after 100 steps in contact, m or rad: the
solvers of float32 and float64 stop at other places."""
EXACT = ("Door", "Lift", "TwoArmPegInHole", "Wipe")
"""Where nothing touches, or a cube rests."""
ROBOTS = ("GR1", "SpotWithArm", "Tiago")
CASES = (*WITH_ID, *(f"Lift-{robot}" for robot in ROBOTS))

pytestmark = [
    *(pytest.mark.peer, pytest.mark.slow),
    pytest.mark.skipif(
        not PYTHON.exists(), reason="not installed: make .venv-accelerators/.installed"
    ),
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Both variants of every case, with the state after the first action."""
    out = tmp_path_factory.mktemp("models")
    for case in CASES:
        name, _, robot = case.partition("-")
        env = wbc_suite.make(name, **({"robots": robot} if robot else {}))
        write_models(env.unwrapped, out, case)
        env.close()
    return out


@pytest.mark.sweep
def test_mujoco_warp_steps_every_benchmark_as_mujoco(folder):
    found = step_in("warp", folder, CASES, steps=100, timeout=1800)
    assert set(found) == set(CASES)
    refused = {name: why for name, why in found.items() if isinstance(why, str)}
    assert refused == {}
    assert max(away["all"] for away in found.values()) < CONTACT, found
    assert max(away["apart"] for away in found.values()) < 1e-3, found
    assert max(found[name]["all"] for name in EXACT) < 1e-5  # float32 beside float64


@pytest.mark.sweep
def test_mjx_takes_the_accelerator_variant_of_every_benchmark(folder):
    found = step_in("mjx", folder, CASES, steps=0, timeout=1800)
    assert found == {case: {"apart": 0.0, "all": 0.0} for case in CASES}


@pytest.mark.sample(1)
@pytest.mark.parametrize("case", ["Lift", "Lift-GR1", "WalkTo"])
def test_mjx_steps_as_mujoco(folder, case):
    """With as many contacts as bodies could have: 998 in Lift, 5,005 with GR1."""
    found = step_in("mjx", folder, [case], steps=100, timeout=1800)[case]
    assert found["apart"] < 1e-3
    assert found["all"] < CONTACT
