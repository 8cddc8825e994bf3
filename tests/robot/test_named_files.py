"""Names of robots in public collections stand for their files."""

import sys

import pytest

from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.robot import load_robot
from wbc_suite.robot.named_files import named_file

MODEL = (
    '<mujoco model="m"><worldbody><body name="b"><joint name="j" range="-1 1"/>'
    '<geom size="0.1" mass="1"/></body></worldbody></mujoco>'
)
API = """
from pathlib import Path
from types import SimpleNamespace as Namespace

HERE = Path(__file__).parent
ENTRIES = (
    Namespace(name="m", file="m.xml"), Namespace(name="scene", file="scene.xml")
)

class MenagerieError(Exception): ...

class Model:
    entry_points, default_model = ENTRIES, "m"
    def xml(self, entry):
        if entry == "scene":
            raise MenagerieError("no network")
        return HERE / f"{entry}.xml"

def names():
    return ["unitree_m"]

def get(name):
    return Model()
"""


@pytest.fixture
def packages(tmp_path, monkeypatch):
    """A folder that packages are imported from, without those of this machine."""
    for name in list(sys.modules):
        if name.partition(".")[0] in ("mujoco_menagerie", "robot_descriptions"):
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.delenv("MENAGERIE_ROOT", raising=False)
    monkeypatch.syspath_prepend(str(tmp_path))
    yield tmp_path
    for name in list(sys.modules):
        if name.partition(".")[0] in ("mujoco_menagerie", "robot_descriptions"):
            del sys.modules[name]


def write(folder, **files):
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        (folder / name.replace("_dot_", ".")).write_text(text)


def test_other_names_are_no_files():
    assert named_file("Panda") is None
    assert named_file("C:/robots/panda.xml") is None


def test_a_checkout_of_menagerie_is_read(tmp_path, monkeypatch):
    files = {f"{stem}_dot_xml": MODEL for stem in ("m", "m_with_hands", "scene")}
    write(tmp_path / "unitree_m", **files)
    monkeypatch.setenv("MENAGERIE_ROOT", str(tmp_path))
    assert load_robot("menagerie:unitree_m").joint_names == ("j",)
    other = named_file("menagerie:unitree_m/m_with_hands")
    assert other == tmp_path / "unitree_m" / "m_with_hands.xml"
    with pytest.raises(UnknownNameError, match="Did you mean 'unitree_m'"):
        named_file("menagerie:unitre_m")
    with pytest.raises(UnknownNameError, match="'m_with_hand'"):
        named_file("menagerie:unitree_m/m_with_hand")


def test_the_package_of_menagerie_gives_its_default_model(packages):
    write(packages / "mujoco_menagerie", __init___dot_py=API, m_dot_xml=MODEL)
    found = named_file("menagerie:unitree_m")
    assert found == packages / "mujoco_menagerie" / "m.xml"
    with pytest.raises(UnknownNameError, match="unitree_m"):
        named_file("menagerie:unitree_n")
    with pytest.raises(ConfigError, match="cannot be fetched: no network"):
        named_file("menagerie:unitree_m/scene")


def test_robot_descriptions_gives_the_path_of_its_module(packages):
    folder = packages / "robot_descriptions"
    write(
        folder,
        __init___dot_py="",
        m_description_dot_py=f"URDF_PATH = {str(folder / 'm.urdf')!r}",
        n_description_dot_py="raise RuntimeError('no git')",
        x_description_dot_py="XACRO_PATH = 'x.xacro'",
    )
    assert named_file("robot_descriptions:m") == folder / "m.urdf"
    assert named_file("robot_descriptions:m_description") == folder / "m.urdf"
    for name, text in (("n", "no git"), ("x", "neither URDF nor MJCF")):
        with pytest.raises(ConfigError, match=text):
            named_file(f"robot_descriptions:{name}")
    with pytest.raises(UnknownNameError, match="m_description"):
        named_file("robot_descriptions:q")


def test_the_message_without_a_package_says_what_to_install(monkeypatch):
    monkeypatch.delenv("MENAGERIE_ROOT", raising=False)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(ConfigError, match="pip install mujoco-menagerie"):
        named_file("menagerie:unitree_g1")
