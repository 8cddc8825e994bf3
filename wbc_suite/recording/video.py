"""Episodes as videos (.mp4, .webp, .gif) and as contact sheets."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from wbc_suite.envs import RobotEnv
from wbc_suite.errors import DatasetError
from wbc_suite.recording.atomic_files import check_folder, replace_file
from wbc_suite.recording.dataset import Dataset
from wbc_suite.recording.env_source import rebuild
from wbc_suite.recording.episode import Episode
from wbc_suite.recording.extras import import_extra
from wbc_suite.recording.mp4_writer import Mp4Writer
from wbc_suite.recording.replaying import play_actions, play_states

Picture = NDArray[np.uint8]

RATE = 20.0  # pictures per second, at most
PILLOW = {".gif": "GIF", ".webp": "WEBP"}
SHEET_ROWS, SHEET_COLUMNS, SHEET_SIZE = 12, 6, 128  # episodes, pictures, pixels
LABEL = 14  # pixels


def check_video(path: Path) -> None:
    """Raise DatasetError for an unknown format, or a package that is missing."""
    suffix = path.suffix.lower()
    if suffix == ".mp4":
        import_extra("av", "video")
    elif suffix not in PILLOW:
        raise DatasetError(f"'{path}': a video is .mp4, .webp or .gif.")


def episode_pictures(
    env: RobotEnv, episode: Episode, *, by_states: bool, every: int = 1
) -> Iterator[Picture]:
    """Play an episode, and draw every so many states as `env.render` does."""
    play: Callable[..., Iterator[Any]] = play_states if by_states else play_actions
    for k, _ in enumerate(play(env, episode)):
        if k % every == 0:
            yield np.asarray(env.render())


def write_video(pictures: Iterable[Picture], path: Path, *, rate: float) -> None:
    """Write pictures as .mp4 (H.264, needs `av`), .webp or .gif."""
    check_video(path)

    def write(temporary: Path) -> None:
        if path.suffix.lower() in PILLOW:
            _write_animation(pictures, temporary, rate)
            return
        with closing(Mp4Writer(temporary, rate=rate, extra="video")) as writer:
            for picture in pictures:
                writer.add(picture)

    check_folder(path.parent)
    replace_file(path, write)


def write_sheet(dataset: Dataset, path: Path, *, camera: str = "agentview") -> None:
    """Draw episodes, one per row, by their pictures of the camera or their states."""
    names = dataset.names[:SHEET_ROWS]
    if not names:
        raise DatasetError(f"'{dataset.path}' has no episodes to draw.")
    env: RobotEnv | None = None
    height = SHEET_SIZE + LABEL
    size = SHEET_COLUMNS * SHEET_SIZE, len(names) * height
    sheet = Image.new("RGB", size, "white")
    pen = ImageDraw.Draw(sheet)
    for row, episode in enumerate(map(dataset.episode, names)):
        word = {None: "", True: ", success", False: ", no success"}[episode.success]
        caption = f"{episode.name}: {episode.length} actions{word}"
        pen.text((4, row * height + 1), caption, fill="black")
        at = np.linspace(0, episode.length - 1, SHEET_COLUMNS).round().astype(int)
        pictures: Any = episode.columns.get(f"obs/{camera}_image")
        if pictures is None:
            env = env or rebuild(
                dataset,
                render_mode="rgb_array",
                render_camera=camera,
                render_size=(SHEET_SIZE, SHEET_SIZE),
                use_camera_obs=False,
            )
            states = play_states(env, episode)
            pictures = {k: np.asarray(env.render()) for k in states if k in at}
        for column, k in enumerate(at.tolist()):
            image = Image.fromarray(pictures[k]).resize((SHEET_SIZE, SHEET_SIZE))
            sheet.paste(image, (column * SHEET_SIZE, row * height + LABEL))
    if env is not None:
        env.close()
    check_folder(path.parent)
    replace_file(path, sheet.save)


def _write_animation(pictures: Iterable[Picture], path: Path, rate: float) -> None:
    images = [Image.fromarray(picture) for picture in pictures]
    if not images:
        raise DatasetError("There are no pictures for a video.")
    unit = 10 if path.suffix.lower() == ".gif" else 1  # ms
    ends = [unit * round(1000.0 * k / (rate * unit)) for k in range(len(images) + 1)]
    first, *others = images
    first.save(
        path,
        format=PILLOW[path.suffix.lower()],
        save_all=True,
        append_images=others,
        duration=[b - a for a, b in pairwise(ends)],
        loop=0,
    )
