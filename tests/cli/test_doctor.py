from importlib import metadata
from pathlib import Path

import pytest

from wbc_suite.cli import doctor
from wbc_suite.cli.doctor import diagnose
from wbc_suite.errors import ConfigError
from wbc_suite.sensing import gl_backend


@pytest.mark.slow
def test_this_machine_is_explained():
    findings = {finding.topic: finding for finding in diagnose()}
    assert "ms for a 256x256 frame" in findings["pictures"].text
    assert "daqp" in findings["QP solvers"].text
    assert "mujoco 4" in findings["packages"].text
    assert not [f for f in findings.values() if f.state == "broken"]


def test_parts_of_mujoco_of_different_versions_are_found(monkeypatch):
    version = metadata.version
    wrong = {"mujoco-core": "3.9.0"}
    monkeypatch.setattr(metadata, "version", lambda n: wrong.get(n) or version(n))
    (finding,) = doctor._mujoco()
    assert finding.state == "broken"
    assert finding.cure.endswith("mujoco mujoco-core mujoco-studio")


def test_a_mujoco_that_lost_its_files_is_found(monkeypatch):
    def fail(name: str) -> None:
        raise ImportError("core bindings are missing\nmore")

    monkeypatch.setattr(doctor.importlib, "import_module", fail)
    (finding,) = doctor._mujoco()
    assert finding.state == "broken"
    assert "core bindings are missing" in finding.text


def test_a_missing_package_comes_with_its_command(monkeypatch):
    monkeypatch.setattr(doctor, "_required", lambda: ["no-such-thing"])
    first, _ = doctor._packages()
    assert (first.state, first.cure) == ("broken", "pip install no-such-thing")


def test_no_opengl_is_a_note_with_the_command_that_mends_it(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setattr(gl_backend, "_gl_renderer", lambda name: None)
    try:
        (finding,) = doctor._rendering()
    finally:
        gl_backend.activate.cache_clear()
    assert finding.state == "optional"
    assert "apt-get install" in finding.cure


@pytest.mark.parametrize("absent", ["piqp", "osqp"])
def test_an_absent_solver_is_named(monkeypatch, absent):
    import qpsolvers

    known = [name for name in qpsolvers.available_solvers if name != absent]
    monkeypatch.setattr(qpsolvers, "available_solvers", known)
    *_, finding = doctor._solvers()
    expected = "broken" if absent == "osqp" else "optional"
    assert absent in finding.text
    assert finding.state == expected


@pytest.mark.slow
def test_kernels_of_robots_are_compiled(capsys):
    doctor.doctor(["Panda"], compiles=True)
    robot, folder = capsys.readouterr().out.splitlines()
    assert robot.startswith("Panda: ready after ")
    assert any(Path(folder.removeprefix("Kernels are in ")).rglob("*.nbi"))


@pytest.mark.parametrize("arguments", [(["Panda"], False), ([], True)])
def test_robots_and_compile_belong_together(arguments):
    robots, compiles = arguments
    with pytest.raises(ConfigError, match="--compile Panda"):
        doctor.doctor(robots, compiles=compiles)
