"""Cameras that follow: they keep direction and distance, and lose nothing."""

from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

from wbc_suite.viewers.camera_follower import CameraFollower

SCENE = """<mujoco><worldbody>
  <body name="table"/>
  <body name="robot0_root"><freejoint/><geom size="0.1"/></body>
</worldbody></mujoco>"""
MIDDLE = np.array([0.1, 0.0, 0.8])


def camera_at(number):
    camera = SimpleNamespace(position=np.array([2.0, 1.0, 1.5]), look_at=MIDDLE.copy())
    return SimpleNamespace(client_id=number, camera=camera)


@pytest.fixture
def follower():
    model = mujoco.MjModel.from_xml_string(SCENE)
    return CameraFollower(model, np.zeros((3, 3)), MIDDLE)


def positions(x, y=0.0, z=0.0):
    return np.array([[0, 0, 0], [0, 0, 0], [x, y, z]], dtype=float)


def test_camera_follows_in_the_plane_and_only_while_it_is_asked_to(follower):
    first, second = camera_at(0), camera_at(1)
    follower.follow(first, True)
    follower.follow(second, True)
    follower.follow(second, False)
    follower.update(positions(1.0, -2.0, 0.3), jump=True)
    np.testing.assert_allclose(first.camera.position, [3.0, -1.0, 1.5])
    np.testing.assert_allclose(second.camera.position, [2.0, 1.0, 1.5])
    np.testing.assert_allclose(follower.moved, [1.0, -2.0, 0.0])


def test_camera_that_reports_late_is_not_left_behind(follower):
    client = camera_at(0)
    follower.follow(client, True)
    for k in range(200):  # the fake camera never reports where it was moved to
        client.camera.position = np.array([2.0, 1.0, 1.5])
        follower.update(positions(0.01 * min(k, 100)), jump=False)
    assert client.camera.position[0] == pytest.approx(2.0)  # the robot rests
    follower.update(positions(1.5), jump=True)
    np.testing.assert_allclose(client.camera.position, [3.5, 1.0, 1.5])


def test_small_motions_move_no_camera(follower):
    client = camera_at(0)
    follower.follow(client, True)
    follower.update(positions(5e-4), jump=True)
    np.testing.assert_array_equal(client.camera.position, [2.0, 1.0, 1.5])
