"""Episodes of random numbers, for tests that need no robot."""

import numpy as np

from wbc_suite.recording import Episode

HEADER = {"env_args": '{"env_name": "Lift", "package": "wbc_suite"}'}


def make_episode(seed, length=5, **facts):
    """Return an episode of random numbers."""
    rng = np.random.default_rng(seed)
    columns = {
        "states": rng.normal(size=(length, 4)),
        "actions": rng.normal(size=(length, 2)),
        "rewards": rng.normal(size=length),
        "dones": (np.arange(length) == length - 1).astype(np.int64),
        "obs/cube_pos": rng.normal(size=(length, 3)),
    }
    facts = {"uid": str(seed), "success": bool(seed % 2), **facts}
    return Episode(
        name="", columns=columns, facts=facts, final_state=rng.normal(size=4)
    )
