"""The timer of a loop, on a clock that advances only by sleeping and working."""

import pytest

from wbc_suite.viewers.loop_timing import LEAD, LoopTimer

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


def test_late_step_begins_at_once_and_the_next_one_when_it_is_due(timer, clock):
    timer.start()
    first, second, third = steps(timer, clock, [(0.0, 0.012), (0.0, 0.0), (0.0, 0.0)])
    assert second == pytest.approx(first + 0.012)
    assert third == pytest.approx(first + 2 * PERIOD)
    assert (timer.overruns, timer.skipped) == (1, 0)


@pytest.mark.parametrize("lost", [1.5, 4.5, 700.5])
def test_periods_that_a_stall_has_taken_are_skipped_and_counted(timer, clock, lost):
    timer.start()
    works = [(0.0, lost * PERIOD), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)]
    first, second, *others = steps(timer, clock, works)
    assert second == pytest.approx(first + lost * PERIOD)  # at once, and no burst:
    due = [second + 0.5 * PERIOD, second + 1.5 * PERIOD]
    assert others == pytest.approx(due)
    assert (timer.overruns, timer.skipped) == (1, int(lost) - 1)


def test_steps_that_always_take_too_long_follow_each_other_and_are_counted(
    timer, clock
):
    timer.start()
    begun = steps(timer, clock, [(0.0, 1.25 * PERIOD)] * 9)
    assert begun == pytest.approx([begun[0] + 1.25 * PERIOD * k for k in range(9)])
    assert (timer.overruns, timer.skipped) == (9, 2)


def test_reset_of_the_scene_is_no_overrun(timer, clock):
    timer.start()
    steps(timer, clock, [(0.0, 0.0)])
    clock.now += 50 * PERIOD
    timer.restart()
    again = clock.now
    assert steps(timer, clock, [(0.0, 0.0)] * 2) == pytest.approx(
        [again, again + PERIOD]
    )
    assert (timer.overruns, timer.skipped) == (0, 0)


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
