"""What users pass to environments is refused before anything changes."""

import copy
import hashlib
import pickle
import subprocess
import sys

import mujoco
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

import wbc_suite
from wbc_suite.errors import ActionError, ConfigError, PhysicsError, WbcError

CONTROLLERS = "WHOLE_BODY_IK", "WHOLE_BODY_MINK_IK"
ROBOTS = "Panda", "GR1", "Tiago", "SpotWithArm"
FULL = mujoco.mjtState.mjSTATE_INTEGRATION


@pytest.fixture(scope="module", params=CONTROLLERS)
def env(request):
    return wbc_suite.make("Lift", robots="Panda", controller_configs=request.param)


def state_of(env):
    """Return everything that a step could have changed, as a digest."""
    model, data = env.simulation.model, env.simulation.data
    state = np.empty(mujoco.mj_stateSize(model, FULL))
    mujoco.mj_getState(model, data, state, FULL)
    controller = env.controllers[0]
    parts = [state, controller.q, controller.hold_action]
    return hashlib.sha256(b"".join(p.tobytes() for p in parts)).hexdigest()


def flat(observation):
    return np.concatenate([observation[key] for key in sorted(observation)])


def episode(env, seed, *, steps=4, disturb=None):
    """Return observations of an episode, with bad actions in between if asked."""
    rng = np.random.default_rng(seed)
    rows = [flat(env.reset(seed=seed)[0])]
    for _ in range(steps):
        if disturb is not None:
            with pytest.raises(ActionError):
                env.step(disturb)
        noise = rng.uniform(-0.05, 0.05, env.action_layout.size)
        rows.append(flat(env.step(env.hold_action + noise)[0]))
    return np.array(rows)


ANYTHING = st.one_of(
    st.none(),
    st.text(max_size=5),
    st.binary(max_size=5),
    st.integers(),
    st.floats(),
    st.complex_numbers(),
    st.booleans(),
    st.dictionaries(st.text(max_size=2), st.floats(), max_size=2),
    st.lists(st.one_of(st.none(), st.text(max_size=2), st.just([1.0])), max_size=8),
    npst.arrays(
        st.sampled_from([np.float64, np.float32, np.complex128, np.bool_, object]),
        npst.array_shapes(min_dims=1, max_dims=3, min_side=0, max_side=3),
        fill=st.just(1),
    ),
)


@pytest.mark.slow
@settings(max_examples=30)
@given(bad=ANYTHING, place=st.integers(0, 6), value=st.sampled_from([np.nan, np.inf]))
def test_a_bad_action_changes_nothing(env, bad, place, value):
    before = state_of(env)
    not_finite = env.hold_action
    not_finite[place] = value
    for action in (bad, not_finite, not_finite.tolist(), [*env.hold_action, 0.0]):
        with pytest.raises(ActionError):
            env.step(action)
    assert state_of(env) == before


def test_episodes_go_on_as_if_bad_actions_had_not_been(env):
    clean = episode(env, 5)
    assert np.array_equal(episode(env, 5), clean)
    assert np.array_equal(episode(env, 5, disturb=np.full(7, np.nan)), clean)


@pytest.mark.parametrize("seed", ["a", -1, 1.5, [1], np.nan, True, {}])
def test_a_bad_seed_changes_nothing(env, seed):
    env.reset(seed=1)
    before, rng = state_of(env), str(env.np_random.bit_generator.state)
    with pytest.raises(ConfigError):
        env.reset(seed=seed)
    with pytest.raises(ConfigError):
        env.reset(seed=2, options={"pose": 1})
    assert state_of(env) == before
    assert str(env.np_random.bit_generator.state) == rng


@pytest.mark.slow
def test_copies_play_the_same_episodes(env):
    env.reset(seed=9)
    copies = copy.deepcopy(env), pickle.loads(pickle.dumps(env))
    unseeded = flat(env.reset()[0])
    for other in copies:
        assert np.array_equal(flat(other.reset()[0]), unseeded)
        assert np.array_equal(episode(other, 5), episode(env, 5))


