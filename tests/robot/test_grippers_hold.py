"""Every gripper picks a cube from a table and holds it when shaken; hands a can too.

`grasp_rig.py` implements the test, and runs it for one gripper from the shell.
"""

import numpy as np
import pytest
from grasp_rig import CAN, CUBE, LIFT, GraspRig

import wbc_suite
from wbc_suite.catalogue import Catalogue

QUICK = "panda_gripper"
SLIP = 0.003  # m; what is held creeps 0.2 mm in a jaw and 1 mm between fingertips
TURN = 0.05  # rad
DEPTH = 0.0015  # m, a rubber pad's; deeper is held by interpenetration
FORCE = 2.0  # N, of all fingers; the cube's weight and shaking are 1.5 N
SETTLE = 0.01  # m; a can comes to rest against the palm
LEAN = 0.2  # rad


def can_grip(name):
    """Whether a gripper has anything that opens and closes."""
    return bool(wbc_suite.load_robot(f"gripper/{name}").synergies)


def is_hand(name):
    """Whether a gripper has three fingers or more."""
    return name.endswith("_hand") or "three_finger" in name


NAMES = Catalogue().names("robots/gripper")
GRIPPERS = [
    pytest.param(name, marks=() if name == QUICK else pytest.mark.slow)
    for name in NAMES
    if can_grip(name)
]


def shaken(name, held):
    """Return how a gripper holds an object after picking and shaking it."""
    rig = GraspRig(name, held)
    rig.grip()
    for axis in np.eye(3):
        rig.shake(axis)
    hold = rig.result()
    assert not hold.links & {"table", "world"}, f"lost: {hold}"
    assert hold.rise == pytest.approx(LIFT, abs=0.02)
    assert hold.force > FORCE
    assert hold.depth < DEPTH
    return hold


@pytest.mark.slow
@pytest.mark.parametrize("name", GRIPPERS)
def test_gripper_picks_a_cube_and_holds_it_when_shaken(name):
    hold = shaken(name, CUBE)
    assert len(hold.links) >= 2, f"only {set(hold.links)} touch the cube"
    assert hold.slip < SLIP
    assert hold.turn < TURN


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in NAMES if is_hand(name)])
def test_hand_closes_around_a_can_and_holds_it_when_shaken(name):
    hold = shaken(name, CAN)
    assert len(hold.links) >= 3, f"only {set(hold.links)} touch the can"
    assert hold.slip < SETTLE
    assert hold.turn < LEAN


def test_a_slippery_cube_is_lost():
    """Otherwise the rig would hold objects by something other than friction."""
    rig = GraspRig(QUICK)
    rig.model.geom_friction[:, 0] = 0.005
    rig.grip()
    assert rig.result().rise < LIFT / 2
