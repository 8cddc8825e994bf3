import threading

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from numpy.testing import assert_array_equal, assert_equal

from wbc_suite.envs import RobotEnv, VectorRobotEnv
from wbc_suite.errors import ActionError, ConfigError, PhysicsError

ARGUMENTS = {
    "robots": "Panda",
    "controller_configs": "WHOLE_BODY_IK",
    "reward_shaping": True,
    "horizon": 4,
}
MODES = [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP]


def make(num_envs=3, **arguments):
    return gymnasium.make_vec(
        "wbc_suite/Lift-v1",
        num_envs=num_envs,
        vectorization_mode="vector_entry_point",
        **{**ARGUMENTS, **arguments},
    )


@pytest.fixture(scope="module")
def envs():
    made = make()
    yield made
    made.close()


def actions_of(envs, rng):
    holds = np.stack(envs.get_attr("hold_action"))
    return holds + 0.02 * rng.normal(size=holds.shape)


def states_of(env):
    data = env.simulation.data
    return np.concatenate([[data.time], data.qpos, data.qvel, data.act, data.ctrl])


def listed(info):
    """Lists in place of arrays, which NumPy cannot compare when they hold dicts."""
    if isinstance(info, dict):
        return {key: listed(value) for key, value in info.items()}
    return info.tolist() if isinstance(info, np.ndarray) else info


@pytest.mark.slow
def test_gymnasium_makes_ours_and_knows_how_it_resets(envs):
    assert isinstance(envs, VectorRobotEnv)
    assert envs.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    assert envs.spec.id == "wbc_suite/Lift-v1"
    observations, _ = envs.reset(seed=0)
    assert observations in envs.observation_space
    assert envs.action_space.sample().shape == (3, envs.single_action_space.shape[0])
    assert isinstance(gymnasium.make_vec("wbc_suite/Lift-v1"), VectorRobotEnv)


@pytest.mark.slow
@pytest.mark.parametrize("controller", ["BASIC", "WHOLE_BODY_IK"])
@pytest.mark.parametrize("threads", [1, 2, 5])
def test_each_environment_does_what_it_does_alone(threads, controller):
    arguments = {**ARGUMENTS, "horizon": 100, "controller_configs": controller}
    envs = VectorRobotEnv(3, threads=threads, **arguments)
    alone = [RobotEnv("Lift", **arguments) for _ in range(3)]
    observations, _ = envs.reset(seed=[5, 6, 7])
    for seed, env in zip((5, 6, 7), alone, strict=True):
        env.reset(seed=seed)
    rng = np.random.default_rng(0)
    for _ in range(8):
        actions = actions_of(envs, rng)
        observations, rewards, *_ = envs.step(actions)
        for i, env in enumerate(alone):
            expected, reward, *_ = env.step(actions[i])
            assert_array_equal(states_of(envs.envs[i]), states_of(env))
            assert rewards[i] == reward
            for key, values in expected.items():
                assert_array_equal(observations[key][i], values)
    envs.close()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("more", "expected"),
    [
        ({"controller_configs": "BASIC"}, 2),
        ({"controller_configs": "WHOLE_BODY_IK"}, 2),
        ({"controller_configs": "WHOLE_BODY_MINK_IK"}, 1),
        ({"controller_configs": "BASIC", "compiled": False}, 1),
        ({"controller_configs": "WHOLE_BODY_MINK_IK", "threads": 2}, 2),
    ],
    ids=["laws", "whole body", "mink", "plain", "mink, but told to"],
)
def test_threads_share_what_holds_no_lock_unless_told_otherwise(
    monkeypatch, more, expected
):
    monkeypatch.setattr("wbc_suite.envs.vector._processors", lambda: 2)
    envs = make(2, **more)
    envs.reset(seed=0)
    hold = np.stack(envs.get_attr("hold_action"))
    envs.step(hold)
    met, here = threading.Barrier(expected), set()
    for env in envs.envs:
        monkeypatch.setattr(env, "advance", noting(env.advance, met, here))
    envs.step(hold)
    assert len(here) == expected
    envs.close()


def noting(advance, met, here):
    def noted(action):
        met.wait(timeout=10.0)
        here.add(threading.get_ident())
        return advance(action)

    return noted


@pytest.mark.slow
@pytest.mark.parametrize("mode", MODES, ids=lambda mode: mode.value)
def test_episodes_follow_each_other_as_in_gymnasiums_own_vectors(mode):
    ours = make(2, autoreset_mode=mode)
    theirs = SyncVectorEnv(
        [lambda: RobotEnv("Lift", **ARGUMENTS)] * 2, True, "same", mode
    )
    assert_equal(ours.reset(seed=3)[0], theirs.reset(seed=3)[0])
    # The second begins its episode later, so that they end apart.
    holds = np.stack(ours.get_attr("hold_action"))
    for envs in (ours, theirs):
        envs.step(holds)
        mask = {"reset_mask": np.array([False, True])}
        envs.reset(seed=[None, 9], options=mask)
    ends = 0
    for _ in range(10):
        actions = np.stack(ours.get_attr("hold_action"))
        got, expected = ours.step(actions), theirs.step(actions)
        assert_equal(got[:4], expected[:4])
        assert_equal(listed(got[4]), listed(expected[4]))
        ends += int(got[3].sum())
    assert ends == 4
    ours.close()
    theirs.close()


