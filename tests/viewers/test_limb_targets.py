import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.control.ik.frame_kinds import FRAME_KINDS as KINDS
from wbc_suite.devices import PipelineConfig
from wbc_suite.devices.action_ports import LimbKind, LimbPort
from wbc_suite.devices.pipeline.limb_pipeline import LimbPipeline
from wbc_suite.viewers.limb_targets import LimbTarget
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
    return LimbTarget(LimbPipeline(port, PipelineConfig(), dt=0.01))


def grabs(held, client, now):
    return held.drag(client, pin.SE3.Identity(), now=now, grab=True)


def test_first_client_keeps_it_until_release():
    held = limb("hand", LimbKind.POSE, pin.SE3.Identity())
    assert not held.drag(1, pin.SE3.Identity(), now=0.0)  # without grabbing it
    assert grabs(held, 1, now=0.0)
    assert not grabs(held, 2, now=1.0)
    held.release(2)
    assert held.holder(2.0) == 1
    held.release(1)
    assert held.holder(2.0) is None
    assert grabs(held, 2, now=3.0)


def test_silent_holder_loses_it_after_the_timeout():
    held = limb("hand", LimbKind.POSE, pin.SE3.Identity())
    held.hold_timeout = 10.0
    assert grabs(held, 1, now=0.0)
    assert held.drag(1, pin.SE3.Identity(), now=9.0)  # a sign of life
    assert not grabs(held, 2, now=18.0)
    assert grabs(held, 2, now=19.5)
    assert not held.drag(1, pin.SE3.Identity(), now=20.0)


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


class Released:
    """A limb that was dragged out of reach and let go; it moves at a speed, m/s."""

    def __init__(self, away, turn=0.0):
        self.place = pin.SE3.Identity()
        port = LimbPort(
            name="x",
            kind=LimbKind.POSE,
            body=-1,
            measure=lambda: self.place.copy(),
            encode=lambda target: values(LimbKind.POSE, target),
            decode=lambda values: self.place.copy(),
        )
        self.limb = LimbTarget(LimbPipeline(port, PipelineConfig(), dt=0.01))
        far = pin.SE3(pin.exp3(np.array([0, 0, turn])), np.array([away, 0.0, 0.0]))
        self.limb.stages.place(far)
        assert self.limb.drag(1, far, now=0.0, grab=True)
        self.limb.stages.place(far)
        self.limb.release(1)

    def settle(self, seconds, speed=0.0, report=None):
        """Let ticks pass; return the time at which the target came back, or None."""
        for k in range(round(seconds / 0.01)):
            before = self.limb.status(report or {}, now=0.0)
            self.place.translation += np.array([0.0, 0.01 * speed, 0.0])
            self.limb.settle(before, period=0.01, now=0.0)
            if np.allclose(self.limb.stages.clutch.target, self.place):
                return 0.01 * (k + 1)
        return None


def test_a_target_out_of_reach_comes_back_when_its_limb_has_rested_for_0_4_s():
    assert Released(away=0.5).settle(1.0) == pytest.approx(0.41)
    assert Released(away=0.0, turn=0.5).settle(1.0) == pytest.approx(0.41)


@pytest.mark.parametrize(("speed", "back"), [(0.019, 0.41), (0.021, None)])
def test_a_limb_rests_below_2_cm_per_second(speed, back):
    assert Released(away=0.5).settle(1.0, speed) == (back and pytest.approx(back))


def test_a_limb_that_moves_on_rests_anew():
    released = Released(away=0.5)
    assert released.settle(0.3) is None
    assert released.settle(0.05, speed=0.1) is None
    assert released.settle(1.0) == pytest.approx(0.41)


@pytest.mark.parametrize(
    ("away", "turn", "back"),
    [(0.029, 0.0, False), (0.031, 0.0, True), (0.0, 0.19, False), (0.0, 0.21, True)],
)
def test_a_target_that_is_near_stays(away, turn, back):
    assert (Released(away=away, turn=turn).settle(1.0) is not None) == back


def test_a_target_stays_where_the_controller_reports_it_as_reached_or_it_is_held():
    released = Released(away=0.5)
    assert released.settle(1.0, report={"reached": True}) is None
    assert released.limb.rest is None
    held = Released(away=0.5)
    assert held.limb.drag(2, held.place, now=0.0, grab=True)
    assert held.settle(1.0) is None
    assert Released(away=0.5).settle(1.0, report={"reached": False}) is not None


@pytest.mark.parametrize(
    ("T", "valid"),
    [
        (pin.SE3(np.eye(3), np.array([999.0, 0, 0])), True),
        (pin.SE3(np.eye(3), np.array([0, -1001.0, 0])), False),
        (pin.SE3(np.eye(3), np.array([0, np.nan, 0])), False),
        (pin.SE3(np.full((3, 3), np.inf), np.zeros(3)), False),
    ],
)
def test_poses_that_cannot_be_take_no_limb(T, valid):
    target = limb("x", LimbKind.POSE, pin.SE3.Identity())
    assert target.drag(1, T, now=0.0, grab=True) == valid
    assert target.holder(0.0) == (1 if valid else None)
