"""Ctrl-C and SIGTERM at any moment: soon over, the right exit code, a whole file."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from wbc_suite.cli import interrupts
from wbc_suite.recording import Dataset

TIMES = int(os.environ.get("WBC_SUITE_SIGNALS", "1"))
"""Signals for each command and kind of signal; 17 make 204, in a quarter of an hour."""
RECORD = ("record", "Lift", "--episodes", "500", "--horizon", "20")
COMMANDS = {
    "list": (("list",), 0.5),
    "start": (RECORD, 1.0),
    "compile": (RECORD, 8.0),  # without a cache of compiled kernels
    "step": (("bench", "Lift", "--actions", "100000"), 8.0),
    "record": (RECORD, 8.0),
    "evaluate": (("evaluate", "Lift", "--episodes", "500"), 8.0),
    "teleop": (("teleop", "--robots", "Panda", "--port", "0"), 8.0),
}
"""Arguments, and the longest time until a signal, s."""
PATIENCE = 60.0  # s, after which a process hangs


def wait_for_handlers(process):
    """Wait until a process handles SIGTERM: before, Python itself is starting."""
    status = Path(f"/proc/{process.pid}/status")
    while status.exists() and process.poll() is None:
        caught = re.search(r"^SigCgt:\s*(\w+)", status.read_text(), re.MULTILINE)
        if caught and int(caught[1], 16) >> (signal.SIGTERM - 1) & 1:
            return
        time.sleep(0.01)


def interrupted(arguments, number, wait, cache=None):
    """Return exit code and what was printed, or None if it had ended by itself."""
    process = subprocess.Popen(
        [sys.executable, "-m", "wbc_suite.cli", *arguments],
        env=os.environ | ({"XDG_CACHE_HOME": str(cache)} if cache else {}),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    wait_for_handlers(process)
    time.sleep(wait)
    if process.poll() is not None:
        return None
    process.send_signal(number)
    printed, _ = process.communicate(timeout=PATIENCE)
    return process.returncode, printed


@pytest.mark.sample(5)
@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("command", COMMANDS)
def test_a_signal_ends_a_command(command, number, tmp_path):
    out, rng = tmp_path / "a.hdf5", np.random.default_rng(number)
    extra = {"record": ("--out", str(out)), "evaluate": ("-o", str(tmp_path / "r"))}
    (name, *arguments), longest = COMMANDS[command]
    for k in range(TIMES):
        cache = tmp_path / f"cache {k}" if command == "compile" else None
        line, wait = (name, *arguments, *extra.get(name, ())), rng.uniform(0.0, longest)
        result = interrupted(line, number, wait, cache)
        if result is None:
            assert command == "list", "it ended by itself"
            continue
        code, printed = result
        print(f"{command} {number} after {wait:.2f} s")
        assert code == 128 + number, printed
        assert "Traceback" not in printed
        assert "wbc-suite: stopped. " in printed
        if out.exists() or out.with_name("a.hdf5.parts").exists():
            with Dataset(out) as dataset:
                list(dataset)


@pytest.mark.slow
def test_a_command_that_does_not_listen_is_ended(tmp_path):
    """As while a kernel is compiled: the main thread is in C, and never returns."""
    code = (
        "import signal, sys, time; sys.argv = ['wbc-suite', 'record'];"
        "from wbc_suite.cli.interrupts import signals_end_the_process;"
        "block = signals_end_the_process(); block.__enter__();"
        "signal.pthread_sigmask(signal.SIG_BLOCK, []);"
        "print('ready', flush=True);"
        "import re; re.match('(a*)*b', 'a' * 40)"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    process.send_signal(signal.SIGINT)
    assert process.wait(PATIENCE) == 130


def test_the_grace_of_a_process_is_less_than_a_second(monkeypatch):
    """The thread waits so long in all, and then ends the process; no clock is read."""
    waited, left = [], []

    class Clock:
        def wait(self, seconds):
            waited.append(seconds)

    monkeypatch.setattr(interrupts.threading, "Event", Clock)
    monkeypatch.setattr(interrupts, "_leave", left.append)
    monkeypatch.setattr(interrupts, "_say_what_is_kept", lambda: waited.append("said"))
    reader, writer = os.pipe()
    os.write(writer, bytes([signal.SIGWINCH, signal.SIGTERM]))  # another one before
    interrupts._end_in_time(reader)
    assert left == [signal.SIGTERM]
    assert waited.count("said") == 1
    assert sum(s for s in waited if s != "said") == pytest.approx(interrupts.GRACE)
    assert interrupts.GRACE < 1.0
    os.close(writer)
    interrupts._end_in_time(reader)  # the block has ended
    assert len(left) == 1


def test_an_exception_that_a_library_makes_of_the_end_is_not_shown():
    """As pydantic does when it builds a class, and numba after a callback."""
    code = (
        "import os, signal;"
        "from wbc_suite.cli.interrupts import signals_end_the_process as block\n"
        "with block():\n"
        "    try:\n"
        "        os.kill(os.getpid(), signal.SIGTERM)\n"
        "    except SystemExit as end:\n"
        "        raise ValueError('half a class') from end\n"
    )
    command = [sys.executable, "-c", code]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == 143
    assert ended.stderr == (
        "\nwbc-suite: stopped. No file is left half-written. Run the command again.\n"
    )


@pytest.mark.parametrize("place", ["import", "compile", "elsewhere"])
def test_nothing_is_raised_through_imports_and_compilers(place, tmp_path):
    (tmp_path / "stopped.py").write_text("import os; os.kill(os.getpid(), 15)")
    run = {
        "import": "import stopped",
        "compile": "exec('os.kill(os.getpid(), 15)', {'__name__': 'numba.core'})",
        "elsewhere": "exec('os.kill(os.getpid(), 15)', {'__name__': 'number'})",
    }
    code = (
        "import os;"
        "from wbc_suite.cli.interrupts import signals_end_the_process as block\n"
        "with block():\n"
        f"    try: {run[place]}\n"
        "    finally: print('raised', flush=True)\n"
    ).replace("{'__name__'", "{'os': os, '__name__'")
    ended = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": f"{Path.cwd()}:{tmp_path}"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 143, ended.stderr
    assert ended.stdout == ("raised\n" if place == "elsewhere" else "")
    assert "wbc-suite: stopped. " in ended.stderr


def test_handlers_are_as_before_after_a_command(monkeypatch, capsys):
    from wbc_suite.cli import main

    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    monkeypatch.setattr(sys, "argv", ["wbc-suite", "--version"])
    with pytest.raises(SystemExit):
        main()
    assert "wbc-suite" in capsys.readouterr().out
    assert before == (
        signal.getsignal(signal.SIGINT),
        signal.getsignal(signal.SIGTERM),
    )
