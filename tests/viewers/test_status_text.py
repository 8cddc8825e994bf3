import pinocchio as pin
import pytest

from wbc_suite.control.reasons import (
    Contact,
    InMotion,
    NoSolution,
    TorqueLimit,
    TrackingError,
)
from wbc_suite.qp import ActiveLimit, Conflict, LimitKind, LinkPair, OutOfReach
from wbc_suite.viewers.session_state import LimbStatus
from wbc_suite.viewers.status_text import describe_reason, explain


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
        "moved": True,
    }
    return LimbStatus(**(values | changes))


def limit(kind, subject, side="upper"):
    return ActiveLimit(
        kind=kind,
        subject=subject,
        side=side,
        is_joint=isinstance(subject, str),
        unit="rad",
        multiplier=1.0,
    )


@pytest.mark.parametrize(
    ("reason", "words"),
    [
        (
            limit(LimitKind.POSITION, "right_elbow_pitch_joint"),
            "right elbow pitch is at its upper limit",
        ),
        (
            limit(LimitKind.POSITION, "arm_1_joint", "lower"),
            "arm 1 is at its lower limit",
        ),
        (
            limit(LimitKind.VELOCITY, "waist_yaw_joint"),
            "waist yaw is at its velocity limit",
        ),
        (
            limit(LimitKind.SELF_COLLISION, LinkPair("right_forearm", "torso")),
            "right forearm would touch torso",
        ),
        (
            limit(LimitKind.FLOOR, "arm_link_fngr"),
            "arm link fngr would touch the floor",
        ),
        (Conflict("left_hand"), "conflict with left hand"),
        (Contact("left_pad", "table", 5.0), "left pad presses on table"),
        (
            TorqueLimit("waist_yaw_joint", 0.1),
            "waist yaw is at its torque limit",
        ),
        (
            TrackingError("waist_yaw_joint", 0.1),
            "waist yaw lags behind its target",
        ),
        (OutOfReach(), "out of reach"),
        (NoSolution(), "no solution"),
    ],
)
def test_reasons_read_as_sentences(reason, words):
    assert describe_reason(reason) == words


def test_explanation_says_how_far_and_why():
    why = explain(status(reasons=(Conflict("left_hand"),)))
    assert why == "6 cm short: conflict with left hand"


def test_a_limb_that_nobody_moved_is_not_explained():
    assert explain(status(moved=False, reasons=(Conflict("left_hand"),))) == ""


def test_turn_that_is_missing_is_told_in_degrees():
    why = explain(status(position_error=0.0, orientation_error=0.5))
    assert why == "29° short: out of reach"


def test_nothing_is_explained_when_all_is_well():
    on_its_way = (InMotion(), limit(LimitKind.ACCELERATION, "b"))
    assert explain(status(reasons=on_its_way)) == ""
    assert explain(status(reasons=(InMotion(),))) == ""
    assert explain(status(position_error=0.002, reasons=(OutOfReach(),))) == ""
    assert (
        explain(status(reached=True, reasons=(limit(LimitKind.VELOCITY, "x"),))) == ""
    )
