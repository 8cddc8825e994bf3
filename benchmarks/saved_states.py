"""Saved states: whether a world that is restored from a recording is the one it was.

Episodes of the benchmark's expert are recorded into a file. A state of each, at a
random step, is read from the file and restored in another environment, which has never
seen the episode. Its model and its data are compared with those of the recording at
that step; then the recorded actions are continued.

A world is equal if all arrays of the model are, and all those of the data that follow
from the state or decide the next step; contacts, accelerations and sensors are one step
behind during an episode. An end is the same if success, failure and error of the last
step are; it is exact if time, qpos and qvel are equal bit for bit.

Usage: python benchmarks/saved_states.py [BENCHMARK ...] [--episodes 20] [--base 8000]
    [--quick] [--json FILE]
"""

import tempfile
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from harness.report import Report, options

import wbc_suite
from wbc_suite.benchmark import BENCHMARKS
from wbc_suite.envs import RobotEnv
from wbc_suite.envs.states import motion_size
from wbc_suite.evaluation.policies import make_policy
from wbc_suite.recording import Dataset
from wbc_suite.wrappers import DataCollection

LONG = ("TwoArmTransport", "ToolHang", "NutAssembly", "PickPlace")
"""Benchmarks with several objects, which experts solve within 1000 steps, not 500."""

OF_DATA = (
    *("time", "qpos", "qvel", "act", "qacc_warmstart", "ctrl", "qfrc_applied"),
    *("xfrc_applied", "eq_active", "mocap_pos", "mocap_quat", "userdata"),
    *("xpos", "xquat", "xmat", "xipos", "ximat", "xanchor", "xaxis", "geom_xpos"),
    *("geom_xmat", "site_xpos", "site_xmat", "subtree_com", "cinert", "cdof"),
)
"""Arrays of the data that are compared."""

Arrays = dict[str, np.ndarray]


def arrays_of(env: RobotEnv) -> Arrays:
    """Return copies of all arrays of the model, and of those of the data."""
    model, data = env.simulation.model, env.simulation.data
    found = {f"data.{name}": np.array(getattr(data, name)) for name in OF_DATA}
    for name in dir(model):
        value = None if name.startswith("_") else getattr(model, name)
        if isinstance(value, np.ndarray):
            found[f"model.{name}"] = value.copy()
    return found


def unequal(one: Arrays, other: Arrays) -> list[str]:
    """Return the names of arrays that differ in any bit."""
    return [name for name, x in one.items() if not np.array_equal(x, other[name])]


def end_of(info: dict[str, Any]) -> tuple[Any, ...]:
    """Return how an episode ended."""
    return info["success"], info.get("failure"), "physics_error" in info


def record(env: Any, seed: int, rng: np.random.Generator) -> dict[str, Any]:
    """Record an episode; return its end, and a world in its midst."""
    inner, info = env.unwrapped, {"success": False}
    observation, _ = env.reset(seed=seed)
    policy = make_policy("expert", inner, seed)
    # The step is drawn as the episode goes on: each is as likely as any other.
    step, world = 0, arrays_of(inner)
    for k in range(inner.horizon):
        if k > 0 and rng.uniform() < 1.0 / (k + 1):
            step, world = k, arrays_of(inner)
        observation, _, terminated, truncated, info = env.step(policy(observation))
        if terminated or truncated:
            break
    return {"end": end_of(info), "step": step, "world": world}


def restore(env: RobotEnv, episode: Any, found: dict[str, Any]) -> dict[str, Any]:
    """Restore a state of a recorded episode, and continue with its actions."""
    env.reset(seed=1)
    env.reset_to(episode.columns["states"][found["step"]])
    differ = unequal(found["world"], arrays_of(env))
    info: dict[str, Any] = {}
    for action in episode.columns["actions"][found["step"] :]:
        *_, info = env.advance(action)
    size, end = motion_size(env.simulation.model), episode.final_state
    gap = np.abs(env.physics_state[:size] - end[:size]).max()
    return {"differ": differ, "same": end_of(info) == found["end"], "gap": float(gap)}


def stored_bytes(path: Path) -> int:
    """Return how many bytes the states of a recording take in the file."""
    with h5py.File(path) as file:
        data: Any = file["data"]
        return sum(demo["states"].id.get_storage_size() for demo in data.values())


def measure(name: str, seeds: range, folder: Path) -> dict[str, Any]:
    """Record and restore episodes of a benchmark, and return what it came to."""
    path = folder / f"{name}.hdf5"
    horizon = 1000 if name in LONG else 500
    arguments: Any = {"terminate_on_success": True, "horizon": horizon}
    made = wbc_suite.make(name, **arguments)
    env, rng = DataCollection(made, path), np.random.default_rng(seeds.start)
    recorded = []
    for seed in seeds:
        recorded.append(record(env, seed, rng))
        env.recorder.keep()
    env.close()
    fresh = wbc_suite.make(name, **arguments).unwrapped
    with Dataset(path) as dataset:
        pairs = zip(dataset, recorded, strict=True)
        results = [restore(fresh, episode, found) for episode, found in pairs]
        sizes = [dataset.length(n) for n in dataset.names]
    fresh.close()
    differ = sorted({array for result in results for array in result["differ"]})
    return {
        "case": name,
        "side": " and ".join(robot.name for robot in fresh.robots),
        "episodes": len(results),
        "solved": sum(bool(found["end"][0]) for found in recorded),
        "steps": sum(sizes),
        "worlds_equal": sum(not result["differ"] for result in results),
        "ends_same": sum(result["same"] for result in results),
        "ends_exact": sum(result["gap"] == 0.0 for result in results),
        "largest_gap": max(result["gap"] for result in results),
        "arrays_that_differ": differ,
        "bytes_per_state": stored_bytes(path) / sum(sizes),
        "bytes_uncompressed": 8 * fresh.physics_state.size,
    }


def main() -> None:
    """Measure what the arguments name."""
    parser = options(__doc__, "two episodes of three benchmarks")
    parser.add_argument("benchmarks", nargs="*")
    parser.add_argument("--episodes", type=int, default=20)
    parser.add_argument("--base", type=int, default=8000, help="the first seed")
    given = parser.parse_args()
    chosen = given.benchmarks or sorted(BENCHMARKS)
    if given.quick:
        chosen = given.benchmarks or ("Lift", "Door", "WalkTo")
    count, report = 2 if given.quick else given.episodes, Report()
    with tempfile.TemporaryDirectory() as folder:
        for name in chosen:
            seeds = range(given.base, given.base + count)
            row = measure(name, seeds, Path(folder))
            report.rows.append(row)
            print(row, flush=True)
    counts = ("episodes", "solved", "worlds_equal", "ends_same", "ends_exact")
    report.show("Saved states", ("case", "side", *counts))
    total = {name: sum(row[name] for row in report.rows) for name in counts}
    print(total)
    report.write(given.json)


if __name__ == "__main__":
    main()
