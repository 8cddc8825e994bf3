"""Every gripper that can grip picks a cube from a table and holds it when shaken.

`grasp_rig.py` says how, and tries one gripper by hand.
"""

import numpy as np
import pytest
from grasp_rig import CUBE, LIFT, GraspRig

import wbc_suite
from wbc_suite.catalogue import Catalogue

QUICK = "panda_gripper"
SLIP = 0.003  # m; what is held creeps 0.2 mm, what slips is gone
TURN = 0.05  # rad
DEPTH = 0.0015  # m, a rubber pad's; deeper is held by interpenetration
FORCE = 2.0  # N, of all fingers; the cube's weight and shaking are 1.5 N


def can_grip(name):
    """Whether a gripper opens and closes by one command; hands follow."""
    return (
        sum(map(len, wbc_suite.load_robot(f"gripper/{name}").synergies.values())) == 1
    )


GRIPPERS = [
    pytest.param(name, marks=() if name == QUICK else pytest.mark.slow)
    for name in Catalogue().names("robots/gripper")
    if can_grip(name)
]


@pytest.mark.parametrize("name", GRIPPERS)
def test_gripper_picks_a_cube_and_holds_it_when_shaken(name):
    rig = GraspRig(name)
    rig.grip()
    for axis in np.eye(3):
        rig.shake(axis, seconds=2.0)
    hold = rig.result()
    assert "table" not in hold.links
    assert len(hold.links) >= 2, f"only {set(hold.links)} touch the cube"
    assert hold.clearance == pytest.approx(LIFT, abs=CUBE)
    assert hold.force > FORCE
    assert hold.slip < SLIP
    assert hold.turn < TURN
    assert hold.depth < DEPTH
