"""Executors of clusters: Ray, whose machines may come and go, and Slurm by submitit."""

import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from wbc_suite.errors import ConfigError
from wbc_suite.executors.executor import Outcome, Work, WorkItem, run_item
from wbc_suite.extras import import_extra

NOTE = " The 'process' executor needs no package."
POLL_SECONDS = 0.5  # between two looks at the jobs


class RayCluster:
    """Runs items as Ray tasks; Ray runs those of dead workers again, elsewhere.

    The cluster is that of `RAY_ADDRESS`, or else one on this machine. Needs the extra
    `ray`, or raises ConfigError.

    Args:
        workers: Number of items that run at once; None for one per processor.
        attempts: How often an item may lose its worker before it fails.

    Source: https://docs.ray.io/en/latest/ray-core/fault_tolerance/tasks.html
    """

    def __init__(self, *, workers: int | None = None, attempts: int = 3) -> None:
        self._ray = ray = import_extra("ray", "ray", error=ConfigError, note=NOTE)
        self._attempts = attempts
        if not ray.is_initialized():
            ray.init(log_to_driver=False, include_dashboard=False)  # it has no password
        self._workers = workers or max(1, int(ray.cluster_resources().get("CPU", 1)))

    def run(
        self, work: Work, items: Sequence[WorkItem], folder: Path
    ) -> Iterator[Outcome]:
        """See `Executor`; all machines must share the folder."""
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
            last = str(error).strip().splitlines()[-1]
            reason = f"{last}. All machines need wbc_suite and the work's module."
        except self._ray.exceptions.RayError as error:
            kind = type(error).__name__
            reason = f"Its worker was lost {self._attempts} times: {kind}."
        return Outcome(name=item.name, error=reason)


class Slurm:
    """Runs every item as a job of its own; logs are in the folder's `jobs`.

    Needs the extra `slurm`, or raises ConfigError.

    Args:
        cluster: "slurm", "local" for processes of this machine, None to detect it.
        attempts: How often a job is submitted before its item fails.
        parameters: Parameters of submitit, such as `timeout_min`, `slurm_partition`.

    Source: https://github.com/facebookincubator/submitit
    """

    def __init__(
        self,
        cluster: str | None = None,
        *,
        attempts: int = 3,
        parameters: dict[str, object] | None = None,
    ) -> None:
        self._submitit = import_extra("submitit", "slurm", error=ConfigError, note=NOTE)
        self._cluster, self._attempts = cluster, attempts
        self._parameters = {"timeout_min": 240, **(parameters or {})}

    def run(
        self, work: Work, items: Sequence[WorkItem], folder: Path
    ) -> Iterator[Outcome]:
        """See `Executor`; all machines must share the folder."""
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
