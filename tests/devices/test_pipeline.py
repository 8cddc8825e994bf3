"""The pipeline as a whole: what a device says becomes an action."""

import itertools

import numpy as np
import pinocchio as pin
import pytest
from floating import FloatingEnv, hand
from hypothesis import given, settings
from hypothesis import strategies as st

from wbc_suite.devices import DeviceState, LimbInput, Pipeline, PipelineConfig

DT = 0.01


class Person:
    """Says things at the pipeline's rate, and lets the environment follow."""

    def __init__(self, env, **config):
        self.env, self.time, self.now = env, 0.0, 0.0
        settings = PipelineConfig(**({"ramp": 0.0} | config))
        self.pipeline = Pipeline(env, settings, clock=lambda: self.now)

    def say(self, ticks=1, *, buttons=(), base=None, **limbs):
        for _ in range(ticks):
            self.time += DT
            state = DeviceState(
                time=self.time, limbs=limbs, buttons=frozenset(buttons), base=base
            )
            self.tick(state)
        return self

    def silent(self, ticks):
        for _ in range(ticks):
            self.tick(DeviceState(time=self.time))
        return self

    def tick(self, state):
        self.now += DT
        self.action = self.pipeline.update(state)
        self.env.step(self.action)

    def target(self, limb="right_hand"):
        return self.env.action_layout.unpack(self.action)[limb]


@pytest.fixture
def person():
    return Person(FloatingEnv())


def test_nothing_moves_before_anything_is_said(person):
    for _ in range(50):
        person.tick(SILENT)
    np.testing.assert_allclose(person.target(), [0.4, -0.2, 1.0, 0, 0, 0], atol=1e-12)
    assert person.pipeline.acting == {"device": ("waiting for the device",)}


def test_hand_repeats_the_motion_of_the_input(person):
    away = hand(5.0, 3.0, -2.0)
    person.say(right=LimbInput(pose=away))
    moved = pin.SE3(np.eye(3), np.array([0.05, 0.02, -0.1])) * away
    person.say(150, right=LimbInput(pose=moved))
    np.testing.assert_allclose(person.target(), [0.45, -0.18, 0.9, 0, 0, 0], atol=1e-4)
    np.testing.assert_allclose(person.target("left_hand")[:3], [0.4, 0.2, 1.0])


@pytest.mark.slow
@settings(max_examples=8)
@given(
    places=st.lists(
        st.tuples(*[st.floats(-2.0, 2.0)] * 3, *[st.floats(-2.0, 2.0)] * 3),
        min_size=2,
        max_size=6,
    )
)
def test_engaging_moves_the_target_by_less_than_a_millimetre(places):
    person = Person(FloatingEnv())
    person.say(right=LimbInput(pose=hand(*places[0][:3], turn=places[0][3:])))
    for *place, a, b, c in places:
        person.say(60, right=LimbInput(pose=hand(*place), engaged=False))
        before = person.target().copy()
        pose = hand(*place, turn=(a, b, c))  # it turned meanwhile, too
        person.say(right=LimbInput(pose=pose, engaged=True))
        person.say(30, right=LimbInput(pose=pose, engaged=True))
        assert np.linalg.norm(person.target()[:3] - before[:3]) < 1e-3
        assert np.linalg.norm(person.target()[3:] - before[3:]) < 1e-2


def test_twist_jogs_the_hand_and_goes_on_between_messages(person):
    jog = LimbInput(twist=np.array([0.2, 0, 0, 0, 0, 0]))
    for _ in range(20):
        person.say(right=jog).silent(4)  # the device has 20 Hz, the pipeline 100
    assert person.target()[0] - 0.4 == pytest.approx(0.2, abs=0.03)


def test_scale_makes_small_motions_of_large_ones():
    person = Person(FloatingEnv(), scale=0.25, jump=None, jump_angle=None)
    person.say(right=LimbInput(pose=hand()))
    person.say(150, right=LimbInput(pose=hand(z=0.2)))
    assert person.target()[2] == pytest.approx(1.05, abs=1e-4)


def test_absolute_mode_goes_to_where_the_input_is_without_a_jump():
    person = Person(FloatingEnv(), mode="absolute")
    wanted = LimbInput(pose=hand(0.5, -0.1, 1.2))
    person.say(right=wanted)
    assert np.linalg.norm(person.target()[:3] - [0.4, -0.2, 1.0]) < 1e-3
    person.say(200, right=wanted)
    np.testing.assert_allclose(person.target()[:3], [0.5, -0.1, 1.2], atol=1e-4)


def test_workspace_keeps_the_hand_inside_and_does_not_wind_up():
    box = {"low": (0.3, -0.5, 0.9), "high": (0.6, 0.5, 1.05)}
    person = Person(FloatingEnv(), workspace=box)
    person.say(right=LimbInput(pose=hand()))
    person.say(150, right=LimbInput(pose=hand(z=0.25)))
    assert person.target()[2] == pytest.approx(1.05, abs=1e-4)
    assert "at the workspace limit" in person.pipeline.acting["right_hand"]
    person.say(150, right=LimbInput(pose=hand(z=0.2)))  # back by 5 cm: obeyed at once
    assert person.target()[2] == pytest.approx(1.0, abs=1e-4)


