"""The same seed and actions give the same bits, wherever and after whatever."""

import copy
import hashlib
import multiprocessing
import pickle

import numpy as np
import pytest

import wbc_suite
from wbc_suite.randomisation import Randomisation
from wbc_suite.sensing.noise import GaussianNoise

ARGUMENTS = {
    "robots": "Panda",
    "horizon": 10**6,
    "observables": {"cube_pos": {"noise": GaussianNoise(0.01), "delay": 0.03}},
    "randomisation": Randomisation(color=0.3, mass=0.05, friction=0.1, gains=0.03),
}


def run(env, steps, seed=11, *, between=lambda: None):
    """Return a digest of all states and observations of an episode."""
    observation, _ = env.reset(seed=seed)
    rng, digest = np.random.default_rng(seed), hashlib.sha256()
    low, high = env.action_space.low, env.action_space.high
    for _ in range(steps):
        between()
        observation, *_ = env.step(rng.uniform(low, high) * 0.3)
        digest.update(env.physics_state.tobytes())
        for key in sorted(observation):
            if not key.endswith("_image"):
                digest.update(observation[key].tobytes())
    return digest.hexdigest()


def run_anew(steps):
    return run(wbc_suite.make("Lift", **ARGUMENTS), steps)


@pytest.fixture(scope="module")
def env():
    return wbc_suite.make("Lift", **ARGUMENTS)


@pytest.mark.slow
def test_after_resets_copies_and_a_disturbed_global_generator(env):
    first = run(env, 40)
    for seed in range(100):
        env.reset(seed=seed)
    assert run(env, 40) == first

    def disturb():
        np.random.seed(1)  # noqa: NPY002 - what other code may do
        np.random.uniform()  # noqa: NPY002

    assert run(env, 40, between=disturb) == first
    for twin in (copy.deepcopy(env), pickle.loads(pickle.dumps(env))):
        assert run(twin, 40) == first
    assert run(env, 40, seed=12) != first


@pytest.mark.slow
def test_with_pictures_and_without():
    plain = wbc_suite.make("Lift", **ARGUMENTS)
    seeing = wbc_suite.make(
        "Lift", use_camera_obs=True, camera_heights=32, camera_widths=32, **ARGUMENTS
    )
    assert run(seeing, 15) == run(plain, 15)
    seeing.close()


@pytest.mark.slow
@pytest.mark.parametrize("method", ["spawn", "fork"])
def test_in_workers(env, method):
    with multiprocessing.get_context(method).Pool(1) as pool:
        assert pool.apply(run_anew, (40,)) == run(env, 40)


SCENES = (
    *("Stack", "PickPlaceSingle", "NutAssembly", "Door", "Wipe", "ToolHang"),
    *("TwoArmLift", "TwoArmPegInHole", "TwoArmHandover", "TwoArmTransport"),
)


def run_each(steps):
    """Return the digest of each benchmark's episode, of its own robots."""
    return [run(wbc_suite.make(name), steps) for name in SCENES]


@pytest.mark.slow
def test_every_scene_in_workers():
    found = run_each(10)
    assert len(set(found)) == len(SCENES)
    for method in ("spawn", "fork"):
        with multiprocessing.get_context(method).Pool(1) as pool:
            there = pool.apply(run_each, (10,))
        wrong = [n for n, a, b in zip(SCENES, found, there, strict=True) if a != b]
        assert not wrong, method


@pytest.mark.slow
def test_over_500_steps():
    assert run_anew(500) == run_anew(500)
