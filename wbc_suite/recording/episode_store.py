"""A dataset that episodes are added to; a crash loses no finished episode.

Each finished episode is written atomically to a file of its own. Closing merges these
into one file, which replaces the old one. The only copy of an episode is never open for
writing.
"""

import fcntl
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import IO, Self

from wbc_suite.atomic_files import check_folder, delete_temporaries
from wbc_suite.errors import DatasetError
from wbc_suite.recording.dataset import Dataset, part_files, parts_folder
from wbc_suite.recording.episode import Episode, Fact
from wbc_suite.recording.hdf5_writer import uncompressed_bytes, write_dataset

ENOUGH = 20 << 20  # bytes that must be free when recording begins


class Store:
    """Adds episodes to a file; after `add` returns, the episode is on disk.

    `header` has the attributes of `data`; a file that exists must be of its `env_args`.

    Raises:
        DatasetError: If the folder cannot be written to, the disk is nearly full, the
            file is another environment's, or another process records into it.
    """

    def __init__(self, path: str | Path, header: Mapping[str, Fact]) -> None:
        self.path, self._header = Path(path), dict(header)
        self._parts = parts_folder(self.path)
        check_folder(self.path.parent, ENOUGH)
        check_folder(self._parts)
        self._lock = _lock(self._parts / "lock")
        try:
            self._take_over()
        except DatasetError:
            self._lock.close()
            raise

    def __len__(self) -> int:
        """Return the number of episodes, old ones included."""
        return self._closed + len(self._own)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *error: object) -> None:
        """Close the store; after an error, episodes stay beside the file."""
        if kind is None:
            self.close()
        else:
            self._lock.close()

    def add(self, episode: Episode) -> str:
        """Write an episode to disk; return its name. Those before it are safe."""
        name = f"demo_{self._next}"
        named = replace(episode, name=name)
        file = self._parts / f"episode_{self._next:09d}.hdf5"
        write_dataset(file, [named], self._header, needed=uncompressed_bytes(named))
        self._own.append(file)
        self._next += 1
        return name

    def undo(self) -> str | None:
        """Delete the last episode of this session; return its name, or None."""
        if not self._own:
            return None
        self._own.pop().unlink(missing_ok=True)
        self._next -= 1
        return f"demo_{self._next}"

    def close(self) -> None:
        """Merge all episodes into the file, and delete the files beside it.

        After an error, episodes stay beside the file, where `Dataset` reads them, and
        `repair` can merge them.
        """
        if self._lock.closed:
            return
        try:
            if part_files(self.path):
                self._consolidate()
            shutil.rmtree(self._parts, ignore_errors=True)
        finally:
            self._lock.close()

    def _take_over(self) -> None:
        """Count the episodes, and delete temporary files of a killed recording."""
        delete_temporaries(self._parts)
        self._own: list[Path] = []
        self._closed, self._next = 0, 0
        if not self.path.exists() and not part_files(self.path):
            return
        with Dataset(self.path) as dataset:
            theirs = str(dataset.header.get("env_args", ""))
            ours = str(self._header.get("env_args", ""))
            if theirs != ours:
                from wbc_suite.recording.env_source import differences

                raise DatasetError(
                    f"'{self.path}' has episodes of another environment: there and "
                    f"here {differences(theirs, ours)}. Choose another file."
                )
            self._closed = len(dataset)
            last = max((int(n.removeprefix("demo_")) for n in dataset.names), default=0)
            numbers = [int(file.stem[8:]) for file in part_files(self.path)]
            self._next = max([last, *numbers]) + 1 if len(dataset) else 0

    def _consolidate(self) -> None:
        files = [self.path, *part_files(self.path)]
        needed = sum(file.stat().st_size for file in files if file.exists())
        with Dataset(self.path, checked=True) as dataset:
            write_dataset(
                self.path,
                dataset.streamed(),
                {**self._header, **dataset.header},
                masks=dataset.masks,
                needed=needed,
            )


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Lock a file; raise DatasetError if another process records into it."""
    folder = parts_folder(path)
    check_folder(folder)
    with _lock(folder / "lock"):
        yield


def _lock(path: Path) -> IO[str]:
    """Lock a file; the system releases it when the process ends."""
    file = path.open("w")
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        file.close()
        raise DatasetError(f"Another process records into '{path.parent}'.") from error
    return file
