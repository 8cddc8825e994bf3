"""LeRobot's loader and evaluation find what they ask for.

What they ask for is written in LeRobot 0.6.1: `envs/factory.py`, `envs/utils.py`, and
`scripts/lerobot_eval.py`, from which `rollout` below is abridged.
"""

import importlib.util
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, VectorEnv

from wbc_suite.compat.lerobot import LeRobotEnv, make_env
from wbc_suite.errors import UnknownNameError
from wbc_suite.registration import WITH_ID

ROOT = Path(__file__).parents[2]


def load_as_lerobot_does():
    spec = importlib.util.spec_from_file_location("hub_env_local", ROOT / "env.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.make_env(n_envs=1, use_async_envs=False)


def rollout(env, act, steps):
    """Run a batch once, as `lerobot_eval.rollout` does; return successes."""
    observation, _ = env.reset(
        seed=[1] * env.num_envs, options={"lerobot_new_rollout": True}
    )
    limit, solved = (
        env.call("_max_episode_steps")[0],
        np.zeros(env.num_envs, dtype=bool),
    )
    done = np.zeros(env.num_envs, dtype=bool)
    assert list(env.call("task_description")) == list(env.get_attr("task"))
    for _ in range(min(limit, steps)):
        observation, _, terminated, truncated, info = env.step(act(observation))
        final = info.get("final_info", info)
        found = np.asarray(final.get("is_success", [False] * env.num_envs), dtype=bool)
        solved |= found & ~done
        done |= terminated | truncated
        if done.all():
            break
    return solved, done


def test_every_benchmark_is_there_and_none_is_made_yet():
    (suite,) = load_as_lerobot_does().items()
    assert suite[0] == "wbc_suite"
    assert list(suite[1]) == list(range(len(WITH_ID)))
    assert all(
        isinstance(env, VectorEnv) and env.num_envs == 1 for env in suite[1].values()
    )


@pytest.mark.slow
@pytest.mark.parametrize("benchmark", WITH_ID)
def test_every_benchmark_runs_in_lerobots_loop(benchmark):
    (env,) = make_env(n_envs=1, cfg=SimpleNamespace(task=benchmark))[
        "wbc_suite"
    ].values()
    observation, _ = env.reset(seed=[0], options={"lerobot_new_rollout": True})
    assert {"agent_pos", "environment_state"} == observation.keys()
    assert env.single_observation_space.contains(
        {k: v[0] for k, v in observation.items()}
    )
    assert env.unwrapped.metadata["render_fps"] == 20
    solved, _ = rollout(env, lambda _: env.action_space.sample(), 3)
    assert solved.shape == (1,)
    env.close()


@pytest.mark.slow
def test_success_is_told_in_the_step_that_ends_the_episode():
    """The expert's actions, in one environment of two."""
    from wbc_suite.evaluation import make_policy

    (env,) = make_env(2, cfg=SimpleNamespace(task="Lift"), horizon=80)[
        "wbc_suite"
    ].values()
    env.reset(seed=[1, 1])
    inner = env.envs[0].unwrapped.env
    policy = make_policy("expert", inner, 1)
    hold = env.envs[1].unwrapped.env

    def act(_):
        return np.stack([policy(inner.observation()), hold.hold_action])

    solved, done = rollout(env, act, 80)
    assert solved.tolist() == [True, False]
    assert done.tolist() == [True, True]
    assert env.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    env.close()


def test_lerobot_sees_the_rate_of_actions():
    """Its films of an evaluation are written at `metadata["render_fps"]`."""
    (env,) = make_env(1, cfg=SimpleNamespace(task="Lift"), control_freq=30)[
        "wbc_suite"
    ].values()
    env.reset(seed=[0])
    assert env.metadata["render_fps"] == 30
    env.close()


@pytest.mark.slow
def test_cameras_are_pixels_with_channels_last():
    env = LeRobotEnv("Lift", cameras=["agentview"], size=48)
    observation, _ = env.reset(seed=0)
    picture = observation["pixels"]["agentview"]
    assert (picture.shape, picture.dtype) == ((48, 48, 3), np.uint8)
    assert env.observation_space.contains(observation)
    env.close()


def test_an_unknown_benchmark_is_named():
    with pytest.raises(UnknownNameError, match="Did you mean 'Lift'"):
        make_env(cfg=SimpleNamespace(task="Lifft"))
