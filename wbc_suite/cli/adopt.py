"""`wbc-suite adopt`: correct an imported robot in the browser, and write its files."""

import logging
from pathlib import Path
from typing import Annotated

import typer

from wbc_suite.cli import options
from wbc_suite.cli.output import print


class _Notes(logging.Handler):
    """Keeps what an import says."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.lines.append(record.getMessage())


def adopt(
    file: Annotated[Path, typer.Argument(help="A .urdf, .xml or .toml file.")],
    output: Annotated[
        Path,
        typer.Option("--output", "-o", help="Folder for robots/ and controllers/."),
    ] = Path("mylab"),
    root: options.RootOption = None,
    mesh_root: options.MeshRootOption = None,
    host: options.HostOption = "127.0.0.1",
    port: options.PortOption = None,
) -> None:
    """Correct a robot's import in the browser, and write its description.

    The page shows the robot in its posture `ready`. Move its joints with the sliders;
    drag the frames of hands and feet, or give them another role; try the grippers open
    and closed, and swap the two where the guess is wrong; read what the import mended
    under Notes. The button Write then writes

        DIR/robots/NAME.toml                        the description

        DIR/controllers/NAME_whole_body_ik.toml     the controller of hands and feet

        DIR/controllers/NAME_whole_body_id.toml     the gait, for a free robot with feet

    simulates the robot for a second, and says what falls or moves. Choose the root
    `free` for a robot that has to stand and walk.
    """
    from wbc_suite.robot import load_robot
    from wbc_suite.robot.named_files import named_file
    from wbc_suite.viewers.adopt_page import AdoptPage
    from wbc_suite.viewers.page_server import PageServer

    file = named_file(str(file)) or file
    notes = _Notes()
    logging.getLogger("wbc_suite").addHandler(notes)
    robot = load_robot(file, root=root, mesh_root=mesh_root)
    logging.getLogger("wbc_suite").removeHandler(notes)
    said = [line.removeprefix(f"{file}: ") for line in notes.lines]
    site = PageServer(host, port)
    AdoptPage(robot, site, notes=said, folder=output, say=print)
    options.serve_until_interrupted(site, f"Adopt {robot.name}")
