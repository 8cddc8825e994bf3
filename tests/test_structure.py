"""Limits on the structure of the package: public doors, functions, depth of classes."""

import ast
import builtins
from collections.abc import Iterator
from pathlib import Path

import pytest

import wbc_suite

PACKAGE = Path(wbc_suite.__file__).parent
TESTS = Path(__file__).parent
TREES = {
    path: ast.parse(path.read_text(encoding="utf-8"))
    for path in sorted(PACKAGE.rglob("*.py"))
    if "_catalogue" not in path.parts
}

PEER_TREES = ("compat/robosuite/",)
"""Names and classes of another project: as deep as there, and tested by tables."""

MAX_FUNCTION = 60  # lines
SETTINGS = "FrozenModel"  # pydantic's base with our settings; no level of its own
MAX_DEPTH = 2  # own classes in a chain of inheritance, foreign bases not counted
MIN_TESTS = 0.7  # lines of tests for each line of the package

MUJOCO_ADDRESSES = PACKAGE / "control" / "ground" / "mujoco_functions.py"
"""The one module that may hold addresses of MuJoCo's functions and structs."""
COMPILER = PACKAGE / "compiling.py", PACKAGE / "kernel_cache.py"
"""The modules that reach into numba, as far as its manual shows."""

FORBIDDEN = ("ctypes", "from_address", "_address", "mjcb_time", "llvmlite")
STATEMENTS = (ast.Import, ast.ImportFrom, ast.Attribute)
NUMBA_CORE = ("import numba.core", "from numba.core", "from numba import core")
NUMBA_EVENTS = "from numba.core import event"  # for applications, says its manual
DOCUMENTED = {  # underscored names that their documentation tells users to use
    *("_fields", "_field_defaults", "_asdict", "_replace", "_make"),  # namedtuple
    "_exit",  # os
}


def place(path: Path, node: ast.AST | None = None) -> str:
    """Return where something stands, for messages."""
    line = f":{node.lineno}" if hasattr(node, "lineno") else ""
    return f"{path.relative_to(PACKAGE)}{line}"


def words(node: ast.AST) -> Iterator[str]:
    """Yield the identifiers of one node of a syntax tree, and names given as text."""
    if isinstance(node, ast.Name):
        yield node.id
    elif isinstance(node, ast.Attribute):
        yield node.attr
    elif isinstance(node, ast.Import):
        for alias in node.names:
            yield from alias.name.split(".")
    elif isinstance(node, ast.ImportFrom):
        yield from (node.module or "").split(".")
        yield from (alias.name for alias in node.names)
    elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("attr"):
        for argument in node.args[1:2]:  # getattr, setattr, hasattr
            if isinstance(argument, ast.Constant) and isinstance(argument.value, str):
                yield argument.value


def forbidden_words(tree: ast.AST) -> Iterator[tuple[ast.AST, str]]:
    """Yield uses of memory addresses, hooks and compilers behind the public API."""
    for node in ast.walk(tree):
        for word in words(node):
            if word in FORBIDDEN:
                yield node, word
        text = ast.unparse(node) if isinstance(node, STATEMENTS) else ""
        core = text.startswith(NUMBA_CORE) or text == "numba.core"
        if core and text != NUMBA_EVENTS:
            yield node, "numba.core"


def is_own_attribute(node: ast.AST) -> bool:
    """Whether an expression is `self.x` or `cls.x` that is being assigned."""
    stored = isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store)
    return stored and ast.unparse(node.value) in ("self", "cls")


def own_names(trees: list[ast.AST]) -> set[str]:
    """Return all names that these modules define: functions, variables, attributes."""
    names: set[str] = set()
    for node in (node for tree in trees for node in ast.walk(tree)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.arg):
            names.add(node.arg)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
        elif is_own_attribute(node):
            names.add(node.attr)
    return names


def is_private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__") and name != "_"


def is_own(module: str) -> bool:
    return module.split(".")[0] == "wbc_suite"


def foreign_modules(tree: ast.AST) -> set[str]:
    """Return the names by which a module calls modules that are not ours."""
    return {
        alias.asname or alias.name.split(".")[0]
        for node in ast.walk(tree)
        if isinstance(node, ast.Import)
        for alias in node.names
        if not is_own(alias.name)
    }


def private_foreign_names(
    tree: ast.AST, own: set[str]
) -> Iterator[tuple[ast.AST, str]]:
    """Yield private names of dependencies: none that `own` defines, or imported ones.

    An underscored attribute that no module of ours defines belongs to somebody else.
    """
    modules = foreign_modules(tree)
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            imported = getattr(node, "module", None) or node.names[0].name
            if not is_own(imported) and imported != "__future__":
                yield from ((node, word) for word in words(node) if is_private(word))
        elif isinstance(node, ast.Attribute | ast.Call):
            foreign = (
                isinstance(node, ast.Attribute) and ast.unparse(node.value) in modules
            )
            for word in words(node):
                if is_private(word) and (foreign or word not in own):
                    yield node, word


def functions(tree: ast.AST) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef]:
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node


