"""Where this package keeps what it can always make again."""

import os
from pathlib import Path

__all__ = ["user_cache", "user_cache_root"]


def user_cache_root() -> Path:
    """Return the user's folder for caches of all programs."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")


def user_cache() -> Path:
    """Return this package's own folder there; it need not exist yet."""
    return user_cache_root() / "wbc_suite"
