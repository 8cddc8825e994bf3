import mujoco
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from wbc_suite.sensing import reading
from wbc_suite.sensing.observation_buffer import LARGEST, ObservationBuffer

CHAIN = """<mujoco><worldbody>
<body name="a"><freejoint/><geom size=".1"/><site name="s" pos=".1 .2 .3"/>
<body name="b" pos="0 0 .5"><joint axis="0 1 0"/><joint type="slide"/>
<geom size=".1"/><site name="t" euler="30 40 50"/></body></body>
</worldbody><size nuserdata="3"/></mujoco>"""
A, B = 1, 2  # bodies
S, T = 0, 1  # sites


@pytest.fixture
def scene():
    model = mujoco.MjModel.from_xml_string(CHAIN)
    return model, mujoco.MjData(model)


def move(scene, rng):
    model, data = scene
    data.qpos[:] = rng.normal(size=model.nq)
    data.qpos[3:7] /= np.linalg.norm(data.qpos[3:7])
    data.qvel[:] = rng.normal(size=model.nv)
    mujoco.mj_forward(model, data)


def test_readings_are_what_mujoco_says(scene):
    data = scene[1]
    readings = {
        "q": reading.joint_positions([8, 7]),
        "q_cos": reading.joint_cosines([7]),
        "q_sin": reading.joint_sines([7]),
        "v": reading.joint_velocities([6]),
        "noted": reading.user_values([2, 0]),
        "b_pos": reading.body_position(B),
        "b_quat": reading.body_quat(B),
        "t_pos": reading.site_position(T),
        "way": reading.offset(reading.body_position(A), reading.site_position(T)),
        "back": reading.offset(reading.site_position(T), reading.body_position(A)),
    }
    buffer = ObservationBuffer(data, {"all": readings})
    for seed in range(5):
        move(scene, np.random.default_rng(seed))
        data.userdata[:] = seed, 0.5, -1e9
        buffer.update()
        seen = buffer.observation()
        assert_array_equal(seen["noted"], [-LARGEST, seed])
        assert_array_equal(seen["q"], data.qpos[[8, 7]])
        assert_allclose(seen["q_cos"], np.cos(data.qpos[7]), atol=1e-15)
        assert_allclose(seen["q_sin"], np.sin(data.qpos[7]), atol=1e-15)
        assert_array_equal(seen["v"], data.qvel[[6]])
        assert_array_equal(seen["b_pos"], data.body("b").xpos)
        turned = Rotation.from_quat(seen["b_quat"]).as_matrix()
        assert_allclose(turned.ravel(), data.body("b").xmat, atol=1e-14)
        assert_array_equal(seen["t_pos"], data.site("t").xpos)
        assert_array_equal(seen["way"], data.body("a").xpos - data.site("t").xpos)
        assert_array_equal(seen["back"], -seen["way"])
        flat = [seen[key].tolist() for key in readings]
        assert_array_equal(seen["all"], np.concatenate(flat))


def test_quaternions_of_sites_are_mujocos_for_every_turn(scene):
    data = scene[1]
    buffer = ObservationBuffer(data, {"all": {"s_quat": reading.site_quat(S)}})
    half_turns = Rotation.from_rotvec(np.pi * np.eye(3))
    near = Rotation.random(500, rng=np.random.default_rng(0))
    for turn in [*half_turns, *near]:
        data.site_xmat[S] = turn.as_matrix().ravel()
        wxyz = np.empty(4)
        mujoco.mju_mat2Quat(wxyz, data.site_xmat[S])
        buffer.update()
        assert_allclose(buffer.values, wxyz[[1, 2, 3, 0]], atol=1e-15)


def test_poses_seen_from_a_site_are_those_in_its_frame(scene):
    data = scene[1]
    readings = {
        "pos": reading.relative_position(A, T),
        "quat": reading.relative_quat(A, T),
    }
    buffer = ObservationBuffer(data, {"all": readings})
    for seed in range(20):
        move(scene, np.random.default_rng(seed))
        buffer.update()
        seen = buffer.observation()
        R_wt = data.site_xmat[T].reshape(3, 3)
        way = data.xpos[A] - data.site_xpos[T]
        assert_allclose(seen["pos"], R_wt.T @ way, atol=1e-14)
        turn = Rotation.from_quat(seen["quat"]).as_matrix()
        assert_allclose(turn, R_wt.T @ data.xmat[A].reshape(3, 3), atol=1e-14)
        assert seen["quat"].max() == np.abs(seen["quat"]).max()


def test_one_of_several_readings_is_selected_by_its_index(scene):
    data = scene[1]
    options, number = [reading.body_position(A), reading.body_position(B)], 0
    readings = {
        "pos": reading.selected(options, lambda: number),
        "id": reading.selected(list(map(reading.constant, (5, 7))), lambda: number),
    }
    buffer = ObservationBuffer(data, {"all": readings})
    move(scene, np.random.default_rng(0))
    for number, body, told in ((0, A, 5.0), (1, B, 7.0)):  # noqa: B007 - it is asked
        buffer.update()
        assert_array_equal(buffer.observation()["pos"], data.xpos[body])
        assert buffer.observation()["id"] == told


def test_functions_are_called_at_every_update(scene):
    data = scene[1]
    readings = {"doubled": reading.computed(2, lambda: 2.0 * data.qvel[:2])}
    buffer = ObservationBuffer(data, {"all": readings})
    for seed in (0, 1):
        move(scene, np.random.default_rng(seed))
        buffer.update()
        assert_array_equal(buffer.observation()["doubled"], 2.0 * data.qvel[:2])


def test_what_is_handed_out_shares_no_memory(scene):
    data = scene[1]
    groups = {
        "first": {"q": reading.joint_positions([7, 8])},
        "none": {},
        "second": {"v": reading.joint_velocities([6, 7])},
    }
    buffer = ObservationBuffer(data, groups)
    move(scene, np.random.default_rng(0))
    buffer.update()
    seen = buffer.observation()
    assert list(seen) == ["q", "first", "v", "second"]
    assert buffer.space.contains(seen)
    expected = {key: values.copy() for key, values in seen.items()}
    for key in seen:
        seen[key] += 1.0
        expected[key] += 1.0
        for other in seen:
            assert_array_equal(seen[other], expected[other])
    assert_array_equal(buffer.observation()["q"], data.qpos[[7, 8]])


def test_bodies_quaternions_rounded_past_one_are_seen_within_bounds(scene):
    data = scene[1]
    buffer = ObservationBuffer(data, {"all": {"a_quat": reading.body_quat(A)}})
    data.xquat[A] = [-1.0 - 1e-15, 0.0, 0.0, 0.0]
    buffer.update()
    assert_array_equal(buffer.values, [0.0, 0.0, 0.0, -1.0])


def test_a_computed_quaternion_rounded_past_one_is_seen_within_its_bounds(scene):
    past = reading.computed(4, lambda: [0.0, 0.0, 0.0, 1.0 + 1e-15])
    buffer = ObservationBuffer(scene[1], {"all": {"a_quat": past}})
    buffer.update()
    assert buffer.space.contains(buffer.observation())