def test_leash_lets_a_target_lead_by_so_much_and_no_more():
    leash = {"distance": 0.1, "angle": 0.5}
    person = Person(FloatingEnv(stuck=True), leash=leash, jump=None, jump_angle=None)
    person.say(right=LimbInput(pose=hand()))
    person.say(300, right=LimbInput(pose=hand(x=1.0)))
    assert person.target()[0] == pytest.approx(0.5, abs=1e-3)
    assert person.pipeline.acting == {"right_hand": ("limited by the leash",)}
    person.say(100, right=LimbInput(pose=hand(x=0.92)))  # nothing to unwind first
    assert person.target()[0] == pytest.approx(0.42, abs=1e-3)


def test_an_input_that_jumps_is_latched_anew(person):
    person.say(right=LimbInput(pose=hand()))
    person.say(right=LimbInput(pose=hand(x=1.0)))
    assert person.pipeline.acting["right_hand"] == (
        "input jumped: clutch latched again",
    )
    person.say(100, right=LimbInput(pose=hand(x=1.05)))
    assert person.target()[0] == pytest.approx(0.45, abs=1e-4)


def test_silence_holds_and_then_brings_the_hand_home():
    person = Person(FloatingEnv(), return_after=1.0)
    person.say(right=LimbInput(pose=hand()))
    person.say(100, right=LimbInput(pose=hand(y=0.1)))
    person.silent(60)
    assert person.target()[1] == pytest.approx(-0.1, abs=1e-3)
    assert person.pipeline.acting["device"] == ("no data from the device: holding",)
    person.silent(60)
    assert person.pipeline.acting["device"] == ("no data from the device: returning",)
    person.silent(150)
    np.testing.assert_allclose(person.target()[:3], [0.4, -0.2, 1.0], atol=1e-4)
    before = person.target().copy()
    person.say(right=LimbInput(pose=hand(y=0.1)))  # it is back: latched anew
    assert np.linalg.norm(person.target() - before) < 1e-3
    assert "device" not in person.pipeline.acting


def test_lost_connection_moves_no_hand_home_unless_asked(person):
    person.say(right=LimbInput(pose=hand()))
    person.say(100, right=LimbInput(pose=hand(y=0.1)))
    person.now += 3600.0
    person.silent(100)
    np.testing.assert_allclose(person.target()[:3], [0.4, -0.1, 1.0], atol=1e-3)
    assert person.pipeline.acting["device"] == ("no data from the device: holding",)


@pytest.mark.parametrize("pause", [False, True])
def test_velocity_that_was_held_in_a_silence_or_a_pause_moves_nothing(person, pause):
    up = LimbInput(twist=np.array([0, 0, 0.2, 0, 0, 0]))
    person.say(20, right=up, base=np.array([0.0, 0.0, 0.5]))
    if pause:
        person.time += DT
        person.pipeline.hold(DeviceState(time=person.time, limbs={"right": up}))
    else:
        person.silent(30)
    person.say(50, right=up)
    before = person.target()[2]
    person.say(50, right=up)
    assert person.target()[2] == pytest.approx(before, abs=1e-6)
    (note,) = person.pipeline.acting["device"]
    assert "released first" in note
    person.say(right=LimbInput(twist=np.zeros(6))).say(50, right=up)
    assert person.target()[2] > before + 0.05
    assert "device" not in person.pipeline.acting


def test_start_ramp_begins_slowly():
    quick, slow = Person(FloatingEnv()), Person(FloatingEnv(), ramp=2.0)
    for person in (quick, slow):
        person.say(right=LimbInput(pose=hand()))
        person.say(30, right=LimbInput(pose=hand(x=0.2)))
    assert slow.target()[0] - 0.4 < 0.4 * (quick.target()[0] - 0.4)


def test_one_hand_is_switched_from_limb_to_limb_and_from_robot_to_robot():
    person = Person(FloatingEnv(robots=2))
    up = LimbInput(twist=np.array([0, 0, 0.5, 0, 0, 0]))
    sides = ("right", "left")
    for name in [f"robot{i}_{side}_hand" for i in range(2) for side in sides]:
        assert person.pipeline.selected == name
        person.say(20, hand=up)
        assert person.target(name)[2] > 1.03
        person.say(buttons=["next"]).say()
    assert person.pipeline.selected == "robot0_right_hand"


def test_both_hands_move_at_once(person):
    up = LimbInput(twist=np.array([0, 0, 0.5, 0, 0, 0]))
    down = LimbInput(twist=np.array([0, 0, -0.5, 0, 0, 0]))
    person.say(20, right=up, left=down)
    assert person.target()[2] > 1.03
    assert person.target("left_hand")[2] < 0.97


