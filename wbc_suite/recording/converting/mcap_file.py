"""Write MCAP files, the log format that Foxglove, rerun and ROS tools read.

The part of the format that logs of JSON need, with an index by time: header, schemas,
channels, messages in chunks, statistics. Chunks are not compressed.

Source: the MCAP specification, version 0 (https://mcap.dev/spec).
"""

import struct
import zlib
from collections.abc import Mapping
from typing import IO, Self

__all__ = ["McapFile"]

MAGIC = b"\x89MCAP0\r\n"
CHUNK_BYTES = 1 << 20
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK = 1, 2, 3, 4, 5, 6
MESSAGE_INDEX, CHUNK_INDEX, STATISTICS, METADATA = 7, 8, 11, 12
METADATA_INDEX, DATA_END = 13, 15


class McapFile:
    """Appends messages to a stream; `finish` writes what makes it a file.

    Args:
        stream: Where bytes go, from its beginning.
        library: Who writes.
    """

    def __init__(self, stream: IO[bytes], library: str) -> None:
        self._stream, self._at = stream, 0
        self._declared = b""  # schemas and channels, repeated at the end
        self._schemas: dict[str, int] = {}
        self._counts: dict[int, int] = {}
        self._times: list[int] = []  # first and last of all messages
        self._indices: list[bytes] = []
        self._metadata = 0
        self._empty_chunk()
        self._put(MAGIC + _record(HEADER, _text("") + _text(library)))

    def __enter__(self) -> Self:
        """Return the writer."""
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        """Finish the file, unless there is an error already."""
        if kind is None:
            self.finish()

    def channel(
        self, topic: str, schema: str, definition: bytes, facts: Mapping[str, str]
    ) -> int:
        """Add a channel of JSON messages; its number is returned.

        Args:
            topic: Its name.
            schema: Name of the kind of message.
            definition: JSON Schema of it; the first one of a name counts.
            facts: Told of the channel as a whole.
        """
        if schema not in self._schemas:
            number = self._schemas[schema] = len(self._schemas) + 1
            content = struct.pack("<H", number) + _text(schema) + _text("jsonschema")
            self._declare(_record(SCHEMA, content + _bytes(definition)))
        number = len(self._counts) + 1
        self._counts[number] = 0
        content = struct.pack("<HH", number, self._schemas[schema])
        content += _text(topic) + _text("json") + _table(facts)
        self._declare(_record(CHANNEL, content))
        return number

    def message(self, channel: int, time: int, content: bytes) -> None:
        """Add a message at a time in ns."""
        held = self._messages.setdefault(channel, [])
        held.append((time, len(self._chunk)))
        count = self._counts[channel]
        head = struct.pack("<HIQQ", channel, count, time, time)
        self._chunk += _record(MESSAGE, head + content)
        self._counts[channel] += 1
        span = [*self._span, time]
        self._span = [min(span), max(span)]
        if len(self._chunk) >= CHUNK_BYTES:
            self._end_chunk()

    def metadata(self, name: str, facts: Mapping[str, str]) -> None:
        """Add facts about the whole log."""
        self._end_chunk()
        record = _record(METADATA, _text(name) + _table(facts))
        index = struct.pack("<QQ", self._at, len(record)) + _text(name)
        self._indices.append(_record(METADATA_INDEX, index))
        self._metadata += 1
        self._put(record)

    def finish(self) -> None:
        """Write the rest of the file."""
        self._end_chunk()
        self._put(_record(DATA_END, struct.pack("<I", 0)))
        start = self._at
        chunks = sum(record[0] == CHUNK_INDEX for record in self._indices)
        first, last = self._times or (0, 0)
        told = struct.pack(
            "<QHIIIIQQ", sum(self._counts.values()), len(self._schemas),
            len(self._counts), 0, self._metadata, chunks, first, last,
        )  # fmt: skip
        counts = b"".join(struct.pack("<HQ", *item) for item in self._counts.items())
        summary = self._declared + _record(STATISTICS, told + _bytes(counts))
        summary += b"".join(self._indices)
        footer = struct.pack("<BQQQ", FOOTER, 20, start, 0)
        crc = zlib.crc32(summary + footer)
        self._put(summary + footer + struct.pack("<I", crc) + MAGIC)

    def _declare(self, record: bytes) -> None:
        self._declared += record
        self._chunk += record

    def _empty_chunk(self) -> None:
        self._chunk = bytearray()
        self._messages: dict[int, list[tuple[int, int]]] = {}
        self._span: list[int] = []

    def _end_chunk(self) -> None:
        """Write what has come together, and where each channel's messages are."""
        if not self._messages:
            return
        start, size = self._at, len(self._chunk)
        span = struct.pack("<QQ", *self._span)
        content = span + struct.pack("<QI", size, zlib.crc32(self._chunk)) + _text("")
        content += struct.pack("<Q", size) + self._chunk
        self._put(_record(CHUNK, content))
        length, places = self._at - start, b""
        for channel, held in self._messages.items():
            places += struct.pack("<HQ", channel, self._at)
            entries = b"".join(struct.pack("<QQ", *entry) for entry in held)
            index = struct.pack("<H", channel) + _bytes(entries)
            self._put(_record(MESSAGE_INDEX, index))
        index = span + struct.pack("<QQ", start, length) + _bytes(places)
        index += struct.pack("<Q", self._at - start - length) + _text("")
        index += struct.pack("<QQ", size, size)
        self._indices.append(_record(CHUNK_INDEX, index))
        self._times = [min([*self._times, *self._span]), max(self._times + self._span)]
        self._empty_chunk()

    def _put(self, content: bytes) -> None:
        self._stream.write(content)
        self._at += len(content)


def _record(kind: int, content: bytes) -> bytes:
    return struct.pack("<BQ", kind, len(content)) + content


def _bytes(content: bytes) -> bytes:
    return struct.pack("<I", len(content)) + content


def _text(text: str) -> bytes:
    return _bytes(text.encode())


def _table(facts: Mapping[str, str]) -> bytes:
    return _bytes(b"".join(_text(k) + _text(v) for k, v in facts.items()))
