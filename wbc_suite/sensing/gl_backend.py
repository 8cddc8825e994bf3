"""Which OpenGL backend MuJoCo draws with, found out once per machine.

MuJoCo fixes its backend when it is imported (``MUJOCO_GL``, else a window system), and
a backend that fails poisons the process. So candidates are tried in a subprocess, the
first that draws wins, and the verdict is kept in the user's cache folder.
"""

import contextlib
import ctypes
import functools
import hashlib
import importlib
import json
import logging
import os
import platform
import subprocess
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import mujoco
from mujoco.rendering.classic import gl_context

from wbc_suite.errors import DeviceError
from wbc_suite.user_cache import user_cache

__all__ = ["GlBackend", "activate", "forget", "probe"]

logger = logging.getLogger(__name__)

APT_COMMAND = "sudo apt-get install libegl1 libegl-mesa0 libgl1-mesa-dri libgles2"
"""What mends a Debian or Ubuntu machine that cannot draw."""

PIP_COMMAND = "pip install --no-deps --only-binary :all: lavavu-osmesa"
"""What mends a Linux machine without root: a wheel that carries OSMesa."""

_CANDIDATES = {"Linux": ("egl", "osmesa", "wheel"), "Darwin": ("cgl",)}
_SOFTWARE = ("llvmpipe", "softpipe", "swiftshader", "swrast")
_PROBE_SECONDS = 60.0


@dataclass(frozen=True, kw_only=True, slots=True)
class GlBackend:
    """A backend that drew a picture on this machine.

    Attributes:
        name: ``egl``, ``osmesa``, ``wheel`` (OSMesa out of the wheel lavavu-osmesa),
            ``cgl``, or what ``MUJOCO_GL`` says.
        renderer: What OpenGL calls the thing that draws, ``GL_RENDERER``.
    """

    name: str
    renderer: str

    @property
    def software(self) -> bool:
        """Whether the processor draws, not a graphics card."""
        return any(word in self.renderer.casefold() for word in _SOFTWARE)


@functools.cache
def activate() -> GlBackend:
    """Choose a backend, make MuJoCo's renderer use it, and return it.

    ``MUJOCO_GL`` is honoured. Otherwise the order is EGL, OSMesa, then OSMesa out of
    the wheel ``lavavu-osmesa`` (the extra ``software-gl``).

    Raises:
        DeviceError: If nothing here can draw; the message holds the cure.
    """
    wanted = os.environ.get("MUJOCO_GL", "").strip().lower()
    backend = _from_environment(wanted) if wanted else _remembered() or _first_found()
    if not wanted:
        _install(backend.name)
    return backend


def forget() -> None:
    """Drop the remembered verdict, so that the next `activate` tries again."""
    activate.cache_clear()
    _verdict_path().unlink(missing_ok=True)


def probe(name: str) -> str:
    """Draw with one backend in this process and return ``GL_RENDERER``.

    For a subprocess: a backend that fails leaves the process unusable for the others.
    """
    _install(name)
    spec = "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>"
    model = mujoco.MjModel.from_xml_string(spec)
    with mujoco.Renderer(model, 8, 8) as renderer:
        renderer.update_scene(mujoco.MjData(model))
        renderer.render()
        return _gl_renderer()


def _gl_renderer() -> str:
    gl = importlib.import_module("OpenGL.GL")
    return str(gl.glGetString(gl.GL_RENDERER).decode())


def _install(name: str) -> None:
    """Let `mujoco.Renderer` make its contexts with the named backend."""
    if name == "wheel":
        _load_osmesa_from_wheel()
    module = "osmesa" if name == "wheel" else name
    context: Any = importlib.import_module(f"mujoco.{module}").GLContext
    gl_context.GLContext = context


def _load_osmesa_from_wheel() -> None:
    """Give PyOpenGL the OSMesa library that the wheel lavavu-osmesa carries.

    PyOpenGL looks for system libraries only; so its platform object gets this one.
    """
    folders = (Path(entry) / "lavavu_osmesa.libs" for entry in sys.path)
    folder = next((folder for folder in folders if folder.is_dir()), None)
    if folder is None:
        raise ImportError("the wheel lavavu-osmesa is not installed")
    loaded = _load_all(sorted(folder.glob("*.so*")))
    library = next(lib for name, lib in loaded.items() if "OSMesa" in name)
    os.environ["PYOPENGL_PLATFORM"] = "osmesa"  # what mujoco.osmesa does too
    opengl: Any = importlib.import_module("OpenGL.platform")
    opengl.PLATFORM.GL = opengl.PLATFORM.OSMesa = library
    opengl.PLATFORM.install(vars(opengl))


def _load_all(files: list[Path]) -> dict[str, ctypes.CDLL]:
    """Load libraries that need one another, in whatever order works."""
    loaded: dict[str, ctypes.CDLL] = {}
    for _ in files:
        for file in files:
            if file.name not in loaded:
                with contextlib.suppress(OSError):  # what it needs comes first
                    library = ctypes.CDLL(str(file), mode=ctypes.RTLD_GLOBAL)
                    loaded[file.name] = library
    if len(loaded) < len(files):
        raise ImportError("the libraries of the wheel lavavu-osmesa do not load")
    return loaded


def _from_environment(wanted: str) -> GlBackend:
    """Report the backend the user chose; MuJoCo has taken it at import already."""
    return GlBackend(name=wanted, renderer=_ask_subprocess(wanted) or "unknown")


def _first_found() -> GlBackend:
    for name in _CANDIDATES.get(platform.system(), ()):
        renderer = _ask_subprocess(name)
        if renderer is not None:
            backend = GlBackend(name=name, renderer=renderer)
            logger.info("drawing with %s (%s)", name, renderer)
            _remember(backend)
            return backend
    raise DeviceError(
        "Nothing on this machine can draw a picture without a display: EGL and OSMesa "
        f"are both missing. Install one: {APT_COMMAND}   (no root? {PIP_COMMAND}). "
        "Everything but pictures works without it."
    )


def _ask_subprocess(name: str) -> str | None:
    """Return ``GL_RENDERER`` of one backend, or None when it cannot draw."""
    code = f"from {__name__} import probe; print('\\n' + probe({name!r}))"
    environment = dict(os.environ)
    environment.pop("MUJOCO_GL", None)
    environment.pop("PYOPENGL_PLATFORM", None)
    try:
        result = subprocess.run(
            [sys.executable, "-c", code],
            capture_output=True,
            text=True,
            timeout=_PROBE_SECONDS,
            env=environment,
            check=True,
        )
    except (subprocess.CalledProcessError, subprocess.TimeoutExpired) as error:
        logger.debug("GL backend %s cannot draw: %s", name, error)
        return None
    return result.stdout.splitlines()[-1]


def _verdict_path() -> Path:
    machine = f"{platform.node()} {sys.prefix} {mujoco.__version__}"
    key = hashlib.sha256(machine.encode()).hexdigest()[:12]
    return user_cache() / f"gl_backend_{key}.json"


def _remembered() -> GlBackend | None:
    try:
        return GlBackend(**json.loads(_verdict_path().read_text()))
    except (OSError, ValueError, TypeError):
        return None


def _remember(backend: GlBackend) -> None:
    path = _verdict_path()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_suffix(f".{os.getpid()}")
        partial.write_text(json.dumps(asdict(backend)))
        partial.replace(path)
    except OSError as error:
        logger.debug("the GL verdict could not be kept: %s", error)
