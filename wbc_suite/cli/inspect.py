"""`wbc-suite inspect`: what is in a recording."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from wbc_suite.recording import Dataset

__all__ = ["inspect"]

SHOWN = 20  # episodes


def inspect(
    file: Annotated[Path, typer.Argument(help="Recording.")],
    *,
    every: Annotated[
        bool, typer.Option("--all", help="List every episode, not twenty.")
    ] = False,
    columns: Annotated[
        bool, typer.Option("--columns", help="List what the first episode holds.")
    ] = False,
    plots: Annotated[
        Path | None, typer.Option(help="Write lengths, actions and rewards as a PNG.")
    ] = None,
    sheet: Annotated[
        Path | None, typer.Option(help="Write pictures of episodes as one PNG.")
    ] = None,
    camera: Annotated[str, typer.Option(help="Camera of the sheet.")] = "agentview",
) -> None:
    """Show lengths, success and origin of episodes; write plots, a contact sheet."""
    from wbc_suite.recording import Dataset

    with Dataset(file) as dataset:
        _print_origin(dataset)
        _print_episodes(dataset, len(dataset) if every else SHOWN)
        if columns and len(dataset):
            _print_columns(dataset)
        if plots is not None:
            from wbc_suite.recording.plots import write_plots

            write_plots(dataset, plots)
            print(f"Wrote {plots}.")
        if sheet is not None:
            from wbc_suite.recording.film import write_sheet

            write_sheet(dataset, sheet, camera=camera)
            print(f"Wrote {sheet}.")


def _print_origin(dataset: "Dataset") -> None:
    from wbc_suite.recording import EnvSource

    header = dataset.header
    told = header.get("env_args")
    if told is not None:
        source = EnvSource.parse(str(told))
        arguments = json.dumps(dict(source.arguments))
        print(f"{dataset.path}: {source.benchmark} {arguments[:300]}")
    else:
        print(f"{dataset.path}: it does not say of what environment")
    for key in ("schema_version", "date", "versions", "model_hash"):
        if key in header:
            print(f"  {key:<15} {str(header[key])[:200]}")
    for name, names in dataset.masks.items():
        print(f"  mask {name:<10} {len(names)} episodes")


def _print_episodes(dataset: "Dataset", most: int) -> None:
    lengths = [dataset.length(name) for name in dataset.names]
    facts = [dataset.facts(name) for name in dataset.names]
    told = [bool(fact["success"]) for fact in facts if "success" in fact]
    print(
        f"  {len(lengths)} episodes, {sum(lengths)} actions"
        + (f", {sum(told)} of {len(told)} succeeded" if told else "")
        + (f"; lengths {min(lengths)} to {max(lengths)}" if lengths else "")
    )
    for name, length, fact in list(zip(dataset.names, lengths, facts, strict=True))[
        :most
    ]:
        word = {None: "", True: "success", False: "no success"}[
            bool(fact["success"]) if "success" in fact else None
        ]
        clipped = fact.get("clipped_steps", 0)
        print(
            f"    {name:<10} {length:6d} actions  {word:<10}"
            + (f"  seed {fact['seed']}" if "seed" in fact else "")
            + (f"  {clipped} clipped" if clipped else "")
        )
    if len(lengths) > most:
        print(f"    ... and {len(lengths) - most} more (--all)")


def _print_columns(dataset: "Dataset") -> None:
    episode = dataset.episode(dataset.names[0])
    print(f"  {episode.name} holds:")
    for name, column in sorted(episode.columns.items()):
        print(f"    {name:<36} {column.dtype!s:<8} {column.shape}")
