"""A lock of an environment after a fork: free in the child, what it guards whole."""

import os
import signal
import threading
import time

import pytest

import wbc_suite
from wbc_suite.envs.thread_lock import thread_lock

pytestmark = pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")


def in_a_child(check):
    """Return whether a check is true in a forked child, which ends after 20 s."""
    child = os.fork()
    if child == 0:
        signal.alarm(20)
        os._exit(0 if check() else 1)
    return os.waitpid(child, 0)[1] == 0


@pytest.fixture
def counting():
    """A thread changes two numbers in turn, and holds a lock until both are equal."""
    lock, numbers, over = thread_lock(), [0, 0], threading.Event()
    held = threading.Event()

    def count():
        while not over.is_set():
            with lock:
                numbers[0] += 1
                held.set()
                time.sleep(0.01)
                numbers[1] += 1

    thread = threading.Thread(target=count)
    thread.start()
    held.wait()
    yield lock, numbers
    over.set()
    thread.join()


def test_a_child_finds_the_lock_free_and_the_state_whole(counting):
    lock, numbers = counting
    for _ in range(5):
        assert in_a_child(lambda: lock.acquire(timeout=5) and numbers[0] == numbers[1])


def test_the_parent_goes_on(counting):
    lock, numbers = counting
    assert in_a_child(lambda: True)
    before = numbers[1]
    while numbers[1] < before + 2:
        time.sleep(0.001)
    assert lock.acquire(timeout=5)
    lock.release()


def test_a_fork_inside_the_lock_keeps_it_in_both_processes():
    lock = thread_lock()

    def is_taken():
        found = []
        other = threading.Thread(target=lambda: found.append(lock.acquire(timeout=0)))
        other.start()
        other.join()
        return found == [False]

    with lock:
        assert in_a_child(is_taken)
        assert is_taken()
    assert not is_taken()


def test_forks_of_two_threads_do_not_wait_for_each_other():
    locks = [thread_lock() for _ in range(20)]
    results = []

    def fork():
        results.append(in_a_child(lambda: all(x.acquire(timeout=5) for x in locks)))

    threads = [threading.Thread(target=fork) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=30)
    assert results == [True] * 4


@pytest.mark.slow
def test_a_child_steps_an_environment_that_another_thread_steps():
    env = wbc_suite.make("Lift", robots="Panda").unwrapped
    env.reset(seed=0)
    over = threading.Event()

    def step():
        while not over.is_set():
            env.step(env.hold_action)

    def steps_in_the_child():
        before = env.simulation.data.time
        env.step(env.hold_action)
        return env.simulation.data.time - before == pytest.approx(0.05)

    thread = threading.Thread(target=step)
    thread.start()
    try:
        for _ in range(10):
            assert in_a_child(steps_in_the_child)
    finally:
        over.set()
        thread.join()
