import numpy as np
import pytest

from wbc_suite.control import ActionLayout, ActionPart, Axis, SliceKind, Unit
from wbc_suite.errors import ActionError, ConfigError, UnknownNameError


def part(name, size):
    return ActionPart(
        name=name,
        kind=SliceKind.POSITION,
        labels=tuple("xyz"[:size]),
        units=(Unit("m"),) * size,
        low=(-1.0,) * size,
        high=(2.0,) * size,
    )


@pytest.fixture
def layout():
    return ActionLayout([part("hand", 3), part("foot", 2)])


def test_pack_and_unpack_are_inverse(layout):
    values = {"foot": [4.0, 5.0], "hand": [1.0, 2.0, 3.0]}
    action = layout.pack(values)
    np.testing.assert_array_equal(action, [1, 2, 3, 4, 5])
    back = layout.unpack(action)
    assert list(back) == ["hand", "foot"]
    np.testing.assert_array_equal(back["foot"], [4, 5])


def test_pack_takes_missing_slices_from_the_base(layout):
    base = np.arange(5.0)
    action = layout.pack({"foot": [8, 9]}, base=base)
    np.testing.assert_array_equal(action, [0, 1, 2, 8, 9])
    np.testing.assert_array_equal(base, np.arange(5.0))


def test_pack_without_a_slice_says_which(layout):
    with pytest.raises(ActionError, match="no value for foot"):
        layout.pack({"hand": [1, 2, 3]})
    with pytest.raises(ActionError, match="slice 'foot' has 2 values"):
        layout.pack({"hand": [1, 2, 3], "foot": [1.0]})
    with pytest.raises(UnknownNameError, match="Did you mean 'hand'"):
        layout.pack({"hnd": [1, 2, 3]}, base=np.zeros(5))


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_value_that_is_not_finite_is_named(layout, bad):
    action = np.zeros(5)
    action[4] = bad
    with pytest.raises(ActionError, match=r"index 4 \(foot: y\) is not finite"):
        layout.check(action)


@pytest.mark.parametrize(
    "bad", [np.zeros(4), np.zeros((1, 5)), 0.0, None, "hand", ["a"] * 5, [1j] * 5]
)
def test_wrong_shapes_and_types_are_refused(layout, bad):
    with pytest.raises(ActionError):
        layout.check(bad)


def test_booleans_are_refused(layout):
    with pytest.raises(ActionError, match="real numbers, not bool"):
        layout.check(np.ones(5, dtype=bool))


def test_clip_counts_what_was_outside_and_leaves_the_input(layout):
    action = np.array([0.0, -5.0, 2.0, 3.0, 1.0])
    clipped, count = layout.clip(action)
    np.testing.assert_array_equal(clipped, [0, -1, 2, 2, 1])
    assert count == 2
    assert action[1] == -5.0


def test_names_are_unique():
    with pytest.raises(ConfigError, match="share a name"):
        ActionLayout([part("hand", 3), part("hand", 2)])


def test_table_names_every_slice_and_unit(layout):
    lines = str(layout).splitlines()
    assert lines[1].split()[:3] == ["hand", "position", "0:3"]
    assert "3:5" in lines[2]
    assert " m " in lines[2]


@pytest.mark.parametrize("dtype", [np.float64, np.float32, np.int64])
def test_take_is_check_and_clip_and_leaves_the_callers_array(layout, dtype):
    rng = np.random.default_rng(0)
    for _ in range(20):
        action = rng.uniform(-3.0, 4.0, 5).astype(dtype)
        before = action.copy()
        taken, outside = layout.take(action)
        expected, count = layout.clip(layout.check(action))
        np.testing.assert_array_equal(taken, expected)
        assert (taken.dtype, outside) == (np.float64, count)
        taken += 1.0
        np.testing.assert_array_equal(action, before)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_take_refuses_what_is_not_finite(layout, bad):
    with pytest.raises(ActionError, match=r"index 3 \(foot: x\)"):
        layout.take(np.array([0.0, 0.0, 0.0, bad, 0.0]))
    with pytest.raises(ActionError, match="shape"):
        layout.take(np.zeros(4))


def test_units_print_what_a_value_of_1_means():
    assert (str(Unit("rad")), str(Unit("rad", 0.05))) == ("rad", "0.05 rad")
    assert str(Unit("m", 1.0)) == "1 m"
    assert Unit("m") != Unit("m", 1.0)


def test_a_layout_prints_axes_and_each_unit_once():
    hand = ActionPart(
        name="hand",
        kind=SliceKind.POSE,
        labels=(Axis.X, Axis.RX),
        units=(Unit("m", 0.05), Unit("rad", 0.5)),
        low=(-1.0, -1.0),
        high=(1.0, 1.0),
    )
    header, row = str(ActionLayout([hand])).splitlines()
    assert header.split() == ["slice", "kind", "index", "values", "unit", "low", "high"]
    assert " ".join(row.split()) == "hand pose 0:2 x rx 0.05 m 0.5 rad -1 1"


def test_a_prefix_renames_a_part_and_keeps_the_rest(layout):
    renamed = layout["hand"].prefixed("robot1_")
    assert renamed.name == "robot1_hand"
    assert (renamed.kind, renamed.labels) == (SliceKind.POSITION, ("x", "y", "z"))