def test_mirror_swaps_sides_and_directions(person):
    person.say(buttons=["mirror"], left=LimbInput(pose=hand())).say(
        left=LimbInput(pose=hand())
    )
    turned = hand(0.03, 0.05, 0.02, turn=(0, 0, 0.4))
    person.say(150, left=LimbInput(pose=turned))
    np.testing.assert_allclose(
        person.target(), [0.43, -0.25, 1.02, 0, 0, -0.4], atol=1e-4
    )


def test_grip_closes_all_synergies_or_each(person):
    person.say(200, right=LimbInput(grip=np.array(1.0)))
    np.testing.assert_allclose(person.target("right_gripper"), [1, 1], atol=1e-4)
    person.say(200, right=LimbInput(grip=np.array([0.5, -0.5])))
    np.testing.assert_allclose(person.target("right_gripper"), [0.5, -0.5], atol=1e-4)


@pytest.mark.slow
def test_button_grips_with_the_hand_that_is_switched_to_and_no_other():
    person = Person(FloatingEnv(robots=2))
    up = LimbInput(twist=np.array([0, 0, 0.1, 0, 0, 0]))

    def closed():
        return [person.target(f"robot{i}_right_gripper")[0] > 0 for i in range(2)]

    person.say(50, buttons=["grip"], hand=up)  # held: it counts once
    assert closed() == [True, False]
    person.say(buttons=["next"]).say(50, hand=up)  # robot 0's left hand grips nothing
    person.say(50, buttons=["grip"], hand=up)
    assert closed() == [True, False]
    person.say(buttons=["next"]).say(50, hand=up)
    assert person.pipeline.selected == "robot1_right_hand"
    assert closed() == [True, False]
    person.say(50, buttons=["grip"], hand=up)
    assert closed() == [True, True]
    person.say(50, hand=up).say(50, buttons=["grip"], hand=up)
    assert closed() == [True, False]


def test_home_brings_every_hand_back(person):
    up = LimbInput(twist=np.array([0, 0, 0.5, 0, 0, 0]))
    person.say(50, right=up).say(buttons=["home"]).say(300)
    np.testing.assert_allclose(person.target()[:3], [0.4, -0.2, 1.0], atol=1e-4)


NUMBERS = st.one_of(
    st.floats(-1.0, 1.0), st.just(1e6), st.just(float("nan")), st.just(float("inf"))
)
MESSAGES = st.tuples(
    st.sampled_from([-1.0, 0.0, DT / 3, DT, 5.0]),  # how far the device's time goes on
    st.sampled_from(["pose", "twist", "none"]),
    st.tuples(NUMBERS, NUMBERS, NUMBERS),
    st.booleans(),
    st.sampled_from(["", "next", "mirror", "home"]),
    st.integers(1, 60),  # how often it is said
)


def said(kind, numbers, engaged):
    if kind == "none":
        return {}
    if kind == "pose":
        pose = pin.SE3(np.eye(3), np.array(numbers))
        return {"right": LimbInput(pose=pose, engaged=engaged, grip=numbers[:2])}
    return {"right": LimbInput(twist=np.tile(numbers, 2), engaged=engaged)}


@pytest.mark.slow
@settings(max_examples=25)
@given(messages=st.lists(MESSAGES, min_size=1, max_size=8), absolute=st.booleans())
def test_no_device_makes_a_target_exceed_its_limits(messages, absolute):
    """It jumps, stalls, repeats, goes back in time, says NaN, or floods."""
    env = FloatingEnv()
    mode = "absolute" if absolute else "relative"
    config = PipelineConfig(mode=mode, return_after=0.5, jump=None, jump_angle=None)
    clock = (DT * k for k in itertools.count()).__next__  # read once a tick
    pipeline = Pipeline(env, config, clock=clock)
    time, path, grips = 0.0, [env.action_layout.unpack(pipeline.update(SILENT))], []
    for step, kind, numbers, engaged, button, count in messages:
        time += step
        state = DeviceState(
            time=time,
            limbs=said(kind, numbers, engaged),
            buttons=frozenset({button} - {""}),
        )
        for _ in range(count):
            action = pipeline.update(state)
            assert np.isfinite(action).all()
            env.step(action)
            path.append(env.action_layout.unpack(action))
    points = np.array([values["right_hand"][:3] for values in path])
    points = np.concatenate([points[:1]] * 3 + [points])
    for order, limit in enumerate(("speed", "acceleration", "jerk"), start=1):
        derivative = np.diff(points, n=order, axis=0) / DT**order
        most = np.linalg.norm(derivative, axis=1).max()
        assert most <= getattr(config.linear, limit) * (1 + 1e-6) + 1e-13 / DT**order
    grips = np.array([values["right_gripper"] for values in path])
    assert np.abs(np.diff(grips, axis=0)).max() / DT <= config.grip.speed * (1 + 1e-9)


SILENT = DeviceState(time=float("nan"))
