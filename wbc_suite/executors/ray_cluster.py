"""Items on a Ray cluster: many machines, none of which needs to last."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from wbc_suite.errors import ConfigError
from wbc_suite.executors.item import Item, Outcome, Work, attempt

__all__ = ["RayCluster"]


class RayCluster:
    """Does items as Ray tasks; Ray does those of dead workers again, elsewhere.

    Args:
        address: Of the cluster; None for `RAY_ADDRESS`, or a cluster of this machine.
        workers: How many at once; None for as many as the cluster has processors.
        attempts: How often an item may lose its worker before it is given up.

    Raises:
        ConfigError: If Ray is not installed (`pip install 'wbc-suite[ray]'`).

    Source: https://docs.ray.io/en/latest/ray-core/fault_tolerance/tasks.html
    """

    def __init__(
        self,
        address: str | None = None,
        *,
        workers: int | None = None,
        attempts: int = 3,
    ) -> None:
        try:
            import ray  # pyright: ignore[reportMissingImports]
        except ImportError as error:
            raise ConfigError(
                "Ray is not installed: pip install 'wbc-suite[ray]'. The 'process' "
                "executor needs nothing."
            ) from error
        self._ray = ray
        self._attempts = attempts
        if not ray.is_initialized():
            ray.init(address=address, log_to_driver=False)
        self._workers = workers or max(1, int(ray.cluster_resources().get("CPU", 1)))

    def run(self, work: Work, items: Sequence[Item], folder: Path) -> Iterator[Outcome]:
        """Do all items; see `Executor`. All machines must share the folder."""
        remote = self._ray.remote(num_cpus=1, max_retries=self._attempts - 1)(attempt)
        waiting = list(reversed(items))
        busy = {}
        while waiting or busy:
            while waiting and len(busy) < self._workers:
                item = waiting.pop()
                busy[remote.remote(work, item, folder)] = item
            done, _ = self._ray.wait(list(busy), num_returns=1)
            for reference in done:
                yield self._outcome(reference, busy.pop(reference))

    def _outcome(self, reference: object, item: Item) -> Outcome:
        try:
            return self._ray.get(reference)
        except self._ray.exceptions.RayTaskError as error:
            # `attempt` raises nothing: the worker could not even load the work.
            told = str(error).strip().splitlines()[-1]
            return Outcome(
                name=item.name,
                error=f"{told}. Is wbc_suite, and the work's module, everywhere?",
            )
        except self._ray.exceptions.RayError as error:
            return Outcome(
                name=item.name,
                error=f"Its worker was lost {self._attempts} times: "
                f"{type(error).__name__}.",
            )
