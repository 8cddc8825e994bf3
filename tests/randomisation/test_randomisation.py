"""Domain randomisation: as much as asked, as the seed says, and put back."""

import copy
import pickle

import numpy as np
import pytest
from pydantic import ValidationError

import wbc_suite
from wbc_suite.envs.states import motion_size
from wbc_suite.errors import ConfigError
from wbc_suite.randomisation import Randomisation

ARRAYS = {
    "color": "geom_rgba",
    "texture": "tex_data",
    "light_position": "light_pos",
    "light_brightness": "light_diffuse",
    "camera_position": "cam_pos",
    "camera_rotation": "cam_quat",
    "camera_fovy": "cam_fovy",
    "mass": "body_mass",
    "inertia": "body_inertia",
    "friction": "geom_friction",
    "armature": "dof_armature",
    "gains": "actuator_gainprm",
}
AMOUNTS = dict.fromkeys(ARRAYS, 0.1) | {"texture": True}


def model_of(env):
    return {
        name: getattr(env.simulation.model, name).copy() for name in ARRAYS.values()
    }


@pytest.fixture(scope="module")
def nominal():
    return wbc_suite.make("Lift", robots="Panda")


@pytest.mark.parametrize("amount", sorted(ARRAYS))
def test_each_amount_changes_its_own_array_within_its_size(amount, nominal):
    env = wbc_suite.make(
        "Lift", robots="Panda", randomisation=Randomisation(**{amount: AMOUNTS[amount]})
    )
    env.reset(seed=1)
    nominal.reset(seed=99)
    plain, drawn = model_of(nominal), model_of(env)
    cube = env.simulation.model.body("cube").id
    for name in ARRAYS.values():
        before, after = plain[name], drawn[name]
        if name in ("body_mass", "body_inertia"):  # the cube's size is drawn anyway
            before, after = np.delete(before, cube, 0), np.delete(after, cube, 0)
        goes_along = (amount, name) == ("mass", "body_inertia")
        changed = name == ARRAYS[amount] or goes_along
        assert changed != np.array_equal(before, after), name
        if changed and amount in ("mass", "inertia", "friction", "damping", "gains"):
            ratio = after[before > 0] / before[before > 0]
            assert 0.9 <= ratio.min() < 0.98
            assert 1.02 < ratio.max() <= 1.1
    _, _, _, _, info = env.step(env.hold_action)
    assert "physics_error" not in info


def test_what_has_a_material_takes_its_colour(nominal):
    env = wbc_suite.make("Lift", robots="Panda", randomisation=Randomisation(color=0.3))
    env.reset(seed=0)
    plain, drawn = nominal.simulation.model, env.simulation.model
    painted = drawn.geom_matid >= 0  # links with a palette, the table, the floor
    assert painted.sum() > 10
    np.testing.assert_array_equal(drawn.geom_rgba[painted], plain.geom_rgba[painted])
    assert (drawn.geom_rgba[~painted] != plain.geom_rgba[~painted]).any()
    assert (drawn.mat_rgba != plain.mat_rgba).any()


def test_damping_is_drawn_where_joints_have_any():
    env = wbc_suite.make("Lift", robots="Panda")  # whose joints have none
    damping = env.simulation.model.dof_damping
    damping[:] = 2.0
    bound = Randomisation(damping=0.1).bind(env)
    bound.apply(np.random.default_rng(0))
    assert 1.8 <= damping.min() < 1.9 < 2.1 < damping.max() <= 2.2
    bound.restore()
    np.testing.assert_array_equal(damping, 2.0)


@pytest.mark.slow
def test_the_seed_says_all_and_the_next_episode_starts_from_nominal():
    env = wbc_suite.make("Lift", robots="Panda", randomisation=Randomisation.default())
    runs = []
    for seed in (5, 6, 5):
        for _ in range(3):
            env.reset()
        env.reset(seed=seed)
        action = env.hold_action
        action[0] += 0.3
        for _ in range(5):
            env.step(action)
        runs.append((model_of(env), env.physics_state, env.latency))
    for name in ARRAYS.values():
        np.testing.assert_array_equal(runs[0][0][name], runs[2][0][name])
        if name != "light_diffuse":
            assert not np.array_equal(runs[0][0][name], runs[1][0][name]), name
    np.testing.assert_array_equal(runs[0][1], runs[2][1])
    assert runs[0][2] == runs[2][2]


