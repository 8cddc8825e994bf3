"""`wbc-suite doctor`: what this machine has, what is missing, and how to install it."""

import importlib
import json
import platform
import sys
import time
import timeit
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from importlib import metadata
from typing import Annotated, Literal

import typer

from wbc_suite.cli.options import ControllerOption, JsonOption
from wbc_suite.cli.output import print
from wbc_suite.errors import ConfigError, WbcError

BASE_SOLVERS = ("daqp", "proxqp", "osqp")  # of the package; names of `qpsolvers`
EXTRA_SOLVERS = ("piqp", "clarabel", "quadprog")  # of the extra `solvers`
MUJOCO_PARTS = ("mujoco", "mujoco-core", "mujoco-studio")  # distributions of MuJoCo 4
REPAIR_MUJOCO = "pip install --force-reinstall --no-deps " + " ".join(MUJOCO_PARTS)

_MARKS = {"fine": "ok  ", "optional": "note", "broken": "BAD "}


RobotsArgument = Annotated[
    list[str] | None,
    typer.Argument(metavar="[ROBOT]...", help="Robots for --compile."),
]
CompileOption = Annotated[
    bool,
    typer.Option(
        "--compile",
        help="Compile the kernels of these robots with their own controllers, and keep "
        "them, such as in an image or on a cluster; see NUMBA_CACHE_DIR.",
    ),
]


def doctor(
    robots: RobotsArgument = None,
    compiles: CompileOption = False,
    controller: ControllerOption = None,
    as_json: JsonOption = False,
) -> None:
    """Check this machine: packages, solvers, rendering, and what is missing.

    The exit code is 1 if a required component is broken.
    """
    if compiles != bool(robots):
        raise ConfigError("doctor: give --compile and robots, such as --compile Panda.")
    if robots:
        compile_kernels(robots, controller)
        return
    broken = 0
    if as_json:
        findings = [asdict(finding) for finding in diagnose()]
        print(json.dumps(findings))
        raise typer.Exit(any(f["state"] == "broken" for f in findings))
    for finding in diagnose():
        print(f"{_MARKS[finding.state]}  {finding.topic:<11} {finding.text}")
        if finding.cure:
            print(f"      {'':<11} -> {finding.cure}")
        broken += finding.state == "broken"
    if broken:
        print("A required component is broken: see BAD above.")
        raise typer.Exit(1)
    print("All required components work.")


def compile_kernels(robots: Sequence[str], controller: str | None) -> None:
    """Make one step of each robot, so that its machine code is in the cache."""
    import numpy as np

    from wbc_suite.envs import make
    from wbc_suite.kernel_cache import cache_folder

    for robot in robots:
        start = time.monotonic()
        env = make("Lift", robots=robot, controller_configs=controller)
        env.reset(seed=0)
        env.step(np.zeros(env.action_space.shape or ()))
        env.close()
        print(f"{robot}: ready after {time.monotonic() - start:.1f} s", flush=True)
    print(f"Kernels are in {cache_folder()}")


@dataclass(frozen=True, slots=True)
class Finding:
    """The result of one check; `cure` is the command that repairs what is wrong."""

    topic: str
    text: str
    state: Literal["fine", "optional", "broken"] = field(default="fine", kw_only=True)
    cure: str = field(default="", kw_only=True)


def diagnose() -> Iterator[Finding]:
    """Run all checks, cheapest first; one broken part does not hide the others."""
    for check in (_system, _packages, _mujoco, _solvers, _catalogue, _rendering):
        yield from check()


def _system() -> Iterator[Finding]:
    name = platform.freedesktop_os_release() if sys.platform == "linux" else {}
    system = name.get("PRETTY_NAME", platform.platform())
    yield Finding("system", f"{system}, {platform.machine()}")
    yield Finding("python", f"{platform.python_version()} at {sys.executable}")


def _packages() -> Iterator[Finding]:
    versions = {name: _version(name) for name in _required()}
    for name, version in versions.items():
        if version is None:
            cure = f"pip install {name}"
            yield Finding(name, "not installed", state="broken", cure=cure)
    yield Finding("packages", ", ".join(f"{n} {v}" for n, v in versions.items() if v))


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def _required() -> list[str]:
    """Return the names of the base dependencies, from the installed metadata."""
    try:
        lines = metadata.requires("wbc-suite") or []
    except metadata.PackageNotFoundError:
        return ["mujoco", "pin"]
    base = (line for line in lines if "extra ==" not in line)
    return [line.split(";")[0].split(">")[0].strip() for line in base]


def _mujoco() -> Iterator[Finding]:
    """Check MuJoCo's distributions; an upgrade from 3 to 4 can lose files."""
    versions = {part: _version(part) or "missing" for part in MUJOCO_PARTS}
    text = ""
    if versions["mujoco"] != versions["mujoco-core"]:
        text = f"parts of different versions: {versions}"
    try:
        importlib.import_module("mujoco").mj_versionString()
    except (ImportError, AttributeError) as error:
        first = str(error).splitlines()[0]
        text = f"broken, as after an upgrade from MuJoCo 3: {first}"
    if text:
        yield Finding("mujoco", text, state="broken", cure=REPAIR_MUJOCO)


def _solvers() -> Iterator[Finding]:
    topic, known = "QP solvers", importlib.import_module("qpsolvers").available_solvers
    yield Finding(topic, ", ".join(sorted(known)))
    if broken := ", ".join(name for name in BASE_SOLVERS if name not in known):
        cure = "pip install --force-reinstall daqp proxsuite osqp"
        yield Finding(topic, f"missing: {broken}", state="broken", cure=cure)
    if absent := ", ".join(name for name in EXTRA_SOLVERS if name not in known):
        text, cure = f"not installed: {absent}", 'pip install "wbc-suite[solvers]"'
        yield Finding(topic, text, state="optional", cure=cure)


def _catalogue() -> Iterator[Finding]:
    from wbc_suite.catalogue import Catalogue

    try:
        catalogue = Catalogue()
    except WbcError as error:
        yield Finding("catalogue", str(error), state="broken")
        return
    folders = ("robots", "tasks", "controllers")
    counts = ", ".join(f"{len(catalogue.names(f))} {f}" for f in folders)
    places = " + ".join(str(p) for p in (catalogue.root, *catalogue.extra))
    yield Finding("catalogue", f"{counts} in {places}")


def _rendering() -> Iterator[Finding]:
    from wbc_suite.sensing import gl_backend

    gl_backend.forget()  # results of an earlier run are not used
    try:
        backend = gl_backend.activate()
        duration = _frame_seconds()
    except WbcError as error:
        cure = gl_backend.APT_COMMAND
        yield Finding("pictures", str(error), state="optional", cure=cure)
        return
    artist = "the processor draws" if backend.software else "a graphics card draws"
    speed = f"{1e3 * duration:.1f} ms for a 256x256 frame"
    text = f"{backend.name}, {artist} ({backend.renderer}): {speed}"
    yield Finding("pictures", text)


def _frame_seconds() -> float:
    """Measure one frame of a small scene with the preset `fast`: best of 20."""
    import mujoco

    from wbc_suite.sensing.renderer import RenderPreset, make_renderer

    scene = """<mujoco><worldbody><light pos="0 0 3"/><geom type="plane" size="1 1 1"/>
        <geom size=".2" pos="0 0 .2"/></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(scene)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    fast = RenderPreset.FAST
    with make_renderer(model, width=256, height=256, preset=fast) as renderer:

        def draw() -> None:
            renderer.update_scene(data)
            renderer.render()

        return min(timeit.repeat(draw, number=1, repeat=20))
