"""Retargeting by fingertips, against hands that a headset recorded."""

import functools

import numpy as np
import pinocchio as pin
import pytest
from human_hand import around, mirrored, points, recorded
from hypothesis import given, settings
from hypothesis import strategies as st

import wbc_suite
from wbc_suite.devices import DeviceState, LimbInput, Pipeline, PipelineConfig
from wbc_suite.devices.pipeline import fingertips
from wbc_suite.devices.pipeline.fingertips import FingertipRetargeting
from wbc_suite.devices.state import mirrored as mirrored_state
from wbc_suite.robot import load_robot

HANDS = ("Fourier", "Inspire")
SIDES = ("right", "left")


def users(pose, side):
    """A recorded hand, of this side, in axes of pose frames."""
    return points(mirrored(pose) if side == "right" else pose)


@functools.cache
def made(hand, side):
    robot = load_robot(f"gripper/{hand}{side.title()}Hand")
    return FingertipRetargeting(robot, next(iter(robot.synergies)), side=side)


def law(hand, side="right"):
    made(hand, side).reset()
    return made(hand, side)


@functools.cache
def closing(aperture):
    """A right hand around something, in axes of pose frames."""
    return points(mirrored(around(aperture)))


def gap(hand, values, finger="index"):
    tips = hand.tips(values)
    return np.linalg.norm(tips[finger] - tips["thumb"])


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("hand", HANDS)
def test_recorded_pinch_closes_and_a_relaxed_hand_opens(hand, side):
    robots = law(hand, side)
    pinch = users(recorded("pinch"), side)
    assert np.linalg.norm(pinch[4] - pinch[9]) < 0.01  # the recording is a pinch
    assert gap(robots, robots(pinch)) < 0.002
    for _ in range(60):  # as many inputs as in a second
        values = robots(users(recorded("relaxed"), side))
    relaxed = users(recorded("relaxed"), side)
    apart = np.linalg.norm(relaxed[4] - relaxed[9])
    assert gap(robots, values) == pytest.approx(apart, abs=0.01)
    assert values[2:].max() < -0.8


@pytest.mark.parametrize("hand", HANDS)
def test_pinch_is_the_users_within_a_centimetre_while_it_closes(hand):
    robots = law(hand)
    for aperture in np.repeat([0.09, 0.075, 0.06], 10):
        values = robots(closing(aperture))
    assert gap(robots, values) == pytest.approx(0.06, abs=0.01)
    for aperture in np.repeat([0.05, 0.04, 0.03, 0.02], 10):
        values = robots(closing(aperture))
    assert gap(robots, values) < 0.01  # tips of people's fingers touch at 20 mm


@pytest.mark.parametrize("hand", HANDS)
def test_pointing_keeps_the_index_straight_and_bends_the_others(hand):
    values = law(hand)(users(recorded("point"), "right"))
    assert values[2] < -0.8
    assert values[3:].min() > 0.4


@settings(max_examples=20, deadline=None)
@given(
    size=st.floats(0.95, 1.05),
    turn=st.tuples(*[st.floats(-2.0, 2.0)] * 3),
    place=st.tuples(*[st.floats(-5.0, 5.0)] * 3),
)
def test_where_the_hand_is_does_not_matter(size, turn, place):
    joints, R = users(recorded("point"), "right"), pin.exp3(np.array(turn))
    robots = law("Fourier")
    expected = robots(joints)
    robots.reset()
    moved = size * joints @ R.T + np.array(place)
    np.testing.assert_allclose(robots(moved), expected, atol=0.15)


@settings(max_examples=30, deadline=None)
@given(
    joints=st.lists(st.floats(-1e6, 1e6), min_size=75, max_size=75),
    again=st.lists(st.floats(-0.2, 0.2), min_size=75, max_size=75),
)
def test_any_numbers_give_synergies_in_their_range(joints, again):
    robots = law("Fourier")
    for numbers in (joints, again, np.zeros(75)):
        values = robots(np.reshape(numbers, (25, 3)))
        assert np.isfinite(values).all()
        assert np.abs(values).max() <= 1.0


def test_a_gripper_without_fingers_has_no_fingertips():
    robot = load_robot("Panda")
    with pytest.raises(LookupError, match="no tips"):
        FingertipRetargeting(robot, next(iter(robot.synergies)), side="right")


def test_mirror_turns_the_left_hand_into_a_right_one():
    left = points(recorded("pinch"))
    state = DeviceState(time=0.0, limbs={"left": LimbInput(fingers=left)})
    fingers = mirrored_state(state).limbs["right"].fingers
    np.testing.assert_allclose(fingers, users(recorded("pinch"), "right"), atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("hand", HANDS)
def test_pinch_closes_the_simulated_hand(hand):
    import mujoco

    grippers = {side: f"{hand}{side.title()}Hand" for side in SIDES}
    env = wbc_suite.make("Lift", robots="GR1", gripper_types=grippers)
    env.reset(seed=0)
    pipeline = Pipeline(env, PipelineConfig())
    simulation = env.unwrapped.simulation
    model, data = simulation.model, simulation.data
    period = 1.0 / env.unwrapped.config.control_freq
    for k in range(round(2.5 / period)):
        limbs = {
            side: LimbInput(
                pose=pin.SE3.Identity(), fingers=users(recorded("pinch"), side)
            )
            for side in SIDES
        }
        env.step(pipeline.update(DeviceState(time=period * k, limbs=limbs)))
    for side in SIDES:
        geoms = [
            [
                g
                for g in range(model.ngeom)
                if model.geom_bodyid[g]
                == model.site(f"robot0_{side}_{finger}_tip").bodyid[0]
                and model.geom_contype[g]
            ]
            for finger in ("thumb", "index")
        ]
        distance = min(
            mujoco.mj_geomDistance(model, data, a, b, 1.0, None)
            for a in geoms[0]
            for b in geoms[1]
        )
        assert distance < 0.003, side
    env.close()


@pytest.mark.parametrize("pose", ["pinch", "relaxed"])
def test_the_work_of_a_tick_is_bounded(pose, monkeypatch):
    """All steps of an input took 1 ms on a quiet machine; a tick has 10 ms."""
    robots, steps = law("Fourier"), []
    step = FingertipRetargeting._step
    monkeypatch.setattr(
        FingertipRetargeting, "_step", lambda *a: steps.append(1) or step(*a)
    )
    counts = []
    for _ in range(3):
        robots(users(recorded(pose), "right"))
        counts.append(len(steps))
        steps.clear()
    assert counts == [fingertips.FIRST_STEPS, fingertips.STEPS, fingertips.STEPS]
    assert fingertips.STEPS <= 10
