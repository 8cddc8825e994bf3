"""Give the parts of an imported robot names that our format allows."""

import logging
import re

from wbc_suite.robot.validation import RESERVED

__all__ = ["NameTable"]

LOG = logging.getLogger(__name__)
LONGEST = 70
"""Characters kept of a foreign name; our own limit of 80 leaves room for a suffix."""


class NameTable:
    """Hands out names: letters, digits and `_`, each of them once.

    URDF has separate names for links and joints, and allows any character; ours are
    unique together. Equal files give equal names.
    """

    def __init__(self) -> None:
        self._taken: set[str] = set(RESERVED)

    def take(self, foreign: str, kind: str) -> str:
        """Return a free name as near to the foreign one as can be.

        Args:
            foreign: Name in the file.
            kind: What is named ("link", "joint", "frame"): the suffix when another
                part already has the name.
        """
        plain = re.sub(r"[^A-Za-z0-9_]", "_", foreign)[:LONGEST]
        if not re.match(r"[A-Za-z]", plain):
            plain = f"{kind}_{plain.lstrip('_')}".rstrip("_")
        name, number = plain, 1
        while name in self._taken:
            name = f"{plain}_{kind}{number if number > 1 else ''}"
            number += 1
        self._taken.add(name)
        if name != foreign:
            LOG.info("The %s '%s' is called '%s' here.", kind, foreign, name)
        return name
