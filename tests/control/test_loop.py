"""The compiled loop does what the plain one does, for any mix of laws."""

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import mujoco
import numpy as np
import pytest

import wbc_suite
from wbc_suite import compiling
from wbc_suite.control.composite.whole_body import WholeBodyIK
from wbc_suite.control.loop import advance
from wbc_suite.control.loop.haste import Haste, begin_haste, end_haste

CASES = [
    ("Panda", "BASIC"),
    ("Panda", "WHOLE_BODY_IK"),
    ("Tiago", "BASIC"),
    pytest.param("Baxter", "BASIC", marks=pytest.mark.slow),
    pytest.param("GR1", "BASIC", marks=pytest.mark.slow),
    pytest.param("GR1", "WHOLE_BODY_IK", marks=pytest.mark.slow),
    ("SpotWithArm", "WHOLE_BODY_IK"),
    ("GR1FreeBody", "BASIC"),
    pytest.param("SpotWithArm", "BASIC", marks=pytest.mark.slow),
    pytest.param("GR1FreeBody", "WHOLE_BODY_IK", marks=pytest.mark.slow),
    pytest.param("PandaOmron", "HYBRID_MOBILE_BASE", marks=pytest.mark.slow),
    pytest.param("TiagoDifferential", "BASIC", marks=pytest.mark.slow),
]

# Where a bound is only just met, rounding decides whether the active set of before or
# the solver answers; their optima of a whole body's second level are within 1.4e-8 rad
# of each other, and feet on the floor make 2e-6 rad/s of it. Before that: 3e-12.
CLOSE = {("GR1FreeBody", "WHOLE_BODY_IK"): 1e-5}


def made(robot, controller, **arguments):
    return wbc_suite.make(
        "Lift", robots=robot, controller_configs=controller, **arguments
    )


def states_of(env, actions):
    """Return qpos and qvel after each action."""
    env.reset(seed=3)
    found = []
    for action in actions:
        env.step(env.hold_action + action)
        data = env.unwrapped.simulation.data
        found.append(np.concatenate([data.qpos, data.qvel]))
    return np.array(found)


def moves(env, count=8):
    rng = np.random.default_rng(0)
    return rng.uniform(-0.1, 0.1, (count, env.action_space.shape[0]))


@pytest.mark.slow
@pytest.mark.parametrize(("robot", "controller"), CASES)
def test_plain_and_compiled_loop_give_the_same_states(robot, controller):
    compiled, plain = (made(robot, controller, compiled=c) for c in (True, False))
    assert compiled.simulation.compiled
    assert not plain.simulation.compiled
    actions, close = moves(compiled), CLOSE.get((robot, controller), 1e-7)
    expected = states_of(plain, actions)
    np.testing.assert_allclose(states_of(compiled, actions), expected, atol=close)
    assert np.ptp(expected, axis=0).max() > 1e-3  # it moved


def test_same_seed_gives_bit_equal_states():
    env = made("Panda", "BASIC")
    actions = moves(env)
    first = states_of(env, actions)
    np.testing.assert_array_equal(states_of(env, actions), first)
    again = states_of(made("Panda", "BASIC"), actions)
    np.testing.assert_array_equal(again, first)


@pytest.mark.parametrize(("controller", "calls"), [("BASIC", 1), ("WHOLE_BODY_IK", 5)])
def test_an_action_is_one_call_per_solve(controller, calls, monkeypatch):
    """25 steps of physics: at once, or five between solves at 100 Hz."""
    env = made("Panda", controller)
    env.reset(seed=0)
    counted = []

    def count(*arguments):
        counted.append(arguments[-2:])
        return advance(*arguments)

    monkeypatch.setattr("wbc_suite.envs.simulation.advance", count)
    env.step(env.hold_action)
    assert [steps for steps, _ in counted] == [25 // calls] * calls
    assert [seen for _, seen in counted] == [False] * (calls - 1) + [True]


def test_what_nobody_sees_between_solves_changes_nothing(monkeypatch):
    """Poses and sensors are brought up to date at the end of an action alone."""
    seen = made("Panda", "WHOLE_BODY_IK")
    monkeypatch.setattr(WholeBodyIK, "looks", True)
    looked_at = made("Panda", "WHOLE_BODY_IK")
    monkeypatch.undo()
    rng = np.random.default_rng(0)
    for env in (seen, looked_at):
        env.reset(seed=0)
    for _ in range(10):
        action = seen.hold_action + rng.uniform(-0.02, 0.02, seen.hold_action.size)
        one, other = seen.step(action)[0], looked_at.step(action)[0]
        for key in one:
            np.testing.assert_array_equal(one[key], other[key], err_msg=key)
        for name in ("qpos", "qvel", "qacc", "xpos", "geom_xpos", "sensordata"):
            ours, theirs = (getattr(e.simulation.data, name) for e in (seen, looked_at))
            np.testing.assert_array_equal(ours, theirs, err_msg=name)


def test_a_subclass_that_prepares_otherwise_sees_poses():
    class Own(WholeBodyIK):
        def prepare(self, state):
            return super().prepare(state)

    assert object.__new__(Own).looks
    assert not object.__new__(WholeBodyIK).looks


def test_positions_after_a_step_are_those_of_the_joints():
    env = made("Panda", "BASIC")
    env.reset(seed=0)
    action = env.hold_action
    action[:3] = 1.0
    observation, *_ = env.step(action)
    simulation = env.simulation
    data = mujoco.MjData(simulation.model)
    data.qpos[:] = simulation.data.qpos
    mujoco.mj_kinematics(simulation.model, data)
    site = simulation.model.site("robot0_right_tcp").id
    np.testing.assert_array_equal(observation["robot0_eef_pos"], data.site_xpos[site])


def test_loop_takes_no_time_for_the_profiler_and_leaves_it_on():
    env = made("Panda", "BASIC")
    env.reset(seed=0)
    model, data = env.simulation.model, env.simulation.data
    before = data.timer.duration.copy()
    env.step(env.hold_action)
    np.testing.assert_array_equal(data.timer.duration, before)
    mujoco.mj_step(model, data)
    assert (data.timer.duration > before).any()


def test_full_physics_reads_sensors_of_the_new_state_and_changes_none():
    lite, full = (made("Panda", "BASIC", lite_physics=x) for x in (True, False))
    actions = moves(lite)
    np.testing.assert_array_equal(states_of(lite, actions), states_of(full, actions))
    model, data = full.simulation.model, full.simulation.data
    before = data.qacc.copy()
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.qacc, before, rtol=1e-6, atol=1e-6)
    assert not np.allclose(lite.simulation.data.qacc, before, rtol=1e-6, atol=1e-6)


