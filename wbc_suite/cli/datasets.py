"""`wbc-suite verify | repair | merge | split | filter`: care of recordings."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from wbc_suite.recording import Dataset
    from wbc_suite.recording.editing import Finding

__all__ = ["filter_episodes", "merge", "repair", "split", "verify"]

FileArgument = Annotated[Path, typer.Argument(help="Recording.")]
OutOption = Annotated[Path, typer.Option("--out", "-o", help="File to write.")]


def verify(file: FileArgument) -> None:
    """Read every episode and compare it with the checksum it was written with."""
    from wbc_suite.recording import editing

    bad = _report(editing.verify(file))
    raise typer.Exit(1 if bad else 0)


def repair(file: FileArgument) -> None:
    """Put what can be read into one file again, after a crash or damage."""
    from wbc_suite.recording import editing

    if _report(editing.repair(file)):
        print(f"What was there before is in {file}.damaged, or still beside it.")


def merge(
    files: Annotated[list[Path], typer.Argument(help="Recordings of one benchmark.")],
    *,
    out: OutOption,
) -> None:
    """Put the episodes of several files into one; an episode comes once."""
    from wbc_suite.recording import editing

    print(f"{out}: {editing.merge(files, out)} episodes.")


def split(
    file: FileArgument,
    *,
    valid: Annotated[
        float, typer.Option(min=0.0, max=1.0, help="Share kept for validation.")
    ] = 0.1,
    seed: Annotated[int, typer.Option(min=0, help="Of the draw.")] = 0,
) -> None:
    """Write the masks `train` and `valid` into a file, as robomimic reads them."""
    from wbc_suite.recording import editing

    masks = editing.split(file, valid=valid, seed=seed)
    told = ", ".join(f"{key} {len(names)}" for key, names in masks.items())
    print(f"{file}: {told} episodes.")


def filter_episodes(
    file: FileArgument,
    *,
    out: OutOption,
    success: Annotated[
        bool, typer.Option("--success", help="Only episodes that succeeded.")
    ] = False,
    shortest: Annotated[int, typer.Option(help="Fewest actions.")] = 0,
    longest: Annotated[int | None, typer.Option(help="Most actions.")] = None,
    mask: Annotated[str | None, typer.Option(help="Only those of a mask.")] = None,
    episode: Annotated[
        list[str] | None, typer.Option(help="Only this one; may be repeated.")
    ] = None,
) -> None:
    """Write those episodes that fulfil every condition."""
    from wbc_suite.errors import UnknownNameError
    from wbc_suite.recording import editing

    def keep(dataset: "Dataset", name: str) -> bool:
        if mask is not None and mask not in dataset.masks:
            raise UnknownNameError("mask", mask, tuple(dataset.masks))
        length = dataset.length(name)
        return (
            (not success or bool(dataset.facts(name).get("success")))
            and shortest <= length <= (longest or length)
            and (mask is None or name in dataset.masks[mask])
            and (not episode or name in episode)
        )

    print(f"{out}: {editing.filter_dataset(file, out, keep)} episodes.")


def _report(findings: "list[Finding]") -> int:
    """Print what is wrong, and how much is right; return the number of problems."""
    bad = [finding for finding in findings if finding.problem]
    for finding in bad:
        print(f"  {finding.place}: {finding.problem}")
    print(f"{len(findings) - len(bad)} episodes are whole, {len(bad)} problems.")
    return len(bad)
