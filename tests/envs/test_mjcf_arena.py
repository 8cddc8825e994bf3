"""Scenes of others as arenas: places, things with states, recordings, and errors."""

import logging
import math
import pickle

import gymnasium
import mujoco
import numpy as np
import pytest
from kitchen import COUNTER, MIDDLE, write_kitchen

import wbc_suite
from wbc_suite.errors import ConfigError, DatasetError, UnknownNameError
from wbc_suite.recording import Dataset, rebuild
from wbc_suite.recording.replaying import divergence
from wbc_suite.scene import ArenaConfig, empty_arena
from wbc_suite.wrappers import DataCollection

THINGS = {"drawer_joint", "cupboard_door_joint", "mug_pos", "mug_quat"}


@pytest.fixture(scope="module")
def kitchen(tmp_path_factory):
    return write_kitchen(tmp_path_factory.mktemp("kitchen"), robot=True)


@pytest.fixture(scope="module")
def lift(kitchen):
    return wbc_suite.make("Lift", robots="Panda", arena=kitchen)


def test_the_counter_replaces_the_table(lift):
    seen, _ = lift.reset(seed=1)
    model = lift.simulation.model
    np.testing.assert_allclose(lift.benchmark.config.table.center, (0, 0, COUNTER))
    assert "table" not in {model.body(i).name for i in range(model.nbody)}
    top = lift.simulation.data.geom("arena_top")
    # the benchmark's origin is 25 cm behind the front edge
    np.testing.assert_allclose(top.xpos, (0.05, 0, COUNTER - 0.02), atol=1e-12)
    # the wall is at +y of the scene, so the robot, at -x here, looks along its +y
    turned = top.xmat.reshape(3, 3)[:2, :2]
    np.testing.assert_allclose(turned, [[0, 1], [-1, 0]], atol=1e-12)
    for _ in range(20):
        seen, *_ = lift.step(lift.hold_action)
    low = lift.benchmark.config.cube.half_size
    assert COUNTER + low[0] - 0.002 < seen["cube_pos"][2] < COUNTER + low[1]


def test_things_are_observed_and_known_to_the_task(lift):
    seen, _ = lift.reset(seed=1)
    assert set(seen) >= THINGS
    # the mug is 0.3 m to the right of the middle and 25 cm from the edge
    np.testing.assert_allclose(seen["mug_pos"], (0.0, -0.3, 0.95), atol=1e-9)
    yaw = 2 * math.atan2(seen["mug_quat"][2], seen["mug_quat"][3])
    assert math.remainder(yaw + math.pi / 2, 2 * math.pi) == pytest.approx(0.0)
    states = lift.benchmark.states
    states["drawer"].joints[:] = 0.2
    states["mug"].move((-0.1, 0.3, 1.2))
    t, dt = 0.15, 0.002
    for _ in range(3):
        seen, *_ = lift.step(lift.hold_action)
    assert seen["mug_pos"][2] == pytest.approx(1.2 - 9.81 / 2 * t * (t + dt))
    assert seen["drawer_joint"] == pytest.approx(0.2, abs=1e-3)
    seen, _ = lift.reset(seed=1)
    assert seen["drawer_joint"] == 0.0
    np.testing.assert_allclose(seen["mug_pos"], (0.0, -0.3, 0.95), atol=1e-9)


def test_physics_options_are_ours_and_robots_of_the_file_are_left_out(kitchen, caplog):
    with caplog.at_level(logging.INFO):
        model = wbc_suite.make("Lift", arena=kitchen).simulation.model
    assert (model.opt.timestep, *model.opt.gravity) == (0.002, 0, 0, -9.81)
    assert "left out what its actuators move: intruder" in caplog.text
    assert "'top' at 0.900 m is the table" in caplog.text
    assert not any("intruder" in model.body(i).name for i in range(model.nbody))
    joint = model.joint("arena_hinge")
    assert joint.range[1] == pytest.approx(math.pi / 2)  # degrees in the file
    assert model.geom("arena_wall").friction[0] == 0.8  # the file's default


