"""Projection against pictures: a coloured ball is where it is said to be."""

import mujoco
import numpy as np
import pytest
from numpy.testing import assert_allclose

from wbc_suite.errors import UnknownNameError
from wbc_suite.sensing.cameras import Cameras
from wbc_suite.sensing.projection import Projection, camera_id

SCENE = """<mujoco><visual><headlight ambient="1 1 1"/></visual><worldbody>
<geom name="wall" type="plane" size="9 9 1" rgba="0 0 1 1"/>
<body name="b" mocap="true"><geom size="{radius}" rgba="1 0 0 1"/></body>
<camera name="above" pos=".1 -.2 1.5" xyaxes="1 .2 0 -.2 1 0" fovy="50"/>
<camera name="aside" pos="1.4 .3 .9" xyaxes="-.2 1 0 -.4 -.1 .8" fovy="60"/>
<camera name="lens" pos="0 0 2" sensorsize=".0036 .0024" resolution="120 80"
 focal=".004 .005" principal=".0002 -.0001"/>
</worldbody></mujoco>"""
WIDTH, HEIGHT = 120, 80


def scene(radius):
    model = mujoco.MjModel.from_xml_string(SCENE.format(radius=radius))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data, Cameras(model, data, (), preset="fast")


@pytest.mark.parametrize("camera", ["above", "aside", "lens"])
def test_a_small_ball_is_at_the_pixel_that_it_projects_to(camera):
    model, data, cameras = scene(0.02)
    view = {"width": WIDTH, "height": HEIGHT}
    rng, found = np.random.default_rng(0), 0
    for _ in range(20):
        ball = rng.uniform([-0.4, -0.4, 0.05], [0.4, 0.4, 0.4])
        data.mocap_pos[0] = ball
        mujoco.mj_forward(model, data)
        pixel, depth = cameras.projection(camera, **view).to_pixels(ball)
        red = cameras.image(camera, **view).astype(int)
        v, u = np.nonzero(red[..., 0] - red[..., 2] > 60)
        inside = (np.array([3, 3]) < pixel) & (pixel < np.array([116, 76]))
        if not inside.all():
            continue
        found += 1
        # A ball of a few pixels: its middle is known to half a pixel.
        assert_allclose([u.mean(), v.mean()], pixel, atol=0.6)
        seen = cameras.depth(camera, **view)[round(pixel[1]), round(pixel[0]), 0]
        assert depth - 0.022 < seen < depth  # its near side, not the wall behind
    cameras.close()
    assert found >= 10


def test_the_way_back_is_exact():
    _, data, cameras = scene(0.1)
    projection = cameras.projection("aside", width=33, height=21)
    rng = np.random.default_rng(1)
    pixels, depth = rng.uniform(0, 20, (50, 2)), rng.uniform(0.1, 5.0, 50)
    there, again = projection.to_pixels(projection.to_world(pixels, depth))
    assert_allclose(there, pixels, atol=1e-9)
    assert_allclose(again, depth, atol=1e-12)
    assert_allclose(projection.T_wc[:3, 3], data.cam("aside").xpos)


def test_points_of_a_cloud_lie_on_what_is_seen_and_normals_stand_on_it():
    model, data, cameras = scene(0.25)
    data.mocap_pos[0] = middle = np.array([0.1, 0.0, 0.25])
    mujoco.mj_forward(model, data)
    view = {"width": 64, "height": 48}
    cloud, normals = (
        getattr(cameras, k)("above", **view) for k in ("point_cloud", "normals")
    )
    ball = cameras.segmentation("above", level="element", **view)[..., 0] == 2
    cameras.close()
    assert ball.sum() > 100
    # a z buffer is right to 1 mm at 1.5 m; a ball of 16 x 8 sides loses up to 9 mm
    assert_allclose(cloud[~ball][:, 2], 0.0, atol=2e-3)
    assert_allclose(np.linalg.norm(cloud[ball] - middle, axis=1), 0.25, atol=1e-2)
    assert_allclose(np.linalg.norm(normals, axis=-1), 1.0, atol=1e-9)
    floor = normals[5:10, 5:10].reshape(-1, 3)
    assert_allclose(floor, np.tile([0, 0, 1], (25, 1)), atol=0.05)
    top = cloud[ball][:, 2] > 0.45
    outward = (cloud[ball] - middle) / 0.25
    assert np.sum(normals[ball][top] * outward[top], axis=1).min() > 0.9


def test_a_point_behind_the_camera_has_a_negative_depth():
    model, data, _ = scene(0.1)
    projection = Projection.of(model, data, 0, width=8, height=8)
    assert projection.to_pixels([0.1, -0.2, 3.0])[1] == pytest.approx(-1.5)


def test_one_hand_also_answers_to_the_datasets_name():
    two = "<camera name='r_left_eye_in_hand'/>"
    one = "<camera name='r_right_eye_in_hand'/>"
    text = "<mujoco><worldbody>{}</worldbody></mujoco>"
    model = mujoco.MjModel.from_xml_string(text.format(one))
    assert camera_id(model, "r_eye_in_hand") == 0
    model = mujoco.MjModel.from_xml_string(text.format(one + two))
    with pytest.raises(UnknownNameError, match="Did you mean 'r_left_eye_in_hand'"):
        camera_id(model, "r_eye_in_hand")


def test_points_and_normals_of_the_background_are_none():
    text = SCENE.format(radius=0.25).replace('<geom name="wall" type="plane"', "<!--")
    text = text.replace('rgba="0 0 1 1"/>', "-->")
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    cameras, view = Cameras(model, data, (), preset="fast"), {"width": 64, "height": 48}
    ball = cameras.segmentation("above", level="element", **view)[..., 0] > 0
    assert 50 < ball.sum() < ball.size
    for found in (cameras.point_cloud, cameras.normals):
        values = found("above", **view)
        np.testing.assert_array_equal(np.isfinite(values).all(axis=-1), ball)
        assert np.isnan(values[~ball]).all()
    cameras.close()
