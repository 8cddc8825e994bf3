"""Films of episodes that failed, played again from their seeds."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from wbc_suite.evaluation.results import Film, Results
from wbc_suite.evaluation.rollouts import Case, make_case, payload_of, run_episode
from wbc_suite.executors import Executor, WorkItem, run_items
from wbc_suite.recording.video import write_video

SIZE = 224  # pixels
MOST_PICTURES = 80  # of a film
RATE = 10.0  # pictures per second


def film_failures(
    results: Results, *, most: int, folder: Path, executor: Executor
) -> None:
    """Film the first failures of each case, at most so many; add them to the results.

    An episode that cannot be drawn is left out.
    """
    items: dict[str, Case] = {}
    wanted: list[WorkItem] = []
    for case, episodes in results.episodes.items():
        failed = [e for e in episodes if not e["succeeded"]][:most]
        for episode in failed:
            payload = payload_of(case) | {"film": episode["seed"]}
            payload |= {"every": max(1, -(-int(episode["steps"]) // MOST_PICTURES))}
            wanted.append(WorkItem.with_digest("film", payload))
            items[wanted[-1].name] = case
    for outcome in run_items(film, wanted, folder=folder, executor=executor):
        if outcome.error is None:
            found: Mapping[str, Any] = outcome.result
            made = Film(
                seed=found["seed"],
                path=folder / found["path"],
                steps=found["steps"],
            )
            results.films.setdefault(items[outcome.name], []).append(made)


def film(item: WorkItem, folder: Path) -> dict[str, Any]:
    """Film one episode; return its seed, steps, and the file in the folder."""
    payload, pictures = item.payload, []
    env = make_case(payload, render_mode="rgb_array", render_size=(SIZE, SIZE))
    count = 0

    def draw() -> None:
        nonlocal count
        if count % payload["every"] == 0:
            pictures.append(np.asarray(env.render()))
        count += 1

    try:
        seed = payload["film"]
        episode = run_episode(env, env, seed, payload["policy"], after_step=draw)
    finally:
        env.close()
    path = Path("films") / f"{item.name}.webp"
    write_video(pictures, folder / path, rate=RATE)
    return {"seed": seed, "steps": episode["steps"], "path": str(path)}