def test_episodes_record_and_replay_bit_by_bit(kitchen, tmp_path):
    path = tmp_path / "kitchen.hdf5"
    env = wbc_suite.make("Lift", robots="Panda", arena=kitchen, horizon=8)
    with_file = DataCollection(env, path)
    with_file.reset(seed=3)
    rng = np.random.default_rng(0)
    for _ in range(8):
        with_file.step(rng.uniform(-1.0, 1.0, env.action_space.shape))
    with_file.close()
    with Dataset(path) as dataset:
        (episode,) = dataset
        assert {key.removeprefix("obs/") for key in episode.columns} >= THINGS
        with pytest.raises(DatasetError, match="--trust-files"):
            rebuild(dataset)
        found = divergence(rebuild(dataset, trust_files=True), episode)
    assert found.exact


def test_states_and_pickles_continue_bit_by_bit(kitchen):
    env = wbc_suite.make("Lift", arena=str(kitchen))
    env.reset(seed=2)
    actions = np.random.default_rng(1).uniform(-1, 1, (6, *env.action_space.shape))
    for action in actions[:3]:
        env.step(action)
    state, copy = env.get_state(), pickle.loads(pickle.dumps(env))
    ends = []
    for one in (env, copy):
        for action in actions[3:]:
            one.step(action)
        ends.append(one.physics_state)
    env.set_state(state)
    for action in actions[3:]:
        env.step(action)
    np.testing.assert_array_equal(ends[0], ends[1])
    np.testing.assert_array_equal(ends[0], env.physics_state)


def test_a_benchmark_file_names_the_scene_its_surface_and_its_things(kitchen):
    file = kitchen.with_name("kitchen_lift.toml")
    lift = (wbc_suite.catalogue.Catalogue().find("tasks", "lift", kind="")).read_text()
    arena = '[arena]\nfile = "scene.xml"\nsurface = "top"\nthings = ["drawer"]\n'
    file.write_text(lift.replace("[table]", arena + "[table]"))
    seen, _ = wbc_suite.make(file).reset(seed=0)
    assert set(seen) & THINGS == {"drawer_joint"}
    assert seen["cube_pos"][2] > COUNTER


def test_the_step_and_gravity_of_a_scene_do_not_count(tmp_path):
    kitchen = write_kitchen(tmp_path)
    other = '<mujoco><option timestep="1" gravity="0 0 5"/>'
    kitchen.write_text(kitchen.read_text().replace("<mujoco>", other, 1))
    option = ArenaConfig(file=kitchen).build().option
    assert option.timestep == empty_arena().option.timestep
    assert option.gravity.tolist() == [0.0, 0.0, -9.81]


@pytest.mark.parametrize("name", ["../scene.xml", "/etc/passwd", "up/scene.xml"])
def test_a_benchmark_file_names_no_scene_outside_of_its_folder(tmp_path, name):
    kitchen = write_kitchen(tmp_path)
    folder = kitchen.parent / "mine"
    folder.mkdir()
    (folder / "up").symlink_to(kitchen.parent, target_is_directory=True)
    lift = (wbc_suite.catalogue.Catalogue().find("tasks", "lift", kind="")).read_text()
    (folder / "x.toml").write_text(f'{lift}\n[arena]\nfile = "{name}"\n')
    with pytest.raises(
        ConfigError, match=r"'arena.file' .line \d+.*outside the folder"
    ):
        wbc_suite.benchmark.load_benchmark(folder / "x.toml")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "robots"),
    [
        ("Stack", "UR5e"),
        ("Door", "Panda"),
        ("PickPlace", "Panda"),
        ("NutAssembly", "Sawyer"),
        ("Wipe", "Panda"),
        ("TwoArmLift", "Baxter"),
    ],
)
def test_other_benchmarks_stand_in_the_scene(tmp_path, name, robots):
    """Those with a table stand at an island, the others on the floor before it."""
    island = {"2 1.35 1.2": "2 4 1.2", "0.8 0.3 0.02": "0.8 0.4 0.02"}
    file = write_kitchen(tmp_path, **island)
    has_table = name != "PickPlace"
    arena = {"file": file} | ({} if has_table else {"at": (2.0, -1.5)})
    env = wbc_suite.make(name, robots=robots, arena=arena)
    env.reset(seed=0)
    for _ in range(5):
        seen, *_, info = env.step(env.hold_action)
    assert "physics_error" not in info
    assert set(seen) >= THINGS
    if has_table:
        assert env.benchmark.config.table.center[2] == pytest.approx(COUNTER)


