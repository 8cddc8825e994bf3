import numpy as np
import pytest
from posing import DOWN, reach

import wbc_suite
from wbc_suite.benchmark.predicates import hull_distances

TOP = 0.9


@pytest.fixture(scope="module")
def env():
    return wbc_suite.make(
        "Wipe", robots="Panda", controller_configs="WHOLE_BODY_IK", reward_shaping=True
    )


def wipe_all_but(env, left=()):
    """Mark all as wiped, but some."""
    wipe = env.benchmark
    wipe.wipe(~np.isin(np.arange(len(wipe.marks)), list(left)))
    return wipe


def test_a_clean_table_is_a_success(env):
    env.reset(seed=0)
    wipe = wipe_all_but(env)
    assert wipe.success()
    assert wipe.reward(shaped=False) == wipe.reward(shaped=True) == 1.0


@pytest.mark.parametrize(
    "left", [[0], [99], [50], range(50), range(100)], ids=lambda left: f"{len(left)}"
)
def test_near_misses_are_no_success(env, left):
    env.reset(seed=0)
    wipe = wipe_all_but(env, left)
    assert not wipe.success()
    assert wipe.reward(shaped=False) == 0.0
    assert 0.0 <= wipe.reward(shaped=True) < 1.0


def press_on(env, place, height, steps=40):
    """Bring the pad over a place and down to a height of its face."""
    layout = env.action_layout
    target = layout.unpack(env.hold_action)["right_hand"].copy()
    target[3:6] = np.pi, 0.0, 0.0  # the pad lies flat
    for z in (TOP + 0.1, height):
        target[:3] = place[0], place[1], z
        action = layout.pack({"right_hand": target}, base=env.hold_action)
        for _ in range(steps):
            *_, info = env.step(action)
            assert "physics_error" not in info


@pytest.mark.slow
def test_pressing_wipes_what_lies_under_the_pad(env):
    observation, _ = env.reset(seed=0)
    wipe = env.benchmark
    assert observation["proportion_wiped"] == 0.0
    place = wipe.marks[50]
    press_on(env, place, TOP - 0.004)
    assert wipe.force > 0.5
    tool = env.simulation.data.site(f"robot0_{wipe.hands[0].frame}")
    seen = (wipe.marks - tool.xpos) @ tool.xmat.reshape(3, 3)
    inside = (np.abs(seen[:, 0]) < 0.02) & (np.abs(seen[:, 1]) < 0.055)
    outside = (np.abs(seen[:, 0]) > 0.035) | (np.abs(seen[:, 1]) > 0.07)
    assert wipe.wiped[50]
    assert inside[~wipe.wiped].sum() == 0
    assert wipe.wiped.sum() < 100
    kept = wipe.wiped & outside
    assert kept.sum() <= 15  # what was passed on the way
    alpha = env.simulation.model.geom_rgba[wipe._geoms, 3]
    np.testing.assert_array_equal(alpha == 0.0, wipe.wiped)


def test_hovering_wipes_nothing(env):
    env.reset(seed=0)
    press_on(env, env.benchmark.marks[50], TOP + 0.004)
    assert not env.benchmark.wiped.any()
    assert env.benchmark.force == 0.0


def test_a_mark_wiped_now_is_rewarded_and_a_reset_brings_it_back(env):
    env.reset(seed=0)
    wipe = env.benchmark
    before = wipe.reward(shaped=True)
    wipe._newly_wiped = 1
    most = 50 * 100 + 500 * (0.01 + 25.5)
    assert before < 0.1
    raw = before / (1.0 - before) + 50 * 500 / most
    assert wipe.reward(shaped=True) == pytest.approx(raw / (1.0 + raw))
    one = wipe.reward(shaped=True)
    wipe._newly_wiped = 20
    assert 1.0 > wipe.reward(shaped=True) > one + 0.2
    wipe._newly_wiped = 0
    wipe.force = 70.0
    left = before / (1.0 - before) + (0.01 - 0.05 * 70.0) * 500 / most
    left = max(left, 0.0)
    assert wipe.reward(shaped=True) == pytest.approx(left / (1.0 + left))
    wipe.wipe(np.ones(len(wipe.marks)))
    env.reset(seed=1)
    assert not wipe.wiped.any()
    assert wipe.force == 0.0


