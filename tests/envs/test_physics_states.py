"""Physics states: a world that is restored is the one that was saved."""

import copy

import numpy as np
import pytest

import wbc_suite
from wbc_suite.envs.physics_states import Origin, generator_of, words_of
from wbc_suite.envs.states import motion_size
from wbc_suite.errors import ConfigError, PhysicsError
from wbc_suite.randomisation import Randomisation
from wbc_suite.recording import Dataset
from wbc_suite.scene import Push
from wbc_suite.wrappers import DataCollection

OF_DATA = ("qpos", "qvel", "ctrl", "qacc_warmstart", "userdata", "xpos", "geom_xpos")
STEPS = 6


def arrays_of(env):
    """Return all arrays of the model, and those of the data that matter."""
    model, data = env.simulation.model, env.simulation.data
    names = [n for n in dir(model) if not n.startswith("_")]
    found = {n: getattr(model, n) for n in names}
    found = {n: x.copy() for n, x in found.items() if isinstance(x, np.ndarray)}
    return found | {f"data.{n}": getattr(data, n).copy() for n in OF_DATA}


def differing(one, other):
    return [n for n, x in one.items() if not np.array_equal(x, other[n])]


def actions_of(env, count, seed=0):
    """Return small random steps from the action that holds all goals."""
    rng, layout = np.random.default_rng(seed), env.action_layout
    noise = rng.uniform(-0.3, 0.3, (count, layout.size))
    return np.clip(env.hold_action + noise, layout.low, layout.high)


def saved_midway(env, at=2, seed=3):
    """Return a world, its arrays, the actions after it, and the end."""
    env.reset(seed=seed)
    actions = actions_of(env, STEPS)
    for action in actions[:at]:
        env.step(action)
    state, arrays = env.physics_state, arrays_of(env)
    for action in actions[at:]:
        env.step(action)
    return state, arrays, actions[at:], env.physics_state


def check_goes_on(env, fresh):
    """Check that a fresh environment goes on from a state as the first one did."""
    state, arrays, actions, end = saved_midway(env)
    fresh.reset(seed=77)
    fresh.reset_to(state)
    assert differing(arrays, arrays_of(fresh)) == []
    np.testing.assert_array_equal(fresh.physics_state, state)
    for action in actions:
        fresh.step(action)
    np.testing.assert_array_equal(fresh.physics_state, end)


@pytest.fixture(scope="module")
def doors():
    return [wbc_suite.make("Door", robots="Panda") for _ in range(2)]


@pytest.fixture(scope="module")
def lifts():
    return [wbc_suite.make("Lift", robots="Panda") for _ in range(2)]


def test_a_restored_door_stands_where_it_stood(doors):
    """It does not move, so its pose is in the model."""
    check_goes_on(*doors)


def test_a_restored_cube_has_its_size_and_mass(lifts):
    check_goes_on(*lifts)


