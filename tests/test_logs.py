"""Messages of loggers command no terminal."""

import logging
from pathlib import Path

import wbc_suite
from wbc_suite import logs

PACKAGE = Path(wbc_suite.__file__).parent
OWN_TEXT = "compiling.py"  # its messages name functions of this package only


def test_messages_and_tracebacks_hold_no_control_characters(caplog):
    log = logs.logger("wbc_suite.some_module")
    log.warning("link '%s' of %d", "\x1b[2J", 3)
    try:
        raise ValueError("\x9b31m")
    except ValueError:
        log.exception("it failed")
    shown = logging.Formatter().format
    first, second = map(shown, caplog.records)
    assert first == r"link '\x1b[2J' of 3"
    assert r"ValueError: \x9b31m" in second
    assert "\x9b" not in second


def test_every_module_has_such_a_logger():
    """Texts of files and clients come into messages of most modules."""
    found = [
        path.name
        for path in PACKAGE.rglob("*.py")
        if "logging.getLogger(__name__)" in path.read_text("utf-8")
    ]
    assert found == [OWN_TEXT]
