"""Videos of episodes: .mp4, .webp and .gif."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from wbc_suite.atomic_files import check_folder, replace_file
from wbc_suite.envs import RobotEnv
from wbc_suite.errors import DatasetError
from wbc_suite.extras import import_extra
from wbc_suite.recording.episode import Episode
from wbc_suite.recording.replaying import play_actions, play_states

Picture = NDArray[np.uint8]

RATE = 20.0  # pictures per second, at most
PILLOW = {".gif": "GIF", ".webp": "WEBP"}


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


class Mp4Writer:
    """Writes an H.264 video picture by picture at a rate, Hz; needs the package `av`.

    An error names the `extra` that installs it; `options` are those of libx264.
    """

    def __init__(
        self,
        path: Path,
        *,
        rate: float,
        extra: str,
        options: dict[str, str] | None = None,
    ) -> None:
        self._av = import_extra("av", extra)
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = self._av.open(str(path), "w")
        self._rate = Fraction(rate).limit_denominator(1001)  # as of 30000/1001 Hz
        self._options = options or {}
        self._stream, self._count = None, 0

    def add(self, picture: Picture) -> None:
        """Add a picture, shape (height, width, 3)."""
        if self._stream is None:
            self._stream = self._file.add_stream(
                "libx264", rate=self._rate, options=self._options
            )
            self._stream.height, self._stream.width = picture.shape[:2]
            self._stream.pix_fmt = "yuv420p"
        frame = self._av.VideoFrame.from_ndarray(np.ascontiguousarray(picture))
        frame.pts, frame.time_base = self._count, 1 / self._rate
        self._file.mux(self._stream.encode(frame))
        self._count += 1

    def close(self) -> None:
        """Finish the file."""
        if self._stream is not None:
            self._file.mux(self._stream.encode())
        self._file.close()
