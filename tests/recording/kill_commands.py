"""Kill commands that write at random moments, then run each again; for test_crashes.

Prints, for each command, how many kills came before its end.
"""

import os
import shutil
import signal
import sys
import time
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from random_episodes import HEADER, make_episode

from wbc_suite import atomic_files
from wbc_suite.recording import Dataset, Store, editing
from wbc_suite.recording.converting import convert
from wbc_suite.robot import load_robot

EPISODES, LENGTH = 12, 200
LAYOUTS = ["robomimic", "npz", "minari"]
LAYOUTS += ["mcap"] if find_spec("mcap") else []
LAYOUTS += ["lerobot"] if find_spec("pyarrow") else []
PANDA = load_robot("Panda").to_mjcf()


def commands(source, out):
    """Return what writes `out`, or the source itself, by name."""
    made = {
        layout: lambda layout=layout: convert(source, out, layout) for layout in LAYOUTS
    }
    return made | {
        "merge": lambda: editing.merge([source, source], out),
        "filter": lambda: editing.filter_dataset(source, out, lambda *_: True),
        "split": lambda: editing.split(source, valid=0.25),
        "repair": lambda: editing.repair(source),
        "export": lambda: atomic_files.write_bytes(out, PANDA.encode()),
    }


def content(path):
    """Return all files at a path by name, but for numbers that change each time."""
    files = sorted(path.rglob("*")) if path.is_dir() else [path]
    return [(f.relative_to(path), f.stat().st_size) for f in files if f.is_file()]


def damage(path):
    """Cut the file of a recording short; its episodes are beside it."""
    with Store(path, HEADER) as store:
        store.add(make_episode(99, length=LENGTH))
        parts = path.with_name(path.name + ".parts")
        shutil.copytree(parts, parts.with_name("kept"))
    shutil.move(parts.with_name("kept"), parts)


def run_and_kill(command, wait):
    """Run a command in a child; return whether it was killed before its end."""
    child = os.fork()
    if child == 0:
        command()
        os._exit(0)
    time.sleep(wait)
    os.kill(child, signal.SIGKILL)
    return os.waitpid(child, 0)[1] != 0


def try_command(folder, name, kills, rng):
    """Kill a command some times; check what is left, and what the next run makes."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    source, out = folder / "source.hdf5", folder / "out-v0"
    with Store(source, HEADER) as store:
        for seed in range(EPISODES):
            store.add(make_episode(seed, length=LENGTH))
    if name == "repair":
        damage(source)
    begun = time.perf_counter()
    commands(source, out)[name]()
    whole = time.perf_counter() - begun
    wanted, cut = content(out) if out.exists() else None, 0
    for _ in range(kills):
        if name == "repair":
            damage(source)
        if out.is_dir():
            shutil.rmtree(out)
        cut += run_and_kill(commands(source, out)[name], rng.uniform(0.0, 1.2 * whole))
        with Dataset(source) as dataset:
            assert len(list(dataset)) >= EPISODES, "the source lost something"
        if out.exists() and content(out):
            assert content(out) == wanted, f"{name} left something torn"
            if out.is_dir():  # the command was finished, and would refuse it
                shutil.rmtree(out)
        commands(source, out)[name]()
        assert wanted is None or content(out) == wanted
        left = {p.name for p in folder.iterdir()} - {source.name, out.name}
        assert left <= {"source.hdf5.parts"}, f"{name} left {left}"
    return cut


folder, total = Path(sys.argv[1]), int(sys.argv[2])
rng = np.random.default_rng(0)
names = list(commands(folder, folder))
for k, name in enumerate(names):
    share = total // len(names) + (k < total % len(names))
    print(name, share, try_command(folder / name, name, share, rng), flush=True)
