import threading
import time
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest
from fake_env import REACH, FakeEnv, upper_limit

from wbc_suite.cli.teleop import stages_of
from wbc_suite.devices import DeviceState, LimbInput, Scripted
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.viewers.limb_targets import HOLD_TIMEOUT
from wbc_suite.viewers.scene_setup import limb_colours
from wbc_suite.viewers.status_text import (
    limbs_html,
    status_html,
    task_html,
    timing_text,
)
from wbc_suite.viewers.teleop_session import TeleopSession

ALICE, BOB = 1, 2
PATIENCE = 120.0  # s; on a busy machine a thread starts late, or compiles first


@pytest.fixture
def session():
    return TeleopSession(FakeEnv(), period=0.02)


def shifted(pose, *offset):
    return pin.SE3(pose.rotation, pose.translation + np.array(offset))


class Clock:
    """A clock that `ticks` advances by a period at each tick."""

    now = 0.0

    def __call__(self):
        return self.now


def ticks(session, n):
    for _ in range(n):
        session.tick()
        if isinstance(session._clock, Clock):
            session._clock.now += session.period


def error(session, name="right_hand"):
    return session.snapshot.limbs[name].position_error


def test_hands_stay_where_they_are_until_somebody_moves_them(session):
    before = session.snapshot.limbs["right_hand"].measured
    ticks(session, 5)
    np.testing.assert_allclose(
        session.snapshot.limbs["right_hand"].measured.translation, before.translation
    )


def test_hand_follows_the_drag(session):
    start = session.snapshot.limbs["right_hand"].measured
    gizmo = shifted(start, 0.5, 0.5, 0.5)  # a gizmo need not be at the hand
    assert session.grab("right_hand", ALICE, gizmo)
    assert session.drag("right_hand", ALICE, shifted(gizmo, 0.0, -0.1, 0.15))
    ticks(session, 60)  # a third of what is left, every tick
    moved = session.snapshot.limbs["right_hand"].measured.translation
    np.testing.assert_allclose(moved - start.translation, [0, -0.1, 0.15], atol=1e-9)
    other = session.snapshot.limbs["left_hand"]
    assert other.position_error < 1e-9


def test_target_does_not_jump_when_the_clutch_comes_in_again(session):
    hand = session.snapshot.limbs["right_hand"].target
    session.grab("right_hand", ALICE, hand)
    session.drag("right_hand", ALICE, shifted(hand, 0, 0, 0.1))
    session.release("right_hand", ALICE)
    ticks(session, 20)
    before = session.snapshot.limbs["right_hand"].target
    session.enable("right_hand", False)
    elsewhere = shifted(hand, 0.3, -0.2, 0.1)
    session.grab("right_hand", ALICE, hand)
    session.drag("right_hand", ALICE, elsewhere)  # out: the gizmo moves alone
    session.tick()
    session.enable("right_hand", True)
    session.drag("right_hand", ALICE, elsewhere)  # in, in the middle of a drag
    session.tick()
    after = session.snapshot.limbs["right_hand"].target
    assert np.linalg.norm(after.translation - before.translation) < 1e-3
    session.drag("right_hand", ALICE, shifted(elsewhere, 0, 0.05, 0))
    session.tick()
    moved = session.snapshot.limbs["right_hand"].target.translation
    np.testing.assert_allclose(moved - after.translation, [0, 0.05, 0], atol=1e-9)


def test_unreachable_target_is_explained_and_does_not_wind_up(session):
    hand = session.snapshot.limbs["right_hand"].target
    session.grab("right_hand", ALICE, hand)
    session.drag("right_hand", ALICE, shifted(hand, 2.0, 0, 0))
    ticks(session, 80)
    status = session.snapshot.limbs["right_hand"]
    assert not status.reached
    assert status.reasons == (upper_limit("right_elbow_pitch_joint"),)
    held = status.target.translation
    session.release("right_hand", ALICE)
    session.tick()
    kept = session.snapshot.limbs["right_hand"].target.translation
    np.testing.assert_array_equal(kept, held)  # it might still be on its way
    ticks(session, 90)
    status = session.snapshot.limbs["right_hand"]
    assert status.position_error < 1e-6
    assert np.linalg.norm(status.target.translation - [0, 0, 0.9]) < REACH + 1e-6


