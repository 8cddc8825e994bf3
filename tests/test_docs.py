"""The site of the documentation: every public name has its place in the reference."""

import ast
import importlib
import os
import pkgutil
import re
import subprocess
import sys
import tomllib
import zlib
from importlib.util import find_spec
from pathlib import Path

import pytest

import wbc_suite

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
INTERNAL = ("wbc_suite.cli", "wbc_suite.control.run")
"""Packages whose names are no part of the API."""
ROBOSUITE = "wbc_suite.compat.robosuite."
"""Its modules have the names of robosuite's, and its documentation."""


def public_packages():
    """Return the packages that list public names, found by walking."""
    found = pkgutil.walk_packages(wbc_suite.__path__, "wbc_suite.")
    names = ["wbc_suite", *(info.name for info in found if info.ispkg)]
    names = [n for n in names if not n.startswith((*INTERNAL, ROBOSUITE))]
    packages = (importlib.import_module(n) for n in names)
    return [package for package in packages if not is_shown_by_parent(package)]


def is_shown_by_parent(package):
    """Whether all public names of a package are those of the one above as well."""
    parent, names = package.__name__.rpartition(".")[0], getattr(package, "__all__", [])
    above = importlib.import_module(parent) if parent.count(".") else None
    above = getattr(above, "__all__", [])
    return set(names) <= set(above)


def directives():
    """Return the objects that pages of the reference ask mkdocstrings for."""
    pages = sorted((DOCS / "reference").glob("*.md"))
    text = "\n".join(page.read_text(encoding="utf-8") for page in pages)
    return re.findall(r"^::: (\S+)$", text, re.MULTILINE)


def shown_imports():
    """Yield (place, module, name) for what docs and examples import from us."""
    for page in [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]:
        text = page.read_text(encoding="utf-8")
        for block in re.findall(r"^```python\n(.*?)^```", text, re.DOTALL | re.M):
            yield from imports_of(page.name, block)
    for script in sorted((ROOT / "examples").glob("*.py")):
        yield from imports_of(script.name, script.read_text(encoding="utf-8"))


def imports_of(place, source):
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom) and node.module.startswith("wbc_suite"):
            yield from ((place, node.module, alias.name) for alias in node.names)


def test_every_public_package_has_a_place_in_the_reference():
    assert {package.__name__ for package in public_packages()} <= set(directives())


def test_the_reference_asks_for_what_exists():
    for name in directives():
        try:
            importlib.import_module(name)
        except ModuleNotFoundError:
            module, _, attribute = name.rpartition(".")
            assert hasattr(importlib.import_module(module), attribute), name


def test_what_docs_and_examples_import_is_in_the_reference():
    listed = set(directives())
    for place, module, name in shown_imports():
        assert {module, f"{module}.{name}"} & listed, (
            f"{place} imports {name} from {module}"
        )
        found = hasattr(importlib.import_module(module), name)
        found = found or find_spec(f"{module}.{name}") is not None
        assert found, (place, module, name)


def test_what_is_listed_as_public_exists():
    for package in public_packages():
        for name in package.__all__:
            assert hasattr(package, name), f"{package.__name__}.{name}"


def test_the_architecture_page_lists_all_packages_and_only_files_that_exist():
    text = (DOCS / "architecture.md").read_text(encoding="utf-8")
    package = Path(wbc_suite.__file__).parent
    found = {path.parent.name for path in package.glob("*/__init__.py")}
    listed = set(re.findall(r"^\| `(\w+)` \|", text, re.MULTILINE))
    assert found <= listed <= found | {path.stem for path in package.glob("*.py")}
    for file in re.findall(r"`(\w+/[\w/]+(?:\.py|/))`", text):
        if not file.startswith(("robots", "tasks", "controllers", "tests", "wbc_")):
            assert (package / file).exists(), file
    modules = {p.stem for p in package.glob("*.py")} - {"__init__"}
    assert {name for name in modules if f"`{name}`" not in text} == set()


def test_the_dependencies_page_states_the_floors_of_pyproject():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    text = (DOCS / "dependencies.md").read_text(encoding="utf-8")
    floors = dict(item.split(">=") for item in project["dependencies"])
    assert dict(re.findall(r"^\| ([\w-]+) \| ([\d.]+) \|", text, re.M)) == floors
    extras = set(re.findall(r"^\| `([\w-]+)` \| [^|]+ \| [^|]+ \|$", text, re.M))
    assert extras == set(project["optional-dependencies"])


RECORDS = sorted((DOCS / "decisions").glob("0*.md"))


@pytest.mark.parametrize("path", RECORDS, ids=lambda path: path.stem[:4])
def test_a_decision_is_a_dated_record_of_one_page(path):
    text = path.read_text(encoding="utf-8")
    number, title = re.match(
        r"# (\d{4}) (.+)\n\nDate: 20\d\d-\d\d-\d\d\n", text
    ).groups()
    assert path.name.startswith(number)
    assert re.findall("^## (.+)$", text, re.M) == ["Decision", "Reasons", "Rejected"]
    assert len(text.splitlines()) <= 50
    assert f"[{title}]({path.name})" in (DOCS / "decisions/index.md").read_text()


def test_decisions_are_numbered_without_a_gap():
    numbers = [int(path.name[:4]) for path in RECORDS]
    assert numbers == list(range(1, len(RECORDS) + 1))


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site, built as `make docs` builds it."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--quiet", "--site-dir", folder]
    environment = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    result = subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, env=environment
    )
    assert (result.returncode, result.stderr) == (0, "")
    return folder


def names_of(inventory):
    """Return the names in an inventory of Sphinx's format, version 2."""
    header, _, _, _, compressed = inventory.split(b"\n", 4)
    assert header == b"# Sphinx inventory version 2"
    lines = zlib.decompress(compressed).decode().splitlines()
    return {line.split()[0] for line in lines}


@pytest.mark.slow
def test_every_public_name_is_in_the_built_reference(site):
    names = names_of((site / "objects.inv").read_bytes())
    missing = []
    for package in public_packages():
        for name in package.__all__:
            home = getattr(getattr(package, name), "__module__", "")
            if not {f"{package.__name__}.{name}", f"{home}.{name}"} & names:
                missing.append(f"{package.__name__}.{name}")
    assert missing == []


@pytest.mark.slow
def test_the_site_asks_nothing_of_the_network(site):
    loads = re.compile(r"""<(?:script|link|img)[^>]*(?:src|href)="?(https?:[^"\s>]+)""")
    for page in sorted(site.rglob("*.html")):
        assert loads.findall(page.read_text(encoding="utf-8")) == [], page
