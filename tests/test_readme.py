"""What the README and the docs show is run, and what they point to exists."""

import contextlib
import io
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from wbc_suite.cli.app import app

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    *sorted(ROOT.glob("docs/**/*.md")),
]
IN_ORDER = "<!-- snippets run in order -->"
"""Snippets of a page with this mark are one program; `<!-- check: ... -->` asserts."""


def blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


def programs(text: str) -> list[str]:
    """Return what is run by itself: each snippet, or all of a page in order."""
    if IN_ORDER not in text:
        return blocks(text, "python")
    steps = re.findall(
        r"^```python\n(.*?)^```|<!-- check: (.*?) -->", text, re.S | re.M
    )
    return ["".join(code or f"assert {check}\n" for code, check in steps)]


SNIPPETS = [
    pytest.param(snippet, id=f"{page.stem}-{k}")
    for page in PAGES
    for k, snippet in enumerate(programs(page.read_text(encoding="utf-8")))
]


@pytest.mark.parametrize("snippet", SNIPPETS)
def test_python_snippets_run(snippet, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # some write files
    exec(compile(snippet, "snippet", "exec"), {"__name__": "__main__"})


def test_snippets_in_order_share_names_and_are_checked():
    text = f"{IN_ORDER}\n```python\nx = 1\n```\n<!-- check: x == 2 -->\n"
    (program,) = programs(text)
    with pytest.raises(AssertionError):
        exec(program, {})


def test_the_first_snippet_is_short_and_what_it_prints_is_true():
    snippet = blocks(README, "python")[0]
    lines = [line for line in snippet.splitlines() if line.strip()]
    assert len(lines) <= 15
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(snippet, {})
    missed = [float(x) for x in re.findall(r"is ([\d.]+) mm", printed.getvalue())]
    assert len(missed) == 2
    assert max(missed) < 1.0  # mm: the hands have arrived


def test_the_first_screen_has_a_picture_that_shows_something():
    path = re.search(r"!\[.*?\]\((.*?)\)", README[:800])
    assert path is not None
    picture = np.asarray(Image.open(ROOT / path[1]).convert("L"))
    assert picture.shape[1] >= 600
    assert picture.std() > 20


def test_every_make_command_exists():
    targets = re.findall(r"^([a-z-]+):.*##", (ROOT / "Makefile").read_text(), re.M)
    shown = {
        c
        for page in PAGES
        for c in re.findall(r"(?:^|`)make ([a-z-]+)", page.read_text(), re.M)
    }
    assert shown <= set(targets)


def test_every_console_command_exists_with_its_options():
    commands = {command.name: command for command in app.registered_commands}
    pages = [page.read_text(encoding="utf-8") for page in PAGES]
    shown = "".join(block for page in pages for block in blocks(page, "sh"))
    for line in shown.splitlines():
        words = shlex.split(line, comments=True)
        if words and words[0] == "wbc-suite":
            assert words[1] in commands, line


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for link in re.findall(r"\]\(([^)#]+)", page.read_text(encoding="utf-8")):
        if not link.startswith("http"):
            assert (page.parent / link).exists(), link
