"""Why a frame is not at its goal: words that are sought when somebody asks."""

from collections.abc import Callable, Sequence
from functools import cache
from typing import overload

__all__ = ["Reasons"]


class Reasons(Sequence[str]):
    """Words that are sought when they are first read; copies are plain lists.

    Most steps of most programs are not asked why a frame is not at its goal.

    Args:
        tell: Returns the words, the same ones at any time.
    """

    def __init__(self, tell: Callable[[], Sequence[str]]) -> None:
        self._tell = cache(tell)

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
