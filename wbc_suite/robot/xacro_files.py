"""Expand xacro files, templates of URDF, with the package `xacro` in a process."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType

from wbc_suite.errors import ConfigError
from wbc_suite.extras import import_extra
from wbc_suite.files import check_file
from wbc_suite.robot.xml_files import MAX_BYTES, package_folder

XACRO = ".xacro"
SECONDS = 60.0  # for one file; templates can run without end
MAX_MESSAGE = 600  # characters of xacro's message

_PROGRAM = (
    "import sys; from wbc_suite.robot.xacro_files import write; write(sys.argv[1])"
)


def expand_xacro(path: Path) -> bytes:
    """Return the URDF that a template gives with its default arguments.

    Expressions of the file are evaluated, and files that it includes are read, wherever
    they are: expand only files that you trust.

    Raises:
        ConfigError: If xacro is not installed, or cannot expand the file.
    """
    check_file(path, most=MAX_BYTES)
    if importlib.util.find_spec("xacro") is None:
        raise ConfigError(
            f"{path}: this is a template of a URDF, which the package 'xacro' expands: "
            "pip install 'wbc-suite[xacro]'. Or expand it elsewhere: "
            f"xacro {path.name} > robot.urdf"
        )
    command = [sys.executable, "-c", _PROGRAM, str(path)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    try:
        ended = subprocess.run(
            command, capture_output=True, timeout=SECONDS, check=False, env=environment
        )
    except subprocess.TimeoutExpired as error:
        raise ConfigError(
            f"{path}: xacro has not expanded it in {SECONDS:g} s."
        ) from error
    if ended.returncode != 0:
        text = ended.stderr.decode(errors="replace").strip()[-MAX_MESSAGE:]
        raise ConfigError(
            f"{path}: xacro cannot expand it: {text} If it needs arguments, expand it "
            f"first: xacro {path.name} NAME:=VALUE > robot.urdf"
        )
    if len(ended.stdout) > MAX_BYTES:
        raise ConfigError(f"{path}: it expands to more than {MAX_BYTES} bytes.")
    return ended.stdout


def write(path: str) -> None:
    """Write the expanded file to the standard output; runs in a process of its own.

    `$(find NAME)` leads to the packages that `package://NAME` leads to.
    """

    def find(name: str) -> str:
        folder = package_folder(name, Path(path))
        if folder is None:
            raise LookupError(
                f"No package '{name}' around or beside the file. Name the folder that "
                "it is in by ROS_PACKAGE_PATH."
            )
        return str(folder)

    packages = ModuleType("ament_index_python.packages")
    vars(packages)["get_package_share_directory"] = find
    sys.modules["ament_index_python"] = ModuleType("ament_index_python")
    sys.modules["ament_index_python.packages"] = packages
    xacro = import_extra("xacro", "xacro", error=ConfigError)
    try:
        text = xacro.process_file(path).toxml()
    except Exception as error:  # noqa: BLE001 (templates raise anything)
        sys.exit(f"{str(error).removesuffix('.') or type(error).__name__}.")
    sys.stdout.write(text)
