"""Choice of the OpenGL backend that pictures are drawn with, once per machine.

A backend that fails leaves the process unusable for the others. So candidates are tried
in subprocesses, the first that draws is taken, and the result is kept in the user's
cache folder. `MUJOCO_GL` overrides the choice.
"""

import functools
import hashlib
import importlib
import json
import os
import platform
import subprocess
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from wbc_suite import logs
from wbc_suite.catalogue import user_cache
from wbc_suite.errors import DeviceError

logger = logs.logger(__name__)

APT_COMMAND = "sudo apt-get install libegl1 libegl-mesa0 libgl1-mesa-dri libgles2"
"""Makes a Debian or Ubuntu machine draw."""

PIP_COMMAND = "pip install --no-deps --only-binary :all: lavavu-osmesa"
"""Makes a Linux machine draw without root: a wheel that contains OSMesa."""

_CANDIDATES = {"Linux": ("egl", "osmesa", "wheel"), "Darwin": ("cgl",)}
_MODULES = ("egl", "osmesa", "cgl", "glfw")
"""Modules of MuJoCo that hold a class of contexts."""

_SOFTWARE = ("llvmpipe", "softpipe", "swiftshader", "swrast")
_PROBE_SECONDS = 60.0  # s until a backend counts as one that cannot draw


@dataclass(frozen=True, kw_only=True, slots=True)
class GlBackend:
    """A backend that drew a picture on this machine.

    Its name is ``egl``, ``osmesa``, ``wheel`` (OSMesa of the wheel lavavu-osmesa),
    ``cgl``, or the value of ``MUJOCO_GL``; its renderer is OpenGL's ``GL_RENDERER``.
    """

    name: str
    renderer: str

    @property
    def software(self) -> bool:
        """Whether the processor draws, not a graphics card."""
        return any(word in self.renderer.casefold() for word in _SOFTWARE)


@functools.cache
def activate() -> GlBackend:
    """Return the backend to draw with.

    ``MUJOCO_GL`` is honoured. Otherwise the order is EGL, OSMesa, then OSMesa of the
    wheel ``lavavu-osmesa`` (the extra ``software-gl``). Libraries of a wheel are found
    only if they are on the library path when Python starts; the command line starts
    itself again with that path (`missing_environment`), scripts have to set it.

    Raises:
        DeviceError: If no backend draws, or the environment of the wheel is not set;
            the message names the remedy.
    """
    if wanted := _wanted():
        return GlBackend(name=wanted, renderer=_gl_renderer(wanted) or "unknown")
    backend = _remembered() or _first_that_draws()
    if missing := _missing(backend):
        settings = " ".join(f"{key}={value}" for key, value in missing.items())
        raise DeviceError(
            "Pictures can be drawn with OSMesa of the wheel lavavu-osmesa if Python "
            "is started with its libraries. wbc-suite does so from its next start on; "
            f"for scripts: export {settings}"
        )
    return backend


def context_class() -> Callable[[int, int], Any]:
    """Return MuJoCo's class of OpenGL contexts of the active backend; see `activate`.

    Its arguments are width and height of the largest picture, pixels.
    """
    name = activate().name
    module = f"mujoco.{name}" if name in _MODULES else "mujoco"
    return importlib.import_module(module).GLContext


def missing_environment() -> dict[str, str]:
    """Return environment variables that Python must be started with to draw.

    Empty if nothing is missing, or no backend was found on this machine yet.
    """
    backend = None if _wanted() else _remembered()
    return _missing(backend) if backend else {}


def forget() -> None:
    """Delete the remembered backend, so that the next `activate` searches again."""
    activate.cache_clear()
    if not _wanted():
        _cache_file().unlink(missing_ok=True)


def _wanted() -> str:
    return os.environ.get("MUJOCO_GL", "").strip().lower()


def _missing(backend: GlBackend) -> dict[str, str]:
    return _wheel_environment() if backend.name == "wheel" else {}


def _wheel_library() -> Path | None:
    """Return the OSMesa library of the wheel lavavu-osmesa, if it is installed."""
    folders = (Path(entry) / "lavavu_osmesa.libs" for entry in sys.path)
    return next((lib for f in folders for lib in f.glob("libOSMesa*.so*")), None)


def _wheel_environment() -> dict[str, str]:
    """Return the environment that makes PyOpenGL find the OSMesa of the wheel.

    The wheel's libraries have a hash in their names, so a link of the usual name leads
    to them. Raises ImportError if the wheel is not installed.
    """
    library = _wheel_library()
    if library is None:
        raise ImportError("the wheel lavavu-osmesa is not installed")
    link = user_cache() / "osmesa" / "libOSMesa.so.8"
    if not (link.is_symlink() and link.readlink() == library):
        link.parent.mkdir(parents=True, exist_ok=True)
        partial = link.with_name(f"{link.name}.{os.getpid()}")
        partial.symlink_to(library)
        partial.replace(link)
    path = [str(link.parent), str(library.parent), os.environ.get("LD_LIBRARY_PATH")]
    return {
        "MUJOCO_GL": "osmesa",
        "PYOPENGL_PLATFORM": "osmesa",
        "LD_LIBRARY_PATH": os.pathsep.join(filter(None, path)),
    }


def _first_that_draws() -> GlBackend:
    for name in _CANDIDATES.get(platform.system(), ()):
        if renderer := _gl_renderer(name):
            backend = GlBackend(name=name, renderer=renderer)
            logger.info("drawing with %s (%s)", name, renderer)
            _remember(backend)
            return backend
    raise DeviceError(
        "Nothing on this machine can draw a picture without a display: EGL and OSMesa "
        f"are both missing. Install one: {APT_COMMAND}   (no root? {PIP_COMMAND}). "
        "Everything but pictures works without it."
    )


_PROBE = r"""
import mujoco
model = mujoco.MjModel.from_xml_string(
    "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>"
)
with mujoco.Renderer(model, 8, 8) as renderer:
    renderer.update_scene(mujoco.MjData(model))
    renderer.render()
    from OpenGL import GL
    print("\n" + GL.glGetString(GL.GL_RENDERER).decode())
"""


def _gl_renderer(name: str) -> str | None:
    """Return ``GL_RENDERER`` of one backend, or None if it cannot draw."""
    environment = {k: v for k, v in os.environ.items() if k != "PYOPENGL_PLATFORM"}
    try:
        wheel = name == "wheel"
        environment |= _wheel_environment() if wheel else {"MUJOCO_GL": name}
        result = subprocess.run(
            [sys.executable, "-c", _PROBE],
            capture_output=True,
            text=True,
            timeout=_PROBE_SECONDS,
            env=environment,
            check=True,
        )
    except (ImportError, OSError, subprocess.SubprocessError) as error:
        logger.debug("GL backend %s cannot draw: %s", name, error)
        return None
    return result.stdout.splitlines()[-1]


def _cache_file() -> Path:
    machine = f"{platform.node()} {sys.prefix} {version('mujoco')}"
    key = hashlib.sha256(machine.encode()).hexdigest()[:12]
    return user_cache() / f"gl_backend_{key}.json"


def _remembered() -> GlBackend | None:
    try:
        backend = GlBackend(**json.loads(_cache_file().read_text()))
    except (OSError, ValueError, TypeError, RecursionError):
        return None
    gone = backend.name == "wheel" and _wheel_library() is None
    return None if gone else backend


def _remember(backend: GlBackend) -> None:
    path = _cache_file()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(asdict(backend)))  # half a file counts as none
    except OSError as error:
        logger.debug("the GL backend could not be remembered: %s", error)
