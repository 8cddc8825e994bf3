"""Every package that is imported is declared; none is admitted with a known fault."""

import re
import runpy
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
DISTRIBUTIONS = {
    "OpenGL": "pyopengl",
    "PIL": "pillow",
    "hid": "hidapi",
    "pinocchio": "pin",
    "collada": "pycollada",
    "pink": "pin-pink",
    "pxr": "usd-core",
    "pydrake": "drake",
    "sbx": "sbx-rl",
    "xdist": "pytest-xdist",
}
"""Distributions by module, where the names differ."""
STATEMENT = re.compile(
    r"^( *)(?:from ([a-zA-Z]\w*)[\w.]* import |import ([a-zA-Z]\w*)[\w. ]*$)",
    re.MULTILINE,
)
CALL = re.compile(
    r"(?:import_\w+|_import\w*|importorskip|find_spec)\(\s*\"(\w+)[^()]*\)"
)
"""Calls that import the module that their first argument names."""


def names(requirements):
    """Return the distributions that requirements name, without included groups."""
    texts = [text for text in requirements if isinstance(text, str)]
    return {canonicalize_name(Requirement(text).name) for text in texts}


def pinned(*files):
    """Return the distributions that requirement files name, and those they include."""
    found = set()
    for file in files:
        for line in file.read_text(encoding="utf-8").splitlines():
            if line.startswith("-r "):
                found |= pinned(file.parent / line[3:])
            elif line and line[0] not in "#-":
                found.add(canonicalize_name(re.split(r"[\[=<>~ ]", line)[0]))
    return found


CORE = names(PYPROJECT["project"]["dependencies"])
EXTRAS = {
    extra: names(listed)
    for extra, listed in PYPROJECT["project"]["optional-dependencies"].items()
}
GROUPS = {k: names(v) for k, v in PYPROJECT["dependency-groups"].items()}
DEVELOPERS = CORE.union(*(GROUPS[k] for k in ("test", "docs", "dev", "peers")))
PEERS = pinned(*(ROOT / "benchmarks" / "peers").glob("*.txt")) | EXTRAS["rl"]


def imports(source):
    """Yield (module, whether it is imported where it is used, the call that does)."""
    for indented, first, second in STATEMENT.findall(source):
        yield first or second, bool(indented), ""
    for call in CALL.finditer(source):
        yield call[1], True, call[0]


MADE = {"wbc_suite", "tests", "mujoco_py", "use_kernel", "a"}
"""Modules that are ours, or that a script or a test makes."""


def foreign(path):
    """Yield what a file imports besides the standard library and this repository."""
    own = MADE | {file.stem for file in OWN}
    for top, lazily, call in imports(path.read_text(encoding="utf-8")):
        if top not in sys.stdlib_module_names and top not in own:
            yield canonicalize_name(DISTRIBUTIONS.get(top, top)), lazily, call


FOLDERS = ("tests", "examples", "benchmarks", "docs")
OWN = [file for folder in FOLDERS for file in (ROOT / folder).rglob("*.py")]
OWN += [file.parent for file in OWN if file.stem == "__init__"]


def test_all_that_the_package_imports_is_declared():
    """What only some features need is imported by them, and they name the extra."""
    missing = []
    for path in sorted((ROOT / "wbc_suite").rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        for name, lazily, call in foreign(path):
            holders = {extra for extra, listed in EXTRAS.items() if name in listed}
            given = set(re.findall(r'"([\w.-]+)"', call)[1:])
            told = {extra for extra in holders if f"wbc-suite[{extra}]" in text}
            told |= holders & given or (holders if call.endswith(" extra)") else set())
            if name not in CORE and not (lazily and told and given <= holders):
                missing.append((path.relative_to(ROOT).as_posix(), name))
    assert missing == []


@pytest.mark.parametrize(
    ("folder", "declared"),
    [
        ("tests", DEVELOPERS | PEERS),
        ("docs", DEVELOPERS),
        ("benchmarks", DEVELOPERS | PEERS),
        ("examples/learning", CORE | EXTRAS["rl"]),
    ],
)
def test_all_that_other_folders_import_is_declared(folder, declared):
    found = {
        (path.relative_to(ROOT).as_posix(), name)
        for path in sorted((ROOT / folder).rglob("*.py"))
        for name, *_ in foreign(path)
        if name not in declared
    }
    assert found == set()


def test_all_that_examples_import_is_declared():
    for path in sorted((ROOT / "examples").glob("*.py")):
        assert {name for name, *_ in foreign(path)} <= CORE, path
    for path in sorted((ROOT / "examples" / "clients").glob("*.py")):
        declared = CORE | pinned(path.with_suffix(".txt"))
        assert {name for name, *_ in foreign(path)} <= declared, path


@pytest.mark.parametrize("source", ["import a", "from a.b import c", "import a.b as d"])
def test_imports_are_found(source):
    lazily = f'def f():\n    {source}\n    return import_extra("a.b", "extra")\n'
    assert [*imports(source)] == [("a", False, "")]
    assert [each[:2] for each in imports(lazily)] == [("a", True)] * 2


AUDIT = runpy.run_path(str(ROOT / ".ci" / "audit"))


def test_no_release_with_a_published_fault_is_admitted_or_shipped():
    """What is installed differs by machine: CI runs `.ci/audit` for it."""
    present = [each for each in AUDIT["present"]() if each[0] != "installed"]
    assert [package for _, package, _ in present].count("three") == 1
    for place, package, version in [*AUDIT["admitted"](), *present]:
        assert list(AUDIT["faults"](package, version)) == [], (place, package, version)


@pytest.mark.parametrize(
    ("package", "version", "faulty"),
    [
        ("aiohttp", "3.11.0", True),
        ("aiohttp", "3.14.3", True),
        ("AIOHTTP", "3.14.4", False),
        ("pillow", "11.0.0", True),
        ("Pillow", "12.3.0.post1", True),
        ("torch", "2.9.0+cpu", True),
        ("torch", "2.10.0", False),  # accepted, for one client
        ("mcap", "0.1", False),
    ],
)
def test_the_audit_finds_releases_in_a_range(package, version, faulty):
    assert bool(list(AUDIT["faults"](package, version))) == faulty


def test_the_audit_reads_bounds_of_all_lists():
    found = {(place, package) for place, package, _ in AUDIT["admitted"]()}
    assert {("dependencies", "aiohttp"), ("rl", "torch"), ("test", "pytest")} <= found
    assert {("clients.txt", "datasets"), ("lerobot_act.txt", "torch")} <= found


def test_the_list_of_packages_has_all_that_are_declared():
    text = (ROOT / "docs" / "packages.md").read_text(encoding="utf-8")
    listed = set(re.findall(r"^\| ([\w.-]+) \| [\w.+]+ \| [^|]+ \|", text, re.M))
    declared = CORE.union(*EXTRAS.values(), *GROUPS.values())
    shipped = {
        (each[1], each[2]) for each in AUDIT["present"]() if each[0] == "shipped"
    }
    assert declared <= listed
    assert all(f"| {name} | {version} |" in text for name, version in shipped)
    assert "not stated" not in text
    assert "not installed" not in text
