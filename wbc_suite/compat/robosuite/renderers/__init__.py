"""Renderers: names of robosuite's, which mean ours."""

from typing import Any


def load_renderer_config(renderer: str) -> dict[str, Any]:
    """Return no settings: renderers have none here.

    Raises:
        ValueError: If there is no such renderer.
    """
    if renderer not in ("mjviewer", "mujoco"):
        raise ValueError(f"'{renderer}' is no renderer: 'mjviewer' or 'mujoco'.")
    return {}
