"""Every robot with every gripper on every base: possible ones move, others raise.

The catalogue is walked, so a new file is covered by being there. Robots that are others
with another gripper, base or lock are their product already, and walk once.
"""

import itertools
from typing import NamedTuple

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import wbc_suite
from wbc_suite.catalogue import Catalogue
from wbc_suite.errors import DescriptionError
from wbc_suite.robot.assembly import read_assembly
from wbc_suite.robot.component_choice import is_bare
from wbc_suite.robot.robot_file import read_robot_file

CATALOGUE = Catalogue()
ACTIONS = 200


class Combination(NamedTuple):
    """Arguments of `load_robot`."""

    robot: str
    gripper: str | None
    base: str | None

    def __str__(self):
        return "-".join(map(str, self))

    def load(self):
        """Load it; a hand for one side goes to that side only."""
        gripper = self.gripper
        side = HANDS.get(str(gripper))
        if side is not None:
            gripper = {side: gripper}
        return wbc_suite.load_robot(self.robot, gripper=gripper, base=self.base)


def headers(folder):
    return {p.stem: read_robot_file(p) for p in CATALOGUE.files(folder)}


def assemblies():
    """One assembly for each set of components that stay, and the sides of its hands."""
    found = {}
    for path in CATALOGUE.files("robots"):
        parts = read_assembly(path, CATALOGUE).parts
        kept = tuple((p.component, p.side) for p in parts if p.choice is None)
        found.setdefault(kept, (path, parts))
    return {path.stem: parts for path, parts in found.values()}


HANDS = {n: c.component.side for n, c in headers("robots/gripper").items()}
BASES = {name: is_bare(component) for name, component in headers("robots/base").items()}
ROBOTS = assemblies()


def product():
    """Return all combinations that make sense, and all pairs that do not."""
    sensible, other = [], []
    for robot, parts in ROBOTS.items():
        sides = {p.side for p in parts if p.choice == "gripper"}
        on_base = any(p.choice == "base" for p in parts)
        fits = {g: bool(sides) and side in (None, *sides) for g, side in HANDS.items()}
        possible = {b: bare or on_base for b, bare in BASES.items()}
        grippers = ("none", *(g for g in fits if fits[g]))
        bases = (None, *(b for b in possible if possible[b]))
        sensible += [Combination(robot, *x) for x in itertools.product(grippers, bases)]
        other += [Combination(robot, g, None) for g in fits if not fits[g]]
        other += [Combination(robot, None, b) for b in possible if not possible[b]]
    return sensible, other


SENSIBLE, OTHER = product()


def sample(seed=0):
    """Shuffle, and keep what shows a robot, a gripper or a base for the first time.

    What shows two of them for the first time goes first: fewer are needed then.
    """
    order = np.random.default_rng(seed).permutation(len(SENSIBLE))
    seen: set[tuple[int, str | None]] = set()
    chosen = []
    for wanted in (3, 2, 1):
        for combination in (SENSIBLE[i] for i in order):
            new = set(enumerate(combination)) - seen
            if len(new) >= wanted:
                chosen.append(combination)
                seen |= new
    return chosen


def scene_of(spec):
    floor = spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0, 0, 1))
    floor.name = "floor"
    spec.option.timestep = 0.002
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    return spec


def check(combination):
    """Build, compile, compare the exports at `ready`, and step random actions."""
    robot = combination.load()
    m = scene_of(robot.to_mjspec()).compile()
    d = mujoco.MjData(m)
    model = robot.to_pinocchio()
    assert [m.joint(i).name for i in range(m.njnt)] == list(model.names)[1:]
    assert m.nv == model.nv
    mujoco.mj_resetDataKeyframe(m, d, m.key("ready").id)
    mujoco.mj_forward(m, d)
    q = model.referenceConfigurations["ready"]
    gravity = pin.rnea(model, model.createData(), q, np.zeros(m.nv), np.zeros(m.nv))
    if robot.root.kind == "free":  # MuJoCo's is along the world's axes
        gravity[:3] = pin.Quaternion(q[3:7]).matrix() @ gravity[:3]
    np.testing.assert_allclose(d.qfrc_bias, gravity, atol=1e-8)
    rng = np.random.default_rng(len(combination.robot))
    low, high = m.actuator_ctrlrange.T
    assert m.actuator_ctrllimited.all()
    for _ in range(ACTIONS):
        d.ctrl[:] = rng.uniform(low, high)
        mujoco.mj_step(m, d)
    assert np.isfinite(d.qpos).all()
    assert np.isfinite(d.qvel).all()
    assert not any(w.number for w in d.warning), [w.number for w in d.warning]
    force = np.abs(d.actuator_force)
    assert (force <= np.abs(m.actuator_forcerange).max(axis=1) + 1e-9).all()
    assert d.time == pytest.approx(ACTIONS * 0.002)


def test_the_sample_covers_every_robot_gripper_and_base():
    for k, names in enumerate((ROBOTS, HANDS, BASES)):
        assert {c[k] for c in sample()} >= set(names)


@pytest.mark.parametrize("combination", sample(), ids=str)
def test_combination_moves(combination):
    check(combination)


@pytest.mark.sample(5)
@pytest.mark.slow
@pytest.mark.parametrize("robot", ROBOTS)
def test_all_combinations_move(robot):
    own = [c for c in SENSIBLE if c.robot == robot]
    assert own
    for combination in own:
        try:
            check(combination)
        except Exception as fault:
            raise AssertionError(f"{combination}: {fault}") from fault


@pytest.mark.parametrize("combination", OTHER, ids=str)
def test_an_impossible_combination_is_refused(combination):
    with pytest.raises(
        DescriptionError, match=r"does not fit|without a body fit|no place"
    ):
        wbc_suite.load_robot(
            combination.robot, gripper=combination.gripper, base=combination.base
        )


def test_names_need_neither_case_nor_underscores():
    robot = wbc_suite.load_robot("PANDA", gripper="Fourier_RightHand", base="nullmount")
    same = wbc_suite.load_robot("panda", gripper="fourier_right_hand", base="NullMount")
    assert robot == same
