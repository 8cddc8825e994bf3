"""What a headset is shown: meshes with edges, poses, and states in words."""

import json
import struct

import numpy as np
import pytest

import wbc_suite
from wbc_suite.robot.triangle_meshes import box_mesh, ellipsoid_mesh
from wbc_suite.viewers.headset_view import SessionView, creased
from wbc_suite.viewers.teleop_session import TeleopSession


def test_box_has_edges_and_a_sphere_none():
    vertices, normals, faces = creased(box_mesh(np.array([0.1, 0.2, 0.3])))
    assert len(vertices) == 24  # three normals at each of the 8 corners
    assert np.sort(np.abs(normals), axis=1) == pytest.approx(
        np.tile([0.0, 0.0, 1.0], (24, 1)), abs=1e-6
    )
    corners = vertices[faces]
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert ((outward * normals[faces[:, 0]]).sum(axis=1) > 0).all()
    vertices, normals, _ = creased(ellipsoid_mesh(np.full(3, 0.1)))
    np.testing.assert_allclose(normals, vertices / 0.1, atol=0.12)


def parsed(scene):
    (size,) = struct.unpack_from("<I", scene)
    header = json.loads(scene[4 : 4 + size])
    assert size % 4 == 0  # arrays of the browser start at multiples of 4 bytes
    assert len(scene) == 4 + size + sum(
        24 * m["vertices"] + 12 * m["faces"] for m in header["meshes"]
    )
    return header


@pytest.mark.slow
def test_view_of_a_session_tells_bodies_eyes_and_how_hands_follow():
    env = wbc_suite.make("Lift", robots="Panda", controller_configs="WHOLE_BODY_IK")
    session = TeleopSession(env, period=0.05)
    view = SessionView(session, "Panda · Lift")
    header = parsed(view.scene)
    assert header["title"] == "Panda · Lift"
    assert header["bodies"] == session.model.nbody
    assert header["hands"] == ["right_hand"]
    poses = np.frombuffer(view.poses(), "<f4").reshape(-1, 7)
    np.testing.assert_allclose(
        poses[:-1, :3], session.snapshot.body_positions, atol=1e-6
    )
    hand = session.snapshot.limbs["right_hand"]
    np.testing.assert_allclose(poses[-1, :3], hand.target.translation, atol=1e-6)
    status = json.loads(view.status())
    assert status["hands"]["right_hand"]["state"] in ("released", "following")
    session.pause(0, True)
    session.tick()
    assert json.loads(view.status())["text"] == "Paused: viewer 1 may resume"
    env.close()
