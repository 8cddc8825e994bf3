"""Scenes: arenas, things and robots composed into one MuJoCo specification."""

from wbc_suite.scene.arena import TableConfig, add_table, empty_arena
from wbc_suite.scene.compose import (
    add_camera,
    attach_robot,
    place_robot,
    robot_prefix,
)
from wbc_suite.scene.objects import add_box

__all__ = [
    "TableConfig",
    "add_box",
    "add_camera",
    "add_table",
    "attach_robot",
    "empty_arena",
    "place_robot",
    "robot_prefix",
]
