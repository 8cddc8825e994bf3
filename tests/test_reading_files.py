"""Files are read if they are regular and of bounded size, whoever opens them."""

import os
import signal
from contextlib import contextmanager

import pytest

from wbc_suite.benchmark import load_benchmark
from wbc_suite.catalogue import Catalogue
from wbc_suite.compat.robosuite.utils.binding_utils import MjSim
from wbc_suite.compat.robosuite.utils.mjcf_utils import parse_file
from wbc_suite.control import load_composite_controller_config
from wbc_suite.errors import ConfigError, DatasetError, WbcError
from wbc_suite.executors.results import ResultFolder, WorkItem
from wbc_suite.files import check_file, open_file, read_bytes, read_text
from wbc_suite.recording.hdf5_check import open_safely
from wbc_suite.robot import load_robot
from wbc_suite.robot.mesh_files import read_points
from wbc_suite.robot.mjcf_compile import compile_mjcf
from wbc_suite.robot.shapes import SkinMesh
from wbc_suite.robot.surfaces import skin_triangles
from wbc_suite.web.certificate import fingerprint, server_context

READERS = {
    "robot.toml": load_robot,
    "robot.urdf": load_robot,
    "robot.xml": load_robot,
    "scene.xml": compile_mjcf,
    "lift.toml": load_benchmark,
    "control.toml": load_composite_controller_config,
    "control.json": lambda path: load_composite_controller_config(path, "Panda"),
    "mesh.stl": read_points,
    "mesh.obj": read_points,
    "skin.obj": lambda path: skin_triangles(SkinMesh(shape="skin", file=str(path))),
    "lift.hdf5": open_safely,
    "key.pem": fingerprint,
    "certificate.pem": lambda path: server_context(path, path),
    "old.xml": lambda path: MjSim.from_xml_file(str(path)),
    "model.xml": parse_file,
}
"""What opens a file that a user names, by the name of the file."""


@contextmanager
def at_most(seconds):
    """Interrupt what waits for a pipe, or reads without end."""

    def interrupt(*_):
        raise TimeoutError

    signal.signal(signal.SIGALRM, interrupt)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)


def pipe(path):
    os.mkfifo(path)


def endless(path):
    path.symlink_to("/dev/zero")


@pytest.mark.parametrize("make", [pipe, endless])
@pytest.mark.parametrize("name", READERS)
def test_pipes_and_devices_are_refused(name, make, tmp_path):
    path = tmp_path / name
    make(path)
    with at_most(5), pytest.raises(WbcError, match=name):
        READERS[name](path)


@pytest.mark.parametrize("make", [pipe, endless])
def test_a_pipe_in_a_catalogue_or_a_mesh_of_a_model_ends_nothing(make, tmp_path):
    (tmp_path / "robots").mkdir()
    make(tmp_path / "robots/mine.toml")
    make(tmp_path / "mesh.stl")
    model = tmp_path / "x.xml"
    model.write_text('<mujoco><asset><mesh file="mesh.stl"/></asset></mujoco>')
    with at_most(5):
        assert "mine" in Catalogue(extra=(tmp_path,)).called("robots")
        with pytest.raises(ConfigError, match=r"x\.xml.*\n?.*mesh\.stl|outside"):
            compile_mjcf(model)
        results = ResultFolder(tmp_path)
        make(tmp_path / "results/item.json")
        assert results.read(WorkItem(name="item", payload={})) is None


def test_the_size_is_bounded_also_of_files_that_do_not_tell_it(tmp_path):
    path = tmp_path / "ten"
    path.write_bytes(b"0123456789")
    assert read_bytes(path, most=10) == b"0123456789"
    assert check_file(path, most=10).st_size == 10
    with pytest.raises(ConfigError, match=r"ten: the file has 10 bytes; at most 9"):
        read_bytes(path, most=9)
    with pytest.raises(DatasetError, match="at most 9"):
        check_file(path, most=9, error=DatasetError)
    with pytest.raises(ConfigError, match="11 bytes; at most 10"):
        read_bytes(type(path)("/proc/self/status"), most=10)  # its size is 0


@pytest.mark.parametrize(
    ("name", "reason"),
    [("", "folder, a device or a pipe"), ("no", "No such file"), ("a\0", "null")],
)
def test_what_cannot_be_opened_is_named(name, reason, tmp_path):
    with pytest.raises(ConfigError, match=reason):
        open_file(tmp_path / name)


def test_text_is_utf8(tmp_path):
    path = tmp_path / "text"
    path.write_bytes("ä".encode())
    assert read_text(path) == "ä"
    path.write_bytes(b"\xff")
    with pytest.raises(ConfigError, match="text: is not text in UTF-8"):
        read_text(path)
