"""The README shows every robot, gripper and base of the catalogue."""

import importlib.util
from pathlib import Path

import pytest
from PIL import Image

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def gallery():
    spec = importlib.util.spec_from_file_location(
        "draw_gallery", ROOT / "docs" / "draw_gallery.py"
    )
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_readme_shows_the_catalogue(gallery):
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert gallery.table() in text, "run `make gallery`"


def test_every_subject_has_a_small_picture(gallery):
    names = [name for rows in gallery.subjects().values() for _, name in rows]
    assert len(names) > 30
    for name in names:
        path = gallery.picture_of(name)
        assert path.is_file(), f"run `make gallery ARGS={name}`"
        assert path.stat().st_size < 30_000
        with Image.open(path) as picture:
            assert picture.size == (gallery.SIZE, gallery.SIZE)
            assert len(set(picture.getdata())) > 500  # something is drawn
    assert len(list(gallery.FOLDER.iterdir())) == len(names)