def length(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Return the lines of a function's body, those of its docstring left out."""
    first = function.body[0]
    lines = (function.end_lineno or 0) - first.lineno + 1
    if ast.get_docstring(function, clean=False) is not None:
        lines -= (first.end_lineno or 0) - first.lineno + 1
    return lines


def depths(trees: dict[Path, ast.AST]) -> dict[str, int]:
    """Return how many own classes stand above each other; bases are found by name."""
    bases = {
        node.name: [
            ast.unparse(base).split("[")[0].split(".")[-1] for base in node.bases
        ]
        for tree in trees.values()
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef)
    }

    def depth(name: str, seen: tuple[str, ...] = ()) -> int:
        own = name in bases and name != SETTINGS
        if not own or name in seen or hasattr(builtins, name):
            return 0
        above = (depth(base, (*seen, name)) for base in bases[name])
        return 1 + max(above, default=0)

    return {name: depth(name) for name in bases}


def listing(found: list[str] | dict[str, int]) -> str:
    """Return offenders, one to a line, the largest first."""
    if isinstance(found, dict):
        largest = sorted(found.items(), key=lambda item: -item[1])
        found = [f"{name}: {number}" for name, number in largest]
    return "\n" + "\n".join(found)


def lines_of(paths: list[Path]) -> int:
    return sum(path.read_text(encoding="utf-8").count("\n") for path in paths)


def test_memory_addresses_and_compiler_internals_stay_in_few_modules():
    found = [
        f"{place(path, node)} {word}"
        for path, tree in TREES.items()
        if path not in (MUJOCO_ADDRESSES, *COMPILER)
        for node, word in forbidden_words(tree)
    ]
    assert not found, listing(found)


def test_no_private_name_of_a_dependency_is_used():
    own = own_names(list(TREES.values()))
    found = [
        f"{place(path, node)} {word}"
        for path, tree in TREES.items()
        if path != MUJOCO_ADDRESSES
        for node, word in private_foreign_names(tree, own)
        if word not in DOCUMENTED
    ]
    assert not found, listing(found)


def test_functions_are_short():
    long = {
        f"{place(path, node)} {node.name}": length(node)
        for path, tree in TREES.items()
        for node in functions(tree)
        if length(node) > MAX_FUNCTION
    }
    assert not long, listing(long)


def test_every_test_file_has_its_own_name():
    names = [path.name for path in TESTS.rglob("test_*.py")]
    assert not [name for name in set(names) if names.count(name) > 1]


def test_inheritance_is_shallow():
    errors = depths({PACKAGE: TREES[PACKAGE / "errors.py"]})
    own = {p: t for p, t in TREES.items() if not place(p).startswith(PEER_TREES)}
    deep = {
        name: depth
        for name, depth in depths(own).items()
        if depth > MAX_DEPTH and name not in errors
    }
    assert not deep, listing(deep)


def test_the_tests_are_many():
    own = [path for path in TREES if not place(path).startswith(PEER_TREES)]
    share = lines_of(sorted(TESTS.rglob("*.py"))) / lines_of(own)
    assert share >= MIN_TESTS


# The checks above find what they look for, and nothing else.


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("import ctypes", ["ctypes"]),
        ("from ctypes import c_int", ["ctypes"]),
        ("model._address", ["_address"]),
        ("getattr(model, '_address')", ["_address"]),
        ("from numba.core import types", ["numba.core"]),
        ("from numba.core import event", []),
        ("import numba\nnumba.core.types", ["numba.core"]),
        ("from llvmlite import binding", ["llvmlite"]),
        ("mujoco.set_mjcb_time(f)", []),
        ("address = 'street'  # ctypes in a comment", []),
    ],
)
def test_addresses_are_found(source, expected):
    assert [word for _, word in forbidden_words(ast.parse(source))] == expected


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("server._clients", ["_clients"]),
        ("getattr(server, '_clients', None)", ["_clients"]),
        ("from viser import _messages", ["_messages"]),
        ("import viser._messages", ["_messages"]),
        ("from viser._messages import Message", ["_messages"]),
        ("import viser\nviser._mine", ["_mine"]),
        ("class A:\n def f(self):\n  return self._foreign", ["_foreign"]),
        ("other._mine", []),
        ("getattr(other, '_mine')", []),
        ("from wbc_suite.qp import _mine", []),
        ("from __future__ import annotations", []),
        ("object.__setattr__(a, '_', 1)", []),
    ],
)
def test_private_names_are_found(source, expected):
    own = own_names([ast.parse("class B:\n def f(self):\n  self._mine = 1")])
    tree = ast.parse(source)
    assert [word for _, word in private_foreign_names(tree, own)] == expected


def test_the_docstring_does_not_count_as_length():
    source = 'def f():\n    """One.\n\n    Two.\n    """\n    return 1\n'
    function = next(functions(ast.parse(source)))
    assert length(function) == 1


def test_depth_counts_own_classes_only():
    source = "class A(Model): ...\nclass B(A): ...\nclass C(x.B[int]): ..."
    assert depths({PACKAGE: ast.parse(source)}) == {"A": 1, "B": 2, "C": 3}
