"""Damaged files through every command that reads: an exit code and words, soon.

Each command runs in a fork, so that a crash of a library or a hang is seen as well.
"""

import os
import random
import resource
import shutil
import sys
import threading
import time
import traceback
from importlib.util import find_spec

import pytest

import wbc_suite
from wbc_suite.catalogue import Catalogue
from wbc_suite.cli import main
from wbc_suite.envs.states import write_scene
from wbc_suite.evaluation import make_policy
from wbc_suite.robot import load_robot
from wbc_suite.sensing import gl_backend
from wbc_suite.wrappers import DataCollection

FILES = int(os.environ.get("WBC_SUITE_FUZZ", "5"))
"""Damaged files of each kind: the first for all commands, others for some of them."""
COMMANDS = 3
SECONDS = 10.0  # of CPU time
PATIENCE = 60.0  # s, on a busy machine
LAYOUTS = ["robomimic", "npz", "minari", *(["mcap"] if find_spec("mcap") else [])]

OF_RECORDINGS = (
    "inspect FILE --all --columns --plots lengths.png",
    "verify FILE",
    "repair FILE",
    "merge FILE FILE -o merged.hdf5",
    "split FILE",
    "filter FILE -o filtered.hdf5 --success",
    *(f"convert FILE --to {layout} -o {layout}-v0" for layout in LAYOUTS),
    "replay FILE",
    "replay FILE --by states",
    "replay FILE --film film.webp --size 64",
    "evaluate Lift --policy FILE --episodes 1 --horizon 3 --executor serial -o out",
    "extract FILE -o extracted.hdf5 --workers 1",
    "record Lift --device hold --episodes 1 --horizon 3 --executor serial -o FILE",
    "multiply FILE -o more.hdf5 --episodes 1 --horizon 3 --executor serial",
)
OF_ROBOTS = (
    "check FILE",
    *(f"export FILE --to {form} -o robot.{form}" for form in ("mjcf", "urdf", "toml")),
    "describe-action FILE",
    "render FILE -o robot.png",
    "evaluate Lift --robots FILE --policy hold --episodes 1 --horizon 3 "
    "--executor serial -o out",
)
OF_BENCHMARKS = (
    "check FILE",
    "bench FILE --actions 5",
    "record FILE --device hold --episodes 1 --horizon 3 --executor serial -o new.hdf5",
    "evaluate FILE --policy hold --episodes 1 --horizon 3 --executor serial -o out",
)
OF_CONTROLLERS = ("check FILE", "describe-action GR1 --controller FILE")
OF_JSON = (
    "check FILE --robot Panda",
    "describe-action Panda --controller FILE",
    "evaluate Lift --controller FILE --policy hold --episodes 1 --horizon 3 "
    "--executor serial -o out",
)
OF_RESULTS = (
    "evaluate Lift --policy hold --episodes 1 --horizon 3 --executor serial -o .",
)
JSON = """{
 "type": "BASIC",
 "body_parts": {
  "right": {
   "type": "OSC_POSE", "input_max": 1, "input_min": -1, "kp": 150,
   "output_max": [0.05, 0.05, 0.05, 0.5, 0.5, 0.5],
   "output_min": [-0.05, -0.05, -0.05, -0.5, -0.5, -0.5],
   "damping_ratio": 1, "impedance_mode": "fixed", "kp_limits": [0, 300],
   "damping_ratio_limits": [0, 10], "uncouple_pos_ori": true,
   "input_type": "delta", "input_ref_frame": "base", "ramp_ratio": 0.2,
   "gripper": {"type": "GRIP"}
  }
 }
}
"""
"""A controller file in robosuite's layout."""


def recording(path):
    """Write what is damaged: two short episodes of Lift."""
    made = wbc_suite.make("Lift", robots="Panda", horizon=6)
    with_file = DataCollection(made, path)
    driver = make_policy("expert", made, 0)
    for seed in range(2):
        seen, _ = with_file.reset(seed=seed)
        for _ in range(6):
            seen, *_ = with_file.step(driver(seen))
    with_file.close()


