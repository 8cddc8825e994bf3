import mujoco
import numpy as np
import pytest

from wbc_suite.viewers.model_scene import ModelScene, relative_poses, robot_box

ARM = """
<mujoco><worldbody>
  <geom type="plane" size="1 1 1"/>
  <body name="upper" pos="0 0 1">
    <joint name="shoulder" axis="0 1 0"/>
    <geom type="capsule" size="0.05 0.2" rgba="1 0 0 1"/>
    <geom type="sphere" size="0.07" pos="0 0 0.2" rgba="1 0 0 1"/>
    <geom type="box" size="0.1 0.1 0.1" group="3"/>
    <body name="fore" pos="0.4 0 0">
      <joint name="elbow" axis="0 1 0"/>
      <geom type="capsule" size="0.04 0.2"/>
      <body name="hand" pos="0.3 0 0"><geom type="sphere" size="0.05"/></body>
    </body>
  </body>
</worldbody></mujoco>
"""


@pytest.fixture
def model():
    return mujoco.MjModel.from_xml_string(ARM)


@pytest.fixture
def scene(model):
    viser = pytest.importorskip("viser")
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield ModelScene(server, model)
    server.stop()


def posed(model, *angles):
    data = mujoco.MjData(model)
    data.qpos[:] = angles
    mujoco.mj_forward(model, data)
    return data.xpos, data.xquat


def test_relative_poses_compose_back_to_the_world(model):
    positions, quaternions = posed(model, 0.7, -1.1)
    local = relative_poses(positions, quaternions, model.body_parentid)
    for body in range(1, model.nbody):
        parent = model.body_parentid[body]
        position, quaternion = np.zeros(3), np.zeros(4)
        mujoco.mju_rotVecQuat(position, local[body, :3], quaternions[parent])
        mujoco.mju_mulQuat(quaternion, quaternions[parent], local[body, 3:])
        np.testing.assert_allclose(
            position + positions[parent], positions[body], atol=1e-12
        )
        assert abs(quaternion @ quaternions[body]) == pytest.approx(1.0)


def test_only_what_moved_is_sent(scene, model):
    assert scene.update(*posed(model, 0, 0)) == 3  # three places, no turn
    assert scene.update(*posed(model, 0, 0)) == 0
    assert scene.update(*posed(model, 0.5, 0)) == 1  # the rest rides along
    assert scene.update(*posed(model, 0.5, -0.5)) == 1
    assert scene.update(*posed(model, 0.5 + 1e-5, -0.5)) == 0


@pytest.mark.slow
def test_slow_motion_is_not_lost_below_the_tolerance(scene, model):
    scene.update(*posed(model, 0, 0))
    sent = sum(scene.update(*posed(model, k * 1e-6, 0)) for k in range(1, 501))
    assert sent == 2  # 500 steps of 0.5e-6 in the quaternion, 1e-4 each


def test_one_mesh_per_body_kind_and_colour(scene):
    assert len(scene.visual_shapes) == 3
    assert len(scene.collision_shapes) == 1
    assert not scene.collision_shapes[0].visible
    assert scene.nodes[3] == "/world/upper/fore/hand"


def test_robot_without_shapes_has_a_box_around_its_bodies():
    bare = """<mujoco><worldbody><body pos="0 0 1"><joint/>
    <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody></mujoco>"""
    m = mujoco.MjModel.from_xml_string(bare)
    data = mujoco.MjData(m)
    mujoco.mj_kinematics(m, data)
    low, high = robot_box(m, data)
    assert (low < [0.0, 0.0, 1.0]).all()
    assert (high > [0.0, 0.0, 1.0]).all()
