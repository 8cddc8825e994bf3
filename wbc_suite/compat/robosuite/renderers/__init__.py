"""Renderers: names of robosuite's, which mean ours."""

from typing import Any

from wbc_suite.compat.robosuite.forwarding import does_nothing

RENDERERS = ("mjviewer", "mujoco")


def load_renderer_config(renderer: str) -> dict[str, Any]:
    """Return no settings: renderers have none here.

    Raises:
        ValueError: If there is no such renderer.
    """
    if renderer.lower() not in RENDERERS:
        raise ValueError(f"'{renderer}' is no renderer: 'mjviewer' or 'mujoco'.")
    return {}


class Viewer:
    """`env.viewer`: what scripts ask of a window; ours is a page with its own camera.

    Attributes:
        callbacks: Functions that take pressed keys; a test or a window may call them.
    """

    def __init__(self, sim: Any = None) -> None:
        self.sim = sim
        self.callbacks: list[Any] = []

    set_camera = does_nothing("the page shows the scene from where its user looks")
    render = reset = update = close = does_nothing("`env.render` draws")

    def add_keypress_callback(self, keypress_callback: Any) -> None:
        """Remember a function that takes keys."""
        self.callbacks.append(keypress_callback)


OpenCVViewer = OpenCVRenderer = MjviewerRenderer = Viewer
