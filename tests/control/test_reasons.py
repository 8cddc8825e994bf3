"""Reasons are typed values, computed when they are read, and print as text."""

import copy
import pickle

import pytest

from wbc_suite.control.reasons import (
    Contact,
    InMotion,
    LazyReasons,
    NoSolution,
    TorqueLimit,
    TrackingError,
    is_transient,
)
from wbc_suite.qp import ActiveLimit, Conflict, LimitKind, OutOfReach


def joint_limit(kind):
    return ActiveLimit(
        kind=kind,
        subject="elbow",
        side="upper",
        is_joint=True,
        unit="rad",
        multiplier=1.0,
    )


def test_reasons_are_computed_once_and_copied_as_lists():
    calls = []

    def compute():
        calls.append(True)
        return [InMotion(), OutOfReach()]

    reasons = LazyReasons(compute)
    assert not calls
    assert reasons == [InMotion(), OutOfReach()]
    assert reasons != [InMotion()]
    assert (len(reasons), reasons[0]) == (2, InMotion())
    assert list(reasons[-1:]) == [OutOfReach()]
    assert repr(reasons) == "[InMotion(), OutOfReach()]"
    assert len(calls) == 1
    for twin in (pickle.loads(pickle.dumps(reasons)), copy.deepcopy(reasons)):
        assert isinstance(twin, list)
        assert twin == reasons


@pytest.mark.parametrize(
    ("reason", "text"),
    [
        (Contact("hand", "table", 5.0), "contact: hand - table"),
        (TrackingError("elbow", 0.1), "lag: elbow"),
        (TorqueLimit("elbow", 0.1), "motor limit: elbow"),
        (InMotion(), "moving"),
        (NoSolution(), "no solution"),
        (Conflict("left_hand"), "conflict: left_hand"),
        (joint_limit(LimitKind.POSITION), "joint limit: elbow (upper)"),
    ],
)
def test_reasons_print_as_text(reason, text):
    assert str(reason) == text


def test_motion_and_acceleration_limits_are_transient():
    assert is_transient(InMotion())
    assert is_transient(joint_limit(LimitKind.ACCELERATION))
    assert not is_transient(joint_limit(LimitKind.POSITION))
    assert not is_transient(Contact("hand", "table", 5.0))
