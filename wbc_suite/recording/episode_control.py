"""Commands of an operator to a recording: begin, keep, discard and undo episodes."""

import threading
from collections.abc import Callable, Collection
from dataclasses import dataclass
from enum import StrEnum

from wbc_suite.errors import DatasetError
from wbc_suite.recording.recorder import Recorder

SUCCESS_STEPS = 10  # successive ones after which an episode of a plan is kept


class EpisodeCommand(StrEnum):
    """A command, sent by one key or button."""

    RECORD = "keep"  # begin an episode, or keep the one in progress
    SUCCESS = "success"  # keep it as a success, whatever the benchmark reports
    DISCARD = "discard"  # discard it
    UNDO = "undo"  # delete the episode that was kept last


@dataclass(frozen=True, kw_only=True, slots=True)
class RecordingPlan:
    """Episodes that begin by themselves until a number of them is kept.

    A solved episode is kept and the next one begins. `horizon` is the maximum number of
    actions in an episode; with `only_success`, those that are not solved are discarded.
    Commands remain possible.
    """

    episodes: int
    horizon: int | None = None
    only_success: bool = False


@dataclass(frozen=True, kw_only=True, slots=True)
class EpisodeStatus:
    """State of the recording; `kept` counts the episodes in the file."""

    recording: bool
    length: int
    kept: int
    message: str


class EpisodeControl:
    """Takes commands from any thread, and applies them in the loop's thread.

    The recorder's wrapper is not automatic. The first episode has the given seed, each
    further one the next. Without a plan, episodes begin and end by commands only. In
    the loop's thread, `report` is called with each new message.
    """

    def __init__(
        self,
        recorder: Recorder,
        *,
        seed: int = 0,
        plan: RecordingPlan | None = None,
        report: Callable[[str], None] | None = None,
    ) -> None:
        self._recorder, self._seed, self._plan = recorder, seed, plan
        self._report, self._kept_before = report, recorder.kept
        self._length = self._success_steps = 0
        self._lock = threading.Lock()
        self._commands: list[EpisodeCommand] = []
        self._message, self._was_recording = "", False

    @property
    def status(self) -> EpisodeStatus:
        """State of the recording; the loop's thread only."""
        return EpisodeStatus(
            recording=self._recorder.recording,
            length=self._recorder.length,
            kept=self._recorder.kept,
            message=self._message,
        )

    def request(self, command: EpisodeCommand) -> None:
        """Send a command; any thread."""
        with self._lock:
            self._commands.append(command)

    def press_buttons(self, buttons: Collection[str]) -> None:
        """Send the commands of a device's buttons."""
        for command in EpisodeCommand:
            if command in buttons:
                self.request(command)

    @property
    def finished(self) -> bool:
        """Whether all episodes of the plan are kept."""
        return self._plan is not None and self._planned_kept >= self._plan.episodes

    @property
    def _planned_kept(self) -> int:
        return self._recorder.kept - self._kept_before

    def update(self, reset: Callable[[int], None]) -> None:
        """Apply the commands between two steps; `reset` is called with a seed."""
        with self._lock:
            commands, self._commands = self._commands, []
        if self._was_recording and not self._recorder.recording:
            self._was_recording = False
            self._set_message("Discarded: the scene was reset.")
        for command in commands:
            self._try(lambda command=command: self._apply(command, reset))
        if self._plan is not None:
            self._follow_plan(self._plan, reset)

    def _try(self, action: Callable[[], str]) -> None:
        try:
            self._set_message(action())
        except DatasetError as error:
            self._set_message(str(error))
        self._was_recording = self._recorder.recording

    def _set_message(self, message: str) -> None:
        if self._report is not None and message != self._message:
            self._report(message)
        self._message = message

    def _follow_plan(self, plan: RecordingPlan, reset: Callable[[int], None]) -> None:
        """Keep a solved episode, end one at the horizon, begin the next."""
        recorder = self._recorder
        if recorder.recording and recorder.length != self._length:
            self._length = recorder.length
            self._success_steps = self._success_steps + 1 if recorder.succeeded else 0
            if self._success_steps >= SUCCESS_STEPS:
                self._success_steps = 0
                self._try(lambda: self._keep(success=True))
            elif plan.horizon is not None and recorder.length >= plan.horizon:
                self._try(lambda: self._keep(success=None))
        if not recorder.recording and not self.finished:
            self._try(lambda: self._begin(reset))

    def _apply(self, command: EpisodeCommand, reset: Callable[[int], None]) -> str:
        recorder, planned = self._recorder, self._plan is not None
        if command is EpisodeCommand.UNDO and (planned or not recorder.recording):
            name = recorder.undo()
            return f"Deleted {name}." if name else "There is nothing to undo."
        if not recorder.recording:
            if command is EpisodeCommand.RECORD:
                return self._begin(reset)
            return "Nothing is being recorded."
        if command is EpisodeCommand.UNDO:
            return "Keep or discard this episode first."
        if command is EpisodeCommand.DISCARD:
            recorder.discard()
            return "Discarded."
        return self._keep(success=True if command is EpisodeCommand.SUCCESS else None)

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
        plan, count = self._plan, self._planned_kept
        progress = "" if plan is None else f" ({count} of {plan.episodes})"
        return f"Kept as {name}: {length} actions, {result}{progress}."

    def _begin(self, reset: Callable[[int], None]) -> str:
        seed, self._seed = self._seed, self._seed + 1
        reset(seed)
        self._recorder.begin()
        self._length = self._success_steps = 0
        if self._plan is None:
            return "Recording: the robot was returned to its start."
        return (
            f"Recording {self._planned_kept + 1} of {self._plan.episodes}, seed {seed}."
        )
