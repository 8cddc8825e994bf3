"""Items as jobs of a batch system (Slurm), through submitit."""

import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from wbc_suite.errors import ConfigError
from wbc_suite.executors.item import Item, Outcome, Work, attempt

__all__ = ["Slurm"]

POLL_SECONDS = 0.5


class Slurm:
    """Does every item as a job of its own; logs lie in the folder's `jobs`.

    Args:
        cluster: "slurm", "local" for processes of this machine, None for what is here.
        attempts: How often a job that fails is handed in again.
        parameters: Further ones of submitit, such as `timeout_min`, `slurm_partition`.

    Raises:
        ConfigError: If submitit is not installed (`pip install 'wbc-suite[slurm]'`).

    Source: https://github.com/facebookincubator/submitit
    """

    def __init__(
        self,
        cluster: str | None = None,
        *,
        attempts: int = 3,
        parameters: dict[str, object] | None = None,
    ) -> None:
        try:
            import submitit  # pyright: ignore[reportMissingImports]
        except ImportError as error:
            raise ConfigError(
                "submitit is not installed: pip install 'wbc-suite[slurm]'. The "
                "'process' executor needs nothing."
            ) from error
        self._submitit = submitit
        self._cluster = cluster
        self._attempts = attempts
        self._parameters = {"timeout_min": 240, **(parameters or {})}

    def run(self, work: Work, items: Sequence[Item], folder: Path) -> Iterator[Outcome]:
        """Do all items; see `Executor`. All machines must share the folder."""
        executor = self._submitit.AutoExecutor(folder / "jobs", cluster=self._cluster)
        executor.update_parameters(**self._parameters)
        jobs = {executor.submit(attempt, work, item, folder): item for item in items}
        tries = {item.name: 1 for item in items}
        while jobs:
            finished = [job for job in jobs if job.done()]
            for job in finished:
                item = jobs.pop(job)
                error = job.exception()
                if error is None:
                    yield job.result()
                elif tries[item.name] < self._attempts:
                    tries[item.name] += 1
                    jobs[executor.submit(attempt, work, item, folder)] = item
                else:
                    told = str(error).splitlines()[0]
                    yield Outcome(name=item.name, error=f"Its job failed: {told}")
            if jobs and not finished:
                time.sleep(POLL_SECONDS)