def test_a_site_can_be_the_surface_and_the_place_can_be_given(kitchen):
    site = '<site name="spot" type="box" size="0.2 0.2 0.01" pos="-0.4 0 0.89"/>'
    file = kitchen.with_name("site.xml")
    text = kitchen.read_text()
    file.write_text(text.replace('<body name="drawer"', site + '<body name="drawer"'))
    arena = {"file": file, "surface": "spot"}
    env = wbc_suite.make("Lift", arena=arena)
    assert env.benchmark.arena.at == pytest.approx((MIDDLE[0] - 0.4, MIDDLE[1]))
    assert env.benchmark.config.table.size[:2] == pytest.approx((0.4, 0.4))
    given = {**arena, "at": (2.3, 1.05), "yaw": math.pi / 2}
    assert wbc_suite.make("Lift", arena=given).benchmark.arena.at == (2.3, 1.05)


def test_objects_do_not_start_in_things_of_the_arena(tmp_path):
    """A post stands on one half of the cube's region, so half of all places is free."""
    post = '<geom name="post" type="box" size="0.05 0.3 0.02" pos="0.06 0 0.92"/>'
    old = '<body name="drawer"'
    env = wbc_suite.make("Lift", arena=write_kitchen(tmp_path, **{old: post + old}))
    for seed in range(10):
        seen, _ = env.reset(seed=seed)
        assert seen["cube_pos"][1] > 0.0  # the post is at +x of the file, -y here


def test_gymnasium_ids_and_own_tables_take_a_scene(kitchen):
    arena = {"file": str(kitchen), "surface": "own", "at": (0.0, -1.0)}
    env = gymnasium.make("wbc_suite/Lift-v1", arena=arena).unwrapped
    env.reset(seed=0)
    assert env.benchmark.config.table.center == (0.0, 0.0, 0.8)
    model = env.simulation.model
    planes = model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE
    assert [model.geom(i).name for i in np.flatnonzero(planes)] == ["floor"]


@pytest.mark.parametrize(
    ("changes", "arena", "words"),
    [
        ({}, {"surface": "tap"}, "surface in .* named 'tap'. Did you mean 'top'?"),
        ({}, {"things": ["cup"]}, "No thing in .* named 'cup'"),
        ({}, {"surfaces": "top"}, "unknown key 'arena.surfaces'.* 'surface'"),
        ({}, {"at": (2.0, 1.3)}, "'robot0_.*' is in"),
        ({'name="mug"': 'name="cube"'}, {}, "both have 'cube'. Rename"),
        ({"0 0 0.88": "0 0 1.88"}, {}, "no level box .*top at 1.90 m of 1.60 x 0.60"),
        ({"0 0 0.88": "0 0 1.88"}, {"surface": "counter"}, "No surface"),
        ({"<asset>": "<assets>"}, {}, "not well-formed XML"),
        ({"cup.obj": "none.obj"}, {}, "MuJoCo refuses it"),
    ],
)
def test_what_is_wrong_is_said(tmp_path, changes, arena, words):
    file = write_kitchen(tmp_path, **changes)
    with pytest.raises((ConfigError, UnknownNameError), match=words):
        wbc_suite.make("Lift", arena={"file": file, **arena})


def test_missing_files_and_surfaces_without_a_table_are_refused(kitchen):
    with pytest.raises(ConfigError, match=r"none\.xml: cannot be read"):
        wbc_suite.make("Lift", arena="none.xml")
    with pytest.raises(ConfigError, match="PickPlace does not have exactly one table"):
        wbc_suite.make("PickPlace", arena={"file": kitchen, "surface": "top"})


def test_cameras_that_a_wall_hides_turn_until_they_see_the_table(lift):
    model, data = lift.simulation.model, lift.simulation.data
    lift.reset(seed=0)
    wall = model.geom("arena_wall").id
    for name in ("agentview", "frontview", "sideview"):
        eye, cube = data.camera(name).xpos, lift.benchmark.cube_position
        assert eye[0] < data.geom_xpos[wall, 0]  # which is across x
        ahead = -data.camera(name).xmat.reshape(3, 3)[:, 2]
        to_cube = (cube - eye) / np.linalg.norm(cube - eye)
        assert math.degrees(math.acos(ahead @ to_cube)) < 22.5  # half of the view
