"""The timer of a loop, on a clock that advances only by sleeping and working."""

import pytest

from wbc_suite.viewers.loop_timing import LEAD, MAX_BACKLOG, LoopTimer

PERIOD = 0.01  # s


class Clock:
    """A clock that advances only when it is told to."""

    def __init__(self):
        self.now = 100.0
        self.rested = []

    def __call__(self):
        return self.now

    def sleep(self, seconds):
        self.rested.append(self.timer.idle.is_set())
        self.now += seconds


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def timer(clock):
    clock.timer = LoopTimer(PERIOD, clock=clock, sleep=clock.sleep)
    return clock.timer


def steps(timer, clock, works):
    """Return when steps begin; `works` has the times before and after each, s."""
    begun = []
    for before, after in works:
        clock.now += before
        timer.wait_for_step()
        begun.append(clock.now)
        clock.now += after
        timer.finish_step()
    return begun


def test_steps_are_one_period_apart_however_long_getting_ready_takes(timer, clock):
    timer.start()
    works = [(0.0, 0.001), (LEAD, 0.004), (0.0003, 0.007), (0.0011, 0.0)]
    first, *others = steps(timer, clock, works)
    assert first == pytest.approx(100.0 + LEAD)
    due = [first + PERIOD * k for k in range(1, 4)]
    assert others == pytest.approx(due)


def test_late_step_begins_at_once_and_the_next_ones_catch_up(timer, clock):
    timer.start()
    works = [(0.0, 0.025), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)]
    first, second, third, fourth = steps(timer, clock, works)
    assert second == third == pytest.approx(first + 0.025)
    assert fourth == pytest.approx(first + 3 * PERIOD)


def test_loop_that_is_far_behind_does_not_race_after_the_time_it_lost(timer, clock):
    timer.start()
    works = [(0.0, (MAX_BACKLOG + 2) * PERIOD), (0.0, 0.0), (0.0, 0.0)]
    _, second, third = steps(timer, clock, works)
    assert third - second == pytest.approx(PERIOD)


def test_loop_rests_between_ticks_and_not_within(timer, clock):
    timer.start()
    assert not timer.idle.is_set()
    steps(timer, clock, [(0.0, 0.0)])
    assert clock.rested == [False, True]
    assert not timer.idle.is_set()
    timer.stop()
    assert timer.idle.is_set()


def test_step_of_a_loop_that_does_not_run_is_not_waited_for(timer, clock):
    timer.wait_for_step()
    assert clock.rested == []
    assert timer.idle.is_set()
