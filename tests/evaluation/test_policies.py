"""Policies by name, without an environment's simulation."""

import sys
import types

import numpy as np
import pytest

from wbc_suite.errors import ConfigError, WbcError
from wbc_suite.evaluation import (
    POLICIES,
    check_policy,
    make_policy,
    register_policy,
)


class Part:
    def __init__(self, name, start):
        self.name, self.start = name, start


class Lift:
    """What policies use of an environment: an arm with 6 numbers and a gripper."""

    def __init__(self, name="Lift", parts=("right", "right_gripper")):
        self.benchmark = types.SimpleNamespace(name=name)
        self.action_layout = types.SimpleNamespace(
            slices=[Part(part, 6 * k) for k, part in enumerate(parts)],
            low=np.full(7, -1.0),
            high=np.linspace(0.1, 1.0, 7),
        )

    @property
    def hold_action(self):
        return np.full(7, 0.25)


def make(name, env, seed=0):
    return make_policy(name, env, seed)


def test_hold_keeps_all_targets():
    env = Lift()
    np.testing.assert_array_equal(make("hold", env)({}), env.hold_action)


def test_random_actions_fill_the_action_space_and_follow_the_seed():
    env = Lift()
    policy = make("random", env, seed=4)
    drawn = np.array([policy({}) for _ in range(2000)])
    low, high = env.action_layout.low, env.action_layout.high
    assert (drawn >= low).all()
    assert (drawn <= high).all()
    mean = (low + high) / 2.0
    spread = (high - low) / np.sqrt(12.0 * len(drawn))
    assert (np.abs(drawn.mean(axis=0) - mean) < 5.0 * spread).all()
    again = make("random", env, seed=4)
    np.testing.assert_array_equal(drawn[0], again({}))
    assert not np.array_equal(drawn[0], make("random", env, seed=5)({}))


def test_a_policy_of_a_users_module_gets_environment_and_generator(monkeypatch):
    module = types.ModuleType("my_policies")
    module.__dict__["noise"] = lambda env, rng: lambda _: env.hold_action + rng.random()
    monkeypatch.setitem(sys.modules, "my_policies", module)
    env = Lift()
    first, again, other = (
        make("my_policies:noise", env, seed)({}) for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


@pytest.mark.parametrize("name", ["my.missing.module:f", "math:no_such_function"])
def test_modules_and_functions_that_do_not_exist_are_named(name):
    with pytest.raises(ConfigError, match=f"policy '{name}' cannot be found"):
        make(name, Lift())


def test_a_policy_of_ones_own_is_registered_by_one_line(forget):
    forget(POLICIES, "still")
    register_policy("still", lambda env, rng: lambda _: env.hold_action)
    env = Lift()
    np.testing.assert_array_equal(make("Still", env)({}), env.hold_action)


@pytest.mark.parametrize(
    ("name", "fault"),
    [
        ("hodl", "Did you mean 'hold'"),
        ("os.path:joyn", "'os.path:joyn' cannot be found"),
        ("none.hdf5", "no such file"),
    ],
)
def test_a_policys_name_is_checked_without_an_environment(name, fault):
    with pytest.raises(WbcError, match=fault):
        check_policy(name)
    for fine in ("expert", "os.path:join", "socket://nowhere:1"):
        check_policy(fine)


def test_every_policy_is_a_factory():
    assert set(POLICIES) == {"expert", "hold", "random"}
