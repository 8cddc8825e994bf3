"""Damaged files through every command that reads: an exit code and words, soon.

Each command runs in a process, so that a crash of a library or a hang is seen as well.
"""

import os
import random
import re
import resource
import shutil
import struct
import subprocess
import sys
import threading
import time
import traceback

import pytest
from whole_files import OF_RESULTS, write_originals

from wbc_suite.cli import main
from wbc_suite.sensing import gl_backend

FILES = int(os.environ.get("WBC_SUITE_FUZZ", "5"))
"""Damaged files of each kind: the first for all commands, others for some of them."""
COMMANDS = 3
SECONDS = 10.0  # of CPU time
PATIENCE = 300.0  # s, on a busy machine


WORDS = re.compile(rb"(?<=[\s=:,\[(\"'>])-?[\w.]+")
"""Numbers and names in a text."""
HOSTILE = (
    *(b"1e308", b"-1", b"0", b"nan", b"inf", b"9" * 40, b"9" * 5000, b"true", b"''"),
    *(b"[1, 2]", b"{}", b"[" * 3000, b"{a=" * 3000, b"a." * 3000, b"<a>" * 3000),
    *(b"\x00", b"\xff", b"../../x", b"/dev/zero", "\u202e\U0001f9e8".encode(), b""),
)
NUMBERS = (-1, 0, 2**31 - 1, 2**63 - 1, float("nan"), float("inf"), 1e300)
"""Values in binary files, of four or eight bytes."""


@pytest.fixture(scope="module")
def originals(tmp_path_factory):
    os.environ |= gl_backend.missing_environment()  # else the first command starts anew
    folder = tmp_path_factory.mktemp("whole")
    found = write_originals(folder)
    inside = folder / "evaluated"
    inside.mkdir()
    assert not run(OF_RESULTS[0], inside)
    (result,) = (inside / "results").glob("*.json")
    return found | {"results": (inside, f"results/{result.name}", OF_RESULTS)}


def damaged(content, rng):
    """Change words, numbers and bytes, cut a part out, repeat one, or cut the end."""
    content = bytearray(content)
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(content) + 1)
        part = rng.randrange(1, 200)
        match rng.choice(
            ["word", "word", "number", "bit", "cut", "repeat", "noise", "end"]
        ):
            case "word" if word := WORDS.search(content, at):
                content[slice(*word.span())] = rng.choice(HOSTILE)
            case "number" if b"\x00" in content:
                number = rng.choice(NUMBERS)
                whole = "<q" if number == 2**63 - 1 else rng.choice(["<i", "<q"])
                form = "<d" if number == 1e300 else rng.choice(["<f", "<d"])
                packed = struct.pack(whole if isinstance(number, int) else form, number)
                content[at & ~3 : (at & ~3) + len(packed)] = packed
            case "bit" if at < len(content):
                content[at] ^= rng.choice([1 << rng.randrange(8), rng.randrange(256)])
            case "cut":
                del content[at : at + part]
            case "repeat":
                content[at:at] = content[at : at + part] * rng.randint(1, 20)
            case "noise":
                content[at : at + part] = rng.randbytes(part)
            case "end" if rng.random() < 0.3:
                del content[at:]
    return bytes(content)


def draws(line):
    """Whether a command draws; a fork cannot where its parent has done so before."""
    return line.startswith("render") or "--film" in line


def limit_time():
    """Limit this process; its own children may have a limit of their own."""
    _, most = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (int(SECONDS), most))


def started(line, folder, printed):
    """Start a command in a process of its own; return its id."""
    program = "from wbc_suite.cli import main; main()"
    with printed.open("w") as output:
        return subprocess.Popen(
            [sys.executable, "-c", program, *line.split()],
            **{"cwd": folder, "stdout": output, "stderr": output},
            preexec_fn=limit_time,
        ).pid


def forked(line, printed):
    """Start a command in a fork, which has all imported; return its id."""
    child = os.fork()
    if child == 0:
        os.chdir(printed.parent)
        output = os.open(printed, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(output, 1)
        os.dup2(output, 2)
        sys.stdout, sys.stderr = (os.fdopen(k, "w") for k in (1, 2))
        sys.argv = ["wbc-suite", *line.split()]
        limit_time()
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
    return child


def run(line, folder):
    """Run a command in a process; return what is wrong with its end, if anything."""
    printed = folder / "printed.txt"
    child = started(line, folder, printed) if draws(line) else forked(line, printed)
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
    *("recording", "part", "npz", "minari", "mcap", "results", "json", "benchmark"),
    *("mjcf", "urdf", "robot", "assembly", "gripper", "base", "skin"),
    *("gr1_whole_body_ik", "gr1freebody_whole_body_id", "arena", "texture", "stone"),
    *("stl", "obj", "glb", "dae", "skin_stl", "skin_obj", "skin_glb", "skin_dae"),
)
PACKAGES = {"mcap": "mcap", "glb": "trimesh", "skin_glb": "trimesh"}
"""What writes files of some kinds; it may be missing."""


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_damaged_file_ends_no_command_in_a_traceback(kind, originals, tmp_path):
    if kind in PACKAGES:
        pytest.importorskip(PACKAGES[kind])
    original, name, commands = originals[kind]
    rng, content = random.Random(kind), (original / name).read_bytes()
    wrong = []
    for index in range(FILES):
        chosen = (
            rng.sample(commands, min(len(commands), COMMANDS)) if index else commands
        )
        folder, broken = tmp_path / str(index), damaged(content, rng)
        for line in chosen:
            shutil.copytree(original, folder, dirs_exist_ok=True)
            (folder / name).write_bytes(broken)
            wrong.append(run(line.replace("FILE", name), folder))
        if not any(wrong[-len(chosen) :]):
            shutil.rmtree(folder)
    assert not any(wrong), "\n\n".join(filter(None, wrong))
