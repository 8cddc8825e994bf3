"""Why a frame is not at its goal: words that are sought when somebody asks."""

from collections.abc import Callable, Sequence
from typing import Generic, TypeVar, overload

__all__ = ["Once", "Reasons"]

Told = TypeVar("Told")


class Once(Generic[Told]):
    """Something that is found out when it is first asked for, and then known.

    `functools.cache` does that too, and takes 5 us to make for each step.

    Args:
        tell: Says it, the same at any time.
    """

    def __init__(self, tell: Callable[[], Told]) -> None:
        self._tell = tell

    def __call__(self) -> Told:
        """Return what is told."""
        if not hasattr(self, "_told"):
            self._told = self._tell()
        return self._told


class Reasons(Sequence[str]):
    """Words that are sought when they are first read; copies are plain lists.

    Most steps of most programs are not asked why a frame is not at its goal.

    Args:
        tell: Returns the words, the same ones at any time.
    """

    def __init__(self, tell: Callable[[], Sequence[str]]) -> None:
        self._tell = Once(tell)

    @overload
    def __getitem__(self, index: int) -> str: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[str]: ...
    def __getitem__(self, index: int | slice) -> str | Sequence[str]:
        return self._tell()[index]

    def __len__(self) -> int:
        return len(self._tell())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, list | Reasons) and list(self) == list(other)

    __hash__ = None  # type: ignore[assignment]  # as of lists

    def __repr__(self) -> str:
        return repr(list(self))

    def __reduce__(self) -> tuple[type[list[str]], tuple[list[str]]]:
        return list, (list(self),)
