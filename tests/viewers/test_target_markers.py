"""Markers of targets: shown where a limb is not at its target."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from fake_env import FakeEnv

from wbc_suite.viewers.scene_setup import limb_colours
from wbc_suite.viewers.target_markers import TargetMarkers
from wbc_suite.viewers.teleop_session import TeleopSession

HAND = "right_hand"


class Node:
    def __init__(self, name, *geometry, visible=True, **options):
        self.name, self.geometry, self.visible = name, geometry, visible
        self.text = geometry[0] if geometry else ""


class Server:
    """A viser server that keeps the nodes of its scene."""

    def __init__(self):
        self.scene, self.nodes = self, {}

    def add(self, name, *geometry, **options):
        self.nodes[name] = Node(name, *geometry, **options)
        return self.nodes[name]

    add_mesh_simple = add_line_segments = add_label = add


@pytest.fixture
def session():
    return TeleopSession(FakeEnv(), period=0.02)


@pytest.fixture
def server():
    return Server()


@pytest.fixture
def markers(server, session):
    colours = limb_colours(session.info.limbs)
    return TargetMarkers(server, session.info, session.snapshot, colours)


def away(session, offset=(0.0, 0.0, 0.1), angle=0.0):
    """A snapshot whose hand is this far from its target."""
    status = session.snapshot.limbs[HAND]
    target = pin.SE3(
        pin.exp3(np.array([0, 0, angle])) @ status.measured.rotation,
        status.measured.translation + np.array(offset),
    )
    status = replace(
        status,
        target=target,
        position_error=float(np.linalg.norm(offset)),
        orientation_error=angle,
    )
    return replace(session.snapshot, limbs={**session.snapshot.limbs, HAND: status})


def visible(server, name=HAND):
    groups = ("targets", "target_lines", "target_labels")
    return tuple(server.nodes[f"/{group}/{name}"].visible for group in groups)


def test_copy_has_the_shape_of_the_limb_in_its_own_frame(server, markers):
    vertices = server.nodes[f"/targets/{HAND}"].geometry[0]
    np.testing.assert_allclose(  # the ellipsoid of the palm
        np.abs(vertices).max(axis=0), [0.06, 0.03, 0.09], rtol=0.03
    )


def test_limb_at_its_target_has_no_marker(server, markers, session):
    markers.update(session.snapshot, {})
    assert visible(server) == (False, False, False)


def test_limb_away_from_its_target_has_a_copy_and_a_line(server, markers, session):
    snapshot = away(session)
    markers.update(snapshot, {})
    assert visible(server) == (True, True, False)
    assert visible(server, "left_hand") == (False, False, False)
    status = snapshot.limbs[HAND]
    copy, line = server.nodes[f"/targets/{HAND}"], server.nodes[f"/target_lines/{HAND}"]
    np.testing.assert_allclose(copy.position, status.target.translation)
    np.testing.assert_allclose(
        line.points[0],
        [status.measured.translation, status.target.translation],
        atol=1e-6,
    )


def test_turned_target_has_a_copy_and_no_line(server, markers, session):
    markers.update(away(session, (0.0, 0.0, 0.0), angle=0.5), {})
    assert visible(server) == (True, False, False)
    wxyz = server.nodes[f"/targets/{HAND}"].wxyz
    np.testing.assert_allclose(np.abs(wxyz), [np.cos(0.25), 0, 0, np.sin(0.25)])


def test_note_is_a_label_above_the_target(server, markers, session):
    snapshot = away(session)
    markers.update(snapshot, {HAND: "10 cm short: out of reach"})
    label = server.nodes[f"/target_labels/{HAND}"]
    assert (label.visible, label.text) == (True, "10 cm short: out of reach")
    assert label.position[2] > snapshot.limbs[HAND].target.translation[2] + 0.1
    markers.update(snapshot, {})
    assert not label.visible
