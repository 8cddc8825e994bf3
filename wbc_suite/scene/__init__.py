"""Scenes: arenas, things and robots composed into one MuJoCo specification."""

from wbc_suite.scene.arena import TableConfig, add_table, add_tables, empty_arena
from wbc_suite.scene.compose import (
    add_camera,
    attach_robot,
    compile_scene,
    fix_to_frame,
    place_robot,
    robot_prefix,
)

__all__ = [
    "TableConfig",
    "add_camera",
    "add_table",
    "add_tables",
    "attach_robot",
    "compile_scene",
    "empty_arena",
    "fix_to_frame",
    "place_robot",
    "robot_prefix",
]
