"""Messages of errors: nearest names, cut lists, and classes."""

import pickle

import pytest

from wbc_suite import errors
from wbc_suite.errors import (
    UnknownNameError,
    WbcError,
    did_you_mean,
    join_first,
    printable,
    shortened,
)

CLEARS = "a\x1b[2J\x9b31m\x07\r\u202eb"  # clears a terminal, colours it, turns it round


def test_an_unknown_name_lists_what_is_known_and_the_nearest():
    message = str(UnknownNameError("robot", "PANDDA", ["gr1", "panda"]))
    assert message == (
        "No robot named 'PANDDA'. Did you mean 'panda'? Known: gr1, panda."
    )


def test_a_long_list_is_cut_short():
    message = str(UnknownNameError("frame", "x", [f"frame{k:03}" for k in range(100)]))
    assert "frame024 and 75 more." in message
    assert "frame025" not in message


def test_nothing_known_is_said():
    assert str(UnknownNameError("task", "x", [])).endswith("Known: none.")


@pytest.mark.parametrize("name", [n for n in vars(errors) if n.endswith("Error")])
def test_every_error_refines_a_builtin_one(name):
    kind = getattr(errors, name)
    assert issubclass(kind, WbcError)
    builtin = {base for base in kind.__mro__ if base.__module__ == "builtins"}
    assert kind is WbcError or builtin - {Exception, BaseException, object}


def test_an_error_survives_pickling():
    error = UnknownNameError("robot", "x", ["a", "b"])
    copy = pickle.loads(pickle.dumps(error))
    assert (str(copy), copy.kind, copy.name, copy.known) == (
        str(error), "robot", "x", ("a", "b"),
    )  # fmt: skip


def test_a_name_of_another_type_is_shown_without_a_guess():
    assert str(UnknownNameError("robot", 3, ["3"])) == "No robot named '3'. Known: 3."


def test_a_long_name_is_cut():
    message = str(UnknownNameError("robot", "x" * 500, []))
    assert f"'{'x' * 77}...'" in message


def test_the_nearest_name_ignores_case_and_may_be_absent():
    assert did_you_mean("PANDDA", ["gr1", "Panda"]) == " Did you mean 'Panda'?"
    assert did_you_mean("zzz", ["gr1", "Panda"]) == ""


@pytest.mark.parametrize(
    ("count", "expected"),
    [(0, ""), (1, "0"), (3, "0; 1; 2"), (4, "0; 1; 2 and 1 more")],
)
def test_lists_are_joined_and_the_rest_is_counted(count, expected):
    items = [str(k) for k in range(count)]
    assert join_first(items, limit=3, separator="; ") == expected


def test_texts_are_cut_to_the_limit():
    assert shortened("abcdef", 6) == "abcdef"
    assert shortened("abcdefg", 6) == "abc..."


@pytest.mark.parametrize(
    "text", ["", "plain", "two\nlines\tand a tab", "1 ± 2 °, ü, 漢", "'quoted' \\ [x]"]
)
def test_plain_text_is_printed_as_it_is(text):
    assert printable(text) == text


def test_control_characters_are_escaped():
    shown = r"a\x1b[2J\x9b31m\x07\r\u202eb"
    assert printable(CLEARS) == shown
    assert printable("\udc9b\x00") == r"\udc9b\x00"
    assert str(WbcError(f"No file {CLEARS}.")) == f"No file {shown}."
    assert shown in str(UnknownNameError("robot", CLEARS, [CLEARS]))
