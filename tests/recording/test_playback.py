"""Recorded actions in place of given ones."""

import numpy as np

from wbc_suite.recording import Dataset
from wbc_suite.wrappers import Playback


def test_an_environment_does_what_was_recorded(lift_recording, lift_env):
    with Dataset(lift_recording) as dataset:
        env = Playback(lift_env, dataset)
        played = []
        for _ in range(3):
            _, info = env.reset()
            played.append(info["playback"])
            if info["playback"] == "demo_1":
                over = False
                while not over:
                    *_, over, info = env.step(np.zeros(7))
                    assert info["playback_error"] == 0.0
    assert played == ["demo_0", "demo_1", "demo_0"]
