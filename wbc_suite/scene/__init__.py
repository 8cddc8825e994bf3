"""Scenes: arenas, objects and robots composed into one MuJoCo specification."""

from wbc_suite.scene.arena import (
    TableConfig,
    add_table,
    add_table_cameras,
    add_tables,
    empty_arena,
)
from wbc_suite.scene.compose import (
    add_camera,
    add_robot_view,
    aim_robot_view,
    attach_robot,
    compile_scene,
    fix_to_frame,
    place_robot,
    robot_prefix,
)
from wbc_suite.scene.mjcf_arena import ArenaConfig
from wbc_suite.scene.pushes import Push, PushConfig, draw_pushes

__all__ = [
    "ArenaConfig",
    "Push",
    "PushConfig",
    "TableConfig",
    "add_camera",
    "add_robot_view",
    "add_table",
    "add_table_cameras",
    "add_tables",
    "aim_robot_view",
    "attach_robot",
    "compile_scene",
    "draw_pushes",
    "empty_arena",
    "fix_to_frame",
    "place_robot",
    "robot_prefix",
]
