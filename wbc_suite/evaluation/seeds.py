"""Seeds of evaluation episodes."""

import hashlib
from pathlib import Path

BITS = 53  # of a seed, so that every reader of JSON keeps it


def episode_seed(base: int, benchmark: str, episode: int) -> int:
    """Return the seed of an episode; it depends on nothing else.

    So another benchmark, or more episodes, change no scene. `benchmark` is a name or a
    file, of which the stem counts; case is ignored.
    """
    name = Path(benchmark).stem.casefold()
    digest = hashlib.sha256(f"{base}/{name}/{episode}".encode()).digest()
    return int.from_bytes(digest[:8], "big") >> (64 - BITS)


def episode_seeds(benchmark: str, count: int, *, base: int = 0) -> list[int]:
    """Return the seeds of the first episodes of a benchmark."""
    return [episode_seed(base, benchmark, k) for k in range(count)]
