"""The package's loggers, whose records hold no control characters.

Names from files and texts from clients end up in messages; their escape codes would
command the terminal that shows them.
"""

import logging
from collections.abc import Generator
from contextlib import contextmanager

from wbc_suite.errors import printable


def logger(name: str) -> logging.Logger:
    """Return the logger of a module; its messages and tracebacks are `printable`."""
    found = logging.getLogger(name)
    found.addFilter(_escape)
    return found


@contextmanager
def quiet(name: str) -> Generator[None]:
    """Leave out the warnings of modules whose names begin so."""
    parent = logging.getLogger(name)
    level = parent.level
    parent.setLevel(logging.ERROR)
    try:
        yield
    finally:
        parent.setLevel(level)


def _escape(record: logging.LogRecord) -> bool:
    record.msg, record.args = printable(record.getMessage()), None
    if record.exc_info:
        record.exc_text = printable(
            logging.Formatter().formatException(record.exc_info)
        )
    return True