PLAY = """
import sys
sys.path.insert(0, sys.argv[1])
import test_environments as t
env = t.wbc_suite.make("Lift", robots=sys.argv[2], controller_configs=sys.argv[3])
print(t.hashlib.sha256(t.episode(env, 5).tobytes()).hexdigest())
"""


@pytest.mark.sample(1)
@pytest.mark.slow
@pytest.mark.parametrize("controller", CONTROLLERS)
@pytest.mark.parametrize("robot", ROBOTS)
def test_two_processes_play_the_same_bits(robot, controller, request):
    here = str(request.path.parent)
    command = [sys.executable, "-c", PLAY, here, robot, controller]
    runs = {subprocess.check_output(command, text=True).strip() for _ in range(2)}
    assert len(runs) == 1


@pytest.mark.slow
@pytest.mark.parametrize("controller", CONTROLLERS)
@pytest.mark.parametrize("robot", ROBOTS)
def test_gymnasium_accepts_every_robot(robot, controller, recwarn):
    env = wbc_suite.make("Lift", robots=robot, controller_configs=controller)
    check_env(env, skip_render_check=True)
    assert [w for w in recwarn if "normalized space" not in str(w.message)] == []


FAULTS = {
    "speed": ("qvel", 0, 1e12),
    "speed not a number": ("qvel", -1, np.nan),
    "position": ("qpos", 8, 1e20),
    "position not a number": ("qpos", 0, np.nan),
    "position infinite": ("qpos", 0, np.inf),
    "push": ("xfrc_applied", 2, 1e30),
    "force infinite": ("qfrc_applied", 0, np.inf),
}


SLOW_FAULTS = ("position", "push")  # MuJoCo takes seconds for these states
PARAMETERS = [
    pytest.param(fault, marks=[pytest.mark.slow] if fault in SLOW_FAULTS else [])
    for fault in FAULTS
]


@pytest.mark.parametrize("fault", PARAMETERS)
def test_broken_physics_ends_the_episode_in_words(env, fault, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    field, index, value = FAULTS[fault]
    clean = episode(env, 3, steps=1)
    env.reset(seed=3)
    getattr(env.simulation.data, field)[index] = value
    observation, reward, terminated, _, info = env.step(env.hold_action)
    assert terminated
    assert reward == 0.0
    words = ("BADQ", "Not finite", f"Beyond 1e+10: {field}")
    assert any(w in info["physics_error"] for w in words)
    assert np.isfinite(flat(observation)).all()
    assert env.observation_space.contains(observation)
    with pytest.raises(PhysicsError, match="reset"):
        env.step(env.hold_action)
    assert np.array_equal(episode(env, 3, steps=1), clean)
    assert list(tmp_path.iterdir()) == []


KEYS = [
    *("robots", "controller_configs", "gripper_types", "base_types", "horizon"),
    *("initialization_noise", "control_freq", "reward_scale", "render_mode"),
    *("render_size", "robot", "use_object_obs"),
]
VALUES = [None, 3.5, -1, np.nan, "nonsense", [], [None], {"a": 1}, b"Panda", object()]
FINE = {
    "controller_configs": ["None", "[None]"],
    "gripper_types": ["None"],
    "base_types": ["None"],
    "horizon": ["None"],
    "control_freq": ["3.5"],
    "initialization_noise": ["None"],
    "reward_scale": ["3.5"],
    "render_mode": ["None"],
}


@pytest.mark.parametrize("key", KEYS)
def test_wrong_arguments_of_make_are_told_in_words(key):
    for value in VALUES:
        if repr(value) in FINE.get(key, ()):
            continue
        with pytest.raises(WbcError) as caught:
            wbc_suite.make("Lift", **{key: value})
        assert len(str(caught.value)) < 1500
