"""Packages that only some formats need, which extras of this package install."""

import importlib
from typing import Any

from wbc_suite.errors import DatasetError


def import_extra(module: str, extra: str) -> Any:
    """Import a module of an optional package; a DatasetError names the extra."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise DatasetError(
            f"This format needs the package '{module.split('.')[0]}': "
            f"pip install 'wbc-suite[{extra}]'."
        ) from error
