"""Which OpenGL backend `MUJOCO_GL` names; without it, cameras choose by themselves."""

import os
import platform
from collections.abc import MutableMapping
from typing import Any

_OF_SYSTEMS = {"Darwin": "cgl", "Windows": "wgl"}


def resolve_mujoco_gl_backend(
    macros: Any,
    environ: MutableMapping[str, str] | None = None,
    system: str | None = None,
) -> str:
    """Return the backend that is set, or the system's with `MUJOCO_GPU_RENDERING`."""
    chosen = (os.environ if environ is None else environ).get("MUJOCO_GL", "")
    if chosen or not macros.MUJOCO_GPU_RENDERING:
        return chosen
    return _OF_SYSTEMS.get(system or platform.system(), "egl")


def configure_mujoco_gl_backend(
    macros: Any,
    environ: MutableMapping[str, str] | None = None,
    system: str | None = None,
) -> str:
    """Set `MUJOCO_GL` to the resolved backend, and return it."""
    environ = os.environ if environ is None else environ
    backend = resolve_mujoco_gl_backend(macros, environ, system)
    if backend:
        environ["MUJOCO_GL"] = backend
    return backend
