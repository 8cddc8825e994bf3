"""Names of imported robots: valid, unique, and the same each time."""

import pytest

from wbc_suite.robot.adopt.importing import NameTable


@pytest.mark.parametrize(
    ("original", "name"),
    [
        ("elbow", "elbow"),
        ("left.arm-1", "left_arm_1"),
        ("1st link", "link_1st_link"),
        ("__tool", "link_tool"),
        ("", "link"),
        ("Größe", "Gr__e"),
        ("world", "world_link"),  # reserved
        ("a" * 200, "a" * 70),
    ],
)
def test_a_name_stays_as_close_as_possible(original, name):
    assert NameTable().take(original, "link") == name


def test_taken_names_get_the_kind_and_a_number():
    names = NameTable()
    taken = [names.take("a", kind) for kind in ("link", "joint", "joint", "frame")]
    assert taken == ["a", "a_joint", "a_joint2", "a_frame"]


def test_long_names_stay_unique_within_the_limit():
    names = NameTable()
    taken = [names.take("x" * 100, "link") for _ in range(30)]
    assert len(set(taken)) == 30
    assert max(map(len, taken)) <= 80


def test_new_names_are_logged_and_kept_ones_are_not(caplog):
    caplog.set_level("INFO")
    names = NameTable()
    names.take("fine", "link")
    names.take("not-fine", "joint")
    assert caplog.messages == ["The joint 'not-fine' is imported as 'not_fine'."]
