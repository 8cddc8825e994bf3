import numpy as np
import pytest

import wbc_suite
from wbc_suite.benchmark.wipe import _distances

TOP = 0.9


@pytest.fixture(scope="module")
def env():
    return wbc_suite.make(
        "Wipe", robots="Panda", controller_configs="WHOLE_BODY_IK", reward_shaping=True
    )


def wipe_all_but(env, left=()):
    """Mark all as wiped, but some."""
    wipe = env.benchmark
    wipe._notes[:] = 1.0
    wipe._notes[list(left)] = 0.0
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
    wipe._fresh = 1
    most = 50 * 100 + 500 * (0.01 + 25.5)
    assert before < 0.1
    assert 1.0 - 1e-9 < wipe.reward(shaped=True) < 1.0  # 1.4 is cut
    wipe._fresh = 0
    wipe.force = 70.0
    assert wipe.reward(shaped=True) == pytest.approx(
        max(before + (0.01 - 0.05 * 70.0) * 500 / most, 0.0)
    )
    wipe._notes[:] = 1.0
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
    wipe.watch()
    assert wipe.collided
    assert wipe.force == 0.0
    assert wipe.reward(shaped=True) == 0.0
    wipe.hands = hands


def test_distances_to_a_hull():
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.5]])
    points = np.array([[0.5, 0.2], [1.5, 0.5], [2.0, 2.0], [-1.0, 0.0]])
    wanted = [0.0, 0.5, np.sqrt(2.0), 1.0]
    np.testing.assert_allclose(_distances(square, points), wanted)
    line = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 0.0]])
    np.testing.assert_allclose(
        _distances(line, points), [0.2, np.hypot(0.5, 0.5), np.hypot(1, 2), 1.0]
    )
    np.testing.assert_allclose(_distances(line[:1], points[:1]), [np.hypot(0.5, 0.2)])


def test_robots_wipe_with_a_pad_unless_told_otherwise():
    fingers = wbc_suite.make("Wipe", robots="Panda", gripper_types="PandaGripper")
    assert fingers.robots[0].synergies
    assert not wbc_suite.make("Wipe", robots="UR5e").robots[0].synergies


@pytest.mark.slow
def test_contact_is_felt_while_the_pad_presses(env):
    env.reset(seed=0)
    assert env.observation()["robot0_contact"] == 0.0
    assert env.observation()["object-state"].shape == (8,)  # as datasets have it
    press_on(env, env.benchmark.marks[50], TOP - 0.004)
    seen = env.observation()
    assert seen["robot0_contact"] == seen["robot0_proprio-state"][-1] == 1.0


def test_a_robot_without_arms_gets_no_pad():
    assert not wbc_suite.make("Wipe", robots="Spot").robots[0].hands
