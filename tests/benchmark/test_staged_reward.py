"""Staged rewards rise with every stage, and sorting counts objects at their places."""

import itertools
import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from wbc_suite.benchmark.sorting import Sorting
from wbc_suite.benchmark.staged_reward import StagedReward

NUMBERS = {
    **{"reach": 0.1, "grasp": 0.35, "lift": 0.5, "hover": 0.7},
    **{"reach_scale": 10.0, "lift_scale": 15.0, "hover_scale": 2.0, "withdrawn": 0.6},
}
STAGES = StagedReward(**NUMBERS)
LENGTH = st.floats(0.0, 2.0)


def test_a_hand_at_the_object_without_a_grasp_gets_the_reach():
    given = {"missing": 0.0, "aside": 0.0, "over": False, "grasped": False}
    assert STAGES.value(distance=0.0, **given) == pytest.approx(0.1)
    near = 0.1 * (1.0 - math.tanh(10.0 * 0.05))
    assert STAGES.value(distance=0.05, **given) == pytest.approx(near)


def test_a_lifted_object_above_its_target_gets_the_hover():
    found = STAGES.value(distance=0.0, grasped=True, missing=0.0, aside=0.0, over=True)
    assert found == pytest.approx(0.7)


@given(LENGTH, LENGTH, LENGTH, st.booleans(), st.booleans())
def test_rewards_stay_between_zero_and_the_hover(distance, missing, aside, held, over):
    found = STAGES.value(
        distance=distance, grasped=held, missing=missing, aside=aside, over=over
    )
    assert 0.0 <= found <= 0.7 + 1e-12
    if held:
        assert found >= 0.35 - 1e-12


@given(LENGTH, LENGTH, LENGTH)
def test_letting_go_over_the_target_costs_nothing(distance, missing, aside):
    given = {"distance": distance, "missing": missing, "aside": aside, "over": True}
    held = STAGES.value(grasped=True, **given)
    assert STAGES.value(grasped=False, **given) == pytest.approx(held)


@given(LENGTH, LENGTH, st.booleans())
def test_nearer_and_higher_are_never_worse(aside, missing, over):
    given = {"distance": 0.0, "grasped": True, "over": over}
    here = STAGES.value(missing=missing, aside=aside, **given)
    assert STAGES.value(missing=0.5 * missing, aside=aside, **given) >= here - 1e-12
    assert STAGES.value(missing=missing, aside=0.5 * aside, **given) >= here - 1e-12


@pytest.mark.parametrize(
    "names", list(itertools.pairwise(("reach", "grasp", "lift", "hover")))
)
def test_stages_that_do_not_rise_are_refused(names):
    first, second = names
    swapped = NUMBERS | {first: NUMBERS[second], second: NUMBERS[first] - 0.01}
    with pytest.raises(ValidationError, match="stages must rise"):
        StagedReward(**swapped)


def test_a_hover_of_one_would_be_a_success():
    with pytest.raises(ValidationError, match="stages must rise"):
        StagedReward(**NUMBERS | {"hover": 1.0})


def test_a_hand_has_left_from_some_distance_on():
    limit = math.atanh(1.0 - 0.6) / 10.0
    assert not STAGES.has_left(limit - 1e-6)
    assert STAGES.has_left(limit + 1e-6)


class Tray:
    """A sorting benchmark of two objects without a simulation."""

    def __init__(self):
        self.states = {
            name: SimpleNamespace(position=np.array([x, 0.0, 0.01]))
            for name, x in (("a", 0.0), ("b", 1.0))
        }
        self.held, self.moving, self.hand = set(), set(), 1.0
        self.scene = self

    def place(self, *names):
        for name, state in self.states.items():
            state.position[1] = 0.5 if name in names else 0.0

    def distance(self, point):
        return self.hand

    def grasped(self, name):
        return name in self.held

    def at_rest(self, name):
        return name not in self.held | self.moving


def sorting(tray, *, pick_one=False):
    return Sorting(
        tray,
        {"a": (0.0, 0.5), "b": (1.0, 0.5)},
        within=lambda dx, dy: math.hypot(dx, dy) < 0.1,
        placed=lambda name: tray.states[name].position[1] == 0.5,
        grip=lambda name: tray.states[name].position,
        floor=0.0,
        lift_height=0.3,
        pick_one=pick_one,
        stages=STAGES,
    )


def test_objects_count_once_they_lie_and_are_left():
    tray = Tray()
    rules = sorting(tray)
    assert rules.progress() < 0.05
    tray.place("a")
    assert 0.5 <= rules.progress() < 0.55
    assert not rules.success()
    tray.place("a", "b")
    assert rules.success()
    assert rules.progress() == 1.0
    tray.hand = 0.0
    assert not rules.success()
    tray.hand, tray.held = 1.0, {"b"}
    assert not rules.success()
    assert 0.5 <= rules.progress() < 1.0
    tray.held, tray.moving = set(), {"b"}
    assert not rules.success()


def test_the_best_of_the_others_is_rewarded():
    tray = Tray()
    tray.place("a")
    tray.held = {"b"}
    tray.states["b"].position[:] = 1.0, 0.5, 0.3  # lifted, above its goal
    tray.hand = 0.2
    assert sorting(tray).progress() == pytest.approx((1.0 + 0.7) / 2)


def test_all_objects_are_used_unless_one_is_picked():
    tray = Tray()
    rules = sorting(tray)
    assert rules.draw(np.random.default_rng(0)) == []
    assert rules.active == ("a", "b")


def test_each_object_is_picked_and_the_others_are_not_used():
    tray, picked = Tray(), set()
    rules = sorting(tray, pick_one=True)
    for seed in range(20):
        unused = rules.draw(np.random.default_rng(seed))
        (name,) = rules.active
        assert ["a", "b"][rules.number] == name
        assert [name, *unused] in (["a", "b"], ["b", "a"])
        picked.add(name)
        tray.place(name)
        assert rules.success()
        tray.place(*unused)
        assert not rules.success()
    assert picked == {"a", "b"}
