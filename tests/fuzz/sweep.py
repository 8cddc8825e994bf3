"""Damaged files through every command that reads them: how the commands end.

    .venv/bin/python tests/fuzz/sweep.py [--texts 500] [--recordings 300] [--meshes 100]

A whole file of each kind is damaged, seeded, and read by `--commands` of the commands
that read such files, or by all of them. A command is at fault if a signal ends it, it
prints a traceback or a text that is not ours, opens a file that is neither the user's
nor the program's, or takes more than 10 s of CPU time or 1 GB. Those files are kept.
"""

import argparse
import json
import os
import random
import shutil
import sys
import tempfile
from pathlib import Path

from damage import Damage
from forked_commands import SECONDS, Watch, run
from whole_files import OF_RESULTS, write_originals

import wbc_suite
from wbc_suite.sensing import gl_backend

RECORDINGS = ("recording", "recording", "recording", "part", "minari")
TEXTS = (
    *("mjcf", "nested", "nested_joints", "nested_tool", "urdf", "robot", "assembly"),
    *("gripper", "base", "skin", "benchmark", "arena", "json", "results"),
    *("tiago_basic", "gr1_whole_body_ik", "gr1freebody_whole_body_id"),
)
"""Kinds of files by what is counted; all others count as meshes."""
ENDS = ("xml", "obj", "stl", "png", "toml", "json", "hdf5", "pem", "urdf")


def outside_of(folder):
    """Write files that no command may open; return them, and names that lead there."""
    hidden = folder / "outside"
    hidden.mkdir()
    files = [hidden / f"secret.{end}" for end in ENDS]
    for file in files:
        file.write_text("<mujoco/>" if file.suffix == ".xml" else "secret = 1\n")
    near = [f"../outside/{file.name}" for file in files]
    deep = [f"../../../outside/{file.name}" for file in files]
    names = [*near, *deep, *map(str, files), "/dev/zero", "/etc/passwd", "link.xml"]
    names += ["pipe.stl", "link0.stl/../../outside/secret.stl", "file:///etc/passwd"]
    names += [f"package://../outside/{file.name}" for file in files[:2]]
    return files, [*names, "arm.xml", ".", "", "panda.xml", "lift.hdf5", "lift.toml"]


def place(original, folder, hidden):
    """Copy the folder of a whole file, with a pipe and links that lead out."""
    shutil.copytree(original, folder)
    os.mkfifo(folder / "pipe.stl")
    for end in ("xml", "obj", "toml"):
        (folder / f"link.{end}").symlink_to(hidden / f"secret.{end}")


def compile_for(original):
    """Compile the loop of robosuite's laws, which each process does once."""
    folder, name, _ = original
    env = wbc_suite.make("Lift", controller_configs=str(folder / name))
    env.reset(seed=0)
    env.step(env.hold_action)


def kinds_of(found, texts, recordings, meshes):
    """Return the kind of each file that is damaged."""
    of_meshes = [k for k in found if k not in TEXTS + RECORDINGS]
    for count, kinds in ((texts, TEXTS), (recordings, RECORDINGS), (meshes, of_meshes)):
        present = [kind for kind in kinds if kind in found]
        yield from (present[k % len(present)] for k in range(count))


def sweep(given, folder):
    """Yield the number and kind of each file, and the outcome of each command."""
    files, names = outside_of(folder)
    found = write_originals(folder / "whole")
    compile_for(found["json"])
    inside = folder / "whole" / "evaluated"
    inside.mkdir()
    first = run(OF_RESULTS[0], inside)
    assert not first.fault, first
    (result,) = (inside / "results").glob("*.json")
    found["results"] = inside, f"results/{result.name}", OF_RESULTS
    kinds = list(kinds_of(found, given.texts, given.recordings, given.meshes))
    watch = Watch(files)
    for number, kind in enumerate(kinds):
        if given.only and str(number) not in [*given.only.split(","), kind]:
            continue
        rng = random.Random(f"{given.seed} {number} {kind}")
        original, name, commands = found[kind]
        if given.commands:
            commands = rng.sample(commands, min(given.commands, len(commands)))
        work = folder / "work" / f"{number}"
        broken = folder / "work" / f"{number}-{Path(name).name}"
        broken.parent.mkdir(exist_ok=True)
        shutil.copy(original / name, broken)
        Damage(rng, names).file(broken)
        watch.opened()
        faults = 0
        for line in commands:
            for _ in range(2):  # the first one may compile, once on a machine
                place(original, work, folder / "outside")
                shutil.copy(broken, work / name)
                outcome = run(line.replace("FILE", name), work, watch)
                shutil.rmtree(work)
                if outcome.seconds < SECONDS:
                    break
            yield number, kind, outcome
            faults += bool(outcome.fault)
        if not faults:
            broken.unlink()


def row_of(number, kind, outcome):
    """Return what is written of an outcome."""
    row = {"number": number, "kind": kind, "line": outcome.line, "code": outcome.code}
    row |= {"s": round(outcome.seconds, 2), "MB": round(outcome.megabytes)}
    return row | {"fault": outcome.fault}


def print_table(rows):
    """Print how many commands read files of each kind, and the most that one took."""
    print(f"{'kind':26} files  runs  refused  most s  most MB  faults")
    kinds = sorted({row["kind"] for row in rows})
    for kind in (*kinds, "all"):
        own = [row for row in rows if kind in (row["kind"], "all")]
        files = len({row["number"] for row in own})
        refused = sum(row["code"] != 0 for row in own)
        seconds, most = (max(row[key] for row in own) for key in ("s", "MB"))
        wrong = sum(bool(row["fault"]) for row in own)
        print(
            f"{kind:26} {files:5} {len(own):5} {refused:8} {seconds:7.1f} {most:8} "
            f"{wrong:7}"
        )


def main():
    about, *_ = (__doc__ or "").splitlines()
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--texts", type=int, default=500, help="URDF, MJCF, TOML, JSON")
    parser.add_argument("--recordings", type=int, default=300, help="HDF5 files")
    parser.add_argument("--meshes", type=int, default=100, help="and all other files")
    parser.add_argument("--commands", type=int, default=0, help="for each file; 0: all")
    parser.add_argument("--only", default="", help="numbers of files, or kinds: 3,urdf")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", type=Path, help="add each outcome to this file")
    given = parser.parse_args()
    if libraries := gl_backend.missing_environment():
        os.execve(sys.executable, sys.orig_argv, os.environ | libraries)
    folder, rows = Path(tempfile.mkdtemp(prefix="damaged_")), []
    for number, kind, outcome in sweep(given, folder):
        rows.append(row_of(number, kind, outcome))
        if given.json:
            with given.json.open("a") as file:
                file.write(json.dumps(rows[-1]) + "\n")
        if outcome.fault:
            print(f"{number} {kind}: {outcome.line}: {outcome.fault}")
            print(outcome.said[-1500:], flush=True)
    print_table(rows)
    if any(row["fault"] for row in rows):
        sys.exit(f"The files at fault are in {folder / 'work'}.")
    shutil.rmtree(folder)


if __name__ == "__main__":
    main()
