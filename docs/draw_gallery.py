"""Draw robots, grippers and bases, their page and the strip of the README."""

import argparse
from pathlib import Path

import numpy as np
from PIL import Image

from wbc_suite.catalogue import Catalogue
from wbc_suite.robot import RobotDescription, load_robot
from wbc_suite.robot.robot_file import Component, read_robot_file
from wbc_suite.viewers.offscreen import View, render_robot

HERE = Path(__file__).parent
FOLDER = HERE / "images" / "gallery"
PAGE = HERE / "gallery.md"
STRIP = HERE / "images" / "strip.jpg"
SIZE = 240  # pixels; drawn twice as large for smooth edges
IN_STRIP = (
    *("GR1", "SpotWithArm", "Tiago", "PandaOmron", "Baxter", "Sawyer"),
    *("UR5e", "Jaco", "InspireRightHand", "RobotiqThreeFingerDexterousGripper"),
)
DOWN = (0.0, 1.0, 0.0, 0.0)  # grippers reach along +z, and are shown reaching down
PALM = View(azimuth=215.0, elevation=-14.0)
EXPOSURE = 0.65  # exponent of brightness for grippers, most of which are black
SHORT = {"bd": "BD", "pal": "PAL", "pr2": "PR2", "umi": "UMI", "xarm7": "XArm7"}
HEAD = """# Gallery

Any gripper goes on any arm, and any arm on any base:
`wbc_suite.load_robot("UR5e", gripper="PandaGripper", base="OmronMobileBase")`.
`wbc-suite view NAME` shows one in the browser. Variants that look alike share a
picture. Written by `make gallery`.
"""
FIGURE = """\
<figure><img src="{source}" alt="{name}"><figcaption>{caption}</figcaption></figure>"""


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


def families(rows: list[tuple[str, str]]) -> list[tuple[str, str, list[str]]]:
    """Put subjects that look alike together: the first one, and names of the others.

    They differ in roots, and in which joints move.
    """
    found: dict[object, tuple[str, str, list[str]]] = {}
    for shown, name in rows:
        looks = tuple((link.name, link.visual) for link in prepared(name).links)
        if looks in found:
            found[looks][2].append(shown)
        else:
            found[looks] = (shown, name, [])
    return [*found.values()]


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
    view = PALM if "hand" in name else "three_quarter"
    picture = render_robot(robot, view=view, size=(2 * SIZE, 2 * SIZE))
    if name.startswith("gripper/"):
        picture = (255.0 * (picture / 255.0) ** EXPOSURE).astype(np.uint8)
    small = Image.fromarray(picture).resize((SIZE, SIZE), Image.Resampling.LANCZOS)
    small.save(path, quality=88, optimize=True)


def picture_of(name: str) -> Path:
    """Return where the picture of a subject lies."""
    return FOLDER / f"{name.rpartition('/')[2].casefold()}.jpg"


def page() -> str:
    """Return the text of the page."""
    parts = [HEAD]
    for heading, rows in subjects().items():
        parts.append(f'## {heading}\n\n<div class="gallery">')
        for shown, name, others in families(rows):
            source = picture_of(name).relative_to(HERE).as_posix()
            caption = "<br>".join([f"<b>{shown}</b>", *others] if others else [shown])
            parts.append(FIGURE.format(source=source, name=shown, caption=caption))
        parts.append("</div>\n")
    return "\n".join(parts)


def draw_strip(path: Path) -> None:
    """Put pictures of some subjects side by side, for the README."""
    named = {shown: name for rows in subjects().values() for shown, name in rows}
    strip = Image.new("RGB", (SIZE * len(IN_STRIP), SIZE))
    for k, shown in enumerate(IN_STRIP):
        with Image.open(picture_of(named[shown])) as picture:
            strip.paste(picture, (k * SIZE, 0))
    width = 1600
    height = round(SIZE * width / strip.width)
    small = strip.resize((width, height), Image.Resampling.LANCZOS)
    small.save(path, quality=88, optimize=True)


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("only", nargs="*", help="names to draw; all by default")
    only = {name.casefold() for name in parser.parse_args().only}
    FOLDER.mkdir(parents=True, exist_ok=True)
    for shown, name, _ in [f for rows in subjects().values() for f in families(rows)]:
        if not only or shown.casefold() in only:
            print(f"drawing {shown}", flush=True)
            draw(name, picture_of(name))
    draw_strip(STRIP)
    PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
