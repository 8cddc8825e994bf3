"""Datasets checked, mended, put together and taken apart.

Whatever is written is written aside and put in place at once: a process that dies at
any moment leaves either the old file or the new one.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from shutil import rmtree

import numpy as np

from wbc_suite.errors import DatasetError
from wbc_suite.recording.dataset import Dataset, part_files, parts_folder
from wbc_suite.recording.episode import Episode
from wbc_suite.recording.store import locked
from wbc_suite.recording.writing import write_dataset

__all__ = ["Finding", "filter_dataset", "merge", "repair", "split", "verify"]


@dataclass(frozen=True, kw_only=True, slots=True)
class Finding:
    """What was found of an episode, or of a file that cannot be opened.

    Attributes:
        place: File, and name of the episode.
        problem: What is wrong, in words; None if nothing is.
    """

    place: str
    problem: str | None = None


def verify(path: str | Path) -> list[Finding]:
    """Read every episode, and compare its numbers with the sum it was written with."""
    return [finding for finding, _ in _read_all(Path(path))]


def repair(path: str | Path) -> list[Finding]:
    """Put what can be read into one file again.

    A file that lost something is kept beside it as `FILE.damaged`.

    Raises:
        DatasetError: If nothing can be read, somebody records into it, or the disk is
            full; then everything is as it was.
    """
    path = Path(path)
    parts = part_files(path)
    with locked(path):
        findings, episodes = [], {}
        for finding, episode in _read_all(path):
            findings.append(finding)
            if episode is not None:
                episodes.setdefault(_identity(finding, episode), finding.place)
        damaged = any(f.problem for f in findings)
        if not episodes and damaged:
            raise DatasetError(f"Nothing of '{path}' can be read: {findings[0]}.")
        if damaged or parts:
            _put_together(path, set(episodes.values()), keep_old=damaged)
            if not damaged:
                rmtree(parts_folder(path), ignore_errors=True)
    if not part_files(path):
        rmtree(parts_folder(path), ignore_errors=True)
    return findings


def merge(sources: Sequence[str | Path], out: str | Path) -> int:
    """Put the episodes of several files into one; their number is returned.

    An episode that is there twice comes once, so that merging again changes nothing.

    Raises:
        DatasetError: If they are of different environments, or one cannot be read.
    """
    out = Path(out)
    datasets = [Dataset(source) for source in sources]
    try:
        origins = {str(d.header.get("env_args", "")) for d in datasets}
        if len(origins) > 1:
            raise DatasetError(
                "These are recordings of different environments: "
                + "; ".join(sorted(o[:120] for o in origins))
            )
        wanted = _without_twins(datasets)
        renamed = (
            replace(dataset.episode(name), name=f"demo_{k}")
            for k, (dataset, name) in enumerate(wanted)
        )
        needed = sum(d.path.stat().st_size for d in datasets if d.path.exists())
        write_dataset(out, renamed, datasets[0].header, needed=needed)
    finally:
        for dataset in datasets:
            dataset.close()
    return len(wanted)


def split(
    path: str | Path, *, valid: float = 0.1, seed: int = 0
) -> Mapping[str, Sequence[str]]:
    """Write the masks `train` and `valid` into a file, as robomimic reads them.

    Args:
        path: The file.
        valid: Share of the episodes that is kept for validation.
        seed: Of the draw.

    Raises:
        DatasetError: If one of both would be empty.
    """
    path = Path(path)
    with Dataset(path) as dataset:
        names = list(dataset.names)
        count = round(valid * len(names))
        if not 0 < count < len(names):
            raise DatasetError(
                f"{valid:g} of {len(names)} episodes is {count}; neither part may be "
                "empty."
            )
        drawn = np.random.default_rng(seed).permutation(len(names))
        chosen = {names[k] for k in drawn[:count]}
        masks = {
            "train": [n for n in names if n not in chosen],
            "valid": [n for n in names if n in chosen],
        }
        write_dataset(path, dataset, dataset.header, masks={**dataset.masks, **masks})
    return masks


def filter_dataset(
    path: str | Path, out: str | Path, keep: Callable[[Dataset, str], bool]
) -> int:
    """Write those episodes that `keep(dataset, name)` wants; their number is returned.

    They keep their names, and masks the names that are left.

    Raises:
        DatasetError: If none is left.
    """
    with Dataset(path) as dataset:
        names = [name for name in dataset.names if keep(dataset, name)]
        if not names:
            raise DatasetError(f"None of the {len(dataset)} episodes would be left.")
        masks = {
            key: [n for n in held if n in names] for key, held in dataset.masks.items()
        }
        chosen = (dataset.episode(name) for name in names)
        write_dataset(Path(out), chosen, dataset.header, masks=masks)
    return len(names)


def _read_all(path: Path) -> Iterator[tuple[Finding, Episode | None]]:
    """Read episode by episode; what cannot be read is told."""
    files = [path] if path.exists() or not part_files(path) else []
    for file in [*files, *part_files(path)]:
        try:
            dataset = Dataset(file, alone=True)
        except DatasetError as error:
            yield Finding(place=str(file), problem=str(error)), None
            continue
        with dataset:
            for name in dataset.names:
                place = f"{file.name}: {name}"
                try:
                    yield Finding(place=place), dataset.episode(name)
                except DatasetError as error:
                    yield Finding(place=place, problem=str(error)), None


def _identity(finding: Finding, episode: Episode) -> str:
    return str(episode.facts.get("uid", finding.place))


def _put_together(path: Path, wanted: set[str], *, keep_old: bool) -> None:
    """Write the wanted episodes, by their places, into one file."""
    header: dict[str, str | int | float | bool] = {}
    masks: dict[str, list[str]] = {}
    for file in [path, *part_files(path)]:
        try:
            with Dataset(file, alone=True) as dataset:
                header, masks = dict(dataset.header), dict(dataset.masks)
            break
        except DatasetError:
            continue
    names: list[str] = []

    def numbered() -> Iterator[Episode]:
        for finding, episode in _read_all(path):
            if episode is not None and finding.place in wanted:
                name = _free(episode.name, names)
                names.append(name)
                yield replace(episode, name=name)

    mended = path.with_name(path.name + ".mended")
    write_dataset(mended, numbered(), header)
    if masks:
        kept = {k: [n for n in held if n in names] for k, held in masks.items()}
        with Dataset(mended, alone=True) as dataset:
            write_dataset(mended, dataset, header, masks=kept)
    if keep_old and path.exists():
        path.replace(path.with_name(path.name + ".damaged"))
    mended.replace(path)


def _free(name: str, taken: Iterable[str]) -> str:
    number = int(name.split("_")[-1].removeprefix("demo"))
    while f"demo_{number}" in taken:
        number += 1
    return f"demo_{number}"


def _without_twins(datasets: Iterable[Dataset]) -> list[tuple[Dataset, str]]:
    """Return where each episode is, those with the same `uid` once."""
    found: dict[str, tuple[Dataset, str]] = {}
    for dataset in datasets:
        for name in dataset.names:
            uid = str(dataset.facts(name).get("uid", f"{dataset.path}: {name}"))
            found.setdefault(uid, (dataset, name))
    return list(found.values())
