"""The commands that serve a page, as a person starts and ends them."""

import re
import signal
import subprocess
import sys
import urllib.error
import urllib.request

import pytest

PATIENCE = 120.0  # s, for a busy machine


def started(*arguments):
    process = subprocess.Popen(
        [sys.executable, "-m", "wbc_suite.cli", *arguments, "--port", "0"],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    url = ""
    for line in process.stdout:
        url = found[0] if (found := re.search(r"http://\S+", line)) else url
        if "Press Ctrl-C" in line:
            return process, url
    raise AssertionError(f"no address was printed, exit code {process.wait()}")


def end(process):
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=PATIENCE) == 130


@pytest.mark.slow
@pytest.mark.parametrize(
    "command",
    [
        ("view", "Panda"),
        ("teleop", "--robots", "Panda", "--gripper", "Robotiq85Gripper"),
        ("teleop", "--robots", "Panda", "--controller", "WHOLE_BODY_MINK_IK"),
    ],
    ids=lambda words: "-".join(words),
)
def test_command_serves_a_page_until_it_is_interrupted(command):
    process, url = started(*command)
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/", url)
    assert b"<html" in urllib.request.urlopen(url, timeout=PATIENCE).read()
    end(process)


@pytest.mark.slow
def test_other_hosts_get_an_address_with_a_token():
    process, url = started("view", "Panda", "--host", "0.0.0.0")
    address, token = url.split("?token=")
    port = re.search(r":(\d+)/", address)
    assert port is not None
    assert len(token) >= 20
    with pytest.raises(urllib.error.HTTPError, match="401"):
        urllib.request.urlopen(f"http://127.0.0.1:{port[1]}/", timeout=PATIENCE)
    end(process)
