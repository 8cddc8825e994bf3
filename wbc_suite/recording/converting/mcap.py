"""Recordings as MCAP logs of JSON messages, for Foxglove, rerun and ROS's tools.

Episodes follow each other in time, a second apart. Topics are the columns' names:

    /episode            wbc_suite.Episode: name, length, success, seed; at its beginning
    /actions /states /rewards /obs/KEY ...
                        wbc_suite.Array: `data`, in row-major order of the shape that
                        the channel's metadata tell
    /obs/CAMERA_image   foxglove.CompressedImage: PNG
"""

import base64
import io
import json
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from wbc_suite import __version__
from wbc_suite.errors import DatasetError
from wbc_suite.recording.converting.mcap_file import McapFile
from wbc_suite.recording.dataset import Dataset
from wbc_suite.recording.episode import Episode
from wbc_suite.recording.files import check_folder, replace_file

__all__ = ["write_mcap"]

SECOND = 1_000_000_000  # ns
YEAR = 3e7  # s; no episode is as long
_TIME = {
    "type": "object",
    "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}},
}
SCHEMAS: dict[str, dict[str, Any]] = {
    "wbc_suite.Episode": {
        "name": {"type": "string"},
        "length": {"type": "integer"},
        "success": {"type": "boolean"},
        "seed": {"type": "integer"},
    },
    "wbc_suite.Array": {"data": {"type": "array", "items": {"type": "number"}}},
    "foxglove.CompressedImage": {
        "timestamp": _TIME,
        "frame_id": {"type": "string"},
        "data": {"type": "string", "contentEncoding": "base64"},
        "format": {"type": "string"},
    },
}
"""Properties of the kinds of message."""


def write_mcap(
    dataset: Dataset, out: Path, tell: Callable[[Episode], None] = lambda _: None
) -> Path:
    """Write a dataset as one log.

    Raises:
        DatasetError: If it cannot be written; then an old file is as it was.
    """
    if not len(dataset):
        raise DatasetError(f"'{dataset.path}' has no episodes.")
    check_folder(out.parent)

    def write(aside: Path) -> None:
        with (
            aside.open("wb") as stream,
            McapFile(stream, f"wbc-suite {__version__}") as log,
        ):
            told = {k: str(v) for k, v in dataset.header.items()}
            log.metadata("wbc_suite", told)
            episodes = _Episodes(log, float(dataset.header.get("control_freq", 20.0)))
            for episode in dataset:
                episodes.add(episode)
                tell(episode)

    replace_file(out, write)
    return out


class _Episodes:
    """Puts episodes into a log, one after the other."""

    def __init__(self, log: McapFile, rate: float) -> None:
        self._log, self._rate = log, rate
        self._channels: dict[str, int] = {}
        self._free = 0  # ns; when the next episode may begin at the earliest

    def add(self, episode: Episode) -> None:
        start = max(self._free, _began(episode))
        times = start + _since_start(episode, self._rate)
        names = ("success", "seed")
        told = {k: episode.facts[k] for k in names if k in episode.facts}
        self._say(
            *("/episode", "wbc_suite.Episode", start, {}),
            {"name": episode.name, "length": episode.length, **told},
        )
        for k, time in enumerate(times.tolist()):
            for name, column in episode.columns.items():
                facts = {"shape": json.dumps(column.shape[1:])}
                if _is_picture(column):
                    kind, message = (
                        "foxglove.CompressedImage",
                        _picture(column[k], time),
                    )
                    message["frame_id"] = name
                else:
                    kind = "wbc_suite.Array"
                    message = {"data": _numbers(column[k])}
                self._say(f"/{name}", kind, time, facts, message)
        self._free = int(times.max(initial=start)) + SECOND

    def _say(
        self, topic: str, kind: str, time: int, facts: dict[str, str], message: Any
    ) -> None:
        if topic not in self._channels:
            schema = {"title": kind, "type": "object", "properties": SCHEMAS[kind]}
            definition = json.dumps(schema).encode()
            self._channels[topic] = self._log.channel(topic, kind, definition, facts)
        content = json.dumps(message, allow_nan=False).encode()
        self._log.message(self._channels[topic], time, content)


def _began(episode: Episode) -> int:
    """Return when an episode began, in ns since 1970; 0 when nobody said."""
    try:
        moment = datetime.fromisoformat(str(episode.facts.get("began")))
        return max(0, round(moment.timestamp() * 1000)) * (SECOND // 1000)
    except (ValueError, OverflowError, OSError):
        return 0


def _since_start(episode: Episode, rate: float) -> NDArray[np.int64]:
    """Return simulated times of the actions since the first one, ns."""
    even = np.arange(episode.length, dtype=np.int64) * round(SECOND / rate)
    if "states" not in episode.columns or not episode.length:
        return even
    time = episode.columns["states"][:, 0]
    passed = time - time[0]
    if passed[-1] > YEAR or not (np.diff(passed) > 0).all():
        return even
    return np.round(passed * SECOND).astype(np.int64)


def _numbers(row: Any) -> list[Any]:
    """Return numbers as JSON has them: what is not finite is null."""
    values = np.ravel(row)
    if values.dtype.kind == "f" and not np.isfinite(values).all():
        return [v if np.isfinite(v) else None for v in values.tolist()]
    return values.tolist()


def _is_picture(column: NDArray[Any]) -> bool:
    return column.dtype == np.uint8 and column.ndim == 4 and column.shape[-1] == 3


def _picture(pixels: NDArray[np.uint8], time: int) -> dict[str, Any]:
    memory = io.BytesIO()
    Image.fromarray(pixels).save(memory, format="PNG", compress_level=1)
    return {
        "timestamp": {"sec": time // SECOND, "nsec": time % SECOND},
        "data": base64.b64encode(memory.getvalue()).decode(),
        "format": "png",
    }