def test_target_that_nobody_touched_stays_when_its_limb_is_dragged_off(session):
    held = session.snapshot.limbs["left_hand"].target
    session.tick()
    session.env.data.qpos[7:10] += [2.0, 0, 0]  # far out, by no command
    ticks(session, 60)
    status = session.snapshot.limbs["left_hand"]
    np.testing.assert_array_equal(status.target.translation, held.translation)


def test_clients_cannot_fight_over_a_limb(session):
    hand = session.snapshot.limbs["right_hand"].target
    assert session.grab("right_hand", ALICE, hand)
    assert not session.grab("right_hand", BOB, hand)
    assert not session.drag("right_hand", BOB, shifted(hand, 0, 0, -0.4))
    session.release("right_hand", BOB)
    session.tick()
    assert session.snapshot.limbs["right_hand"].holder == ALICE
    assert error(session) < 1e-9
    session.leave(ALICE)
    assert session.grab("right_hand", BOB, hand)


def test_client_that_went_silent_lets_go_and_has_to_grab_again():
    session = TeleopSession(FakeEnv(), period=0.02, clock=Clock())
    hand = session.snapshot.limbs["right_hand"].target
    session.grab("right_hand", ALICE, hand)
    session.drag("right_hand", ALICE, shifted(hand, 0, 0, 0.1))
    ticks(session, round((HOLD_TIMEOUT + 1.0) / 0.02))  # its connection is stuck
    status = session.snapshot.limbs["right_hand"]
    assert status.holder is None
    assert not session.drag("right_hand", ALICE, shifted(hand, 0, 0, -0.3))
    ticks(session, 5)
    np.testing.assert_array_equal(
        session.snapshot.limbs["right_hand"].target.translation,
        status.target.translation,
    )
    assert session.grab("right_hand", BOB, hand)


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e300])
def test_invalid_input_moves_nothing_and_takes_nothing(session, value):
    hand = session.snapshot.limbs["right_hand"].target
    far = pin.SE3(hand.rotation, np.full(3, value))
    assert not session.grab("right_hand", ALICE, far)
    assert session.snapshot.limbs["right_hand"].holder is None
    assert session.grab("right_hand", ALICE, hand)
    assert not session.drag("right_hand", ALICE, far)
    turned = pin.SE3(np.full((3, 3), np.nan), hand.translation)
    assert not session.drag("right_hand", ALICE, turned)
    session.set_gripper("right_gripper", 0, value)
    ticks(session, 3)
    target = session.snapshot.limbs["right_hand"].target
    np.testing.assert_array_equal(target.translation, hand.translation)
    assert np.isfinite(session.env.actions).all()


def test_gripper_value_reaches_the_action(session):
    session.tick()
    assert session.env.actions[-1][12:].tolist() == [-1, -1]
    session.set_gripper("right_gripper", 1, 0.25)
    ticks(session, 80)
    np.testing.assert_allclose(session.env.actions[-1][12:], [-1, 0.25], atol=1e-9)


def test_reset_brings_hands_and_targets_back(session):
    hand = session.snapshot.limbs["right_hand"].target
    session.grab("right_hand", ALICE, hand)
    session.drag("right_hand", ALICE, shifted(hand, 0, 0, 0.3))
    session.set_gripper("right_gripper", 0, 1.0)
    ticks(session, 10)
    session.reset()
    session.tick()
    assert session.env.actions[-1][12:].tolist() == [-1, -1]
    status = session.snapshot.limbs["right_hand"]
    np.testing.assert_allclose(status.target.translation, hand.translation, atol=1e-9)
    assert session.snapshot.epoch == 1
    assert error(session) < 1e-9


def test_nothing_moves_while_paused(session):
    session.pause(ALICE, True)
    ticks(session, 3)
    assert session.env.actions == []
    assert session.snapshot.paused
    session.pause(ALICE, False)
    session.tick()
    assert len(session.env.actions) == 1


def test_only_who_paused_resumes_and_anybody_after_they_have_left(session):
    assert session.pause(ALICE, True)
    assert session.pause(BOB, True)
    assert not session.pause(BOB, False)
    ticks(session, 2)
    assert session.snapshot.paused_by == ALICE
    session.leave(BOB)
    session.leave(ALICE)
    ticks(session, 2)
    assert (session.snapshot.paused, session.snapshot.paused_by) == (True, None)
    assert session.env.actions == []
    assert session.pause(BOB, False)
    ticks(session, 2)
    assert len(session.env.actions) == 2


