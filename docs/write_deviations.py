"""Write docs/deviations.md: every deliberate difference from a source of figures.

Run after changing a `deviations` list: `python docs/write_deviations.py`, in the
project's environment.
"""

from pathlib import Path

from wbc_suite.catalogue import Catalogue
from wbc_suite.robot.component import Component, read_robot_file

HEAD = """# Where our figures differ from their source

Written by `docs/write_deviations.py` from the `deviations` and `accept` entries of the
robot files. Everything else agrees with the source: frame poses to 1e-8 m, gravity
torques to 1e-7 N m (`tests/robot/test_vendor_figures.py`).
"""


def section(path: Path) -> str:
    """Return one component's text, or nothing when it has no deviation."""
    component = read_robot_file(path)
    if isinstance(component, Component):
        header, links = component.component, component.links
        title, source = header.title or header.name, header.source
        source += f" ({header.license})" if source else ""
    else:
        header, links, source = component.assembly, (), ""
        title = header.title or header.name
    lines = [f"- {text}" for text in header.deviations]
    lines += [
        f"- `{link.name}` is excused from the check of its {rule}: {reason}."
        for link in links
        for rule, reason in link.accept.items()
    ]
    if not lines:
        return ""
    about = f"Source: {source}.\n\n" if source else ""
    return f"\n## {title} (`{path.stem}`)\n\n{about}" + "\n".join(lines) + "\n"


def text() -> str:
    """Return the whole page."""
    folders = ("robots", "robots/arm", "robots/body", "robots/gripper", "robots/base")
    files = [path for folder in folders for path in Catalogue().files(folder)]
    return HEAD + "".join(section(path) for path in files)


if __name__ == "__main__":
    (Path(__file__).parent / "deviations.md").write_text(text(), encoding="utf-8")
