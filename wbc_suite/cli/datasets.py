"""Commands for recordings, from `inspect` to `convert`, except `replay`."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from wbc_suite.cli import options
from wbc_suite.cli.output import print

if TYPE_CHECKING:
    from wbc_suite.recording import Dataset
    from wbc_suite.recording.editing import Finding

OutOption = Annotated[Path, typer.Option("--out", "-o", help="File or folder.")]
SHOWN = 20  # episodes


def inspect(
    file: options.RecordingArgument,
    *,
    every: Annotated[
        bool, typer.Option("--all", help="List all episodes, not only 20.")
    ] = False,
    columns: Annotated[
        bool, typer.Option("--columns", help="List the first episode's columns.")
    ] = False,
    plots: Annotated[
        Path | None, typer.Option(help="Write lengths, actions and rewards as a PNG.")
    ] = None,
    sheet: Annotated[
        Path | None, typer.Option(help="Write a contact sheet as a PNG.")
    ] = None,
    camera: Annotated[str, typer.Option(help="Camera of the sheet.")] = "agentview",
) -> None:
    """Show origin, lengths and success of episodes; write plots or a contact sheet."""
    from wbc_suite.recording import Dataset
    from wbc_suite.recording.plots import write_plots, write_sheet

    with Dataset(file) as dataset:
        _print_origin(dataset)
        _print_episodes(dataset, len(dataset) if every else SHOWN)
        if columns and len(dataset):
            episode = dataset.episode(dataset.names[0])
            print(f"  {episode.name} holds:")
            for name, column in sorted(episode.columns.items()):
                print(f"    {name:<36} {column.dtype!s:<8} {column.shape}")
        if plots is not None:
            write_plots(dataset, plots)
            print(f"Wrote {plots}.")
        if sheet is not None:
            write_sheet(dataset, sheet, camera=camera)
            print(f"Wrote {sheet}.")


def _print_origin(dataset: "Dataset") -> None:
    from wbc_suite.recording import EnvSource

    header, origin = dataset.header, "its environment is not named"
    if "env_args" in header:
        source = EnvSource.parse(str(header["env_args"]))
        origin = f"{source.benchmark} {json.dumps(dict(source.arguments))[:300]}"
    print(f"{dataset.path}: {origin}")
    for key in ("schema_version", "date", "versions", "model_hash"):
        if key in header:
            print(f"  {key:<15} {str(header[key])[:200]}")
    for name, names in dataset.masks.items():
        print(f"  mask {name:<10} {len(names)} episodes")


def _print_episodes(dataset: "Dataset", most: int) -> None:
    lengths = [dataset.length(name) for name in dataset.names]
    facts = [dataset.facts(name) for name in dataset.names]
    successes = [bool(fact["success"]) for fact in facts if "success" in fact]
    print(
        f"  {len(lengths)} episodes, {sum(lengths)} actions"
        + (f", {sum(successes)} of {len(successes)} succeeded" if successes else "")
        + (f"; lengths {min(lengths)} to {max(lengths)}" if lengths else "")
    )
    rows = list(zip(dataset.names, lengths, facts, strict=True))
    for name, length, fact in rows[:most]:
        success = bool(fact["success"]) if "success" in fact else None
        word = {None: "", True: "success", False: "no success"}[success]
        clipped = fact.get("clipped_steps", 0)
        print(
            f"    {name:<10} {length:6d} actions  {word:<10}"
            + (f"  seed {fact['seed']}" if "seed" in fact else "")
            + (f"  {clipped} clipped" if clipped else "")
        )
    if len(lengths) > most:
        print(f"    ... and {len(lengths) - most} more (--all)")


def verify(file: options.RecordingArgument) -> None:
    """Read every episode and compare it with its checksum."""
    from wbc_suite.recording import editing

    raise typer.Exit(1 if _report(editing.verify(file)) else 0)


def repair(file: options.RecordingArgument) -> None:
    """Save all readable episodes into one file, after a crash or damage."""
    from wbc_suite.recording import editing

    if _report(editing.repair(file)):
        print(f"The damaged originals are kept in {file}.damaged or {file}.parts.")


def merge(
    files: Annotated[list[Path], typer.Argument(help="Recordings of one benchmark.")],
    *,
    out: OutOption,
) -> None:
    """Merge several files into one; an episode found in several is kept once."""
    from wbc_suite.recording import editing

    print(f"{out}: {editing.merge(files, out)} episodes.")


def split(
    file: options.RecordingArgument,
    *,
    valid: Annotated[
        float, typer.Option(min=0.0, max=1.0, help="Share of episodes for validation.")
    ] = 0.1,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the split.")] = 0,
) -> None:
    """Add robomimic's filter keys `train` and `valid` to a file."""
    from wbc_suite.recording import editing

    masks = editing.split(file, valid=valid, seed=seed)
    counts = ", ".join(f"{key} {len(names)}" for key, names in masks.items())
    print(f"{file}: {counts} episodes.")


