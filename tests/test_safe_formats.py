"""Files are read in formats that hold data only: no code of a file is executed."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FOLDERS = ("wbc_suite", "examples", "benchmarks", "docs", "tests")
PICKLES = {"cloudpickle", "dill", "joblib", "jsonpickle", "marshal", "shelve"}
READERS = {"load", "loads", "Unpickler", "load_replay_buffer", "load_from_pkl"}
ALLOWED = {
    # What robosuite's DataCollectionWrapper writes, as robosuite reads it.
    ("tests/compat/robosuite/test_upstream_cases.py", "np.load"),
    # A model that the same script has just saved, by the library that it shows.
    ("examples/clients/sbx_sac.py", "SAC.load"),
}


def is_safe(call: ast.Call) -> bool:
    """Return whether a call of a reader reads data only."""
    owner, _, name = ast.unparse(call.func).rpartition(".")
    given = {k.arg: ast.unparse(k.value) for k in call.keywords}
    if owner == "pickle":  # a copy of an own object
        return bool(call.args) and ast.unparse(call.args[0]).startswith("pickle.dumps(")
    if owner == "torch":
        return given.get("weights_only") == "True"
    if owner in ("np", "numpy"):
        return given.get("allow_pickle", "False") == "False"
    return owner not in ("PPO", "SAC", "TD3", "yaml") and name in ("load", "loads")


def unsafe(source: str) -> list[str]:
    """Return the calls that may execute code of a file, and modules of pickles."""
    found = []
    if not any(word in source for word in (*PICKLES, *READERS)):
        return found  # parsing all takes two seconds
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom):
            found += [node.module] if node.module in PICKLES else []
        elif isinstance(node, ast.Import):
            found += [each.name for each in node.names if each.name in PICKLES]
        elif isinstance(node, ast.Call):
            name = getattr(node.func, "attr", getattr(node.func, "id", ""))
            if name in READERS and not is_safe(node):
                found.append(ast.unparse(node.func))
    return found


@pytest.mark.parametrize("folder", FOLDERS)
def test_no_file_is_read_as_a_pickle(folder):
    found = {
        (path.relative_to(ROOT).as_posix(), call)
        for path in sorted((ROOT / folder).rglob("*.py"))
        for call in unsafe(path.read_text(encoding="utf-8"))
    }
    assert found == {each for each in ALLOWED if each[0].startswith(f"{folder}/")}


@pytest.mark.parametrize(
    "source",
    [
        "pickle.load(file)",
        "pickle.loads(text)",
        "pickle.Unpickler(file)",
        "torch.load(path)",
        "torch.load(path, weights_only=False)",
        "np.load(path, allow_pickle=True)",
        "yaml.load(text)",
        "SAC.load(path)",
        "model.load_replay_buffer(path)",
        "import joblib",
        "from cloudpickle import loads",
    ],
)
def test_unsafe_readers_are_found(source):
    assert len(unsafe(source)) == 1


@pytest.mark.parametrize(
    "source",
    [
        "torch.load(path, weights_only=True)",
        "np.load(path)",
        "np.load(path, allow_pickle=False)",
        "json.load(file)",
        "pickle.loads(pickle.dumps(env))",
    ],
)
def test_safe_readers_are_not_named(source):
    assert unsafe(source) == []
