import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.control.composite.frame_kinds import FRAME_KINDS as KINDS
from wbc_suite.devices import PipelineConfig
from wbc_suite.devices.action_ports import LimbKind, LimbPort
from wbc_suite.devices.pipeline.limb_pipeline import LimbPipeline
from wbc_suite.viewers.limb_targets import LimbTarget, Ownership
from wbc_suite.viewers.session_state import LimbInfo

FRAME_KINDS = {
    LimbKind.POSE: "pose",
    LimbKind.POSITION: "position",
    LimbKind.ORIENTATION: "orientation",
    LimbKind.PLANAR: "base",
}


def values(kind, T):
    return KINDS[FRAME_KINDS[kind]].values(T)


def limb(name, kind, T):
    port = LimbPort(
        name=name,
        kind=kind,
        body=-1,
        measure=lambda: T,
        encode=lambda target: values(kind, target),
        decode=lambda values: T,
    )
    return LimbTarget(LimbPipeline(port, PipelineConfig(), dt=0.01), Ownership())


def test_first_client_keeps_it_until_release():
    ownership = Ownership(timeout=10)
    assert ownership.take(1, now=0.0)
    assert not ownership.take(2, now=1.0)
    assert not ownership.release(2)
    assert ownership.holder(2.0) == 1
    assert ownership.release(1)
    assert ownership.take(2, now=3.0)


def test_silent_holder_loses_it_after_the_timeout():
    ownership = Ownership(timeout=10)
    ownership.take(1, now=0.0)
    ownership.take(1, now=9.0)  # a sign of life
    assert not ownership.take(2, now=18.0)
    assert ownership.take(2, now=19.5)
    assert not ownership.take(1, now=20.0)


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        (LimbKind.POSE, [1, 2, 3, 0, 0, 0.5]),
        (LimbKind.POSITION, [1, 2, 3]),
        (LimbKind.ORIENTATION, [0, 0, 0.5]),
        (LimbKind.PLANAR, [1, 2, 0.5]),
    ],
)
def test_command_holds_what_the_kind_commands(kind, expected):
    T = pin.SE3(pin.exp3(np.array([0, 0, 0.5])), np.array([1.0, 2.0, 3.0]))
    np.testing.assert_allclose(values(kind, T), expected, atol=1e-12)


def test_limbs_have_titles_for_people():
    titles = {
        name: LimbInfo(name=name, kind=LimbKind.POSE, body=-1).title
        for name in ("right_hand", "com")
    }
    assert titles == {"right_hand": "Right hand", "com": "Centre of mass"}


def test_shown_target_takes_what_is_not_commanded_from_the_measured_pose():
    T = pin.SE3(pin.exp3(np.array([0, 0, 0.5])), np.array([1.0, 2.0, 3.0]))
    measured = pin.SE3.Identity()
    seen = {kind: limb("x", kind, T).shown_target(measured) for kind in LimbKind}
    assert seen[LimbKind.POSE] == T
    assert seen[LimbKind.POSITION] == pin.SE3(np.eye(3), T.translation)
    assert seen[LimbKind.ORIENTATION] == pin.SE3(T.rotation, np.zeros(3))
    assert seen[LimbKind.PLANAR] == pin.SE3(T.rotation, np.array([1.0, 2.0, 0.0]))
