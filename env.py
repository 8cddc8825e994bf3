"""LeRobot's entry to this repository: it loads `env.py` and calls `make_env`."""

from wbc_suite.compat.lerobot import make_env

__all__ = ["make_env"]
