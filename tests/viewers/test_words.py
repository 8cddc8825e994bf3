import pinocchio as pin
import pytest

from wbc_suite.viewers.snapshot import LimbStatus
from wbc_suite.viewers.words import describe_reason, explain


def status(**changes):
    values = {
        "measured": pin.SE3.Identity(),
        "target": pin.SE3.Identity(),
        "position_error": 0.062,
        "orientation_error": 0.0,
        "reached": False,
        "reasons": (),
        "holder": None,
        "enabled": True,
        "acting": (),
    }
    return LimbStatus(**(values | changes))


@pytest.mark.parametrize(
    ("reason", "words"),
    [
        (
            "joint limit: right_elbow_pitch_joint (upper)",
            "right elbow pitch is at its upper limit",
        ),
        ("joint limit: arm_1_joint", "arm 1 is at its limit"),
        ("velocity limit: waist_yaw_joint (lower)", "waist yaw is at its top speed"),
        ("self-collision: right_forearm - torso", "right forearm would touch torso"),
        ("floor: arm_link_fngr", "arm link fngr would touch the floor"),
        ("conflict: left_hand", "it pulls against left hand"),
        ("contact: left_pad - table", "left pad presses on table"),
        ("motor limit: waist_yaw_joint", "waist yaw has no more force"),
        ("lag: waist_yaw_joint", "waist yaw lags behind"),
        ("something new", "something new"),
    ],
)
def test_reasons_read_as_sentences(reason, words):
    assert describe_reason(reason) == words


def test_explanation_says_how_far_and_why():
    why = explain(status(reasons=("conflict: left_hand",)))
    assert why == "6 cm short: it pulls against left hand"


def test_turn_that_is_missing_is_told_in_degrees():
    why = explain(status(position_error=0.0, orientation_error=0.5))
    assert why == "29° short: out of reach"


def test_nothing_is_explained_when_all_is_well():
    on_its_way = ("moving", "acceleration limit: b (lower)")
    assert explain(status(reasons=on_its_way)) == ""
    assert explain(status(reasons=("moving",))) == ""
    assert explain(status(position_error=0.002, reasons=("out of reach",))) == ""
    assert explain(status(reached=True, reasons=("velocity limit: x",))) == ""
