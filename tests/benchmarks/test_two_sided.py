"""The two-sided search finds false verdicts where they are, and none elsewhere."""

import mujoco
import numpy as np
import pytest
from harness.geometric_judges import JUDGES
from harness.rigid_world import World
from two_sided import ALL, Search

from wbc_suite.benchmark import Stack
from wbc_suite.benchmark.base import load_benchmark


def found(name, robots, tries, seed=0):
    search = Search(name, robots, seed)
    for _ in range(tries):
        search.attempt()
    return search


def test_every_benchmark_that_is_searched_has_a_judge():
    for name in ALL:
        kinds = [kind.__name__ for kind in type(load_benchmark(name)).__mro__]
        assert any(kind in JUDGES for kind in kinds), name


def in_axes_of_b(stack):
    a, b, half = stack.states["cubeA"], stack.states["cubeB"], 0.025
    x, y, z = ((a.position - b.position) @ b.rotation).tolist()
    over = max(abs(x), abs(y)) < half < z
    return over and a.is_still and stack.scene.touching("cubeA", "cubeB")


def touches(stack):
    return stack.scene.touching("cubeA", "cubeB")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("success", "side"), [(in_axes_of_b, "failure"), (touches, "success")]
)
def test_a_wrong_idea_of_on_is_found(monkeypatch, success, side):
    monkeypatch.setattr(Stack, "success", success)
    assert side in {one["side"] for one in found("Stack", "Panda", 300).found}


def below_all_hands(wipe):
    """Wipe below one hull over all hands, as it once was."""
    faces, force, collided = type(wipe)._contacts(wipe)
    return [np.vstack(faces)] if faces else [], force, collided


@pytest.mark.slow
def test_one_hull_over_all_hands_is_found(monkeypatch):
    search = Search("Wipe", "Baxter", 0)
    monkeypatch.setattr(search.task, "_contacts", lambda: below_all_hands(search.task))
    for _ in range(300):
        search.attempt()
    assert "success" in {one["side"] for one in search.found}


SAMPLE = (
    *(("Stack", "Panda"), ("PickPlaceMilk", "PandaDexRH"), ("Door", "GR1")),
    *(("NutAssemblySquare", "Baxter"), ("TwoArmPegInHole", "Panda,Panda")),
    *(("Lift", "Panda"), ("Wipe", "Panda"), ("WalkTo", "Spot")),
    ("Carry", "GR1FreeBody"),
)


@pytest.mark.parametrize(("name", "robots"), SAMPLE)
def test_none_is_found_in_thirty_tries(name, robots):
    search = found(name, robots, 30, seed=1)
    assert not search.found
    assert search.counts["right"] > 20


@pytest.mark.slow
@pytest.mark.parametrize(("name", "robots"), SAMPLE)
def test_some_of_a_hundred_and_twenty_tries_are_done(name, robots):
    search = found(name, robots, 120, seed=1)
    assert not search.found
    assert search.done > 0


def test_the_same_seed_makes_the_same_tries():
    first, again = (found("Stack", "Panda", 20, seed=3) for _ in range(2))
    np.testing.assert_array_equal(first.world.data.qpos, again.world.data.qpos)
    assert first.counts == again.counts


def test_rigid_robots_have_the_poses_of_those_with_joints():
    world = World("Stack", ["Baxter"])
    world.begin(3)
    assert world.model.nv == 12  # two cubes
    moving = world.moving
    moving.data.qpos[7:10] += 0.3
    mujoco.mj_kinematics(moving.model, moving.data)
    world.pose()
    mujoco.mj_kinematics(world.model, world.data)
    for name in ("xpos", "xmat"):
        wanted, seen = (
            getattr(data, name)[moving.bodies] for data in (moving.data, world.data)
        )
        np.testing.assert_allclose(seen, wanted, atol=1e-12)
