"""Episodes that follow each other by themselves while a person drives."""

import pytest

from wbc_suite.errors import DatasetError
from wbc_suite.recording.episode_control import (
    SUCCESS_STEPS,
    EpisodeCommand,
    EpisodeControl,
    RecordingPlan,
)


class Notebook:
    """A recorder that writes nothing down but names."""

    def __init__(self, before=0):
        self.names: list[str] = [f"old_{k}" for k in range(before)]
        self.recording, self.succeeded, self.length = False, False, 0
        self.full = False

    @property
    def kept(self):
        return len(self.names)

    def begin(self):
        self.recording, self.succeeded, self.length = True, False, 0

    def keep(self, success=None):
        if self.full:
            raise DatasetError("The disk is full.")
        solved = self.succeeded if success is None else success
        self.names.append(f"demo_{len(self.names)}{'+' if solved else ''}")
        self.recording = False
        return self.names[-1]

    def discard(self):
        self.recording = False

    def undo(self):
        return self.names.pop() if self.names else None


class Person:
    """Wishes between actions that a benchmark judges."""

    def __init__(self, before=0, **plan):
        self.messages, self.seeds = [], []
        self.notebook = Notebook(before)
        self.episode_control = EpisodeControl(
            self.notebook,
            seed=7,
            plan=RecordingPlan(**({"episodes": 3} | plan)),
            report=self.messages.append,
        )

    def acts(self, count, *commands, solved=False):
        self.episode_control.press_buttons({command.value for command in commands})
        for _ in range(count):
            self.episode_control.update(self.seeds.append)
            self.notebook.succeeded = solved
            self.notebook.length += 1
        return self


def test_what_is_solved_is_kept_and_the_next_episode_begins():
    person = Person(before=2)
    person.acts(20).acts(SUCCESS_STEPS + 2, solved=True)
    assert person.notebook.names[2:] == ["demo_2+"]
    assert person.notebook.recording
    assert person.seeds == [7, 8]
    assert person.messages[-2:] == [
        f"Kept as demo_2+: {20 + SUCCESS_STEPS} actions, success (1 of 3).",
        "Recording 2 of 3, seed 8.",
    ]
    assert not person.episode_control.finished
    person.acts(2 * SUCCESS_STEPS + 4, solved=True)
    assert person.episode_control.finished
    assert not person.notebook.recording
    assert len(person.notebook.names) == 5


def test_a_success_that_does_not_last_is_not_kept():
    person = Person()
    for _ in range(5):
        person.acts(SUCCESS_STEPS - 2, solved=True).acts(2)
    assert person.notebook.names == []


def test_one_key_keeps_discards_and_takes_back():
    person = Person().acts(5).acts(1, EpisodeCommand.RECORD)
    assert person.notebook.names == ["demo_0"]
    assert person.seeds == [7, 8]
    person.acts(5).acts(1, EpisodeCommand.DISCARD)
    assert person.notebook.names == ["demo_0"]
    assert person.seeds == [7, 8, 9]
    person.acts(5).acts(1, EpisodeCommand.UNDO)  # the present episode goes on
    assert (person.notebook.names, person.seeds) == ([], [7, 8, 9])
    person.acts(5).acts(1, EpisodeCommand.SUCCESS)
    assert person.notebook.names == ["demo_0+"]


def test_an_episode_that_takes_too_long_ends():
    person = Person(horizon=30).acts(33)
    assert person.notebook.names == ["demo_0"]
    assert "no success" in " ".join(person.messages)
    picky = Person(horizon=30, only_success=True).acts(100)
    assert picky.notebook.names == []
    assert picky.messages.count("Discarded: no success in 30 actions.") == 3


def test_a_full_disk_is_said_and_the_episode_goes_on():
    person = Person()
    person.notebook.full = True
    person.acts(30, solved=True)
    assert "The disk is full." in person.messages
    assert person.notebook.recording
    person.notebook.full = False
    person.acts(SUCCESS_STEPS + 1, solved=True)
    assert person.notebook.names[0] == "demo_0+"


@pytest.mark.parametrize("command", list(EpisodeCommand))
def test_each_command_has_a_button(command):
    person = Person().acts(3).acts(1, command)
    assert person.messages
