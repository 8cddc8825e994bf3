"""Imports run one way: a package imports only packages to its left, and itself."""

import ast
from collections.abc import Iterator
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
    "tomlfile",
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


def _is_for_types_only(node: ast.AST) -> bool:
    """Whether a statement is `if TYPE_CHECKING:`, which never runs."""
    return isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"


class _WithoutTypeImports(ast.NodeTransformer):
    def visit_If(self, node: ast.If) -> ast.AST | None:
        return None if _is_for_types_only(node) else self.generic_visit(node)


def upward_imports(own: str, source: str) -> list[str]:
    """Return what a module of the package `own` imports from above it."""
    tree = _WithoutTypeImports().visit(ast.parse(source))
    names = (n.split(".") for n in _imported(tree) if n.startswith("wbc_suite."))
    allowed = PACKAGES[: PACKAGES.index(own) + 1]
    return [".".join(n) for n in names if n[1] in PACKAGES and n[1] not in allowed]


@pytest.mark.parametrize("path", MODULES, ids=lambda p: "/".join(_parts(p)))
def test_module_imports_only_downwards(path):
    own = _parts(path)[0]
    if own == "__init__":  # the front door opens to every room, lazily
        return
    assert own in PACKAGES, f"say in {Path(__file__).name} where '{own}' belongs"
    assert upward_imports(own, path.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    ("own", "source", "expected"),
    [
        ("robot", "import wbc_suite.qp", ["wbc_suite.qp"]),
        ("qp", "from wbc_suite import envs", ["wbc_suite.envs"]),
        ("qp", "def f():\n from wbc_suite.cli.app import a", ["wbc_suite.cli.app"]),
        ("qp", "if TYPE_CHECKING:\n from wbc_suite.cli import a", []),
        ("qp", "from wbc_suite.robot import load_robot\nimport numpy", []),
    ],
)
def test_the_test_itself_sees_an_upward_import(own, source, expected):
    assert upward_imports(own, source) == expected


def test_star_imports_are_nowhere():
    for path in MODULES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = node.names if isinstance(node, ast.ImportFrom) else []
            assert "*" not in [alias.name for alias in names], path
