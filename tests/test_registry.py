"""Registries: names, duplicates, replacement, and places that are imported."""

import sys

import pytest

from wbc_suite.benchmark import BENCHMARKS
from wbc_suite.control import COMPOSITES, FRAME_KINDS, LAWS, PART_CONTROLLERS
from wbc_suite.control.composite.registry import CONVERTERS
from wbc_suite.devices import DEVICES
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.evaluation import POLICIES
from wbc_suite.executors import EXECUTORS
from wbc_suite.experts import EXPERTS
from wbc_suite.locomotion import GAITS
from wbc_suite.recording.converting import LAYOUTS
from wbc_suite.registry import Registry
from wbc_suite.scene.placement import SAMPLERS

ALL = {
    "benchmark": BENCHMARKS,
    "composite controller": COMPOSITES,
    "converter of configs": CONVERTERS,
    "device": DEVICES,
    "executor": EXECUTORS,
    "expert": EXPERTS,
    "gait": GAITS,
    "kind of controlled frame": FRAME_KINDS,
    "law": LAWS,
    "layout": LAYOUTS,
    "part controller": PART_CONTROLLERS,
    "policy": POLICIES,
    "sampler": SAMPLERS,
}


@pytest.fixture
def animals():
    registry = Registry[object]("animal")
    registry.register("BigCat", 1)
    registry.register("dog", 2)
    return registry


@pytest.mark.parametrize("name", ["BigCat", "bigcat", "big_cat", "BIG-CAT"])
def test_case_and_underscores_do_not_matter(animals, name):
    assert name in animals
    assert animals[name] == animals.find(name) == 1
    assert animals.spelled(name) == "BigCat"


def test_names_are_listed_as_they_were_registered(animals):
    assert list(animals) == ["BigCat", "dog"]
    assert len(animals) == 2
    assert "cat" not in animals
    assert 3 not in animals


def test_a_duplicate_is_refused_unless_it_is_meant(animals):
    with pytest.raises(
        ConfigError, match=r"animal named 'BigCat' exists.*replace=True"
    ):
        animals.register("big_cat", 3)
    assert animals["BigCat"] == 1
    animals.register("big_cat", 3, replace=True)
    assert animals["BigCat"] == 3
    assert list(animals) == ["big_cat", "dog"]


@pytest.mark.parametrize("name", ["", "_", "a:b", 3, None])
def test_what_is_no_name_is_refused(animals, name):
    with pytest.raises(ConfigError, match="cannot be the name of a animal"):
        animals.register(name, 4)


@pytest.mark.parametrize("name", ["dogg", 3, None])
def test_an_unknown_name_gets_the_nearest_one(animals, name):
    with pytest.raises(UnknownNameError, match="No animal named") as caught:
        animals[name]
    assert ("Did you mean 'dog'?" in str(caught.value)) == (name == "dogg")


def test_an_item_is_checked_before_it_is_registered():
    def check(name, item):
        if item != name:
            raise ConfigError("It is not its name.")

    registry = Registry[str]("word", check=check)
    with pytest.raises(ConfigError, match="not its name"):
        registry.register("a", 3)
    assert "a" not in registry


def test_a_place_is_imported_when_it_is_looked_up(animals):
    animals.register("path", "os.path:join")
    assert animals["path"] is sys.modules["os.path"].join
    animals.register("nothing", "no.such.module:x")
    with pytest.raises(ConfigError, match=r"animal 'no.such.module:x' cannot be found"):
        animals["nothing"]


def test_only_find_imports_what_a_name_says(animals):
    assert animals.find("os.path:join") is sys.modules["os.path"].join
    with pytest.raises(UnknownNameError):
        animals["os.path:join"]
    with pytest.raises(ConfigError, match=r"'os.path:joyn' cannot be found.*joyn"):
        animals.find("os.path:joyn")


def test_a_module_of_the_current_directory_is_found(animals, tmp_path, monkeypatch):
    (tmp_path / "own_animals.py").write_text("cow = 'moo'\n")
    monkeypatch.setattr(sys, "path", [p for p in sys.path if p])
    monkeypatch.chdir(tmp_path)
    assert animals.find("own_animals:cow") == "moo"
    assert sys.path[-1] == str(tmp_path), "it hides no other module"
    del sys.modules["own_animals"]


@pytest.mark.parametrize("kind", ALL)
def test_every_registry_refuses_its_own_names(kind):
    registry = ALL[kind]
    assert type(registry) is Registry
    assert registry.kind == kind
    for name in registry:
        with pytest.raises(ConfigError, match=f"{kind} named '{name}' exists already"):
            registry.register(name.swapcase(), None)