@pytest.mark.slow
def test_a_disabled_autoreset_leaves_resets_to_the_caller():
    envs = make(2, autoreset_mode="Disabled", horizon=1)
    envs.reset(seed=0)
    holds = np.stack(envs.get_attr("hold_action"))
    for _ in range(2):
        *_, truncated, _ = envs.step(holds)
        assert truncated.all()
    mask = np.array([True, False])
    times = [env.simulation.data.time for env in envs.envs]
    envs.reset(options={"reset_mask": mask})
    assert envs.envs[0].simulation.data.time < times[0]
    assert envs.envs[1].simulation.data.time == times[1]


@pytest.mark.slow
def test_infos_are_arrays_with_masks(envs):
    envs.reset(seed=0)
    actions = np.stack(envs.get_attr("hold_action"))
    actions[1, 0] = 1e6
    *_, info = envs.step(actions)
    assert_array_equal(info["clipped"], [0, 1, 0])
    assert_array_equal(info["_clipped"], [True, True, True])
    assert info["success"].dtype == np.bool_
    assert info["ik"]["reached"].shape == (3,)


def test_a_wrong_action_names_its_environment_and_moves_none(envs):
    envs.reset(seed=0)
    actions = np.stack(envs.get_attr("hold_action"))
    before = [states_of(env) for env in envs.envs]
    actions[1, 2] = np.nan
    with pytest.raises(ActionError, match=r"Environment 1: .*right_hand: z"):
        envs.step(actions)
    with pytest.raises(ActionError, match="one row per environment"):
        envs.step(actions[0])
    assert_array_equal([states_of(env) for env in envs.envs], before)


def test_physics_that_fails_in_one_leaves_the_others_alone(envs):
    envs.reset(seed=0)
    actions = np.stack(envs.get_attr("hold_action"))
    envs.envs[2].simulation.data.qvel[3] = 1e12
    _, _, terminated, _, info = envs.step(actions)
    assert_array_equal(terminated, [False, False, True])
    assert_array_equal(info["_physics_error"], [False, False, True])
    assert "BADQVEL" in info["physics_error"][2]
    *_, terminated, _, info = envs.step(actions)
    assert not terminated.any()
    assert "physics_error" not in info


@pytest.mark.slow
def test_an_error_names_its_environment_when_all_others_are_done():
    envs = make(3, autoreset_mode="Disabled", horizon=100)
    envs.reset(seed=0)
    actions = np.stack(envs.get_attr("hold_action"))
    envs.envs[1].simulation.data.qvel[3] = 1e12
    envs.step(actions)
    with pytest.raises(PhysicsError, match="Environment 1: Call reset"):
        envs.step(actions)
    assert envs.envs[2].simulation.data.time == pytest.approx(0.1)


def test_attributes_are_got_set_and_called_for_each(envs):
    envs.reset(seed=4)
    assert envs.np_random_seed == (4, 5, 6)
    assert len(envs.np_random) == 3
    envs.set_attr("mark", [1, 2, 3])
    assert envs.get_attr("mark") == envs.call("mark") == (1, 2, 3)
    envs.set_attr("mark", 7)
    assert envs.get_attr("mark") == (7, 7, 7)
    (first, *_) = envs.call("get_wrapper_attr", "action_layout")
    assert first is envs.envs[0].action_layout
    with pytest.raises(ConfigError, match="2 values for 3"):
        envs.set_attr("mark", [1, 2])


def test_observations_are_the_callers_own(envs):
    first, _ = envs.reset(seed=0)
    kept = {key: values.copy() for key, values in first.items()}
    envs.step(np.stack(envs.get_attr("hold_action")))
    assert_equal(first, kept)


@pytest.mark.slow
def test_pictures_come_from_each():
    envs = make(2, render_mode="rgb_array", render_size=(32, 24))
    envs.reset(seed=0)
    pictures = envs.render()
    assert [picture.shape for picture in pictures] == [(24, 32, 3)] * 2
    envs.close()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"num_envs": 0}, "num_envs is a whole number"),
        ({"threads": 0}, "threads is a whole number"),
        ({"autoreset_mode": "never"}, "NextStep, SameStep, Disabled"),
        ({"robot": "Panda"}, "Did you mean 'robots'"),
    ],
)
def test_wrong_arguments_say_what_is_legal(arguments, message):
    with pytest.raises(ConfigError, match=message):
        make(**arguments)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"seed": [1, 2]}, "2 seeds for 3"),
        ({"seed": -1}, "seed is a whole number"),
        ({"seed": [1, 2.5, 3]}, "seed is a whole number"),
        ({"options": {"mask": [True]}}, "the one option is 'reset_mask'"),
        ({"options": {"reset_mask": np.ones(2, bool)}}, "array of 3"),
    ],
)
def test_a_wrong_reset_changes_nothing(envs, arguments, message):
    envs.reset(seed=0)
    before = [states_of(env) for env in envs.envs]
    with pytest.raises(ConfigError, match=message):
        envs.reset(**arguments)
    assert_array_equal([states_of(env) for env in envs.envs], before)


@pytest.mark.slow
def test_closing_ends_the_threads_and_can_be_said_twice():
    before = set(threading.enumerate())  # others' may end meanwhile
    envs = make(3, threads=3)
    envs.reset(seed=0)
    began = set(threading.enumerate()) - before
    assert began
    envs.close()
    envs.close()
    assert not any(thread.is_alive() for thread in began)
