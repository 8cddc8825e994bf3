"""`wbc-suite convert | extract`: recordings for others, and seen anew."""

from pathlib import Path
from typing import Annotated, Any

import typer

from wbc_suite.cli.options import ExecutorOption, progress

__all__ = ["convert", "extract"]

FileArgument = Annotated[Path, typer.Argument(help="Recording.")]


def convert(
    file: FileArgument,
    *,
    to: Annotated[str, typer.Option(help="robomimic, npz, lerobot, minari or mcap.")],
    out: Annotated[
        Path, typer.Option("--out", "-o", help="File, or folder, to write.")
    ],
    executor: ExecutorOption = "serial",
    workers: Annotated[
        int, typer.Option(min=1, help="At once, for lerobot and npz; others are one.")
    ] = 1,
) -> None:
    """Write a recording in another layout.

    Stopped, all but `serial` go on when the same command is given again.
    """
    from wbc_suite.executors import make_executor
    from wbc_suite.recording import Dataset
    from wbc_suite.recording.converting import convert as write

    asked = None if executor == "serial" else make_executor(executor, workers=workers)
    with Dataset(file) as dataset:
        total = len(dataset)
    with progress("Converting", total) as advance:
        written = write(file, out, to, advance, executor=asked, workers=workers)
    print(f"Wrote {written}.")


def extract(
    file: FileArgument,
    *,
    out: Annotated[Path, typer.Option("--out", "-o", help="File to write.")],
    camera: Annotated[
        list[str] | None, typer.Option(help="Camera to see by; may be repeated.")
    ] = None,
    size: Annotated[
        int, typer.Option(min=8, max=2048, help="Of its pictures, pixels.")
    ] = 84,
    depth: Annotated[bool, typer.Option("--depth", help="See depth too.")] = False,
    shaped: Annotated[
        bool, typer.Option("--shaped", help="Reward progress, not success alone.")
    ] = False,
    executor: ExecutorOption = "process",
    workers: Annotated[
        int, typer.Option(min=1, help="At once; each makes an environment.")
    ] = 1,
    trust_files: Annotated[
        bool,
        typer.Option(
            "--trust-files", help="Let the recording name files to read robots from."
        ),
    ] = False,
) -> None:
    """Show recorded states again, and store other pictures and rewards.

    Stopped, it goes on when the same command is given again.
    """
    from wbc_suite.executors import make_executor
    from wbc_suite.recording import Dataset
    from wbc_suite.recording.extracting import extract as see_again

    changes: dict[str, Any] = {"reward_shaping": shaped, "use_camera_obs": bool(camera)}
    if camera:
        changes |= {"camera_names": tuple(camera), "camera_depths": depth}
        changes |= {"camera_heights": size, "camera_widths": size}
    chosen = "serial" if executor == "process" and workers == 1 else executor
    with Dataset(file) as dataset:
        total = len(dataset)
    with progress("Extracting", total) as advance:
        count = see_again(
            file,
            out,
            trust_files=trust_files,
            executor=make_executor(chosen, workers=workers),
            workers=workers,
            tell=advance,
            **changes,
        )
    print(f"{out}: {count} episodes.")
