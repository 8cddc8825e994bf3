import math

import mujoco
import numpy as np
import pytest
from conftest import penetration, put

import wbc_suite
from wbc_suite.errors import PlacementError
from wbc_suite.scene.placement import Region, UniformSampler

TOP = 0.8
B_AT = (0.1, 0.1, TOP + 0.025 - 1e-4)
ON_B = (0.1, 0.1, TOP + 0.05 + 0.02 - 2e-4)


@pytest.fixture(scope="module")
def env():
    return wbc_suite.make("Stack", robots="Panda")


def test_a_on_b_is_a_success(env):
    env.reset(seed=0)
    stack = put(env, cubeB=(B_AT, None), cubeA=(ON_B, None))
    assert stack.success()
    assert stack.reward(shaped=False) == stack.reward(shaped=True) == 1.0


def test_it_stays_a_success_for_a_second(env):
    env.reset(seed=0)
    put(env, cubeB=(B_AT, None), cubeA=(ON_B, None))
    for _ in range(20):
        _, reward, _, _, info = env.step(env.hold_action)
        assert info["success"]
        assert reward == 1.0


@pytest.mark.parametrize(
    ("a", "b"),
    [
        ((0.1, 0.1, ON_B[2] + 0.003), B_AT),  # 3 mm above
        ((0.1 + 0.0449, 0.1, TOP + 0.02), B_AT),  # beside, touching
        ((0.1, 0.1, TOP + 0.02 - 1e-4), (0.1, 0.1, TOP + 0.04 + 0.025)),  # B on A
        ((-0.1, 0.1, TOP + 0.02), B_AT),  # on the table
        ((0.1, 0.1, 0.02), (0.1, 0.1, 0.065)),  # both on the floor, B on A
    ],
)
def test_near_misses_are_no_success(env, a, b):
    env.reset(seed=0)
    stack = put(env, cubeA=(a, None), cubeB=(b, None))
    assert not stack.success()
    assert stack.reward(shaped=False) == 0.0
    assert 0.0 <= stack.reward(shaped=True) < 1.0


HALF = math.sqrt(0.5)
TIPPED = [(HALF, HALF, 0, 0), (HALF, -HALF, 0, 0), (HALF, 0, HALF, 0), (0, 0, 0, 1)]
"""B on a side, on the opposite one, on another, and on its top."""


@pytest.mark.parametrize("tipped", TIPPED)
@pytest.mark.parametrize("turn", range(4))
def test_a_beside_a_tipped_b_is_not_on_it(env, tipped, turn):
    env.reset(seed=0)
    c, s = math.cos(turn * math.pi / 2), math.sin(turn * math.pi / 2)
    beside = (0.1 + 0.0449 * c, 0.1 + 0.0449 * s, TOP + 0.02 - 1e-4)
    stack = put(env, cubeB=(B_AT, tipped), cubeA=(beside, None))
    assert stack.scene.touching("cubeA", "cubeB")
    assert not stack.success()


@pytest.mark.parametrize("tipped", TIPPED)
def test_a_on_a_tipped_b_is_on_it(env, tipped):
    env.reset(seed=0)
    assert put(env, cubeB=(B_AT, tipped), cubeA=(ON_B, None)).success()


@pytest.mark.parametrize(
    ("aside", "turn"),
    [((0.0, 0.027, 0.0), 0.0), ((0.0, 0.0, 0.00823), math.pi / 4 + 0.06)],
    ids=["tips over the side", "on its edge"],
)
def test_a_that_will_tip_is_not_on_b(env, aside, turn):
    env.reset(seed=0)
    tipping = (math.cos(turn / 2), math.sin(turn / 2), 0.0, 0.0)
    at = tuple(np.add(ON_B, aside))
    stack = put(env, cubeB=(B_AT, None), cubeA=(at, tipping))
    assert stack.scene.touching("cubeA", "cubeB")
    assert not stack.success()


def hold_between_fingers(env):
    """Put A between the fingers' pads and close them on it; B right below it."""
    data = env.simulation.data
    env.reset(seed=0)
    hand = data.site("robot0_right_tcp")
    quat = np.empty(4)
    mujoco.mju_mat2Quat(quat, hand.xmat)
    down = hand.xmat.reshape(3, 3)[:, 2]
    at, turn = hand.xpos.copy(), tuple(quat)
    for finger in ("panda_finger_joint1", "panda_finger_joint2"):
        data.joint(f"robot0_{finger}").qpos[0] = 0.0195
    return put(env, cubeA=(at, turn), cubeB=(at + (0.045 - 1e-4) * down, turn))


def test_a_held_on_b_is_no_success(env):
    stack = hold_between_fingers(env)
    assert stack.scene.touching("cubeA", "cubeB")
    assert stack.scene.grasped("cubeA")
    assert not stack.success()


def test_the_reward_rises_from_reach_to_grasp_to_lift_to_align(env):
    env.reset(seed=0)
    far = put(env, cubeA=((-0.2, 0.3, TOP + 0.02), None)).reward(shaped=True)
    held = hold_between_fingers(env).reward(shaped=True)
    put(env, cubeA=((0.3, 0.3, TOP + 0.3), None), cubeB=(B_AT, None))
    lifted = env.benchmark.reward(shaped=True)
    put(env, cubeA=((0.1, 0.1, TOP + 0.3), None))
    aligned = env.benchmark.reward(shaped=True)
    assert far < 0.25 / 2 < held
    assert 0.5 < lifted < aligned == 0.75


def near_the_hand(env, spread):
    """Return a sampler that puts both cubes at the hand's height, around it."""
    env.reset(seed=0)
    hand = env.benchmark.hands[0].position.tolist()
    ends = (-spread, spread)
    region = Region(x=ends, y=ends, clearance=-0.02)
    return UniformSampler(names=["cubeA", "cubeB"], region=region, origin=hand)


def test_things_are_not_put_into_a_robot(env, monkeypatch):
    monkeypatch.setattr(env.benchmark, "sampler", near_the_hand(env, 0.12))
    for seed in range(20):
        env.reset(seed=seed)
        assert penetration(env) == 0.0


def test_a_robot_that_leaves_no_room_is_told(env, monkeypatch):
    around = near_the_hand(env, 0.02)
    palm = around.region.model_copy(update={"clearance": 0.06})
    sampler = UniformSampler(names=["cubeA"], region=palm, origin=around.origin)
    monkeypatch.setattr(env.benchmark, "sampler", sampler)
    with pytest.raises(PlacementError, match="a robot touched cubeA"):
        env.reset(seed=0)
