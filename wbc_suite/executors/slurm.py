"""Work items as jobs of a batch system (Slurm), by submitit."""

import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from wbc_suite.errors import ConfigError
from wbc_suite.executors.executor import Outcome, Work, WorkItem, run_item

__all__ = ["Slurm"]

POLL_SECONDS = 0.5


class Slurm:
    """Runs every item as a job of its own; logs are in the folder's `jobs`.

    Args:
        cluster: "slurm", "local" for processes of this machine, None to detect it.
        attempts: How often a job is submitted before its item fails.
        parameters: Parameters of submitit, such as `timeout_min`, `slurm_partition`.

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
                "'process' executor needs no package."
            ) from error
        self._submitit = submitit
        self._cluster = cluster
        self._attempts = attempts
        self._parameters = {"timeout_min": 240, **(parameters or {})}

    def run(
        self, work: Work, items: Sequence[WorkItem], folder: Path
    ) -> Iterator[Outcome]:
        """Run all items; see `Executor`. All machines must share the folder."""
        executor = self._submitit.AutoExecutor(folder / "jobs", cluster=self._cluster)
        executor.update_parameters(**self._parameters)
        jobs = {executor.submit(run_item, work, item, folder): item for item in items}
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
                    jobs[executor.submit(run_item, work, item, folder)] = item
                else:
                    reason = str(error).splitlines()[0]
                    yield Outcome(name=item.name, error=f"Its job failed: {reason}")
            if jobs and not finished:
                time.sleep(POLL_SECONDS)