def test_key_that_is_held_through_a_pause_does_not_drive_after_it(session):
    session.drive(ALICE, np.zeros(4))
    session.pause(BOB, True)
    session.drive(ALICE, np.array([1.0, 0.0, 0.0, 0.0]))
    session.tick()
    session.pause(BOB, False)
    session.drive(ALICE, np.array([1.0, 0.0, 0.0, 0.0]))
    session.tick()
    assert session.snapshot.drive_waits


def test_latency_counts_from_input_to_the_end_of_its_step():
    now = [0.0]
    env = FakeEnv()
    session = TeleopSession(env, period=0.02, clock=lambda: now[0])
    hand = session.snapshot.limbs["right_hand"].target
    session.grab("right_hand", ALICE, hand)
    session.drag("right_hand", ALICE, hand)
    now[0] = 0.007
    session.drag("right_hand", ALICE, hand)
    now[0] = 0.030
    session.tick()
    np.testing.assert_allclose(session.latencies(), [0.03, 0.023])
    session.tick()
    assert len(session.latencies()) == 2


def test_step_time_is_that_of_a_step_and_overruns_are_counted_apart():
    """At 100 Hz; the sixth step takes 35 ms, all others 2."""
    clock = Clock()
    env = FakeEnv()
    step, taken = env.step, iter([0.002] * 5 + [0.035] + [0.002] * 4)

    def slow(action):
        clock.now += next(taken)
        return step(action)

    env.step = slow
    session = TeleopSession(env, period=0.01, clock=clock)
    session.timer._sleep = lambda seconds: setattr(clock, "now", clock.now + seconds)
    session.timer.start()
    for k in range(10):
        session.tick()
        session.timer.finish_step()
        if k == 4:
            assert session.snapshot.step_time == pytest.approx(0.002)
            assert session.snapshot.step_period == pytest.approx(0.010)
    snapshot = session.snapshot
    assert (snapshot.overruns, snapshot.skipped) == (1, 2)
    assert 0.002 < snapshot.step_time < 0.004
    assert 0.010 < snapshot.step_period < 0.012
    text = status_html(snapshot, session.info, limb_colours(session.limbs))
    assert "1 (2 skipped)" in text
    assert timing_text(snapshot).endswith("1 overruns, 2 periods skipped.")


def test_loop_runs_in_its_own_thread_and_stops(session):
    session.start()
    deadline = time.monotonic() + PATIENCE
    while session.snapshot.tick < 5 and time.monotonic() < deadline:
        time.sleep(0.01)
    session.stop()
    assert session.snapshot.tick >= 5
    assert "teleop" not in [t.name for t in threading.enumerate()]


def test_physics_that_gives_up_starts_again_and_says_so(session):
    step = session.env.step

    def broken(action):
        *rest, _ = step(action)
        return *rest, {"physics_error": "unstable"}

    session.env.step = broken
    session.tick()
    session.env.step = step
    assert session.snapshot.epoch == 1
    assert "unstable" in session.snapshot.message
    session.tick()
    assert error(session) < 1e-9


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_error_in_the_loop_ends_it_and_says_so(session):
    def broken(_):
        raise RuntimeError("no more")

    session.env.step = broken
    session.start()
    deadline = time.monotonic() + PATIENCE
    while not session.snapshot.message and time.monotonic() < deadline:
        time.sleep(0.01)
    session.stop()
    assert "Stopped by an error" in session.snapshot.message


def test_loop_survives_a_device_that_fails_and_says_why():
    class Faulty(Scripted):
        def read(self):
            if 3 <= len(told) < 20:
                told.append(None)
                raise OSError("unplugged")
            told.append(super().read())
            return told[-1]

    told = []
    says = [
        DeviceState(
            time=0.02 * k,
            limbs={"left": LimbInput(twist=np.array([0, 0, speed, 0, 0, 0]))},
        )
        for k, speed in enumerate([0.1] * 7 + [0.0] + [0.1] * 10, start=1)
    ]
    session = TeleopSession(FakeEnv(), period=0.02, device=Faulty(says), clock=Clock())
    ticks(session, 5)
    assert session.snapshot.device[0] == "device error: unplugged"
    ticks(session, 10)
    held = session.snapshot.limbs["left_hand"].target.translation
    ticks(session, 2)
    assert session.snapshot.limbs["left_hand"].target.translation == pytest.approx(held)
    ticks(session, 7)  # it works again, but its key is still held
    assert session.snapshot.limbs["left_hand"].target.translation == pytest.approx(held)
    assert "released first" in session.snapshot.device[0]
    ticks(session, 5)  # it was released and pressed again
    assert session.snapshot.device == ()
    assert session.snapshot.limbs["left_hand"].target.translation[2] > held[2]
    assert np.isfinite(session.env.actions).all()