def test_strokes_stay_on_their_part_of_the_table_and_hang_together(env):
    for seed in range(50):
        env.reset(seed=seed)
        marks = env.benchmark.marks
        away = np.abs(marks[:, :2] - (0.15, 0.0))
        assert (away <= (0.15 + 1e-12, 0.24 + 1e-12)).all()
        steps = np.linalg.norm(np.diff(marks, axis=0), axis=1)
        np.testing.assert_allclose(steps, 0.005, atol=1e-12)
        drawn = env.simulation.data.geom_xpos[env.benchmark._geoms]
        np.testing.assert_allclose(drawn, marks, atol=1e-12)


def test_another_part_on_the_table_is_a_collision(env):
    env.reset(seed=0)
    wipe = env.benchmark
    press_on(env, wipe.marks[50], TOP - 0.004)
    assert not wipe.collided
    hands, wipe.hands = wipe.hands, []  # as if the pad were another part
    wipe.after_step()
    assert wipe.collided
    assert wipe.force == 0.0
    assert wipe.reward(shaped=True) == 0.0
    wipe.hands = hands


def test_nothing_is_wiped_between_two_hands():
    env = wbc_suite.make("Wipe", robots="Baxter")
    env.reset(seed=0)
    wipe = env.benchmark
    for hand, y in enumerate((-0.33, 0.33)):
        reach(env, hand, np.array([0.15, y, TOP - 0.001]), DOWN)
    wipe.after_step()
    assert wipe.force > 0.5
    assert not wipe.wiped[np.abs(wipe.marks[:, 1]) < 0.2].any()
    assert np.abs(wipe.marks[:, 1]).min() < 0.2


def test_distances_to_a_hull():
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.5]])
    points = np.array([[0.5, 0.2], [1.5, 0.5], [2.0, 2.0], [-1.0, 0.0]])
    wanted = [0.0, 0.5, np.sqrt(2.0), 1.0]
    np.testing.assert_allclose(hull_distances(square, points), wanted)
    line = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 0.0]])
    np.testing.assert_allclose(
        hull_distances(line, points), [0.2, np.hypot(0.5, 0.5), np.hypot(1, 2), 1.0]
    )
    np.testing.assert_allclose(
        hull_distances(line[:1], points[:1]), [np.hypot(0.5, 0.2)]
    )


def test_robots_wipe_with_a_pad_unless_told_otherwise():
    fingers = wbc_suite.make("Wipe", robots="Panda", gripper_types="PandaGripper")
    assert fingers.robots[0].synergies
    assert not wbc_suite.make("Wipe", robots="UR5e").robots[0].synergies


@pytest.mark.slow
def test_contact_is_observed_while_the_pad_presses(env):
    env.reset(seed=0)
    assert env.observation()["robot0_contact"] == 0.0
    assert env.observation()["object-state"].shape == (8,)  # as datasets have it
    press_on(env, env.benchmark.marks[50], TOP - 0.004)
    seen = env.observation()
    assert seen["robot0_contact"] == seen["robot0_proprio-state"][-1] == 1.0


def test_a_robot_without_arms_gets_no_pad():
    assert not wbc_suite.make("Wipe", robots="Spot").robots[0].hands


def test_distances_to_a_random_hull_are_those_of_the_nearest_point_in_it():
    rng = np.random.default_rng(0)
    for size in (2, 3, 4, 7):
        hull, points = rng.normal(size=(size, 2)), rng.normal(0.0, 2.0, (20, 2))
        weights = rng.dirichlet(np.full(size, 0.3), 20_000)
        inside = weights @ hull
        nearest = [np.linalg.norm(inside - p, axis=1).min() for p in points]
        found = hull_distances(hull, points)
        assert (found <= np.array(nearest) + 1e-9).all()
        np.testing.assert_allclose(found, nearest, atol=0.05)  # samples are 5 cm apart


def test_the_marks_left_are_measured(env):
    env.reset(seed=3)
    wipe = wipe_all_but(env, left=[10, 20])
    middle = wipe.marks[[10, 20]].mean(axis=0)
    np.testing.assert_allclose(wipe.centroid, middle)
    assert wipe.portion == pytest.approx(0.98)
    env.observables.update()
    seen = env.observation()
    np.testing.assert_allclose(seen["wipe_centroid"], middle)
    radius = np.linalg.norm(wipe.marks[10] - middle)
    assert seen["wipe_radius"] == pytest.approx(radius)
    wipe_all_but(env)
    env.observables.update()
    assert env.observation()["wipe_radius"] == 0.0
    np.testing.assert_allclose(wipe.centroid, wipe.marks.mean(axis=0))
