"""Optional packages, which extras of this package install."""

import importlib
from typing import Any

from wbc_suite.errors import DatasetError, WbcError


def import_extra(
    module: str, extra: str, *, error: type[WbcError] = DatasetError, note: str = ""
) -> Any:
    """Import a module of an optional package, or raise an error that names the extra.

    A note is added to the message.
    """
    try:
        return importlib.import_module(module)
    except ImportError as cause:
        raise error(
            f"This needs the package '{module.split('.')[0]}': "
            f"pip install 'wbc-suite[{extra}]'.{note}"
        ) from cause
