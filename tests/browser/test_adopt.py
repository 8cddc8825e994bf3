"""`wbc-suite adopt` in a real browser: guesses are corrected, and files written."""

import time

import numpy as np
import pinocchio as pin
import pytest
from conftest import Viewer, note, wait_until

import wbc_suite
from wbc_suite.catalogue import Catalogue
from wbc_suite.control import load_composite_controller_config
from wbc_suite.envs.hold_check import hold_faults
from wbc_suite.viewers.adopt_page import AdoptPage
from wbc_suite.viewers.page_server import PageServer

pytestmark = [pytest.mark.browser, pytest.mark.slow]


def exported(name, folder):
    path = folder / "robot.urdf"
    robot = wbc_suite.load_robot(name)
    path.write_text(robot.to_urdf(mesh_dir=folder / "robot_meshes"), encoding="utf-8")
    return wbc_suite.load_robot(path)


def opened(robot, context, folder):
    said = []
    page = AdoptPage(
        robot, PageServer(port=0), notes=["a note"], folder=folder, say=said.append
    )
    return page, Viewer(context, page.site, dots=0.2), said


def choose(viewer, label, option):
    """Pick an option of a list, as a person would."""
    viewer.page.get_by_label(label, exact=True).first.click()
    viewer.page.get_by_role("option", name=option, exact=True).click()


def write(viewer, said):
    viewer.page.get_by_role("button", name="Write", exact=True).last.click()
    return wait_until(lambda: said and said[0], "the files are written")


def test_a_mobile_manipulator_is_adopted(context, tmp_path):
    page, viewer, said = opened(exported("Tiago", tmp_path), context, tmp_path / "lab")
    began = time.monotonic()
    try:
        name = page.robot.hands["left"]
        before = page.frames[name].pos
        handle = page.handles[name]
        body = page.page.data.body(page.frames[name].link)

        def arrow():
            R = body.xmat.reshape(3, 3)
            local = pin.Quaternion(*np.roll(handle.wxyz, -1)).matrix()
            at = body.xpos + R @ np.asarray(handle.position)
            return viewer.arrow(pin.SE3(R @ local, at), handle.scale)

        viewer.drag_until(lambda: page.frames[name].pos != before, arrow, 30)
        guessed = next(iter(page.synergies.values()))
        viewer.page.get_by_role("button", name="swap").first.click()
        wait_until(
            lambda: next(iter(page.synergies.values())) != guessed, "it is swapped"
        )
        swapped = next(iter(page.synergies.values()))
        choose(viewer, "Root", "planar")
        text = write(viewer, said)
        note(adopt_tiago_seconds=round(time.monotonic() - began, 1))
        viewer.screenshot("adopt_tiago")
    finally:
        page.site.stop()
    assert "Next: wbc-suite teleop --robots" in text
    robot = wbc_suite.load_robot(next((tmp_path / "lab/robots").glob("*.toml")))
    assert robot.frame(name).pos == page.frames[name].pos != before
    assert swapped in [s for own in robot.synergies.values() for s in own]
    assert robot.root.kind == "planar"
    catalogue = Catalogue(extra=(tmp_path / "lab",))
    config = load_composite_controller_config(
        "WHOLE_BODY_IK", robot, catalogue=catalogue
    )
    assert {frame["name"] for frame in config["frame"]} >= {"right_hand", "base"}
    file = next((tmp_path / "lab/controllers").glob("*_ik.toml"))
    assert hold_faults(robot, controller=str(file)) == []


def test_a_humanoid_is_adopted_with_a_gait(context, tmp_path):
    page, viewer, said = opened(exported("G1", tmp_path), context, tmp_path / "lab")
    began = time.monotonic()
    try:
        choose(viewer, "Root", "free")
        text = write(viewer, said)
        note(adopt_g1_seconds=round(time.monotonic() - began, 1))
        viewer.screenshot("adopt_g1")
    finally:
        page.site.stop()
    checks = [line for line in text.splitlines() if line.startswith("Check: ")]
    assert all("it holds" in x or "_thumb_" in x for x in checks), text
    path = next((tmp_path / "lab/robots").glob("*.toml"))
    robot = wbc_suite.load_robot(path)
    assert robot.root.kind == "free"
    file = tmp_path / f"lab/controllers/{path.stem}_whole_body_id.toml"
    gait = load_composite_controller_config(file, robot)
    assert gait["gait"]["type"] == "walk"
    assert "left" in gait["foot"][0]["frame"]
    heel, toes, right, left = gait["foot"][0]["sole"]
    assert heel < 0.0 < toes
    assert right < 0.0 < left
    file = tmp_path / f"lab/controllers/{path.stem}_whole_body_ik.toml"
    # Thumbs are pushed off the palm, where their open ends are guessed.
    faults = hold_faults(robot, controller=str(file))
    assert all("_thumb_" in fault for fault in faults), faults
