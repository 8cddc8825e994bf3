"""Datasets verified, repaired, merged, split and filtered, each file atomically."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from shutil import rmtree

import numpy as np

from wbc_suite.errors import DatasetError
from wbc_suite.recording.dataset import (
    Dataset,
    dataset_files,
    free_name,
    part_files,
    parts_folder,
)
from wbc_suite.recording.env_source import differences
from wbc_suite.recording.episode import Episode, Fact
from wbc_suite.recording.episode_store import locked
from wbc_suite.recording.hdf5_check import check_files
from wbc_suite.recording.hdf5_writer import write_dataset


@dataclass(frozen=True, kw_only=True, slots=True)
class Finding:
    """Result of reading an episode or a file; `problem` is None without damage."""

    place: str
    problem: str | None = None


def verify(path: str | Path) -> list[Finding]:
    """Read every episode, and compare its numbers with its checksum."""
    return [finding for finding, _ in _read_all(Path(path))]


def repair(path: str | Path) -> list[Finding]:
    """Write all readable episodes into one file.

    A file that lost something is kept beside it as `FILE.damaged`.

    Raises:
        DatasetError: If nothing can be read, another process records into it, or the
            disk is full; then everything stays as it was.
    """
    path = Path(path)
    with locked(path):
        findings: list[Finding] = []
        uids: set[Fact] = set()
        names: dict[str, str] = {}  # by place
        for finding, episode in _read_all(path):
            findings.append(finding)
            if episode is None:
                continue
            uid = episode.facts.get("uid", finding.place)
            if uid not in uids:
                uids.add(uid)
                names[finding.place] = free_name(episode.name, names.values())
        damaged = any(f.problem for f in findings)
        if not names and damaged:
            raise DatasetError(f"Nothing can be read. {findings[0].problem}")
        if damaged or part_files(path):
            _write_repaired(path, names, keep_old=damaged)
        if not damaged or not part_files(path):
            rmtree(parts_folder(path), ignore_errors=True)
    return findings


def merge(sources: Sequence[str | Path], out: str | Path) -> int:
    """Merge the episodes of several files, each one once; return their number.

    Raises:
        DatasetError: If they are of different environments, or one cannot be read.
    """
    out = Path(out)
    with ExitStack() as opened:
        datasets = [opened.enter_context(Dataset(source)) for source in sources]
        origins = [str(d.header.get("env_args", "")) for d in datasets]
        for dataset, origin in zip(datasets, origins, strict=True):
            if origin != origins[0]:
                raise DatasetError(
                    "These are recordings of different environments: of "
                    f"'{datasets[0].path}' and '{dataset.path}', "
                    f"{differences(origins[0], origin)}."
                )
        wanted: dict[Fact, tuple[Dataset, str]] = {}  # by uid
        for dataset in datasets:
            for name in dataset.names:
                uid = dataset.facts(name).get("uid", f"{dataset.path}: {name}")
                wanted.setdefault(uid, (dataset, name))
        renamed = (
            replace(dataset.episode(name), name=f"demo_{k}")
            for k, (dataset, name) in enumerate(wanted.values())
        )
        needed = sum(d.path.stat().st_size for d in datasets if d.path.exists())
        write_dataset(out, renamed, datasets[0].header, needed=needed)
    return len(wanted)


def split(
    path: str | Path, *, valid: float = 0.1, seed: int = 0
) -> Mapping[str, Sequence[str]]:
    """Write the masks `train` and `valid` into a file, as robomimic reads them.

    `valid` is the share of the episodes for validation, drawn with the seed. Raises
    DatasetError if either mask would be empty.
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
        masks = {
            "train": [names[k] for k in sorted(drawn[count:])],
            "valid": [names[k] for k in sorted(drawn[:count])],
        }
        write_dataset(path, dataset, dataset.header, masks={**dataset.masks, **masks})
    return masks


def filter_dataset(
    path: str | Path, out: str | Path, keep: Callable[[Dataset, str], bool]
) -> int:
    """Write the episodes for which `keep(dataset, name)` is true; return their number.

    They keep their names; masks keep the names that remain. Raises DatasetError if none
    remains.
    """
    with Dataset(path) as dataset:
        names = [name for name in dataset.names if keep(dataset, name)]
        if not names:
            raise DatasetError(f"None of the {len(dataset)} episodes would be left.")
        chosen = (dataset.episode(name) for name in names)
        masks = _masks_of(dataset, names)
        write_dataset(Path(out), chosen, dataset.header, masks=masks)
    return len(names)


def _read_all(path: Path) -> Iterator[tuple[Finding, Episode | None]]:
    """Read episode by episode; yield None in place of one that cannot be read."""
    files = dataset_files(path)
    damage = _damage(files)
    for file in files:
        if file in damage:
            yield Finding(place=str(file), problem=damage[file]), None
            continue
        try:
            dataset = Dataset(file, alone=True, checked=True)
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


def _damage(files: Sequence[Path]) -> dict[Path, str]:
    """Return which files cannot be opened safely, and why."""
    try:
        check_files(files)
    except DatasetError as error:
        if len(files) == 1:
            return {files[0]: str(error)}
        half = len(files) // 2
        return _damage(files[:half]) | _damage(files[half:])
    return {}


def _write_repaired(path: Path, names: Mapping[str, str], *, keep_old: bool) -> None:
    """Write episodes into one file, with their new names by their places."""
    header: dict[str, Fact] = {}
    masks: dict[str, list[str]] = {}
    for file in [path, *part_files(path)]:  # the first that can be opened
        with suppress(DatasetError), Dataset(file, alone=True) as dataset:
            header, masks = dataset.header, _masks_of(dataset, names.values())
            break
    renamed = (
        replace(episode, name=names[finding.place])
        for finding, episode in _read_all(path)
        if episode is not None and finding.place in names
    )
    repaired = path.with_name(path.name + ".repaired")
    write_dataset(repaired, renamed, header, masks=masks)
    if keep_old and path.exists():
        damaged = path.with_name(path.name + ".damaged")
        damaged.unlink(missing_ok=True)
        try:
            damaged.hardlink_to(path)  # so that `path` is there all the time
        except OSError:  # a file system without hard links
            path.replace(damaged)
    repaired.replace(path)


def _masks_of(dataset: Dataset, names: Collection[str]) -> dict[str, list[str]]:
    """Return a dataset's masks, with the names that remain."""
    return {k: [n for n in held if n in names] for k, held in dataset.masks.items()}
