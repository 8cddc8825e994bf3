"""Imports run one way: a package imports only packages to its left, and itself.

Modules do not import each other in a circle. Imports of types alone count, and so do
names of modules in strings. Nothing names the layer of other tools' interfaces.
"""

import ast
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

import wbc_suite

PACKAGE = Path(wbc_suite.__file__).parent
MODULES = sorted(p for p in PACKAGE.rglob("*.py") if "_catalogue" not in p.parts)

BASE = (
    "errors",
    "logs",
    "files",
    "atomic_files",
    "extras",
    "typing",
    "arguments",
    "timing",
    "config_files",
    "catalogue",
    "registry",
    "registration",
    "kernel_cache",
    "compiling",
    "linear_algebra",
)
ORDER = (
    "robot",
    "kinematics",
    "qp",
    "planning",
    "locomotion",
    "control",
    "scene",
    "sensing",
    "benchmark",
    "envs",
)
TOP = (
    "executors",
    "randomisation",
    "web",
    "devices",
    "recording",
    "wrappers",
    "experts",
    "evaluation",
    "compat",
    "viewers",
    "teleoperation",
    "cli",
)
"""Everything above `envs`; only `cli` may use all the others."""

PACKAGES = BASE + ORDER + TOP

CONTROL = ("ground", "law", "contact", "part", "ik", "walking", "composite", "run")
"""Packages of `control`; the modules beside them come first."""

OPENED_BY_NAME = {
    "registration": {"envs", "wrappers"},  # Gymnasium's entry points are strings
    "envs": {"viewers"},  # the page of `render_mode="human"` is made when it is shown
}
"""Packages above its own that a package names in strings, and why."""

PLUGIN = "compat"
"""The layer of other tools' interfaces: it registers itself by entry points."""