def test_it_can_be_put_back(nominal):
    env = wbc_suite.make("Lift", robots="Panda")
    bound = Randomisation.default().bind(env)
    before = model_of(env)
    bound.apply(np.random.default_rng(0))
    assert not np.array_equal(model_of(env)["geom_rgba"], before["geom_rgba"])
    bound.restore()
    for name, values in model_of(env).items():
        np.testing.assert_array_equal(values, before[name])


@pytest.mark.slow
@pytest.mark.parametrize(
    "copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))]
)
def test_copies_live_in_the_same_world(copied):
    env = wbc_suite.make("Lift", robots="Panda", randomisation=Randomisation.default())
    env.reset(seed=2)
    env.step(env.hold_action)
    twin = copied(env)
    for one in (env, twin):
        for _ in range(4):
            one.step(one.hold_action)
    np.testing.assert_array_equal(env.physics_state, twin.physics_state)


@pytest.mark.slow
def test_textures_are_seen():
    env = wbc_suite.make(
        "Lift", robots="Panda", randomisation=Randomisation(texture=True)
    )
    pictures = []
    for seed in (0, 1, 0):
        env.reset(seed=seed)
        pictures.append(env.cameras.image("agentview", width=48, height=48).astype(int))
    env.close()
    assert np.abs(pictures[0] - pictures[1]).mean() > 10.0
    np.testing.assert_array_equal(pictures[0], pictures[2])


def test_latency_holds_actions_back():
    moved = {}
    for latency in (0.0, 0.04):
        env = wbc_suite.make(
            "Lift", robots="Panda", randomisation=Randomisation(latency=(latency,) * 2)
        )
        env.reset(seed=0)
        start = env.observation()["robot0_eef_pos"]
        action = env.hold_action
        action[0] += 0.5
        seen, *_ = env.step(action)
        moved[latency] = np.linalg.norm(seen["robot0_eef_pos"] - start)
        assert env.simulation.data.time == pytest.approx(0.05)
    assert moved[0.04] < 0.3 * moved[0.0]


@pytest.mark.slow
def test_a_latency_of_several_periods_is_a_queue_of_actions():
    late = wbc_suite.make(
        "Lift", robots="Panda", randomisation=Randomisation(latency=(0.11, 0.11))
    )
    prompt = wbc_suite.make("Lift", robots="Panda", control_freq=500.0)
    for env in (late, prompt):
        env.reset(seed=3)
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1.0, 1.0, (4, 7))
    for action in actions:
        late.step(action)
    # At 500 Hz, in one-step periods: what counts when, written out.
    for k in range(4 * 25):
        began = (k - 55) // 25
        if k >= 55 and (k - 55) % 25 == 0:
            prompt.controllers[0].set_goal(actions[began], 0.05)
        prompt.simulation.tick(1)
    motion = slice(motion_size(late.simulation.model))  # the rest differs with the rate
    one, other = late.physics_state[motion], prompt.physics_state[motion]
    np.testing.assert_array_equal(one, other)

    kept, twin = late.get_state(), copy.deepcopy(late)
    futures = []
    for one in (late, twin, late):
        one.set_state(kept)
        for action in -actions:
            one.step(action)
        futures.append(one.physics_state)
    np.testing.assert_array_equal(futures[0], futures[1])
    np.testing.assert_array_equal(futures[0], futures[2])
    late.reset(seed=3)  # what waited is forgotten
    start = late.physics_state
    late.step(np.zeros(7))
    late.reset(seed=3)
    np.testing.assert_array_equal(late.physics_state, start)


def test_wrong_amounts_are_refused():
    with pytest.raises(ValidationError, match="smallest latency must come first"):
        Randomisation(latency=(0.2, 0.1))
    with pytest.raises(ValidationError, match="less than 1"):
        Randomisation(mass=1.5)
    with pytest.raises(ConfigError, match="randomisation is a"):
        wbc_suite.make("Lift", randomisation="colours")
