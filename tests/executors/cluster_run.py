"""Run by the cluster's own environment: six items, one of them a killer of workers.

Arguments: name of the executor, folder, and the JSON file for the outcomes: Ray writes
its log where a script prints.
"""

import json
import os
import signal
import sys
from pathlib import Path

from wbc_suite.executors import Executor, WorkItem, run_items


def killed(item, folder):
    """Let b kill its worker the first time, c every time."""
    mark = folder / f"{item.name}.seen"
    before = mark.exists()
    mark.touch()
    if item.name == "c" or (item.name == "b" and not before):
        os.kill(os.getpid(), signal.SIGKILL)
    return {"twice": 2 * item.payload["number"]}


def executor(name) -> Executor:
    if name == "ray":
        import ray  # pyright: ignore[reportMissingImports]

        from wbc_suite.executors.clusters import RayCluster

        ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
        return RayCluster(attempts=2)
    from wbc_suite.executors.clusters import Slurm

    return Slurm("local", attempts=2)


if __name__ == "__main__":
    import cluster_run  # workers find it by this name, not as __main__

    items = [WorkItem(name=n, payload={"number": k}) for k, n in enumerate("abcdef")]
    folder = Path(sys.argv[2])
    outcomes = run_items(
        cluster_run.killed, items, folder=folder, executor=executor(sys.argv[1])
    )
    found = {o.name: [o.result.get("twice"), o.error] for o in outcomes}
    Path(sys.argv[3]).write_text(json.dumps(found))