def _imported(tree: ast.AST) -> Iterator[str]:
    """Yield the dotted names of our own that a module imports, inside functions too."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute"
            yield node.module or ""
            if node.module == "wbc_suite":
                yield from (f"wbc_suite.{alias.name}" for alias in node.names)


def _parts(path: Path) -> tuple[str, ...]:
    return path.relative_to(PACKAGE).with_suffix("").parts


def upward_imports(own: str, source: str) -> list[str]:
    """Return what a module of the package `own` imports from above it."""
    names = (n.split(".") for n in _imported(ast.parse(source)))
    allowed = PACKAGES[: PACKAGES.index(own) + 1]
    return [
        ".".join(name)
        for name in names
        if name[0] == "wbc_suite" and name[1:2] != [] and name[1] in PACKAGES
        if name[1] not in allowed
    ]


def named_modules(own: str, source: str) -> list[str]:
    """Return the modules above the package `own` that strings of a module name.

    A string that is the name of a module alone counts, and any text that has the name
    of the plug-in.
    """
    allowed = {*PACKAGES[: PACKAGES.index(own) + 1], *OPENED_BY_NAME.get(own, ())}
    found: list[str] = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            named = re.fullmatch(r"wbc_suite\.(\w+)(\.\w+)*(:\w+)?", node.value)
            above = named and named[1] in PACKAGES and named[1] not in allowed
            text = re.search(rf"\bwbc_suite\.{PLUGIN}\b", node.value)
            if above or (text and own != PLUGIN):
                found.append(node.value)
    return found


def _at_module_level(body: list[ast.stmt]) -> Iterator[ast.stmt]:
    """Yield the statements that run on import, and those for types alone."""
    for node in body:
        yield node
        for inner in ("body", "orelse", "finalbody"):
            if isinstance(node, ast.If | ast.Try | ast.With):
                yield from _at_module_level(getattr(node, inner, []))


def _imported_modules(tree: ast.Module, known: Mapping[str, object]) -> set[str]:
    """Return the known modules that a module imports when it is imported itself."""
    found: set[str] = set()
    for node in _at_module_level(tree.body):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            for name in (f"{node.module}.{alias.name}" for alias in node.names):
                found.add(name if name in known else str(node.module))
    return found & known.keys()


def circles(sources: Mapping[str, str]) -> list[list[str]]:
    """Return the modules in circles, each followed by those of them it imports."""
    above = {
        name: _imported_modules(ast.parse(text), sources) - {name}
        for name, text in sources.items()
    }
    while free := [name for name, others in above.items() if not others]:
        for name in free:
            del above[name]
        above = {name: others - {*free} for name, others in above.items()}
    below = {name: {n for n in above if name in above[n]} for name in above}
    while free := [name for name, others in below.items() if not others]:
        for name in free:
            del below[name]
        below = {name: others - {*free} for name, others in below.items()}
    return [[name, *sorted(above[name] & below.keys())] for name in below]


def _dotted(path: Path) -> str:
    return ".".join(("wbc_suite", *_parts(path))).removesuffix(".__init__")


@pytest.mark.parametrize("room", CONTROL)
def test_packages_of_control_import_only_those_before_them(room):
    allowed = CONTROL[: CONTROL.index(room) + 1]
    for path in (PACKAGE / "control" / room).glob("*.py"):
        for name in _imported(ast.parse(path.read_text(encoding="utf-8"))):
            match = re.match(r"wbc_suite\.control\.(\w+)", name)
            above = match is not None and match[1] in CONTROL
            assert not above or match[1] in allowed, (path, name)


def test_every_package_of_control_has_a_place():
    found = {path.parent.name for path in (PACKAGE / "control").glob("*/__init__.py")}
    assert found == {*CONTROL}


def test_no_modules_import_each_other_in_a_circle():
    sources = {_dotted(path): path.read_text(encoding="utf-8") for path in MODULES}
    assert circles(sources) == []


def test_the_test_itself_sees_a_circle_of_types():
    typed = "if TYPE_CHECKING:\n from wbc_suite.b import B"
    sources = {"wbc_suite.a": typed, "wbc_suite.b": "from wbc_suite.c import C"}
    sources |= {"wbc_suite.c": "import wbc_suite.a", "wbc_suite.d": typed}
    assert [own for own, *_ in circles(sources)] == [
        f"wbc_suite.{name}" for name in "abc"
    ]
    sources["wbc_suite.c"] = "def f():\n import wbc_suite.a"
    assert circles(sources) == []


@pytest.mark.parametrize("path", MODULES, ids=lambda p: "/".join(_parts(p)))
def test_module_imports_only_downwards(path):
    own = _parts(path)[0]
    if own == "__init__":  # the front door opens to every room, lazily
        return
    assert own in PACKAGES, f"say in {Path(__file__).name} where '{own}' belongs"
    source = path.read_text(encoding="utf-8")
    assert upward_imports(own, source) == []
    assert named_modules(own, source) == []


@pytest.mark.parametrize(
    ("own", "source", "expected"),
    [
        ("robot", "import wbc_suite.qp", ["wbc_suite.qp"]),
        ("qp", "from wbc_suite import envs", ["wbc_suite.envs"]),
        ("qp", "def f():\n from wbc_suite.cli.app import a", ["wbc_suite.cli.app"]),
        ("qp", "if TYPE_CHECKING:\n from wbc_suite.cli import a", ["wbc_suite.cli"]),
        ("qp", "from wbc_suite.robot import load_robot\nimport numpy", []),
    ],
)
def test_the_test_itself_sees_an_upward_import(own, source, expected):
    assert upward_imports(own, source) == expected


@pytest.mark.parametrize(
    ("own", "source", "expected"),
    [
        ("qp", "name = 'wbc_suite.viewers.page'", ["wbc_suite.viewers.page"]),
        ("qp", "name = 'wbc_suite.cli:main'", ["wbc_suite.cli:main"]),
        ("cli", "name = 'wbc_suite.compat.x'", ["wbc_suite.compat.x"]),
        ("cli", "def f():\n 'See wbc_suite.compat.'", ["See wbc_suite.compat."]),
        ("envs", "name = 'wbc_suite.viewers.page'", []),
        ("qp", "'See wbc_suite.viewers.'", []),
    ],
)
def test_the_test_itself_sees_a_name_in_a_string(own, source, expected):
    assert named_modules(own, source) == expected


@pytest.mark.parametrize("path", MODULES, ids=lambda p: "/".join(_parts(p)))
def test_nothing_outside_imports_the_plugin(path):
    if _parts(path)[0] != PLUGIN:
        names = _imported(ast.parse(path.read_text(encoding="utf-8")))
        assert [n for n in names if n.startswith(f"wbc_suite.{PLUGIN}")] == []


def test_star_imports_are_nowhere():
    for path in MODULES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = node.names if isinstance(node, ast.ImportFrom) else []
            assert "*" not in [alias.name for alias in names], path
