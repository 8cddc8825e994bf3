"""Write docs/deviations.md: every deliberate difference from a source of figures.

Run after changing a `deviations` list: `python docs/write_deviations.py`, in the
project's environment.
"""

from pathlib import Path

from wbc_suite.catalogue import Catalogue
from wbc_suite.robot.robot_file import Component, read_robot_file

HEAD = """# Deviations from sources

Written by `docs/write_deviations.py` from the `deviations` and `accept` entries of the
robot files. All other figures agree with the source: frame poses to 1e-8 m, gravity
torques to 1e-7 N m (`tests/robot/test_vendor_figures.py`).
"""


def rows(path: Path) -> list[str]:
    """Return the rows of one file."""
    component = read_robot_file(path)
    if isinstance(component, Component):
        header, links = component.component, component.links
    else:
        header, links = component.assembly, ()
    excused: dict[str, list[str]] = {}
    for link in links:
        for rule, reason in link.accept.items():
            key = f"excused from the check of its {rule}: {reason}"
            excused.setdefault(key, []).append(f"`{link.name}`")
    texts = [
        *header.deviations,
        *(f"{', '.join(names)}: {reason}" for reason, names in excused.items()),
    ]
    name = f"**{header.title or header.name}** `{path.parent.name}/{path.stem}`"
    names = [name, *([""] * len(texts))]
    return [
        f"| {name} | {text.replace('|', '/')} |"
        for name, text in zip(names, texts, strict=False)
    ]


def sources() -> str:
    """Return the table of sources."""
    lines = ["| component | figures from | licence |", "|---|---|---|"]
    for path in files():
        component = read_robot_file(path)
        if isinstance(component, Component) and component.component.source:
            header = component.component
            name = f"`{path.parent.name}/{path.stem}`"
            lines.append(f"| {name} | {header.source} | {header.license} |")
    return "\n".join(lines)


def files() -> list[Path]:
    """Return every robot file: assemblies, then components."""
    folders = ("robots", "robots/arm", "robots/body", "robots/gripper", "robots/base")
    return [path for folder in folders for path in Catalogue().files(folder)]


def text() -> str:
    """Return the whole page."""
    table = ["| component | difference, and its reason |", "|---|---|"]
    for path in files():
        table += rows(path)
    return f"{HEAD}\n" + "\n".join(table) + f"\n\n## Sources\n\n{sources()}\n"


if __name__ == "__main__":
    (Path(__file__).parent / "deviations.md").write_text(text(), encoding="utf-8")
