"""The beat of a loop, by a clock that stands still unless somebody waits or works."""

import pytest

from wbc_suite.viewers.beat import LEAD, PATIENCE, Beat

PERIOD = 0.01  # s


class Clock:
    """Time that passes only when somebody lets it."""

    def __init__(self):
        self.now = 100.0
        self.rested = []

    def __call__(self):
        return self.now

    def sleep(self, seconds):
        self.rested.append(self.beat.resting.is_set())
        self.now += seconds


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def beat(clock):
    clock.beat = Beat(PERIOD, clock=clock, sleep=clock.sleep)
    return clock.beat


def steps(beat, clock, works):
    """Return when steps begin; `works` has the times before and after each, s."""
    begun = []
    for before, after in works:
        clock.now += before
        beat.await_step()
        begun.append(clock.now)
        clock.now += after
        beat.rest()
    return begun


def test_steps_are_one_period_apart_however_long_getting_ready_takes(beat, clock):
    beat.start()
    works = [(0.0, 0.001), (LEAD, 0.004), (0.0003, 0.007), (0.0011, 0.0)]
    first, *others = steps(beat, clock, works)
    assert first == pytest.approx(100.0 + LEAD)
    due = [first + PERIOD * k for k in range(1, 4)]
    assert others == pytest.approx(due)


def test_late_step_begins_at_once_and_the_next_ones_catch_up(beat, clock):
    beat.start()
    works = [(0.0, 0.025), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)]
    first, second, third, fourth = steps(beat, clock, works)
    assert second == third == pytest.approx(first + 0.025)
    assert fourth == pytest.approx(first + 3 * PERIOD)


def test_loop_that_is_far_behind_does_not_race_after_the_time_it_lost(beat, clock):
    beat.start()
    works = [(0.0, (PATIENCE + 2) * PERIOD), (0.0, 0.0), (0.0, 0.0)]
    _, second, third = steps(beat, clock, works)
    assert third - second == pytest.approx(PERIOD)


def test_loop_rests_between_ticks_and_not_within(beat, clock):
    beat.start()
    assert not beat.resting.is_set()
    steps(beat, clock, [(0.0, 0.0)])
    assert clock.rested == [False, True]
    assert not beat.resting.is_set()
    beat.stop()
    assert beat.resting.is_set()


def test_step_of_a_loop_that_does_not_run_is_not_waited_for(beat, clock):
    beat.await_step()
    assert clock.rested == []
    assert beat.resting.is_set()
