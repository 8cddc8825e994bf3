"""Playback of recorded episodes: play, pause, seek; shown in a window."""

import contextlib

import numpy as np
import pytest

from wbc_suite.errors import DatasetError
from wbc_suite.recording import Dataset
from wbc_suite.viewers.episode_player import (
    PAUSE,
    Clip,
    EpisodePlayer,
    open_player,
    show_in_window,
)


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
        summary="",
    )


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def player(clock):
    return EpisodePlayer(["a", "b", "bad"], make_clip, clock)


def after(player, clock, seconds):
    clock.now += seconds
    return player.advance()


def test_it_plays_in_real_time_and_goes_on_to_the_next_episode(player, clock):
    assert player.advance().frame == 0
    assert after(player, clock, 0.55).frame == 5
    assert after(player, clock, 0.6).frame == 10
    assert after(player, clock, PAUSE).clip.name == "a"
    assert player.advance().position == 0.0
    status = player.advance()
    assert (status.clip.name, status.frame) == ("b", 0)


def test_it_pauses_and_goes_on_where_it_was(player, clock):
    player.advance()
    after(player, clock, 0.3)
    player.toggle()
    assert after(player, clock, 5.0).frame == 3
    player.toggle()
    player.set_speed(0.5)
    assert after(player, clock, 0.22).frame == 4


def test_it_seeks_within_the_episode_only(player, clock):
    player.advance()
    player.toggle()
    for wanted, frame in [(0.7, 7), (99.0, 10), (-1.0, 0)]:
        player.seek(wanted)
        assert player.advance().frame == frame
    player.step_frames(3)
    assert player.status.frame == 3
    player.step_frames(-9)
    assert player.status.frame == 0
    player.seek(9.0)
    player.toggle()  # at the end it begins again
    assert player.advance().frame == 0


def test_an_episode_that_cannot_be_played_is_told_and_passed_by(player, clock):
    player.advance()
    player.skip(-1)
    status = player.advance()
    assert status.clip is None
    assert status.error == "'bad' cannot start here"
    player.choose("b")
    assert player.advance().clip.name == "b"
    with pytest.raises(DatasetError, match="no episodes"):
        EpisodePlayer([], make_clip)


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
    def launch(model, data, *, key_callback, **options):
        assert model is lift_env.simulation.model
        yield Window(key_callback)

    with Dataset(lift_recording) as dataset:
        player = open_player(dataset, ["demo_1"], lift_env, by_states=True)
        show_in_window(player, lift_env, launch)
        states = dataset.column("demo_1", "states")
    for state, frame in zip(seen, [0, 1, 2, 1, 0], strict=True):
        np.testing.assert_array_equal(state, states[frame])


def test_actions_that_are_played_say_how_exact_they_are(lift_recording, lift_env):
    with Dataset(lift_recording) as dataset:
        player = open_player(dataset, ["demo_1"], lift_env, by_states=False)
        clip, episode = player.advance().clip, dataset.episode("demo_1")
    assert clip.summary == "no success, bit for bit as recorded"
    np.testing.assert_array_equal(clip.states[-1], episode.final_state)
    np.testing.assert_allclose(np.diff(clip.times), 0.05, atol=1e-9)
    assert clip.effort.max() == 1.0
    assert len(clip.rewards) == len(clip.times) == episode.length + 1