def test_loop_survives_an_input_that_causes_an_error(session):
    def broken(*_):
        raise FloatingPointError("worse than NaN")

    update, session._pipeline.update = session._pipeline.update, broken
    session.tick()
    assert session.snapshot.message == "An input was refused: worse than NaN"
    np.testing.assert_array_equal(session.env.actions[-1], session.env.hold_action)
    session._pipeline.update = update
    session.tick()
    assert error(session) < 1e-9


@pytest.mark.parametrize("field", ["twist", "fingers"])
def test_arrays_of_a_wrong_shape_are_refused_where_they_come_in(field):
    with pytest.raises(ValueError, match=r"has shape \(2,\)"):
        LimbInput(**{field: np.zeros(2)})
    with pytest.raises(ValueError, match=r"has shape \(2,\)"):
        DeviceState(time=0.0, base=np.zeros(2))


@pytest.mark.parametrize("device", ["stream", "SpaceMouse", "my:Device"])
@pytest.mark.parametrize("jump", ["position", "angle"])
def test_headset_that_loses_track_moves_no_hand(device, jump):
    """With the stages of the command line: the pose jumps by 0.5 m, or by 120 deg."""
    offset = pin.SE3(np.eye(3), np.array([0.5, 0.0, 0.0]))
    if jump == "angle":
        offset = pin.SE3(pin.exp3(np.array([0.0, 0.0, 2.1])), np.zeros(3))
    poses = [pin.SE3.Identity()] * 150 + [offset] * 50
    says = [
        DeviceState(time=0.02 * k, limbs={"right": LimbInput(pose=pose)})
        for k, pose in enumerate(poses)
    ]
    stages = stages_of(device, scale=1.0, mirror=False)
    session = TeleopSession(
        FakeEnv(), period=0.02, device=Scripted(says), pipeline=stages
    )
    start = session.snapshot.limbs["right_hand"].measured
    moved = turned = 0.0
    for _ in poses:
        session.tick()
        now = session.snapshot.limbs["right_hand"].measured
        moved = max(moved, np.linalg.norm(now.translation - start.translation))
        turned = max(turned, np.linalg.norm(pin.log3(start.rotation.T @ now.rotation)))
    assert moved < 1e-3
    assert turned < 1e-3


def test_drags_of_the_page_in_long_steps_count_beside_a_device():
    device = Scripted([DeviceState(time=0.0)])
    stages = stages_of("stream", scale=1.0, mirror=False)
    session = TeleopSession(FakeEnv(), period=0.02, device=device, pipeline=stages)
    start = session.snapshot.limbs["right_hand"].target
    session.grab("right_hand", ALICE, start)
    far = pin.SE3(start.rotation, start.translation - [0.0, 0.0, 0.4])
    session.drag("right_hand", ALICE, far)
    ticks(session, 150)
    moved = (
        session.snapshot.limbs["right_hand"].measured.translation - start.translation
    )
    assert moved[2] == pytest.approx(-stages.leash.distance, abs=1e-3)


def test_page_takes_a_limb_over_from_a_device_that_went_silent():
    says = [
        DeviceState(time=0.02 * k, limbs={"right": LimbInput(pose=pin.SE3.Identity())})
        for k in range(20)
    ]
    stages = stages_of("stream", scale=1.0, mirror=False)
    session = TeleopSession(
        FakeEnv(),
        period=0.02,
        device=Scripted(says),
        pipeline=stages.model_copy(update={"return_after": 10.0}),
        clock=Clock(),
    )
    ticks(session, 200)
    start = session.snapshot.limbs["right_hand"].target
    session.grab("right_hand", ALICE, start)
    for k in range(600):  # longer than the time after which the limb would move home
        lower = start.translation - [0.0, 0.0, min(0.2, 0.002 * k)]
        session.drag("right_hand", ALICE, pin.SE3(start.rotation, lower))
        ticks(session, 1)
    moved = (
        session.snapshot.limbs["right_hand"].measured.translation - start.translation
    )
    assert moved[2] == pytest.approx(-0.2, abs=0.01)


