"""A tape of recorded episodes: played, paused, wound; shown in a window."""

import contextlib

import numpy as np
import pytest

from wbc_suite.errors import DatasetError
from wbc_suite.recording import Dataset
from wbc_suite.viewers.replay_window import show_in_window
from wbc_suite.viewers.tape import PAUSE, Clip, Tape, open_tape


class Clock:
    now = 100.0

    def __call__(self):
        return self.now


def make_clip(name, count=11):
    if name == "bad":
        raise DatasetError("'bad' cannot start here")
    return Clip(
        name=name,
        states=np.zeros((count, 3)),
        times=0.1 * np.arange(count),
        effort=np.zeros(count),
        rewards=np.zeros(count),
        told="",
    )


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def tape(clock):
    return Tape(["a", "b", "bad"], make_clip, clock)


def after(tape, clock, seconds):
    clock.now += seconds
    return tape.turn()


def test_it_plays_in_real_time_and_goes_on_to_the_next_episode(tape, clock):
    assert tape.turn().frame == 0
    assert after(tape, clock, 0.55).frame == 5
    assert after(tape, clock, 0.6).frame == 10
    assert after(tape, clock, PAUSE).clip.name == "a"
    assert tape.turn().position == 0.0
    status = tape.turn()
    assert (status.clip.name, status.frame) == ("b", 0)


def test_it_pauses_and_goes_on_where_it_was(tape, clock):
    tape.turn()
    after(tape, clock, 0.3)
    tape.toggle()
    assert after(tape, clock, 5.0).frame == 3
    tape.toggle()
    tape.set_speed(0.5)
    assert after(tape, clock, 0.22).frame == 4


def test_it_seeks_within_the_episode_only(tape, clock):
    tape.turn()
    tape.toggle()
    for wanted, frame in [(0.7, 7), (99.0, 10), (-1.0, 0)]:
        tape.seek(wanted)
        assert tape.turn().frame == frame
    tape.nudge(3)
    assert tape.status.frame == 3
    tape.nudge(-9)
    assert tape.status.frame == 0
    tape.seek(9.0)
    tape.toggle()  # at the end it begins again
    assert tape.turn().frame == 0


def test_an_episode_that_cannot_be_played_is_told_and_passed_by(tape, clock):
    tape.turn()
    tape.skip(-1)
    status = tape.turn()
    assert status.clip is None
    assert status.error == "'bad' cannot start here"
    tape.choose("b")
    assert tape.turn().clip.name == "b"
    with pytest.raises(DatasetError, match="no episodes"):
        Tape([], make_clip)


def test_a_window_shows_states_and_its_keys_wind(lift_recording, lift_env):
    seen, presses = [], [32, 262, 262, 263, 265]

    class Window:
        lock = staticmethod(contextlib.nullcontext)

        def __init__(self, press):
            self.press = press

        def is_running(self):
            if len(seen) < len(presses):
                self.press(presses[len(seen)])
            return len(seen) < len(presses)

        def sync(self):
            seen.append(lift_env.physics_state.copy())

    @contextlib.contextmanager
    def launch(model, data, press):
        assert model is lift_env.simulation.model
        yield Window(press)

    with Dataset(lift_recording) as dataset:
        tape = open_tape(dataset, ["demo_1"], lift_env, by_states=True)
        show_in_window(tape, lift_env, launch)
        states = dataset.column("demo_1", "states")
    for state, frame in zip(seen, [0, 1, 2, 1, 0], strict=True):
        np.testing.assert_array_equal(state, states[frame])


def test_actions_that_are_played_say_how_exact_they_are(lift_recording, lift_env):
    with Dataset(lift_recording) as dataset:
        tape = open_tape(dataset, ["demo_1"], lift_env, by_states=False)
        clip, episode = tape.turn().clip, dataset.episode("demo_1")
    assert clip.told == "no success, bit by bit as recorded"
    np.testing.assert_array_equal(clip.states[-1], episode.final_state)
    np.testing.assert_allclose(np.diff(clip.times), 0.05, atol=1e-9)
    assert clip.effort.max() == 1.0
    assert len(clip.rewards) == len(clip.times) == episode.length + 1
