"""Pictures that differ from what is drawn, as they were told to."""

import itertools

import gymnasium
import numpy as np
import pytest
from numpy.testing import assert_array_equal

from wbc_suite.errors import ConfigError
from wbc_suite.sensing.change import Change, Channel
from wbc_suite.sensing.noise import GaussianNoise, LowPass

SPACE = gymnasium.spaces.Box(0, 255, (6, 8, 3), np.uint8)
PERIOD, TIMESTEP = 0.05, 0.002


def drawn(k):
    return np.full((6, 8, 3), k, dtype=np.uint8)


def seen(channel, count=8, seed=0):
    """Return what is observed of pictures whose pixels are their number."""
    rng = np.random.default_rng(seed)
    channel.start()
    shown = [channel.look(drawn(k), k * PERIOD, rng) for k in range(count)]
    assert all(channel.space.contains(picture) for picture in shown)
    return [int(picture[0, 0, 0]) for picture in shown]


def test_a_delay_shows_what_was_drawn_then():
    channel = Channel(Change(delay=2 * PERIOD), SPACE, TIMESTEP)
    assert seen(channel) == [0, 0, 0, 1, 2, 3, 4, 5]
    assert seen(channel) == [0, 0, 0, 1, 2, 3, 4, 5]  # nothing of the last episode


def test_a_rate_keeps_pictures_until_the_next_one_is_due():
    channel = Channel(Change(sampling_rate=1.0 / (3 * PERIOD)), SPACE, TIMESTEP)
    assert seen(channel) == [0, 0, 0, 3, 3, 3, 6, 6]


def test_pictures_that_are_lost_leave_the_one_before():
    channel = Channel(Change(dropout=0.5), SPACE, TIMESTEP)
    lost = [a == b for a, b in itertools.pairwise(seen(channel, 250))]
    assert 90 < sum(lost) < 160
    assert seen(Channel(Change(dropout=1.0), SPACE, TIMESTEP)) == [0] * 8
    assert seen(Channel(Change(enabled=False), SPACE, TIMESTEP)) == [0] * 8


def test_noise_is_rounded_and_clipped_and_follows_the_generator():
    channel, rng = Channel(Change(noise=GaussianNoise(9.0)), SPACE, TIMESTEP), []
    for seed in (1, 1, 2):
        channel.start()
        generator = np.random.default_rng(seed)
        rng.append(channel.look(drawn(100), 0.0, generator).astype(float))
    assert 5.0 < rng[0].std() < 13.0
    assert_array_equal(rng[0], rng[1])
    assert np.abs(rng[0] - rng[2]).max() > 5
    channel.start()
    bright = channel.look(drawn(255), 0.0, np.random.default_rng(0))
    assert bright.dtype == np.uint8
    assert bright.max() == 255
    assert bright.min() > 200


def test_a_crop_is_the_middle_and_the_space_says_so():
    channel = Channel(Change(crop=(2, 4)), SPACE, TIMESTEP)
    assert channel.space.shape == (2, 4, 3)
    picture = np.arange(6 * 8 * 3, dtype=np.uint8).reshape(6, 8, 3)
    shown = channel.look(picture, 0.0, np.random.default_rng(0))
    assert_array_equal(shown, picture[2:4, 2:6])
    for wrong in ((7, 4), (0, 4), (2,)):
        with pytest.raises(ConfigError, match="crop"):
            Channel(Change(crop=wrong), SPACE, TIMESTEP)


def test_a_filter_starts_anew_and_a_second_look_takes_no_sample():
    channel = Channel(Change(filter=LowPass(0.5)), SPACE, TIMESTEP)
    rng = np.random.default_rng(0)
    for _ in range(2):
        channel.start()
        assert channel.look(drawn(100), 0.0, rng)[0, 0, 0] == 100
        for _ in range(3):
            assert channel.look(drawn(200), PERIOD, rng)[0, 0, 0] == 150
