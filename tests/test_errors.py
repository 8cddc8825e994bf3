import pytest

from wbc_suite import errors
from wbc_suite.errors import UnknownNameError, WbcError


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


@pytest.mark.parametrize("name", [n for n in errors.__all__ if n.endswith("Error")])
def test_every_error_refines_a_builtin_one(name):
    kind = getattr(errors, name)
    assert issubclass(kind, WbcError)
    builtin = {base for base in kind.__mro__ if base.__module__ == "builtins"}
    assert kind is WbcError or builtin - {Exception, BaseException, object}
