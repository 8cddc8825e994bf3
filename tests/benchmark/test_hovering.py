"""With a shaped reward, no policy that hovers earns more than the expert that wins."""

import itertools

import numpy as np
import pytest

import wbc_suite
from wbc_suite.evaluation import make_policy
from wbc_suite.registration import WITH_ID

STAYS = 5  # actions for which a reward is paid, which a policy that hovers gets on
SEEDS = 3  # of which the expert solves one


def rewards_of_the_expert(env, seed):
    """Return the reward of each action up to the success; None without one."""
    env.begin(seed)
    policy, rewards = make_policy("expert", env, seed), []
    for _ in range(env.horizon):
        action = np.array(policy(env.observation()))
        reward, terminated, _, info = env.advance(action)
        rewards.append(reward)
        if info["success"]:
            assert terminated
            return np.array(rewards)
        if terminated:
            break
    return None


@pytest.mark.sample(3)
@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(WITH_ID))
def test_winning_earns_more_than_hovering_anywhere_on_the_way(name):
    env = wbc_suite.make(name, reward_shaping=True, terminate_on_success=True)
    played = (rewards_of_the_expert(env, seed) for seed in itertools.count(7000))
    rewards = next(r for r in itertools.islice(played, SEEDS) if r is not None)
    *way, last = rewards.tolist()
    assert max(way, default=0.0) < 1.0
    assert last == 1 + env.horizon - len(rewards)  # each step that remains
    pushes = getattr(env.benchmark.config, "until", 0.0)  # s; nobody hovers before
    for k in range(int(pushes * env.config.control_freq), len(way) - STAYS):
        stays = min(way[k : k + STAYS])
        hovering = sum(way[:k]) + (env.horizon - k) * stays
        assert hovering < sum(rewards), k
