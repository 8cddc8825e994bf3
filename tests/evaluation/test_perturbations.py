"""Perturbations change what they name, by the seed, and nothing else."""

import numpy as np
import pytest

import wbc_suite
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.evaluation import PERTURBATIONS, Case, plan_rollouts, run_rollouts
from wbc_suite.evaluation.rollouts import make_case, payload_of

ARRAYS = {
    "camera": {"cam_pos", "cam_quat", "cam_fovy"},
    "light": {"light_pos", "light_dir", "light_diffuse"},
    "colour": {"geom_rgba", "mat_rgba", "tex_data"},
    "layout": set(),
    "start": set(),
    "wording": set(),
}
WATCHED = set().union(*ARRAYS.values()) | {"body_mass", "geom_friction", "geom_pos"}


def made(perturb, benchmark="Lift"):
    case = Case(benchmark=benchmark, robots=("Panda",), perturb=perturb)
    return make_case(payload_of(case))


def arrays(env, seed):
    env.reset(seed=seed)
    return {name: getattr(env.simulation.model, name).copy() for name in WATCHED}


def test_all_perturbations_are_tested():
    assert {*PERTURBATIONS} == {*ARRAYS}


@pytest.mark.parametrize("name", ARRAYS)
def test_a_perturbation_draws_its_own_properties_by_the_seed(name):
    usual, env = arrays(made(""), 3), made(name)
    first, again, other = arrays(env, 3), arrays(env, 3), arrays(env, 4)
    changed = {key for key in WATCHED if not np.array_equal(first[key], usual[key])}
    assert changed == ARRAYS[name]
    assert all(np.array_equal(first[key], again[key]) for key in WATCHED)
    assert all(not np.array_equal(first[key], other[key]) for key in changed)


def test_a_wider_layout_goes_beyond_the_usual_region_by_half():
    env, usual = made("layout"), made("").benchmark.config.cube.region
    places = []
    for seed in range(60):
        env.reset(seed=seed)
        places.append(env.benchmark.states["cube"].position[0])
    (low, high), half = usual.x, (usual.x[1] - usual.x[0]) / 2
    assert min(places) < low
    assert max(places) > high
    assert min(places) >= low - half / 2 - 1e-9
    assert max(places) <= high + half / 2 + 1e-9


def test_a_layout_that_bins_bound_cannot_be_wider():
    with pytest.raises(ConfigError, match="no region of start poses"):
        made("layout", "PickPlaceCan")


def test_another_start_moves_the_joints_five_times_as_far():
    spread = {}
    for name in ("", "start"):
        env, found = made(name), []
        for seed in range(30):
            env.reset(seed=seed)
            found.append(env.simulation.robots[0].q[:7])
        spread[name] = np.std(found, axis=0).mean()
    assert spread["start"] == pytest.approx(5 * spread[""], rel=0.01)


def test_another_wording_is_none_of_those_of_recordings():
    env, config = made("wording"), made("").benchmark.config
    env.reset(seed=0)
    assert env.instruction in config.paraphrases
    assert not {*config.paraphrases} & {*config.instructions}


def test_episodes_of_a_perturbation_are_a_case_of_their_own(tmp_path):
    cases = [
        Case(
            benchmark="Lift",
            robots=("Panda",),
            policy="hold",
            perturb=name,
            arguments=(("horizon", 3),),
        )
        for name in ("", "start")
    ]
    items = plan_rollouts(cases, seeds=range(2), chunk=2)
    assert len({item.name for item in items}) == 2
    assert cases[1].title == "Lift Panda hold with another start"
    usual, perturbed = (run_rollouts(item, tmp_path)["episodes"] for item in items)
    assert [e["seed"] for e in usual] == [e["seed"] for e in perturbed] == [0, 1]
    with pytest.raises(UnknownNameError, match="Did you mean 'camera'"):
        made("camra")


def test_instructions_name_the_thing_that_was_drawn_in_three_wordings():
    env, seen = wbc_suite.make("PickPlaceSingle", robots="Panda"), set()
    for seed in range(40):
        env.reset(seed=seed)
        (thing,) = env.benchmark.sorting.active
        words = env.instruction
        assert f"the {thing.lower()}" in words
        assert "its container" in words
        seen.add(words.replace(thing.lower(), "*"))
        env.reset(seed=seed)
        assert env.instruction == words
    assert len(seen) == 3


def test_instructions_of_several_things_are_sentences():
    env = wbc_suite.make("NutAssembly", robots="Panda")
    env.reset(seed=0)
    assert "the square nut and the round nut" in env.instruction
    assert env.instruction.endswith("their pegs")


@pytest.mark.parametrize("name", wbc_suite.benchmark.BENCHMARKS)
def test_every_benchmark_has_three_instructions_and_a_paraphrase(name):
    benchmark = wbc_suite.benchmark.load_benchmark(name)
    wordings = {benchmark.instruction(k) for k in range(3)}
    assert len(wordings) == 3
    assert benchmark.instruction(0, paraphrased=True) not in wordings
    assert not any("{" in words or words == name for words in wordings)
