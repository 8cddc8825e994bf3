"""Recordings as MCAP logs of JSON messages, for Foxglove, rerun and ROS tools.

Written by the package `mcap` (extra `mcap`), in chunks compressed with Zstandard.

Episodes follow each other in time, a second apart. Topics are the columns' names:

    /episode            wbc_suite.Episode: name, length, success, seed; at its beginning
    /actions /states /rewards /obs/KEY ...
                        wbc_suite.Array: `data`, in row-major order of the `shape` in
                        the channel's metadata
    /obs/CAMERA_image   foxglove.CompressedImage: PNG
"""

import base64
import io
import json
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from wbc_suite import __version__
from wbc_suite.atomic_files import check_folder, replace_file
from wbc_suite.extras import import_extra
from wbc_suite.recording.converting.layout import Layout, Piece, Progress
from wbc_suite.recording.dataset import Dataset
from wbc_suite.recording.episode import Episode

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
"""JSON Schema properties of each message type."""


def _begin(out: Path) -> None:
    import_extra("mcap.writer", "mcap")
    check_folder(out.parent)


def _write(dataset: Dataset, piece: Piece, out: Path, on_progress: Progress) -> None:
    writer = import_extra("mcap.writer", "mcap")

    def write(temporary: Path) -> None:
        with temporary.open("wb") as stream:
            log = writer.Writer(stream)
            log.start(library=f"wbc-suite {__version__}")
            header = {name: str(fact) for name, fact in dataset.header.items()}
            log.add_metadata("wbc_suite", header)
            episodes = _EpisodeWriter(log, float(header.get("control_freq", 20.0)))
            for episode in map(dataset.episode, piece.names):
                episodes.add(episode)
                on_progress(1)
            log.finish()

    replace_file(out, write)


class _EpisodeWriter:
    """Writes episodes into a log; `rate`, Hz, is that of episodes without times."""

    def __init__(self, log: Any, rate: float) -> None:
        self._log, self._rate = log, rate
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._earliest_start = 0  # ns, of the next episode

    def add(self, episode: Episode) -> None:
        start = max(self._earliest_start, _start_time(episode))
        times = start + _since_start(episode, self._rate)
        names = ("success", "seed")
        summary = {"name": episode.name, "length": episode.length}
        summary |= {k: episode.facts[k] for k in names if k in episode.facts}
        self._write("/episode", "wbc_suite.Episode", start, summary, {})
        for k, time in enumerate(times.tolist()):
            for name, column in episode.columns.items():
                if column.dtype == np.uint8 and column.shape[3:] == (3,):
                    schema = "foxglove.CompressedImage"
                    message = _picture(column[k], time, name)
                else:
                    schema, message = "wbc_suite.Array", {"data": _numbers(column[k])}
                metadata = {"shape": json.dumps(column.shape[1:])}
                self._write(f"/{name}", schema, time, message, metadata)
        self._earliest_start = int(times.max(initial=start)) + SECOND

    def _write(
        self, topic: str, schema: str, time: int, message: Any, metadata: dict[str, str]
    ) -> None:
        if schema not in self._schemas:
            table = {"title": schema, "type": "object", "properties": SCHEMAS[schema]}
            text = json.dumps(table).encode()
            number = self._log.register_schema(schema, "jsonschema", text)
            self._schemas[schema] = number
        if topic not in self._channels:
            number = self._schemas[schema]
            channel = self._log.register_channel(topic, "json", number, metadata)
            self._channels[topic] = channel
        content = json.dumps(message, allow_nan=False).encode()
        self._log.add_message(
            self._channels[topic], log_time=time, publish_time=time, data=content
        )


def _start_time(episode: Episode) -> int:
    """Return when an episode began, in ns since 1970; 0 if unknown."""
    try:
        moment = datetime.fromisoformat(str(episode.facts.get("began")))
        return max(0, round(moment.timestamp() * 1000)) * (SECOND // 1000)
    except (ValueError, OverflowError, OSError):
        return 0


def _since_start(episode: Episode, rate: float) -> NDArray[np.int64]:
    """Return simulated times of the actions since the first one, ns."""
    even = np.round(np.arange(episode.length) * (SECOND / rate)).astype(np.int64)
    if "states" not in episode.columns or not episode.length:
        return even
    time = episode.columns["states"][:, 0]
    elapsed = time - time[0]
    if elapsed[-1] > YEAR or not (np.diff(elapsed) > 0).all():
        return even
    return np.round(elapsed * SECOND).astype(np.int64)


def _numbers(row: Any) -> list[Any]:
    """Return numbers as JSON has them: what is not finite is null."""
    values = np.ravel(row)
    if values.dtype.kind == "f" and not np.isfinite(values).all():
        return [v if np.isfinite(v) else None for v in values.tolist()]
    return values.tolist()


def _picture(pixels: NDArray[np.uint8], time: int, frame: str) -> dict[str, Any]:
    memory = io.BytesIO()
    Image.fromarray(pixels).save(memory, format="PNG", compress_level=1)
    return {
        "timestamp": {"sec": time // SECOND, "nsec": time % SECOND},
        "frame_id": frame,
        "data": base64.b64encode(memory.getvalue()).decode(),
        "format": "png",
    }


LAYOUT = Layout(begin=_begin, write=_write)
