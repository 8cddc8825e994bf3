"""Goals of sorting benchmarks, and how to put objects there."""

from conftest import put

from wbc_suite.benchmark.pick_place import GROCERIES, REST

BINS, PEGS = 0.8, 0.82
"""Heights of what things are put down on, m."""
RESTING = {
    "NutAssembly": dict.fromkeys(("SquareNut", "RoundNut"), PEGS + 0.01),
    "PickPlace": {name: BINS + REST[name] for name in GROCERIES},
}
"""Height of each thing's middle where it rests, m, by benchmark."""


def goals(env, names=None):
    """Return where each thing rests in its place, pressed in by 0.1 mm."""
    heights = RESTING[env.benchmark.name.removesuffix("Single")]
    names = heights if names is None else names
    return {n: (*env.benchmark.goal(n), heights[n] - 1e-4) for n in names}


def put_at(env, places):
    """Start an episode, put things at places, and return the benchmark."""
    env.reset(seed=0)
    return put(env, **{name: (at, None) for name, at in places.items()})
