"""A humanoid on two feet under WHOLE_BODY_IK: it reaches, squats, is pushed, stands."""

from typing import Any

import gymnasium
import mujoco
import numpy as np
import pytest

import wbc_suite
from wbc_suite.qp import ActiveLimit, LimitKind

FRAMES = ("right_hand", "left_hand", "pelvis", "torso", "head")
RATE = 20.0  # Hz
BOX = ([-0.07, -0.15, -0.15], [0.23, 0.15, 0.15])  # m, about each hand


def make(**options: Any) -> Any:
    env: gymnasium.Env[Any, Any] = wbc_suite.make(
        "Lift",
        robots="GR1FreeBody",
        controller_configs="WHOLE_BODY_IK",
        control_freq=RATE,
        initialization_noise=None,
        **options,
    )
    env.reset(seed=0)
    return env.unwrapped


def moved(env: Any, **shifts: tuple[float, ...]) -> np.ndarray:
    """Return the action that shifts the goals of slices by so much."""
    action = env.hold_action.copy()
    for name, shift in shifts.items():
        start = env.action_layout[name].start
        action[start : start + len(shift)] += shift
    return action


def run(env: Any, action: np.ndarray, seconds: float) -> dict[str, Any]:
    """Step with one action; return the last report on frames."""
    info: dict[str, Any] = {}
    for _ in range(round(seconds * RATE)):
        info = env.step(action)[-1]
        assert upright(env) > 0.7
    return info["ik"]["frames"]


def limit_kinds(hand: dict[str, Any]) -> set[LimitKind]:
    return {r.kind for r in hand["reasons"] if isinstance(r, ActiveLimit)}


def upright(env: Any) -> float:
    """Return the cosine of the pelvis's inclination."""
    return float(env.simulation.data.body("robot0_base_link").xmat[8])


def pelvis(env: Any) -> np.ndarray:
    return env.simulation.data.body("robot0_base_link").xpos.copy()


@pytest.mark.slow
def test_it_stands_where_it_stood():
    env = make()
    start = pelvis(env)
    run(env, env.hold_action, 1.0)
    np.testing.assert_allclose(pelvis(env), start, atol=1e-3)
    assert upright(env) > np.cos(np.radians(0.5))


@pytest.mark.slow
def test_a_near_hand_target_moves_the_arm_and_not_the_pelvis():
    """Without balance, the pelvis went 17 mm in 50 ms, and the robot fell."""
    env = make()
    start = pelvis(env)
    frames = run(env, moved(env, right_hand=(0.05,)), 1.5)
    assert all(frames[name]["reached"] for name in FRAMES)
    np.testing.assert_allclose(pelvis(env), start, atol=2e-3)


@pytest.mark.slow
def test_it_squats_by_its_pelvis_while_its_hands_stay():
    env = make()
    start = pelvis(env)
    action = moved(env, pelvis=(0.0, 0.0, -0.1))
    frames = run(env, action, 2.5)
    assert frames["right_hand"]["position_error"] < 1e-3
    assert frames["left_hand"]["position_error"] < 1e-3
    np.testing.assert_allclose(pelvis(env), start - [0.0, 0.0, 0.1], atol=3e-3)


@pytest.mark.slow
@pytest.mark.parametrize("force", [(30.0, 0.0), (-30.0, 0.0), (0.0, 30.0)])
def test_a_push_is_survived(force: tuple[float, float]):
    env = make()
    start = pelvis(env)
    torso = env.simulation.model.body("robot0_torso_link").id
    env.simulation.data.xfrc_applied[torso, :2] = force
    run(env, env.hold_action, 0.1)
    assert np.linalg.norm(pelvis(env) - start) > 1e-4
    env.simulation.data.xfrc_applied[torso] = 0.0
    run(env, env.hold_action, 0.9)
    np.testing.assert_allclose(pelvis(env), start, atol=2e-3)


@pytest.mark.slow
def test_a_far_reach_leans_as_far_as_balance_allows():
    env = make()
    action = moved(env, right_hand=(0.6,), left_hand=(0.6,))
    hand = run(env, action, 1.5)["right_hand"]
    assert LimitKind.BALANCE in limit_kinds(hand)
    frames = run(env, action, 3.0)
    assert frames["right_hand"]["position_error"] < 5e-3
    assert not frames["torso"]["reached"]
    com = env.simulation.data.subtree_com[
        env.simulation.model.body("robot0_base_link").id
    ]
    assert com[0] - env.simulation.data.site("robot0_left_foot").xpos[0] < 0.1
    assert np.abs(env.simulation.data.qvel).max() < 0.5


@pytest.mark.slow
def test_targets_out_of_reach_are_survived():
    """90 cm ahead is 30 cm too far, even with all the lean that there is."""
    env = make()
    frames = run(env, moved(env, right_hand=(0.9,), left_hand=(0.9,)), 3.0)
    assert not frames["right_hand"]["reached"]
    kinds = limit_kinds(frames["right_hand"])
    assert kinds & {LimitKind.BALANCE, LimitKind.EFFORT}
    frames = run(env, env.hold_action, 0.2)
    run(env, moved(env, right_hand=(-0.9,), left_hand=(-0.9,)), 2.5)
    assert upright(env) > 0.98


@pytest.mark.slow
def test_the_head_turns_alone():
    env = make()
    start = pelvis(env)
    frames = run(env, moved(env, head=(0.0, 0.2, 0.4)), 1.5)
    assert frames["head"]["orientation_error"] < 0.02
    np.testing.assert_allclose(pelvis(env), start, atol=2e-3)


@pytest.mark.slow
def test_it_stands_for_ten_seconds():
    env = make()
    start = pelvis(env)
    run(env, env.hold_action, 10.0)
    np.testing.assert_allclose(pelvis(env), start, atol=1e-3)


@pytest.mark.slow
def test_hands_reach_targets_in_front():
    """Both hands at once, within 30 cm boxes in front of where they are."""
    env, rng = make(), np.random.default_rng(0)
    home, errors = env.hold_action, list[float]()
    layout = env.action_layout
    for _ in range(20):
        action = home.copy()
        for name in ("right_hand", "left_hand"):
            start = layout[name].start
            action[start : start + 3] += rng.uniform(*BOX)
        frames = run(env, action, 2.5)
        errors += [frames[f"{s}_hand"]["position_error"] for s in ("right", "left")]
    assert np.median(errors) < 1e-3
    assert np.mean(np.array(errors) < 5e-3) >= 0.9


@pytest.mark.slow
def test_pressure_stays_inside_the_soles_while_hands_move():
    env = make()
    action = moved(env, right_hand=(0.2, 0.0, 0.1), left_hand=(0.2, 0.0, 0.1))
    worst = np.inf
    for _ in range(30):
        env.step(action)
        worst = min(worst, *sole_rooms(env))
    assert worst > 1e-3


def sole_rooms(env: Any) -> list[float]:
    """Return how far the pressure points of both soles are from heel and toes, m."""
    model, data = env.simulation.model, env.simulation.data
    rooms: list[float] = []
    for side in ("right", "left"):
        foot = model.body(f"robot0_{side}_foot_roll_link").id
        pressed, moment, wrench = 0.0, 0.0, np.zeros(6)
        for i, contact in enumerate(data.contact[: data.ncon]):
            if foot in model.geom_bodyid[[contact.geom1, contact.geom2]]:
                mujoco.mj_contactForce(model, data, i, wrench)
                pressed += wrench[0]
                moment += wrench[0] * contact.pos[0]
        x = moment / pressed - data.site(f"robot0_{side}_foot").xpos[0]
        rooms += [x + 0.058, 0.128 - x]
    return rooms
