"""Stacks that ask for what cannot be had come to rest, or say why they move."""

import numpy as np
import pytest
from hard_stacks import AT_REST, FAMILIES, HardStack, run

CYCLING = (25, 30, 33, 58)  # at up to 0.5 rad/s from tick to tick, without a remedy


@pytest.mark.parametrize("seed", [4, 9, 14, 19])  # of Panda, one level
def test_an_arm_comes_to_rest(seed):
    found = run(HardStack(seed), 10.0)
    assert found.change <= AT_REST


@pytest.mark.sample(4)
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 500, 24))  # all robots, families and levels
def test_a_sample_comes_to_rest_or_says_why_it_moves(seed):
    found = run(HardStack(seed))
    assert found.unsaid <= AT_REST


@pytest.mark.slow
@pytest.mark.parametrize("seed", CYCLING)
def test_cycles_end(seed):
    hard = HardStack(seed)
    for _ in range(1700):
        hard.stack.solve(0.01)
        step = hard.stack.solution().dq
        hard.configuration.update(hard.configuration.integrate(step))
    turned = np.zeros(300, dtype=bool)
    for k in range(300):
        before = hard.stack.v_previous.copy()
        solution = hard.stack.solve(0.01)
        hard.configuration.update(hard.configuration.integrate(solution.dq))
        turned[k] = ((solution.v * before < 0.0) & (abs(solution.v) > AT_REST)).any()
    assert turned.mean() < 0.1


@pytest.mark.slow
def test_nearly_dependent_equalities_do_not_shake_the_robot():
    """They have solutions of any speed: GR1 jumped by 37 rad/s in each tick."""
    found = run(HardStack(460), 10.0)
    assert found.change <= AT_REST


def test_each_seed_makes_one_stack():
    a, b = HardStack(13), HardStack(13)
    np.testing.assert_array_equal(a.stack.solve(0.01).dq, b.stack.solve(0.01).dq)
    assert {HardStack(5 * k).family for k in range(5)} == set(FAMILIES)
