"""Draw robots, grippers and bases, and the README's table of them: `make gallery`."""

import argparse
import re
from pathlib import Path

from PIL import Image

from wbc_suite.catalogue import Catalogue
from wbc_suite.robot import RobotDescription, load_robot
from wbc_suite.robot.component import Component, read_robot_file
from wbc_suite.viewers.offscreen import render_robot

HERE = Path(__file__).parent
FOLDER = HERE / "images" / "gallery"
README = HERE.parent / "README.md"
SIZE = 240  # pixels; drawn twice as large: smooth edges
COLUMNS = 6
DOWN = (0.0, 1.0, 0.0, 0.0)  # grippers reach along +z, and are shown reaching down
SHORT = {"bd": "BD", "pal": "PAL", "xarm7": "XArm7"}
MARKS = ("<!-- gallery: written by `make gallery` -->\n", "<!-- gallery ends -->\n")


def subjects() -> dict[str, list[tuple[str, str]]]:
    """Return what to draw, by heading: names to show, and names to load."""
    catalogue = Catalogue()
    robots = [load_robot(name).name for name in catalogue.names("robots")]
    grippers = catalogue.names("robots/gripper")
    bases = [
        n for n, file in base_files(catalogue) if any(x.visual for x in file.links)
    ]
    return {
        "Robots": [(name, name) for name in sorted(set(robots), key=str.casefold)],
        "Grippers and hands": [(camel(n), f"gripper/{n}") for n in grippers],
        "Bases": [(camel(name), f"base/{name}") for name in bases],
    }


def base_files(catalogue: Catalogue) -> list[tuple[str, Component]]:
    """Read the bases; some are nothing but joints, and cannot stand alone."""
    files = catalogue.files("robots/base")
    read = [(path.stem, read_robot_file(path)) for path in files]
    return [(name, file) for name, file in read if isinstance(file, Component)]


def camel(name: str) -> str:
    """Write a file's name as users write it: `panda_gripper` is `PandaGripper`."""
    return "".join(SHORT.get(x, x[:1].upper() + x[1:]) for x in name.split("_"))


def prepared(name: str) -> RobotDescription:
    """Load what is drawn: arms without their stands, grippers reaching down."""
    if name.startswith("gripper/"):
        return load_robot(name).with_root("fixed", pos=(0.0, 0.0, 0.3), quat=DOWN)
    robot = load_robot(name)
    if "/" not in name and any(link.name == "controller_box" for link in robot.links):
        return load_robot(name, base="none")
    return robot


def draw(name: str, path: Path) -> None:
    """Draw one subject."""
    robot = prepared(name)
    if "ready" not in robot.keyframes:
        robot = robot.model_copy(update={"keyframes": {"ready": {}}})
    picture = render_robot(robot, size=(2 * SIZE, 2 * SIZE))
    small = Image.fromarray(picture).resize((SIZE, SIZE), Image.Resampling.LANCZOS)
    small.save(path, quality=88, optimize=True)


def picture_of(name: str) -> Path:
    """Return where the picture of a subject lies."""
    return FOLDER / f"{name.rpartition('/')[2].casefold()}.jpg"


def table() -> str:
    """Write the README's tables."""
    lines: list[str] = []
    for heading, rows in subjects().items():
        lines += [f"**{heading}**", ""]
        for k in range(0, len(rows), COLUMNS):
            row = rows[k : k + COLUMNS]
            images = [
                f"![{shown}]({picture_of(name).relative_to(README.parent)})"
                for shown, name in row
            ]
            names = [f"`{shown}`" for shown, _ in row]
            head = [images, ["---"] * len(row), names] if k == 0 else [images, names]
            lines += ["| " + " | ".join(cells) + " |" for cells in head]
        lines.append("")
    return "\n".join(lines)


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("only", nargs="*", help="names to draw; all by default")
    only = {name.casefold() for name in parser.parse_args().only}
    FOLDER.mkdir(parents=True, exist_ok=True)
    for shown, name in [row for rows in subjects().values() for row in rows]:
        if not only or shown.casefold() in only:
            print(f"drawing {shown}", flush=True)
            draw(name, picture_of(name))
    begin, end = MARKS
    pattern = re.compile(re.escape(begin) + ".*?" + re.escape(end), re.DOTALL)
    text = README.read_text(encoding="utf-8")
    README.write_text(pattern.sub(lambda _: begin + "\n" + table() + end, text))


if __name__ == "__main__":
    main()
