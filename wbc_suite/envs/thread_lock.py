"""The lock of an environment, which a forked child finds free and its state whole."""

import functools
import os
import threading
from collections.abc import Callable
from typing import Any, TypeVar, cast
from weakref import WeakSet

Method = TypeVar("Method", bound=Callable[..., Any])

_LOCKS: WeakSet[Any] = WeakSet()
_held = threading.local()
"""Locks that the thread which is forking holds."""


def thread_lock() -> Any:
    """Return a reentrant lock for which a fork waits.

    A child has a copy of all locks, but only one thread: a lock that another thread
    held would never be released there, and what it guards would be half changed.
    """
    lock = threading.RLock()
    _LOCKS.add(lock)
    return lock


def one_thread_at_a_time(method: Method) -> Method:
    """Let other threads wait for the `lock` of a method's object.

    MuJoCo's state is shared: two threads that step it would crash the process.
    """

    @functools.wraps(method)
    def locked(owner: Any, *arguments: Any, **named: Any) -> Any:
        with owner.lock:
            return method(owner, *arguments, **named)

    return cast("Method", locked)


def _hold() -> None:
    _held.locks = sorted(_LOCKS, key=id)  # in one order, else two forks wait for ever
    for lock in _held.locks:
        lock.acquire()


def _release() -> None:
    for lock in _held.locks:
        lock.release()
    del _held.locks


os.register_at_fork(before=_hold, after_in_parent=_release, after_in_child=_release)