@pytest.mark.parametrize(
    "name",
    [
        "Wipe",
        *(
            pytest.param(name, marks=pytest.mark.slow)
            for name in (
                *("TwoArmPegInHole", "TwoArmHandover", "PickPlaceSingle", "WalkTo"),
                *("Reach", "LocoLift", "Stand", "Carry", "NutAssemblySingle"),
            )
        ),
    ],
)
def test_a_restored_world_goes_on_bit_by_bit(name):
    check_goes_on(*(wbc_suite.make(name) for _ in range(2)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("benchmark", "robots", "controller"),
    [
        ("Lift", "Panda", "JOINT_POSITION"),
        ("Lift", "Panda", "JOINT_VELOCITY"),
        ("Lift", "Panda", "JOINT_TORQUE"),
        ("Lift", "Panda", "OSC_POSITION"),
        ("Lift", "Panda", "IK_POSE"),
        ("Lift", "Tiago", "WHOLE_BODY_ID"),
        ("Lift", "PandaOmron", "HYBRID_MOBILE_BASE"),
        ("Stand", "GR1FreeBody", "BASIC"),
    ],
)
def test_all_controllers_go_on_from_their_references(benchmark, robots, controller):
    arguments = {"robots": robots, "controller_configs": controller}
    check_goes_on(*(wbc_suite.make(benchmark, **arguments) for _ in range(2)))


@pytest.mark.slow
@pytest.mark.parametrize("robots", ["Panda", "GR1FreeBody"])
def test_whole_body_inverse_kinematics_goes_on_from_its_references(robots):
    """Near goals; a motion that was being planned is planned anew."""
    benchmark = "Lift" if robots == "Panda" else "Stand"
    arguments = {"robots": robots, "controller_configs": "WHOLE_BODY_IK"}
    env, fresh = (wbc_suite.make(benchmark, **arguments) for _ in range(2))
    env.reset(seed=3)
    rng, layout = np.random.default_rng(0), env.action_layout
    actions = env.hold_action + rng.uniform(-2e-3, 2e-3, (12, layout.size))
    actions = np.clip(actions, layout.low, layout.high)
    for action in actions[:6]:
        env.step(action)
    state = env.physics_state
    fresh.reset_to(state)
    for action in actions[6:]:
        env.step(action)
        fresh.step(action)
        np.testing.assert_array_equal(fresh.physics_state, env.physics_state)


@pytest.mark.slow
def test_rows_of_a_recording_are_worlds(doors, tmp_path):
    env, fresh = doors
    with DataCollection(env, tmp_path / "door.hdf5") as recorded:
        recorded.reset(seed=4)
        actions = actions_of(env, STEPS)
        for action in actions:
            recorded.step(action)
    with Dataset(tmp_path / "door.hdf5") as dataset:
        episode = dataset.episode("demo_0")
    for k in (0, 4):
        fresh.reset(seed=9)
        fresh.reset_to(episode.columns["states"][k])
        for action in episode.columns["actions"][k:]:
            fresh.step(action)
        np.testing.assert_array_equal(fresh.physics_state, episode.final_state)


def test_states_of_other_scenes_are_refused_and_change_nothing(doors, lifts):
    door, lift = doors[0], lifts[0]
    door.reset(seed=0)
    lift.reset(seed=0)
    state = lift.physics_state
    with pytest.raises(ConfigError, match=r"not of this scene.*bodies or joints"):
        lift.reset_to(door.physics_state)
    np.testing.assert_array_equal(lift.physics_state, state)
    lift.step(lift.hold_action)
    damaged = state.copy()
    damaged[-20] = 0.5
    with pytest.raises(ConfigError, match="numbers that cannot be"):
        lift.reset_to(damaged)


def test_a_scene_that_draws_otherwise_is_refused(doors):
    door = doors[0]
    door.reset(seed=0)
    state, given = door.physics_state, door.benchmark.sampler

    class Later:
        def sample(self, rng, objects, taken):
            rng.uniform()
            return given.sample(rng, objects, taken)

    moved = wbc_suite.make("Door", robots="Panda", placement_initializer=Later())
    with pytest.raises(ConfigError, match="draws poses and sizes of objects otherwise"):
        moved.reset_to(state)
    with pytest.raises(PhysicsError, match=r"Call reset\(\) first"):
        moved.step(moved.hold_action)
    moved.reset(seed=0)
    moved.step(moved.hold_action)


def test_another_controller_starts_from_the_world_of_a_state(lifts):
    """As where demonstrations of one controller are starts of another."""
    state, arrays, *_ = saved_midway(lifts[0])
    other = wbc_suite.make("Lift", robots="Panda", controller_configs="OSC_POSITION")
    other.reset_to(state)
    assert differing(arrays, arrays_of(other)) == []
    before = other.simulation.data.qpos.copy()
    other.step(other.hold_action)
    assert np.abs(other.simulation.data.qpos - before).max() < 0.2


def test_time_positions_and_velocities_alone_keep_what_a_reset_draws(lifts):
    env = lifts[0]
    env.reset(seed=1)
    short = env.physics_state[: motion_size(env.simulation.model)]
    env.reset(seed=2)
    env.reset_to(short)
    twin = copy.deepcopy(env)
    np.testing.assert_array_equal(env.physics_state, twin.physics_state)
    np.testing.assert_array_equal(env.physics_state[: short.size], short)


RANDOM = Randomisation(mass=0.3, friction=0.3, latency=(0.06, 0.14))


def test_randomisation_and_waiting_actions_are_part_of_a_state():
    """A delay of more than a control period leaves actions waiting."""
    check_goes_on(
        *(wbc_suite.make("Lift", robots="Panda", randomisation=RANDOM) for _ in "ab")
    )


def test_another_randomisation_is_drawn_anew(lifts):
    state, arrays, *_ = saved_midway(lifts[0])
    random = wbc_suite.make("Lift", robots="Panda", randomisation=RANDOM)
    masses = []
    for seed in (1, 2):
        random.reset(seed=seed)
        random.reset_to(state)
        masses.append(random.simulation.model.body_mass.copy())
        again = arrays_of(random)
        assert np.array_equal(again["geom_size"], arrays["geom_size"])
        assert np.array_equal(again["data.qpos"], arrays["data.qpos"])
    assert np.abs(masses[0] - masses[1]).max() > 0.01


def test_a_push_goes_on_where_it_was(lifts):
    env, fresh = lifts
    body = env.simulation.model.body("cube").id
    push = Push(body=body, force=(0.3, 0.0, 0.0), start=0.08, stop=0.23)
    env.pushes = fresh.pushes = (push,)
    try:
        check_goes_on(env, fresh)
    finally:
        env.pushes = fresh.pushes = ()


def test_shown_states_wipe_marks_and_change_no_episode():
    env = wbc_suite.make("Wipe", robots="Panda")
    env.reset(seed=0)
    env.benchmark.wipe(np.arange(100) < 30)
    state, colors = env.physics_state, env.simulation.model.geom_rgba.copy()
    env.reset(seed=0)
    assert env.benchmark.portion == 0.0
    env.show_state(state)
    assert env.benchmark.portion == 0.3
    np.testing.assert_array_equal(env.simulation.model.geom_rgba, colors)


def test_states_of_a_start_do_not_depend_on_what_was_before(lifts):
    used, new = lifts[0], wbc_suite.make("Lift", robots="Panda")
    saved_midway(used)
    for env in (used, new):
        env.reset(seed=5)
    np.testing.assert_array_equal(used.physics_state, new.physics_state)


@pytest.mark.parametrize("part", ["OSC_POSE", "JOINT_POSITION"])
def test_gains_outlive_a_reset_unless_actions_set_them(part):
    def made(mode):
        right = {"type": part, "impedance_mode": mode, "kp": 100.0}
        config = {"type": "BASIC", "body_parts": {"right": right}}
        env = wbc_suite.make("Lift", robots="Panda", controller_configs=config)
        env.reset(seed=0)
        return env, env.controllers[0].parts["right"].law

    env, law = made("fixed")
    law.gains[0][:] = 250.0
    env.reset(seed=1)
    env.reset_to(made("fixed")[0].physics_state)
    assert np.all(law.gains[0] == 250.0)

    pair = [made("variable")[0] for _ in range(2)]
    check_goes_on(*pair)
    law = pair[0].controllers[0].parts["right"].law
    assert np.any(law.gains[0] != 100.0)
    pair[0].reset(seed=1)
    assert np.all(law.gains[0] == 100.0)


def test_generators_are_words_and_back():
    rng = np.random.default_rng(5)
    rng.integers(10, dtype=np.int32)  # half of a word waits
    twin = generator_of(words_of(rng))
    assert twin.bit_generator.state == rng.bit_generator.state
    np.testing.assert_array_equal(twin.uniform(size=5), rng.uniform(size=5))
    words = words_of(rng)
    origin = Origin(words, words, 1, 2, 3, 4)
    assert Origin.parse(np.array([9.0, *origin.values])) == origin


def test_other_generators_draw_scenes_too(lifts):
    env, fresh = lifts
    env.np_random = np.random.Generator(np.random.MT19937(3))
    try:
        env.begin()
        state, arrays = env.physics_state, arrays_of(env)
    finally:
        env.reset(seed=0)
    fresh.reset_to(state)
    assert differing(arrays, arrays_of(fresh)) == []


def test_an_environment_says_what_it_is(lifts):
    shown = "<RobotEnv Lift: Panda by BASIC; 7 values of an action, 20 Hz>"
    assert repr(lifts[0]) == str(lifts[0]) == shown