def write_originals(folder):
    """Write one whole file of each kind; return them by kind, with their commands."""
    recording(folder / "lift.hdf5")
    panda = load_robot("Panda", gripper="none")
    (folder / "panda.xml").write_text(write_scene(panda.to_mjspec()))
    (folder / "panda.urdf").write_text(panda.to_urdf())
    gr1 = "gr1_whole_body_ik"
    shipped = {
        f.stem: f for k in ("tasks", "controllers") for f in Catalogue().files(k)
    }
    copied = {"lift": OF_BENCHMARKS, gr1: OF_CONTROLLERS}
    arm = next(f for f in Catalogue().files("robots/arm") if f.stem == "panda")
    shutil.copy(arm, folder / "panda.toml")
    whole = next(f for f in Catalogue().files("robots") if f.stem == "ur5e")
    shutil.copy(whole, folder / "ur5e.toml")
    (folder / "mine.json").write_text(JSON)
    assert not run(OF_RESULTS[0], folder)
    (result,) = (folder / "results").glob("*.json")
    for name in copied:
        shutil.copy(shipped[name], folder / f"{name}.toml")
    return {
        "recording": (folder / "lift.hdf5", OF_RECORDINGS),
        "mjcf": (folder / "panda.xml", OF_ROBOTS),
        "urdf": (folder / "panda.urdf", OF_ROBOTS),
        "robot": (folder / "panda.toml", OF_ROBOTS),
        "assembly": (folder / "ur5e.toml", OF_ROBOTS),
        "json": (folder / "mine.json", OF_JSON),
        "results": (result, OF_RESULTS),
        **{k: (folder / f"{k}.toml", commands) for k, commands in copied.items()},
    }


@pytest.fixture(scope="module")
def originals(tmp_path_factory):
    os.environ |= gl_backend.missing_environment()  # else the first command starts anew
    return write_originals(tmp_path_factory.mktemp("whole"))


def damaged(content, rng):
    """Change bytes, cut a part out, repeat one, or cut the end off."""
    content = bytearray(content)
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(content) + 1)
        part = rng.randrange(1, 200)
        match rng.choice(["byte", "byte", "bit", "cut", "repeat", "noise", "end"]):
            case "byte" | "bit" if at < len(content):
                bit = 1 << rng.randrange(8)
                content[at] = rng.choice([rng.randrange(256), content[at] ^ bit])
            case "cut":
                del content[at : at + part]
            case "repeat":
                content[at:at] = content[at : at + part] * rng.randint(1, 20)
            case "noise":
                content[at : at + part] = rng.randbytes(part)
            case "end" if rng.random() < 0.3:
                del content[at:]
    return bytes(content)


def run(line, folder):
    """Run a command in a fork; return what is wrong with its end, if anything."""
    printed = folder / "printed.txt"
    child = os.fork()
    if child == 0:
        os.chdir(folder)
        output = os.open(printed, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(output, 1)
        os.dup2(output, 2)
        sys.stdout, sys.stderr = (os.fdopen(k, "w") for k in (1, 2))
        sys.argv = ["wbc-suite", *line.split()]
        limit = int(SECONDS)
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))
        code = 70
        try:
            main()
        except SystemExit as ended:
            code = ended.code or 0
        except BaseException:  # noqa: BLE001  (a fork must not go on with pytest)
            traceback.print_exc()
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    timer = threading.Timer(PATIENCE, os.kill, (child, 9))
    timer.start()
    began = time.monotonic()
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    timer.cancel()
    text = printed.read_text(errors="replace")
    if status in (0, 1, 2) and "Traceback" not in text:
        return ""
    return f"{line}: {status} after {time.monotonic() - began:.1f} s: {text[-3000:]}"


KINDS = (
    *("recording", "mjcf", "urdf", "robot", "assembly", "lift", "gr1_whole_body_ik"),
    *("json", "results"),
)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_damaged_file_ends_no_command_in_a_traceback(kind, originals, tmp_path):
    original, commands = originals[kind]
    rng, content = random.Random(kind), original.read_bytes()
    wrong = []
    for index in range(FILES):
        chosen = (
            rng.sample(commands, min(len(commands), COMMANDS)) if index else commands
        )
        folder = tmp_path / str(index)
        folder.mkdir()
        broken = damaged(content, rng)
        for line in chosen:
            inside = folder / "results" if kind == "results" else folder
            inside.mkdir(exist_ok=True)
            (inside / original.name).write_bytes(broken)
            wrong.append(run(line.replace("FILE", original.name), folder))
        if not any(wrong[-len(chosen) :]):
            shutil.rmtree(folder)
    assert not any(wrong), "\n\n".join(filter(None, wrong))
