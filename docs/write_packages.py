"""Write docs/packages.md: what is shipped and depended on, with versions and licences.

    python docs/write_packages.py [ENVIRONMENT...]

reads the metadata of packages that are installed in this environment and in others,
such as `.venv-learning` for those of the extra `rl`. A package that none has keeps the
row that it has on the page.
"""

import json
import platform
import re
import sys
import tomllib
from collections.abc import Iterable
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "docs" / "packages.md"
HEADSET = ROOT / "wbc_suite" / "devices" / "pages" / "headset"
LOCK = ROOT / "tests" / "browser" / "package-lock.json"
HEAD = """# Packages and licences

Written by `docs/write_packages.py` from the metadata of installed packages.
[Dependencies](dependencies.md) states the lowest versions and the purposes. Versions
here were installed on {date} with Python {python} on {system}; newer ones are accepted.
A package stands in the first table that needs it. `.ci/audit` compares installed and
lowest versions with published advisories.

Robots, benchmarks and controllers in the wheel are text files of this repository; each
robot file names the sources of its figures. The wheel holds no meshes, textures or
fonts of others. viser draws the scene of the pages and holds its own JavaScript.
"""
COLUMNS = (
    "| package | version | licence | needed by |",
    "|---|---|---|---|",
)
LICENCES = {"cmeel-qhull": "Qhull"}
"""Of packages whose metadata state none, as read in their licence files."""


class Row(NamedTuple):
    """A line of a table."""

    package: str
    version: str
    licence: str
    needed_by: str

    def __str__(self) -> str:
        """Return the line in Markdown."""
        return f"| {' | '.join(self)} |"


def installed(folders: Iterable[str]) -> dict[str, metadata.Distribution]:
    """Return what is installed here, and in other environments, by name."""
    found: dict[str, metadata.Distribution] = {}
    paths = [str(p) for f in folders for p in Path(f).glob("lib/python*/site-packages")]
    for each in [*metadata.distributions(), *metadata.distributions(path=paths)]:
        found.setdefault(canonicalize_name(each.metadata["Name"]), each)
    return found


def licence(package: metadata.Distribution) -> str:
    """Return the licence that the metadata state: expression, text or classifier."""
    about: Any = package.metadata
    name = canonicalize_name(about["Name"])
    classes = [c for c in about.get_all("Classifier") or () if c.startswith("License")]
    named = [c.rpartition(" :: ")[2] for c in classes if c.count(" :: ") > 1]
    first = (about.get("License") or "UNKNOWN").strip().split("\n")[0]
    short = first if first != "UNKNOWN" and len(first) < 60 else ""
    stated = about.get("License-Expression") or short or ", ".join(named)
    return LICENCES.get(name) or stated or "not stated"


def needs(package: metadata.Distribution) -> set[str]:
    """Return the packages that one asks for on this machine, without its extras."""
    found = map(Requirement, package.requires or ())
    here = (r for r in found if r.marker is None or r.marker.evaluate({"extra": ""}))
    return {canonicalize_name(r.name) for r in here}


def rows(
    direct: set[str], known: dict[str, metadata.Distribution], old: dict[str, Row]
) -> list[Row]:
    """Return the packages of a list and all that they bring, in alphabetical order."""
    why: dict[str, set[str]] = {name: {"wbc-suite"} for name in direct}
    todo = list(direct)
    while todo:
        parent = todo.pop()
        for name in needs(known[parent]) if parent in known else ():
            if name not in why:
                todo.append(name)
            why.setdefault(name, set()).add(parent)
    table = []
    for name in sorted(why):
        parents = sorted(why[name], key=lambda parent: (parent != "wbc-suite", parent))
        more = f" and {len(parents) - 3} more" if len(parents) > 3 else ""
        by = ", ".join(parents[:3]) + more
        if name in known:
            table.append(Row(name, known[name].version, licence(known[name]), by))
        elif name in old:
            table.append(old[name])
        else:
            table.append(Row(name, "", "not installed here", by))
    return table


def scripts() -> dict[str, list[Row]]:
    """Return the JavaScript that the wheel holds, and what tests load from npm."""
    entry = (HEADSET / "three.entry.js").read_text(encoding="utf-8")
    (version,) = re.findall(r"three ([\d.]+) from npm", entry)
    text = (HEADSET / "three.js").read_text(encoding="utf-8")
    (stated,) = set(re.findall(r"SPDX-License-Identifier: (\S+)", text))
    shipped = [Row("three", version, stated, "the page of a headset")]
    found = json.loads(LOCK.read_text(encoding="utf-8"))["packages"]
    tests = [
        Row(
            path.rpartition("node_modules/")[2],
            each["version"],
            each["license"],
            "tests",
        )
        for path, each in found.items()
        if path
    ]
    return {"Shipped in the wheel": shipped, "npm, for the tests of pages": tests}


def names(requirements: Iterable[object]) -> set[str]:
    """Return the packages that requirements name, without included groups."""
    texts = (text for text in requirements if isinstance(text, str))
    return {canonicalize_name(Requirement(text).name) for text in texts}


def page(known: dict[str, metadata.Distribution], old: dict[str, Row]) -> str:
    """Return the page."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    lists = {"Runtime": names(project["project"]["dependencies"])}
    for extra, listed in project["project"]["optional-dependencies"].items():
        lists[f"Extra `{extra}`"] = names(listed)
    for group, listed in project["dependency-groups"].items():
        lists[f"Group `{group}`"] = names(listed)
    js = scripts()
    tables = {"Shipped in the wheel": js.pop("Shipped in the wheel")}
    seen: set[str] = set()
    for title, direct in lists.items():
        each = [row for row in rows(direct, known, old) if row.package not in seen]
        seen |= {row.package for row in each}
        tables[title] = each
    date = datetime.now(UTC).date().isoformat()
    system = f"{platform.system()} {platform.machine()}"
    parts = [HEAD.format(date=date, python=platform.python_version(), system=system)]
    for title, table in (tables | js).items():
        if table:
            parts.append(
                "\n".join([f"## {title}\n", *COLUMNS, *map(str, table)]) + "\n"
            )
    return "\n".join(parts)


def written() -> dict[str, Row]:
    """Return the rows that are on the page."""
    text = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    cells = re.findall(r"^\| (.+?) \| (.*?) \| (.*?) \| (.*?) \|$", text, re.MULTILINE)
    return {row[0]: Row(*row) for row in cells}


if __name__ == "__main__":
    PAGE.write_text(page(installed(sys.argv[1:]), written()), encoding="utf-8")
