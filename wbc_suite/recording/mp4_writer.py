"""Pictures written as an H.264 video."""

from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wbc_suite.recording.extras import import_extra


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
        self._file = self._av.open(str(path), "w")
        self._rate = Fraction(rate).limit_denominator(1001)  # as of 30000/1001 Hz
        self._options = options or {}
        self._stream, self._count = None, 0

    def add(self, picture: NDArray[np.uint8]) -> None:
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
