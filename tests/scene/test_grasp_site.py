"""Grasp sites: frames of hands on objects."""

import numpy as np
import pytest

from wbc_suite.scene.objects import grasp_site

SETS = {
    "box": grasp_site.box_grasps((0.02, 0.02, 0.05)),
    "rod": grasp_site.rod_grasps([(0.0, 0.0, 0.1)], axis=2),
    "end": grasp_site.end_grasps((0.0, 0.0, 0.1), axis=2),
    "top": grasp_site.top_grasps((0.0, 0.0, 0.1), [(0.0, 1.0, 0.0)]),
}


@pytest.mark.parametrize("name", SETS)
def test_poses_are_rotations_with_the_axes_of_hands(name):
    for site in SETS[name]:
        R = site.pose.rotation
        np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-12)
        assert np.linalg.det(R) == pytest.approx(1.0)
        np.testing.assert_allclose(R[:, 2], site.approach, atol=1e-12)
        np.testing.assert_allclose(R[:, 1], site.closing, atol=1e-12)
        np.testing.assert_allclose(site.turned().pose.rotation[:, 1], -R[:, 1])


def test_fingers_close_only_on_faces_that_they_can_hold():
    wide = grasp_site.box_grasps((0.02, 0.06, 0.06))
    assert {abs(site.closing[0]) for site in wide} == {1.0}
    assert len(grasp_site.box_grasps((0.02, 0.02, 0.02))) == 24
    assert grasp_site.box_grasps((0.1, 0.1, 0.1)) == ()


def test_rods_are_held_across_and_before_their_axis():
    for site in grasp_site.rod_grasps([(0.0, 0.0, 0.1)], axis=2, lift=0.01):
        assert abs(site.approach[2]) < 1e-12
        assert abs(site.closing[2]) < 1e-12
        before = (0.0, 0.0, 0.1) - 0.01 * np.array(site.approach)
        np.testing.assert_allclose(site.pos, before, atol=1e-12)
