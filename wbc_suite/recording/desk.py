"""What a person says of episodes while they drive: begin, keep, discard, undo."""

import threading
from collections.abc import Callable, Collection
from dataclasses import dataclass
from enum import StrEnum

from wbc_suite.errors import DatasetError
from wbc_suite.recording.recorder import Recorder

__all__ = ["DeskStatus", "RecordingDesk", "RecordingPlan", "Wish"]

HELD = 10
"""Actions; so long a benchmark must count as solved before its episode is kept."""


class Wish(StrEnum):
    """What a person asks for, by one key or button."""

    RECORD = "keep"
    """Begin an episode, or keep the one in progress."""
    SUCCESS = "success"
    """Keep the episode in progress as a success, whatever the benchmark says."""
    DISCARD = "discard"
    """Forget the episode in progress."""
    UNDO = "undo"
    """Forget the episode that was kept last."""


@dataclass(frozen=True, kw_only=True, slots=True)
class RecordingPlan:
    """Episodes that follow each other by themselves, until there are enough.

    An episode begins at once; solved, it is kept and the next one begins. Wishes go on
    to be heard: one may keep earlier, discard, or take the last one back.

    Attributes:
        episodes: How many to keep.
        horizon: Actions in an episode at most; None for as many as it takes.
        only_success: Whether episodes that are not solved are discarded.
    """

    episodes: int
    horizon: int | None = None
    only_success: bool = False


@dataclass(frozen=True, kw_only=True, slots=True)
class DeskStatus:
    """How the recording stands.

    Attributes:
        recording: Whether an episode is in progress.
        length: Its actions.
        kept: Episodes in the file.
        said: What became of the last wish, in words.
    """

    recording: bool
    length: int
    kept: int
    said: str


class RecordingDesk:
    """Carries wishes from any thread to the loop that steps the environment.

    Args:
        recorder: Records that environment; its wrapper must not be automatic.
        seed: Of the first episode; each attempt has the next one.
        plan: Whether episodes follow each other by themselves; None if a person begins
            and ends each.
        tell: Is told each thing that happens, in words, by the loop's thread.
    """

    def __init__(
        self,
        recorder: Recorder,
        *,
        seed: int = 0,
        plan: RecordingPlan | None = None,
        tell: Callable[[str], None] | None = None,
    ) -> None:
        self._recorder, self._seed, self._plan = recorder, seed, plan
        self._tell, self._before = tell, 0
        self._length = self._solved = 0
        if plan is not None:
            recorder.open()
            self._before = recorder.kept
        self._lock = threading.Lock()
        self._wishes: list[Wish] = []
        self._said, self._began = "", False

    @property
    def status(self) -> DeskStatus:
        """How the recording stands; the loop's thread only."""
        recorder = self._recorder
        return DeskStatus(
            recording=recorder.recording,
            length=recorder.length,
            kept=recorder.kept,
            said=self._said,
        )

    def ask(self, wish: Wish) -> None:
        """Ask for something; any thread."""
        with self._lock:
            self._wishes.append(wish)

    def press(self, buttons: Collection[str]) -> None:
        """Ask for what buttons of a device stand for."""
        for wish in Wish:
            if wish in buttons:
                self.ask(wish)

    @property
    def finished(self) -> bool:
        """Whether all episodes of the plan are kept."""
        return self._plan is not None and self._done >= self._plan.episodes

    @property
    def _done(self) -> int:
        return self._recorder.kept - self._before

    def serve(self, reset: Callable[[int], None]) -> None:
        """Do what was asked for, between two steps.

        Args:
            reset: Resets the environment with a seed.
        """
        with self._lock:
            wishes, self._wishes = self._wishes, []
        if self._began and not self._recorder.recording:
            self._began = False
            self._say("Discarded: started again.")
        for wish in wishes:
            self._try(lambda wish=wish: self._do(wish, reset))
        if self._plan is not None:
            self._go_on(self._plan, reset)

    def _try(self, act: Callable[[], str]) -> None:
        try:
            self._say(act())
        except DatasetError as error:
            self._say(str(error))
        self._began = self._recorder.recording

    def _say(self, words: str) -> None:
        if self._tell is not None and words != self._said:
            self._tell(words)
        self._said = words

    def _go_on(self, plan: RecordingPlan, reset: Callable[[int], None]) -> None:
        """Keep what is solved, end what takes too long, begin what is next."""
        recorder = self._recorder
        if recorder.recording and recorder.length != self._length:
            self._length = recorder.length
            self._solved = self._solved + 1 if recorder.succeeded else 0
            if self._solved >= HELD:
                self._solved = 0
                self._try(lambda: self._keep(success=True))
            elif plan.horizon is not None and recorder.length >= plan.horizon:
                self._try(lambda: self._keep(success=None))
        if not recorder.recording and not self.finished:
            self._try(lambda: self._begin(reset))

    def _do(self, wish: Wish, reset: Callable[[int], None]) -> str:
        recorder = self._recorder
        if wish is Wish.UNDO and (self._plan is not None or not recorder.recording):
            name = recorder.undo()
            return f"Took {name} back." if name else "There is nothing to take back."
        if not recorder.recording:
            if wish is Wish.RECORD:
                return self._begin(reset)
            return "Nothing is being recorded."
        if wish in (Wish.RECORD, Wish.SUCCESS):
            return self._keep(success=True if wish is Wish.SUCCESS else None)
        if wish is Wish.DISCARD:
            recorder.discard()
            return "Discarded."
        return "Keep or discard this episode first."

    def _keep(self, *, success: bool | None) -> str:
        recorder, length = self._recorder, self._recorder.length
        solved = recorder.succeeded if success is None else success
        result = "success" if solved else "no success"
        if self._plan is not None and self._plan.only_success and not solved:
            recorder.discard()
            return f"Discarded: {result} in {length} actions."
        name = recorder.keep(success=success)
        if name is None:
            return "Nothing to keep yet."
        count = (
            "" if self._plan is None else f" ({self._done} of {self._plan.episodes})"
        )
        return f"Kept as {name}: {length} actions, {result}{count}."

    def _begin(self, reset: Callable[[int], None]) -> str:
        self._recorder.open()
        seed, self._seed = self._seed, self._seed + 1
        reset(seed)
        self._recorder.begin()
        self._length = self._solved = 0
        if self._plan is None:
            return "Recording."
        return f"Recording {self._done + 1} of {self._plan.episodes}, seed {seed}."
