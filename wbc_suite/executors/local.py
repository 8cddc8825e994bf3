"""Executors of this machine: in this process, or in worker processes."""

import multiprocessing
import os
import signal
import sys
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

from wbc_suite.errors import ConfigError
from wbc_suite.executors.executor import Outcome, Work, WorkItem, run_item

FORKS = sys.platform == "linux"  # macOS ends forked processes that use its libraries


class Serial:
    """Runs items in this process, in their order; for debugging."""

    def run(
        self, work: Work, items: Sequence[WorkItem], folder: Path
    ) -> Iterator[Outcome]:
        """Run all items; see `Executor`."""
        for item in items:
            yield run_item(work, item, folder)


class Processes:
    """Runs items in worker processes, by default one per processor.

    Workers are started anew, 3 to 4 s of processor time each. With `prepare` they are
    forked from this process instead, with all that it has imported, compiled and made;
    this is only safe where no other thread works and no GPU is in use. On macOS they
    are always started anew. `prepare` is called with the first item before.

    When a worker dies (killed, out of memory, a crash in C), the pool is started
    again. Each item that was running then runs alone, so that the one which kills its
    worker is identified and no other item fails with it. It fails after so many
    attempts alone.
    """

    def __init__(
        self,
        workers: int | None = None,
        *,
        attempts: int = 3,
        prepare: Callable[[WorkItem], None] | None = None,
    ) -> None:
        if (workers is not None and workers < 1) or attempts < 1:
            raise ConfigError(
                f"workers ({workers}) and attempts ({attempts}) must be at least 1."
            )
        self.workers = workers or os.cpu_count() or 1
        self.attempts, self.prepare = attempts, prepare

    def run(
        self, work: Work, items: Sequence[WorkItem], folder: Path
    ) -> Iterator[Outcome]:
        """Run all items; see `Executor`."""
        waiting = deque(items)
        if items and self.prepare is not None:
            self.prepare(items[0])
        while waiting:
            busy: dict[Future[Outcome], WorkItem] = {}
            yield from self._run_until_a_death(work, waiting, busy, folder)
            for future, item in busy.items():
                if future.exception() is None:
                    yield future.result()
                else:
                    yield self._run_alone(work, item, folder)

    def _run_until_a_death(
        self,
        work: Work,
        waiting: deque[WorkItem],
        busy: dict[Future[Outcome], WorkItem],
        folder: Path,
    ) -> Iterator[Outcome]:
        """Run waiting items; those without an outcome are left in `busy`."""
        pool = self._pool(min(self.workers, len(waiting)))
        try:
            while waiting or busy:
                while waiting and len(busy) < self.workers:
                    future = pool.submit(run_item, work, waiting[0], folder)
                    busy[future] = waiting.popleft()  # not before: `submit` may fail
                for future in wait(busy, return_when=FIRST_COMPLETED).done:
                    outcome = future.result()
                    del busy[future]
                    yield outcome
        except BrokenProcessPool:
            return
        finally:
            pool.shutdown(wait=True, cancel_futures=True)

    def _run_alone(self, work: Work, item: WorkItem, folder: Path) -> Outcome:
        """Run an item beside which a worker died, or which killed it."""
        for _ in range(self.attempts):
            with self._pool(1) as pool:
                future = pool.submit(run_item, work, item, folder)
            if future.exception() is None:
                return future.result()
        return Outcome(
            name=item.name,
            error=f"Its worker died {self.attempts} times (killed, out of memory, or a "
            "crash). Run it alone with the serial executor to see why.",
        )

    def _pool(self, workers: int) -> ProcessPoolExecutor:
        forks = FORKS and self.prepare is not None
        context = multiprocessing.get_context("fork" if forks else "spawn")
        return ProcessPoolExecutor(
            workers, mp_context=context, initializer=_leave_signals_to_the_parent
        )


def _leave_signals_to_the_parent() -> None:
    """Ignore Ctrl-C; drop what a forked worker has of its parent's handling."""
    signal.set_wakeup_fd(-1)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
