"""Observations are laid out group by group, and stay within their bounds."""

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wbc_suite.sensing import reading
from wbc_suite.sensing.observation_buffer import LARGEST, ObservationBuffer

ARM = """<mujoco><worldbody><body><joint/><geom size=".1"/><body><joint/>
<geom size=".1"/><body><joint/><geom size=".1"/><site/></body></body></body>
</worldbody><actuator><motor joint="j"/></actuator></mujoco>"""
ARM = ARM.replace("<joint/>", '<joint name="j"/>', 1)


@pytest.fixture
def data():
    model = mujoco.MjModel.from_xml_string(ARM)
    return mujoco.MjData(model)


def test_groups_follow_their_readings(data):
    groups = {
        "robot": {
            "q": reading.joint_positions([0, 1]),
            "v": reading.joint_velocities([2]),
        },
        "empty": {},
        "object": {"pos": reading.body_position(1)},
    }
    buffer = ObservationBuffer(data, groups)
    assert buffer.places == {
        "q": slice(0, 2),
        "v": slice(2, 3),
        "robot": slice(0, 3),
        "pos": slice(3, 6),
        "object": slice(3, 6),
    }
    assert list(buffer.space) == sorted(buffer.places)
    assert buffer.values.shape == (6,)


@pytest.mark.parametrize(
    "addresses", [[0], [1, 2], [0, 1, 2], [2, 1, 0], [0, 2], [1, 1], []]
)
def test_any_addresses_are_read_in_their_order(data, addresses):
    data.qpos[:] = 0.1, 0.2, 0.3
    buffer = ObservationBuffer(data, {"g": {"q": reading.joint_positions(addresses)}})
    buffer.update()
    np.testing.assert_array_equal(buffer.values, data.qpos[np.array(addresses, int)])


def test_readings_follow_the_simulation_and_not_its_past(data):
    buffer = ObservationBuffer(data, {"g": {"q": reading.joint_positions([0, 1, 2])}})
    buffer.update()
    before = buffer.observation()["q"]
    data.qpos[:] = 1.0
    np.testing.assert_array_equal(before, np.zeros(3))
    np.testing.assert_array_equal(buffer.values, np.zeros(3))
    buffer.update()
    np.testing.assert_array_equal(buffer.values, np.ones(3))


def test_two_simulations_share_readings(data):
    model = mujoco.MjModel.from_xml_string(ARM)
    other = mujoco.MjData(model)
    readings = {"g": {"q": reading.joint_positions([0])}}
    first, second = (ObservationBuffer(each, readings) for each in (data, other))
    data.qpos[0], other.qpos[0] = 1.0, 2.0
    for buffer in (first, second):
        buffer.update()
    assert (first.values[0], second.values[0]) == (1.0, 2.0)


def test_forces_of_actuators_are_read(data):
    model = mujoco.MjModel.from_xml_string(ARM)
    data = mujoco.MjData(model)
    buffer = ObservationBuffer(data, {"g": {"tau": reading.actuator_forces([0, 1])}})
    data.ctrl[0] = 3.0
    mujoco.mj_forward(model, data)
    buffer.update()
    np.testing.assert_array_equal(buffer.values, [3.0, 0.0])


@given(st.floats(-1e300, 1e300), st.floats(-5.0, 5.0))
def test_values_are_clipped_to_their_bounds(large, small):
    data = mujoco.MjData(mujoco.MjModel.from_xml_string(ARM))
    readings = {
        "force": reading.computed(1, lambda: large),
        "hand_quat": reading.computed(1, lambda: small),
    }
    buffer = ObservationBuffer(data, {"g": readings})
    buffer.update()
    expected = [np.clip(large, -LARGEST, LARGEST), np.clip(small, -1.0, 1.0)]
    np.testing.assert_array_equal(buffer.values, expected)
    assert buffer.space.contains(buffer.observation())


@pytest.mark.parametrize(
    ("key", "bound"),
    [
        ("a_quat", 1.0),
        ("a_cos", 1.0),
        ("a_sin", 1.0),
        ("a_pos", LARGEST),
        ("quat", LARGEST),
    ],
)
def test_bounds_follow_the_ends_of_keys(data, key, bound):
    buffer = ObservationBuffer(data, {"g": {key: reading.constant(0.0)}})
    assert buffer.bounds[key] == bound
    assert buffer.space[key].high[0] == bound


def test_a_reading_of_a_wrong_size_is_an_error(data):
    wrong = reading.computed(2, lambda: [1.0, 2.0, 3.0])
    buffer = ObservationBuffer(data, {"g": {"x": wrong}})
    with pytest.raises(ValueError, match="broadcast"):
        buffer.update()


def test_offsets_are_differences_of_any_readings(data):
    ahead = reading.computed(3, lambda: [1.0, 2.0, 3.0])
    way = reading.offset(ahead, reading.offset(ahead, reading.constant(1.0)))
    buffer = ObservationBuffer(data, {"g": {"way": way}})
    buffer.update()
    np.testing.assert_array_equal(buffer.values, [1.0, 1.0, 1.0])