def filter_episodes(
    file: options.RecordingArgument,
    *,
    out: OutOption,
    success: Annotated[
        bool, typer.Option("--success", help="Only successful episodes.")
    ] = False,
    shortest: Annotated[int, typer.Option(help="Least number of actions.")] = 0,
    longest: Annotated[
        int | None, typer.Option(help="Greatest number of actions.")
    ] = None,
    mask: Annotated[str | None, typer.Option(help="Only this filter key.")] = None,
    episode: Annotated[
        list[str] | None, typer.Option(help="Only this episode; may be repeated.")
    ] = None,
) -> None:
    """Copy the episodes that meet all conditions into a file."""
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
    """Print each problem and the number of intact episodes; return the problems'."""
    bad = [finding for finding in findings if finding.problem]
    for finding in bad:
        print(f"  {finding.place}: {finding.problem}")
    print(f"{len(findings) - len(bad)} episodes are intact, {len(bad)} problems.")
    return len(bad)


def convert(
    file: options.RecordingArgument,
    *,
    to: Annotated[str, typer.Option(help="robomimic, npz, lerobot, minari or mcap.")],
    out: OutOption,
    executor: options.ExecutorOption = "serial",
    workers: Annotated[
        int, typer.Option(min=1, help="Workers, for lerobot and npz only.")
    ] = 1,
) -> None:
    """Write a recording in another layout.

    With an executor other than `serial`, a stopped command continues if run again.
    """
    from wbc_suite.executors import make_executor
    from wbc_suite.recording.converting import convert as write

    asked = None if executor == "serial" else make_executor(executor, workers=workers)
    with options.progress("Converting", _count_episodes(file)) as advance:
        written = write(file, out, to, advance, executor=asked, workers=workers)
    print(f"Wrote {written}.")


def _count_episodes(file: Path) -> int:
    from wbc_suite.recording import Dataset

    with Dataset(file) as dataset:
        return len(dataset)


def extract(
    file: options.RecordingArgument,
    *,
    out: OutOption,
    camera: options.CamerasOption = None,
    size: options.PictureSizeOption = 84,
    depth: Annotated[bool, typer.Option("--depth", help="Store depth too.")] = False,
    shaped: Annotated[
        bool, typer.Option("--shaped", help="Store shaped rewards.")
    ] = False,
    executor: options.ExecutorOption = "process",
    workers: Annotated[
        int, typer.Option(min=1, help="Workers, each with its environment.")
    ] = 1,
    trust_files: options.TrustFilesOption = False,
) -> None:
    """Restore recorded states, and store new observations and rewards.

    A stopped command continues if it is run again.
    """
    from wbc_suite.executors import make_executor
    from wbc_suite.recording.extracting import extract as extract_observations

    changes: dict[str, Any] = {"reward_shaping": shaped, "use_camera_obs": bool(camera)}
    if camera:
        changes |= options.camera_arguments(camera, size) | {"camera_depths": depth}
    chosen = "serial" if executor == "process" and workers == 1 else executor
    with options.progress("Extracting", _count_episodes(file)) as advance:
        count = extract_observations(
            file,
            out,
            trust_files=trust_files,
            executor=make_executor(chosen, workers=workers),
            workers=workers,
            on_progress=advance,
            **changes,
        )
    print(f"{out}: {count} episodes.")
