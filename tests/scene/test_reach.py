"""Links that floors ignore cannot touch them, and nothing else changes."""

import mujoco
import numpy as np
import pytest

import wbc_suite
from wbc_suite.scene import attach_robot, compile_scene, empty_arena
from wbc_suite.scene.compose import place_robot

FLOOR = 0
BITS = ("geom_contype", "geom_conaffinity", "body_contype", "body_conaffinity")


def scene_of(robot: str) -> mujoco.MjSpec:
    """Return a robot on the floor, and a ball that lies on its own."""
    spec = empty_arena()
    placed = place_robot(wbc_suite.load_robot(robot), (0.0, 0.0), 0.0)
    attach_robot(spec, placed, "robot0_")
    ball = spec.worldbody.add_body(name="ball", pos=(2.0, 0.0, 0.049))
    ball.add_freejoint()
    ball.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=(0.05, 0.0, 0.0))
    return spec


def touching(model: mujoco.MjModel, qpos: np.ndarray) -> list[tuple[int, int]]:
    """Return the pairs of geoms in contact, one entry per contact."""
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_fwdPosition(model, data)
    return sorted((int(c.geom1), int(c.geom2)) for c in data.contact)


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["Panda", "Tiago", "GR1", "UR5e"])
def test_contacts_are_those_of_a_scene_without_bits(robot: str) -> None:
    """Random postures: arms touch themselves, mounts, and the floor where they can."""
    spec = scene_of(robot)
    plain, ours = spec.compile(), compile_scene(spec)
    rng = np.random.default_rng(0)
    low, high = plain.jnt_range.T
    found = 0
    for _ in range(60):
        qpos = plain.qpos0.copy()
        for joint in np.flatnonzero(plain.jnt_limited):
            qpos[plain.jnt_qposadr[joint]] = rng.uniform(low[joint], high[joint])
        expected = touching(plain, qpos)
        assert touching(ours, qpos) == expected
        found += len(expected)
    assert found > 60  # the ball's own, and others


def test_floor_ignores_the_links_of_an_arm_on_a_pedestal() -> None:
    """A Panda's finger tips stay 10 cm above it, so its links have other bits."""
    model = compile_scene(scene_of("Panda"))
    far = np.flatnonzero(model.body_contype == 2)
    links = {model.body(b).name for b in far}
    assert {"robot0_panda_link1", "robot0_panda_leftfinger"} <= links
    assert not {"ball", "robot0_pedestal", "world"} & links
    assert model.geom_contype[FLOOR] == model.geom_conaffinity[FLOOR] == 1


def test_floor_sees_links_of_what_can_come_down_to_it() -> None:
    """An arm on the floor, and one whose root floats, keep MuJoCo's own bits."""
    low, floating = empty_arena(), empty_arena()
    arm = wbc_suite.load_robot("Panda").with_root("fixed", pos=(0.0, 0.0, 0.2))
    attach_robot(low, arm, "a_")
    attach_robot(floating, wbc_suite.load_robot("GR1FloatingBody"), "a_")
    near, free = compile_scene(low), compile_scene(floating)
    bits = {near.body(b).name: near.body_contype[b] for b in range(near.nbody)}
    assert bits["a_panda_link2"] == 2  # its shoulder stays above
    assert bits["a_panda_leftfinger"] != 2
    assert not np.any(free.body_contype == 2)


def test_scene_with_bits_of_its_own_is_left_alone() -> None:
    """Whoever uses bits of collision has given them a meaning."""
    spec = scene_of("Panda")
    spec.geom("floor").contype = 4
    plain, ours = spec.compile(), compile_scene(spec)
    for name in BITS:
        np.testing.assert_array_equal(getattr(ours, name), getattr(plain, name))
