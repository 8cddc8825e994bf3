"""The gallery shows every robot, gripper and base, and every benchmark."""

import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from wbc_suite.benchmark import BENCHMARKS

ROOT = Path(__file__).parent.parent


def script(name):
    spec = importlib.util.spec_from_file_location(name, ROOT / "docs" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def gallery():
    return script("draw_gallery")


@pytest.fixture(scope="module")
def benchmarks():
    return script("draw_benchmarks")


def check_picture(path, size, name, most=30_000):
    assert path.is_file(), f"run `make gallery ARGS={name}`"
    assert path.stat().st_size < most
    with Image.open(path) as picture:
        assert picture.size == size
        pixels = np.asarray(picture.convert("RGB")).reshape(-1, 3)
    assert len(np.unique(pixels, axis=0)) > 500  # something is drawn


def test_the_page_shows_the_catalogue(gallery):
    page = gallery.page()
    assert gallery.PAGE.read_text(encoding="utf-8") == page
    for robot in ("GR1", "Panda", "OmronMobileBase", "InspireRightHand"):
        assert f'alt="{robot}"' in page
    for rows in gallery.subjects().values():
        for shown, _ in rows:
            assert re.search(rf">{shown}<", page), shown


def test_variants_that_look_alike_share_a_picture(gallery):
    robots = gallery.families(gallery.subjects()["Robots"])
    others = {shown: others for shown, _, others in robots}
    assert others["G1"] == [
        *("G1ArmsOnly", "G1FixedLowerBody", "G1FloatingBody", "G1FreeBody")
    ]
    assert others["Panda"] == []
    assert {"Spot", "SpotWithArm", "PandaOmron"} <= set(others)


def test_the_readme_has_one_strip_of_pictures(gallery):
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert "](docs/images/strip.jpg)" in text
    assert text.count("![") <= 2
    with Image.open(gallery.STRIP) as strip:
        assert strip.width == 10 * strip.height
        assert gallery.STRIP.stat().st_size < 120_000


@pytest.mark.slow
def test_every_subject_has_a_small_picture(gallery):
    rows = gallery.subjects().values()
    names = [name for row in rows for _, name, _ in gallery.families(row)]
    assert len(names) > 30
    for name in names:
        check_picture(gallery.picture_of(name), (gallery.SIZE, gallery.SIZE), name)
    assert len(list(gallery.FOLDER.iterdir())) == len(names)


@pytest.mark.slow
def test_every_benchmark_has_a_picture_and_a_place_on_the_page(benchmarks):
    names = sorted(BENCHMARKS)
    assert benchmarks.PAGE.read_text(encoding="utf-8") == benchmarks.page()
    assert set(benchmarks.ROBOTS) == set(names)
    for name in names:
        check_picture(benchmarks.picture_of(name), benchmarks.SIZE, name, 80_000)
    assert len(list(benchmarks.FOLDER.iterdir())) == len(names)
