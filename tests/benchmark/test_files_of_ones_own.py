"""Benchmarks of one's own: files that extend others, classes by name and by place."""

import sys

import pytest

import wbc_suite
from wbc_suite.benchmark import BENCHMARKS, Lift, load_benchmark, register_benchmark
from wbc_suite.catalogue import ENVIRONMENT_VARIABLE, Catalogue
from wbc_suite.errors import ConfigError, UnknownNameError

HIGH = 'extends = "lift"\nname = "HighLift"\n[reward]\nlift_height = 0.1\n'


@pytest.fixture
def lab(tmp_path):
    (tmp_path / "tasks").mkdir()
    (tmp_path / "tasks" / "high.toml").write_text(HIGH)
    return tmp_path


def check(benchmark):
    ours = load_benchmark("Lift").config
    assert type(benchmark) is Lift
    assert (benchmark.name, benchmark.title) == ("HighLift", "Lift a cube")
    reward = ours.reward.model_copy(update={"lift_height": 0.1})
    changed = {"name": "HighLift", "reward": reward}
    assert benchmark.config == ours.model_copy(update=changed)


def test_a_file_of_ones_own_extends_one_of_the_catalogue(lab):
    check(load_benchmark(lab / "tasks" / "high.toml"))


def test_a_file_beside_a_script_is_named_by_its_relative_path(lab, monkeypatch):
    monkeypatch.chdir(lab / "tasks")
    check(load_benchmark("high.toml"))


@pytest.mark.parametrize("name", ["high", "HighLift", "highlift"])
def test_a_catalogue_of_ones_own_has_new_names(lab, name, monkeypatch):
    check(load_benchmark(name, Catalogue(extra=(lab,))))
    monkeypatch.setenv(ENVIRONMENT_VARIABLE, str(lab))
    check(load_benchmark(name))


def test_an_environment_is_made_of_it(lab, monkeypatch):
    monkeypatch.setenv(ENVIRONMENT_VARIABLE, str(lab))
    env = wbc_suite.make("HighLift", robots="Panda")
    check(env.benchmark)
    env.close()


def test_a_file_extends_that_of_its_own_name_over_which_it_has_precedence(lab):
    (lab / "tasks" / "lift.toml").write_text('extends = "lift"\nhorizon = 7\n')
    catalogue = Catalogue(extra=(lab,))
    assert load_benchmark("Lift", catalogue).horizon == 7
    high = load_benchmark("high", catalogue)
    assert (high.name, high.horizon) == ("HighLift", 7)


def test_tables_are_merged_and_lists_replaced(lab):
    path = lab / "tasks" / "near.toml"
    path.write_text(
        'extends = "high"\n[cube]\nhalf_size = [0.03, 0.03]\n'
        "[places]\nPanda = [-0.5, 0]\n"
    )
    near, high = load_benchmark(path), load_benchmark(lab / "tasks" / "high.toml")
    assert near.config.reward == high.config.reward
    assert near.config.cube.half_size == (0.03, 0.03)
    assert near.config.cube.region == high.config.cube.region
    assert near.config.places == high.config.places | {"Panda": (-0.5, 0.0)}


def test_the_name_is_read_after_the_base_is_merged(lab):
    path = lab / "tasks" / "short.toml"
    path.write_text('extends = "lift"\nhorizon = 9\n')
    assert (load_benchmark(path).name, load_benchmark(path).horizon) == ("Lift", 9)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ('extends = "lfit"', r"'extends' \(line 1\) = 'lfit': No .*mean 'lift'"),
        ('extends = "bad"', "the files form a loop"),
        ('extends = "other"', "the files form a loop"),
        ('extends = "../lift"', "No benchmark file named '../lift'"),
        ("horizon = 3", "missing key 'name'"),
        ('name = "Nothing"', r"key 'name' \(line 1\): No benchmark named 'Nothing'"),
        (
            'extends = "lift"\n[reward]\nheight = 1',
            r"unknown key 'reward.height' \(line",
        ),
    ],
)
def test_a_fault_in_a_file_names_file_and_line(lab, text, fault):
    path = lab / "tasks" / "bad.toml"
    path.write_text(text)
    (lab / "tasks" / "other.toml").write_text('extends = "bad"\n')
    with pytest.raises(ConfigError, match=fault) as caught:
        load_benchmark(path)
    assert str(lab / "tasks") in str(caught.value)


def test_an_arena_is_relative_to_the_file_that_names_it(lab):
    other = lab / "elsewhere"
    other.mkdir()
    base = lab / "tasks" / "kitchen.toml"
    base.write_text('extends = "lift"\n[arena]\nfile = "scene.xml"\nsurface = "own"\n')
    load = load_benchmark(base).arena
    assert load.file == lab / "tasks" / "scene.xml"
    changed = other / "mine.toml"
    changed.write_text('extends = "kitchen"\nname = "Mine"\n[arena]\nyaw = 1.0\n')
    arena = load_benchmark(changed, Catalogue(extra=(lab,))).arena
    assert (arena.file, arena.yaw) == (load.file, 1.0)


def test_names_of_ones_own_are_refused_if_they_are_taken():
    with pytest.raises(ConfigError, match="benchmark named 'Lift' exists already"):
        register_benchmark("lift", Lift)


class Nothing(Lift):
    """Lift, which needs no file of its own."""

    def __init__(self):
        super().__init__(Catalogue().find("tasks", "lift", kind="benchmark"))


def test_a_class_without_file_is_registered_by_one_line(forget):
    forget(BENCHMARKS, "Nothing")
    register_benchmark("Nothing", Nothing)
    assert type(load_benchmark("nothing")) is Nothing
    with pytest.raises(UnknownNameError, match="Did you mean 'Nothing'"):
        load_benchmark("Nothin")


def test_a_registered_class_gets_the_file_of_its_name(lab, forget):
    class High(Lift):
        pass

    forget(BENCHMARKS, "HighLift")
    register_benchmark("HighLift", High)
    assert type(load_benchmark("HighLift", Catalogue(extra=(lab,)))) is High
    with pytest.raises(UnknownNameError, match="No benchmark named 'HighLift'"):
        load_benchmark("HighLift", Catalogue(extra=()))


def test_a_class_of_a_module_is_named_by_its_place(tmp_path, monkeypatch):
    (tmp_path / "own_tasks.py").write_text(
        "from wbc_suite.benchmark import Lift\n"
        "from wbc_suite.catalogue import Catalogue\n"
        "class Mine(Lift):\n"
        "    def __init__(self):\n"
        "        super().__init__(Catalogue().find('tasks', 'lift', kind='file'))\n"
        "class Filed(Lift):\n"
        "    pass\n"
        "def nothing():\n"
        "    return object()\n"
    )
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.chdir(tmp_path)
    assert type(load_benchmark("own_tasks:Mine")).__name__ == "Mine"
    with pytest.raises(ConfigError, match=r"register_benchmark\('Name'"):
        load_benchmark("own_tasks:Filed")
    with pytest.raises(ConfigError, match=r"own_tasks:nothing.*no benchmark: it lacks"):
        load_benchmark("own_tasks:nothing")
    with pytest.raises(ConfigError, match="own_tasks:Min' cannot be found"):
        load_benchmark("own_tasks:Min")
    del sys.modules["own_tasks"]