SPANS = ("body_geomadr", "body_geomnum")


def test_hasty_steps_change_nothing_that_is_seen():
    """A hand that runs into the table: states, contacts and sensors, bit for bit."""
    hasty, never = made("Panda", "BASIC"), made("Panda", "BASIC")
    never.simulation._haste[Haste.MAY][:] = False
    model, data = hasty.simulation.model, hasty.simulation.data
    flags, spans = model.opt.disableflags, [getattr(model, s).copy() for s in SPANS]
    assert not flags & int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
    actions = moves(hasty, count=24)
    actions[:, 2] = -1.0  # down
    np.testing.assert_array_equal(states_of(hasty, actions), states_of(never, actions))
    other = never.simulation.data
    assert data.sensordata.any()
    np.testing.assert_array_equal(data.sensordata, other.sensordata)
    np.testing.assert_array_equal(data.cfrc_int, other.cfrc_int)
    np.testing.assert_array_equal(data.geom_xpos, other.geom_xpos)
    touching = {model.geom(g).name for g in data.contact.geom.ravel()}
    assert any("hand" in name or "finger" in name for name in touching)
    np.testing.assert_array_equal(data.contact.geom, other.contact.geom)
    assert model.opt.disableflags == flags
    for name, span in zip(SPANS, spans, strict=True):
        np.testing.assert_array_equal(getattr(model, name), span)


def test_hasty_steps_show_the_broadphase_what_collides_alone():
    """Bodies hide geoms that are only drawn, and none that is made to collide later."""
    env = made("Panda", "BASIC")
    model, table = env.simulation.model, env.simulation._haste.table
    hand = model.body("robot0_panda_hand").id
    geoms = np.flatnonzero(model.geom_bodyid == hand)
    solid = geoms[model.geom_contype[geoms] > 0]
    assert len(solid) < len(geoms)
    for expected in (solid, geoms):
        begin_haste(table)
        first, count = model.body_geomadr[hand], model.body_geomnum[hand]
        end_haste(table)
        assert list(range(first, first + count)) == list(expected)
        model.geom_contype[geoms] = 1


def test_sensors_that_are_switched_off_stay_off():
    env = made("Panda", "BASIC")
    env.reset(seed=0)
    simulation = env.simulation
    simulation.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SENSOR
    before = simulation.data.sensordata.copy()
    env.step(env.hold_action + 0.1)
    np.testing.assert_array_equal(simulation.data.sensordata, before)


@pytest.fixture
def machine_code(monkeypatch, tmp_path):
    """Machine code is kept in an empty folder."""
    memories = compiling.cache_folder, compiling._parent, compiling._sources
    monkeypatch.setattr(compiling, "user_cache", lambda: tmp_path)
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    for memory in memories:
        memory.cache_clear()
    yield tmp_path / "compiled"
    for memory in memories:
        memory.cache_clear()


def test_machine_code_of_other_sources_is_not_used(machine_code, monkeypatch, tmp_path):
    """A law's folder changes with a file that only its imports import, and no other."""
    package = tmp_path / compiling._PACKAGE.name
    shutil.copytree(compiling._PACKAGE / "control", package / "control")
    monkeypatch.setattr(compiling, "_PACKAGE", package)
    loop = package / "control" / "loop"
    laws, other = loop / "advance.py", loop / "window.py"

    def folders():
        compiling.cache_folder.cache_clear()
        return [compiling.cache_folder(file) for file in (laws, other)]

    first = folders()
    assert first[0].parent == machine_code
    assert first == folders()
    changed = loop / "straight.py"
    changed.write_text(changed.read_text() + "# changed\n")
    second = folders()
    assert second[0] != first[0]
    assert second[1] == first[1]


def test_machine_code_that_is_long_unused_is_deleted(machine_code):
    for age, name in ((0.5, "recent"), (1.5, "old")):
        folder = machine_code / name
        folder.mkdir(parents=True)
        then = time.time() - age * compiling.KEPT
        os.utime(folder, (then, then))
    present = compiling.cache_folder(Path(compiling.__file__)).name
    kept = {folder.name for folder in machine_code.iterdir()}
    assert kept == {present, "recent"}


@pytest.mark.slow
def test_a_second_process_finds_the_machine_code():
    """Nothing is compiled again: the loop's statistics count hits of the cache."""
    code = (
        "import wbc_suite; from wbc_suite.control.loop import advance;"
        "wbc_suite.make('Lift', robots='Panda', controller_configs='BASIC');"
        "hits = sum(advance.stats.cache_hits.values());"
        "print(hits, sum(advance.stats.cache_misses.values()))"
    )
    for _ in range(2):
        result = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        )
    assert result.stdout.split() == ["1", "0"]
