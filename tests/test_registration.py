"""Environments are registered once, whatever is imported first."""

import subprocess
import sys

import gymnasium
import pytest

import wbc_suite
from wbc_suite.benchmark import BENCHMARKS
from wbc_suite.registration import WITH_ID, environment_id, register_environments


def run(code):
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_every_benchmark_has_an_id():
    assert set(WITH_ID) == set(BENCHMARKS)
    for name in WITH_ID:
        assert environment_id(name) in gymnasium.registry


def test_registering_twice_changes_nothing(recwarn):
    before = dict(gymnasium.registry)
    register_environments()
    assert gymnasium.registry == before
    assert not recwarn.list


def test_a_users_entry_of_the_same_name_is_kept():
    code = """
import gymnasium
gymnasium.register("wbc_suite/Lift-v1", entry_point="mine:Env")
import wbc_suite
print(gymnasium.spec("wbc_suite/Lift-v1").entry_point)
"""
    assert run(code) == "mine:Env"


@pytest.mark.parametrize(
    "first_use",
    [
        "gymnasium.spec('wbc_suite/Stack-v1')",
        "gymnasium.spaces.Box(0, 1)",
        "print(gymnasium.__version__, file=sys.stderr)",
        "isinstance(gymnasium, object) and gymnasium.Env",
    ],
)
def test_gymnasium_is_whole_at_its_first_use(first_use):
    code = f"""
import sys, wbc_suite
assert "gymnasium.core" not in sys.modules
import gymnasium
{first_use}
print("wbc_suite/Stack-v1" in gymnasium.registry, gymnasium.__spec__.name)
"""
    assert run(code) == "True gymnasium"


def test_submodules_can_be_imported_first():
    code = """
import wbc_suite
from gymnasium.envs.registration import registry
import gymnasium.wrappers, gymnasium
print("wbc_suite/Lift-v1" in registry, gymnasium.registry is registry)
"""
    assert run(code) == "True True"


def test_without_gymnasium_the_package_still_imports():
    code = """
import sys
import wbc_suite
sys.path[:] = [p for p in sys.path if "site-packages" not in p]
try:
    import gymnasium
except ModuleNotFoundError as error:
    print(wbc_suite.__version__, error.name)
"""
    assert run(code) == f"{wbc_suite.__version__} gymnasium"


@pytest.mark.parametrize("module", ["core", "error", "spaces", "envs.registration"])
def test_no_module_of_gymnasium_is_executed_twice(module):
    code = f"""
import wbc_suite
import gymnasium.{module} as first
import gymnasium, sys
print(first is sys.modules["gymnasium.{module}"], gymnasium.core.Env is gymnasium.Env)
"""
    assert run(code) == "True True"


def test_the_import_system_is_left_as_it_was():
    code = """
import sys
before = list(sys.meta_path)
import wbc_suite, gymnasium
print(sys.meta_path == before, gymnasium.__spec__.loader.__class__.__name__)
"""
    assert run(code) == "True SourceFileLoader"


def test_threads_that_use_gymnasium_first_all_find_it():
    code = """
import threading, wbc_suite, gymnasium
found = []
threads = [threading.Thread(target=lambda: found.append(gymnasium.Env)) for _ in "1234"]
for thread in threads: thread.start()
for thread in threads: thread.join()
print(len(found), "wbc_suite/Lift-v1" in gymnasium.registry)
"""
    assert run(code) == "4 True"
