"""Episodes as films and as sheets of pictures."""

import importlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from wbc_suite.envs import RobotEnv
from wbc_suite.errors import DatasetError
from wbc_suite.recording.dataset import Dataset
from wbc_suite.recording.episode import Episode
from wbc_suite.recording.replaying import play_actions, play_states
from wbc_suite.recording.source import rebuild

__all__ = ["check_film", "episode_pictures", "write_film", "write_sheet"]

Picture = NDArray[np.uint8]

RATE = 20.0  # pictures per second, at most
PILLOW = {".gif": "GIF", ".webp": "WEBP"}
SHEET_ROWS, SHEET_COLUMNS, SHEET_SIZE = 12, 6, 128  # episodes, pictures, pixels
LABEL = 14  # pixels


def check_film(path: Path) -> None:
    """Say early that a film cannot be written.

    Raises:
        DatasetError: If nothing here writes films of that kind.
    """
    if path.suffix.lower() in PILLOW:
        return
    if path.suffix.lower() != ".mp4":
        raise DatasetError(
            f"'{path}': films are .mp4, .webp or .gif, not '{path.suffix}'."
        )
    _import_av()


def episode_pictures(
    env: RobotEnv, episode: Episode, *, by_states: bool, every: int = 1
) -> Iterator[Picture]:
    """Play an episode, and draw it as `env.render` does.

    Args:
        env: Made with `render_mode="rgb_array"`.
        episode: What is played.
        by_states: Whether states are shown as recorded; else actions are taken.
        every: Draw every so many actions.
    """
    if by_states:
        played: Iterator[Any] = play_states(env, episode)
    else:
        played = play_actions(env, episode)
    for k, _ in enumerate(played):
        if k % every == 0:
            yield np.asarray(env.render())


def write_film(pictures: Iterable[Picture], path: Path, *, rate: float) -> None:
    """Write pictures as .mp4 (H.264, needs `av`), .webp or .gif (always there).

    Raises:
        DatasetError: If it cannot be written.
    """
    check_film(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.suffix.lower() == ".mp4":
            _write_mp4(pictures, path, rate)
        else:
            _write_animation(pictures, path, rate)
    except OSError as error:
        raise DatasetError(f"'{path}' cannot be written: {error}.") from error


def write_sheet(dataset: Dataset, path: Path, *, camera: str = "agentview") -> None:
    """Draw episodes, one per row, from their beginning to their end.

    Recorded pictures of the camera are taken where there are some; else states are
    shown again.

    Raises:
        DatasetError: If there is nothing to draw, or the file cannot be written.
    """
    names = dataset.names[:SHEET_ROWS]
    if not names:
        raise DatasetError(f"'{dataset.path}' has no episodes to draw.")
    env: RobotEnv | None = None
    rows = []
    for name in names:
        episode = dataset.episode(name)
        pictures = episode.columns.get(f"obs/{camera}_image")
        at = np.linspace(0, episode.length - 1, SHEET_COLUMNS).round().astype(int)
        if pictures is None:
            env = env or rebuild(
                dataset,
                render_mode="rgb_array",
                render_camera=camera,
                render_size=(SHEET_SIZE, SHEET_SIZE),
                use_camera_obs=False,
            )
            wanted = set(at.tolist())
            drawn = {
                k: np.asarray(env.render())
                for k in play_states(env, episode)
                if k in wanted
            }
            row = [drawn[k] for k in at.tolist()]
        else:
            row = [pictures[k] for k in at.tolist()]
        rows.append((_caption(episode), row))
    if env is not None:
        env.close()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _tile(rows).save(path)
    except (OSError, ValueError) as error:
        raise DatasetError(f"'{path}' cannot be written: {error}.") from error


def _caption(episode: Episode) -> str:
    word = {None: "", True: ", success", False: ", no success"}[episode.success]
    return f"{episode.name}: {episode.length} actions{word}"


def _tile(rows: list[tuple[str, list[Picture]]]) -> Image.Image:
    """Put pictures beside each other, each row under its words."""
    height = SHEET_SIZE + LABEL
    sheet = Image.new("RGB", (SHEET_COLUMNS * SHEET_SIZE, len(rows) * height), "white")
    pen = ImageDraw.Draw(sheet)
    for k, (caption, pictures) in enumerate(rows):
        pen.text((4, k * height + 1), caption, fill="black")
        for j, picture in enumerate(pictures):
            image = Image.fromarray(picture).resize((SHEET_SIZE, SHEET_SIZE))
            sheet.paste(image, (j * SHEET_SIZE, k * height + LABEL))
    return sheet


def _write_animation(pictures: Iterable[Picture], path: Path, rate: float) -> None:
    images = (Image.fromarray(picture) for picture in pictures)
    first = next(images, None)
    if first is None:
        raise DatasetError("There are no pictures to make a film of.")
    first.save(
        path,
        format=PILLOW[path.suffix.lower()],
        save_all=True,
        append_images=images,
        duration=round(1000.0 / rate),
        loop=0,
    )


def _write_mp4(pictures: Iterable[Picture], path: Path, rate: float) -> None:
    av = _import_av()
    with av.open(str(path), "w") as film:
        stream = None
        for picture in pictures:
            if stream is None:
                stream = film.add_stream("libx264", rate=round(rate))
                stream.height, stream.width = picture.shape[:2]
                stream.pix_fmt = "yuv420p"
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture))
            film.mux(stream.encode(frame))
        if stream is not None:
            film.mux(stream.encode())


def _import_av() -> Any:
    try:
        return importlib.import_module("av")
    except ImportError as error:
        raise DatasetError(
            "Films as .mp4 need the package 'av': pip install 'wbc-suite[video]'. "
            "Without it, choose .webp or .gif."
        ) from error
