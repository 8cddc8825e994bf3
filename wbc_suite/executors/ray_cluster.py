"""Work items on a Ray cluster; its machines may come and go."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from wbc_suite.errors import ConfigError
from wbc_suite.executors.executor import Outcome, Work, WorkItem, run_item

__all__ = ["RayCluster"]


class RayCluster:
    """Runs items as Ray tasks; Ray runs those of dead workers again, elsewhere.

    The cluster is that of `RAY_ADDRESS`, or else one on this machine.

    Args:
        workers: Number of items that run at once; None for one per processor.
        attempts: How often an item may lose its worker before it fails.

    Raises:
        ConfigError: If Ray is not installed (`pip install 'wbc-suite[ray]'`).

    Source: https://docs.ray.io/en/latest/ray-core/fault_tolerance/tasks.html
    """

    def __init__(self, *, workers: int | None = None, attempts: int = 3) -> None:
        try:
            import ray  # pyright: ignore[reportMissingImports]
        except ImportError as error:
            raise ConfigError(
                "Ray is not installed: pip install 'wbc-suite[ray]'. The 'process' "
                "executor needs no package."
            ) from error
        self._ray = ray
        self._attempts = attempts
        if not ray.is_initialized():
            ray.init(log_to_driver=False)
        self._workers = workers or max(1, int(ray.cluster_resources().get("CPU", 1)))

    def run(
        self, work: Work, items: Sequence[WorkItem], folder: Path
    ) -> Iterator[Outcome]:
        """Run all items; see `Executor`. All machines must share the folder."""
        remote = self._ray.remote(num_cpus=1, max_retries=self._attempts - 1)(run_item)
        waiting = list(reversed(items))
        busy = {}
        while waiting or busy:
            while waiting and len(busy) < self._workers:
                item = waiting.pop()
                busy[remote.remote(work, item, folder)] = item
            done, _ = self._ray.wait(list(busy), num_returns=1)
            for reference in done:
                yield self._outcome(reference, busy.pop(reference))

    def _outcome(self, reference: object, item: WorkItem) -> Outcome:
        try:
            return self._ray.get(reference)
        except self._ray.exceptions.RayTaskError as error:
            # `run_item` raises nothing: the worker could not load the work.
            reason = str(error).strip().splitlines()[-1]
            return Outcome(
                name=item.name,
                error=f"{reason}. All machines need wbc_suite and the work's module.",
            )
        except self._ray.exceptions.RayError as error:
            return Outcome(
                name=item.name,
                error=f"Its worker was lost {self._attempts} times: "
                f"{type(error).__name__}.",
            )