def test_controller_that_takes_no_world_targets_is_refused():
    env = FakeEnv()
    env.controllers[0].config.input_type = "delta"
    with pytest.raises(ConfigError, match=r"absolute.*not .* with 'delta'"):
        TeleopSession(env, period=0.02)


def test_unknown_limb_is_named_with_the_nearest_one(session):
    with pytest.raises(UnknownNameError, match="Did you mean 'right_hand'"):
        session.grab("right_hnd", ALICE, pin.SE3.Identity())


def test_device_moves_a_hand_beside_the_page_and_presses_buttons():
    up = LimbInput(twist=np.array([0, 0, 0.2, 0, 0, 0]))
    says = [DeviceState(time=float(k), limbs={"left": up}) for k in range(1, 40)]
    last = DeviceState(time=99.0, buttons=frozenset({"pause"}))
    session = TeleopSession(
        FakeEnv(), period=0.02, device=Scripted([*says, last]), clock=Clock()
    )
    start = session.snapshot.limbs["left_hand"].measured.translation[2]
    ticks(session, 40)
    moved = session.snapshot.limbs["left_hand"].measured.translation[2] - start
    assert moved == pytest.approx(39 * 0.02 * 0.2, abs=0.02)
    assert session.snapshot.paused_by == "device"
    assert not session.pause(ALICE, False)
    ticks(session, round(20.1 / 0.02))  # it is silent for so long that it has left
    assert session.snapshot.device == ("no data from the device: holding",)
    assert (session.snapshot.paused, session.snapshot.paused_by) == (True, None)
    moved = len(session.env.actions)
    assert session.pause(ALICE, False)
    ticks(session, 1)
    assert len(session.env.actions) == moved + 1


def test_limbs_say_which_of_them_a_device_for_one_hand_moves():
    hand = {"hand": LimbInput(twist=np.zeros(6))}
    says = [DeviceState(time=0.02 * k, limbs=hand) for k in range(2)]
    says.append(DeviceState(time=0.04, limbs=hand, buttons=frozenset({"next"})))
    session = TeleopSession(FakeEnv(), period=0.02, device=Scripted(says))
    for name in ("right_hand", "right_hand", "left_hand"):
        session.tick()
        assert session.snapshot.selected == name
    colours = limb_colours(session.limbs)
    rows = limbs_html(session.snapshot, session.info.limbs, colours, client=0)
    right, left = rows.split("</tr>")[:2]
    assert "selected" in left
    assert "selected" not in right


def test_attempts_and_successes_are_counted():
    env = FakeEnv()
    session = TeleopSession(env, period=0.02)
    step, solved = env.step, {"success": True}
    env.step = lambda action: (*step(action)[:4], solved)
    ticks(session, 3)
    assert session.snapshot.solved == 1
    assert session.snapshot.solved_at == pytest.approx(0.02)
    session.reset()
    solved["success"] = False
    ticks(session, 2)
    snapshot = session.snapshot
    assert (snapshot.epoch, snapshot.solved) == (1, 1)
    assert np.isnan(snapshot.solved_at)


def test_the_status_says_task_and_first_gesture_until_a_limb_was_moved():
    env = FakeEnv()
    env.benchmark = SimpleNamespace(title="Lift <a> cube")
    session = TeleopSession(env, period=0.02)
    colours = limb_colours(session.limbs)
    text = status_html(session.snapshot, session.info, colours)
    assert "Lift &lt;a&gt; cube" in task_html(session.info.task)
    assert "Not solved yet" in text
    assert "Drag an arrow" in text
    session.grab("left_hand", 1, session.snapshot.limbs["left_hand"].target)
    session.tick()
    assert "Drag an arrow" not in status_html(session.snapshot, session.info, colours)
    tables = [
        limbs_html(session.snapshot, session.info.limbs, colours, client=client)
        for client in (0, 1)
    ]
    assert "held by viewer 2" in tables[0]
    assert "held by you" in tables[1]
