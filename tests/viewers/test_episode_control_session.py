"""Episodes recorded from the teleoperation loop, by one button each."""

import numpy as np
import pytest

import wbc_suite
from wbc_suite.errors import DatasetError
from wbc_suite.recording import Dataset, rebuild
from wbc_suite.recording.episode_control import EpisodeCommand, EpisodeControl
from wbc_suite.recording.replaying import divergence
from wbc_suite.viewers.scene_setup import limb_colours
from wbc_suite.viewers.status_text import status_html
from wbc_suite.viewers.teleop_panel import _buttons
from wbc_suite.viewers.teleop_session import TeleopSession
from wbc_suite.wrappers import DataCollection


@pytest.fixture
def session(tmp_path):
    env = wbc_suite.make(
        "Lift", robots="Panda", controller_configs="WHOLE_BODY_IK", horizon=10_000
    )
    collection = DataCollection(env, tmp_path / "a.hdf5", automatic=False)
    episode_control = EpisodeControl(collection.recorder, seed=4)
    return TeleopSession(collection, period=0.05, episode_control=episode_control)


def ticks(session, count, *commands):
    for command in commands:
        session.episode_control.request(command)
    for _ in range(count):
        session.tick()
    return session.snapshot.recording


@pytest.mark.slow
def test_episodes_of_a_session_are_kept_discarded_taken_back_and_replay(
    session, tmp_path
):
    ticks(session, 2)
    assert _buttons(session.snapshot)[2:] == ("Record",)
    colours = limb_colours(session.limbs)
    assert "Record starts a new episode: the robot returns to its start" in status_html(
        session.snapshot, session.info, colours
    )
    status = ticks(session, 3, EpisodeCommand.RECORD)
    assert (status.recording, status.length) == (True, 3)
    assert _buttons(session.snapshot)[2:] == ("Keep", "Discard")
    text = status_html(session.snapshot, session.info, colours)
    assert "Recording episode 1: 3 actions" in text
    assert "The robot was returned to its start" in text
    hand = session.snapshot.limbs["right_hand"].target
    session.grab("right_hand", 1, hand)
    hand.translation += [0.0, 0.05, 0.05]
    session.drag("right_hand", 1, hand)
    session.pause(1, True)
    assert ticks(session, 5).length == 3
    session.pause(1, False)
    assert ticks(session, 6).length == 9
    assert (
        ticks(session, 1, EpisodeCommand.SUCCESS).message
        == "Kept as demo_0: 9 actions, success."
    )
    assert (
        ticks(session, 2, EpisodeCommand.RECORD, EpisodeCommand.DISCARD).message
        == "Discarded."
    )
    ticks(session, 2, EpisodeCommand.RECORD)
    session.reset()
    assert ticks(session, 1).message == "Discarded: the scene was reset."
    ticks(session, 2, EpisodeCommand.RECORD)
    assert ticks(session, 1, EpisodeCommand.RECORD).kept == 2
    assert ticks(session, 1, EpisodeCommand.UNDO).message == "Deleted demo_1."
    session.env.close()
    with Dataset(tmp_path / "a.hdf5") as dataset:
        episode = dataset.episode("demo_0")
        assert len(dataset) == 1
        assert (episode.facts["seed"], episode.success) == (4, True)
        assert np.ptp(episode.columns["actions"], axis=0).max() > 0.01
        assert divergence(rebuild(dataset), episode).exact


@pytest.mark.slow
def test_a_disk_that_is_full_is_said_and_the_session_goes_on(session, monkeypatch):
    ticks(session, 1, EpisodeCommand.RECORD)

    def no_room(*_, **__):
        raise DatasetError("The disk is full.")

    with monkeypatch.context() as patched:
        patched.setattr(session.env.recorder, "add", no_room)
        ticks(session, 1)
    assert session.snapshot.message == "The disk is full."
    tick = session.snapshot.tick
    ticks(session, 2)
    assert session.snapshot.tick == tick + 2
