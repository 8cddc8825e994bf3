"""A composed scene touches as its shapes do, however lean it is."""

import mujoco
import numpy as np
import pytest
from pydantic import ValidationError

from wbc_suite.benchmark import load_benchmark
from wbc_suite.robot import load_robot
from wbc_suite.robot.mjcf_export import build_mjspec
from wbc_suite.scene import (
    TableConfig,
    add_tables,
    attach_robot,
    compile_scene,
    empty_arena,
)
from wbc_suite.scene.objects import box

POSTURES = 60


def scene(robot):
    benchmark, spec = load_benchmark("Lift"), empty_arena()
    benchmark.build(spec)
    (robot,) = benchmark.arrange([robot], "default")
    attach_robot(spec, robot, "robot0_")
    return spec


def contacts(model, postures):
    """Return pairs of names, distances and places, sorted, of each posture."""
    data, found = mujoco.MjData(model), []
    for q in postures:
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        found.append(
            sorted(
                (*sorted(model.geom(g).name for g in c.geom), c.dist, *c.pos)
                for c in data.contact
            )
        )
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Panda", "GR1", "Tiago", "SpotWithArm"])
def test_a_lean_scene_finds_every_contact(name, monkeypatch):
    robot = load_robot(name)
    lean = compile_scene(scene(robot))
    monkeypatch.setattr(
        type(robot), "to_mjspec", lambda self: build_mjspec(self, merged=False)
    )
    plain = scene(robot).compile()
    assert plain.ngeom > 1.4 * lean.ngeom
    rng = np.random.default_rng(0)
    limited = plain.jnt_limited.astype(bool)
    where, ranges = plain.jnt_qposadr[limited], plain.jnt_range[limited]
    postures = np.tile(plain.qpos0, (POSTURES, 1))
    postures[:, where] = rng.uniform(*ranges.T, (POSTURES, len(where)))
    expected, found = contacts(plain, postures), contacts(lean, postures)
    assert sum(map(len, expected)) > POSTURES
    for one, other in zip(expected, found, strict=True):
        assert [c[:2] for c in one] == [c[:2] for c in other]
        np.testing.assert_array_equal([c[2:] for c in one], [c[2:] for c in other])


def test_several_tables_stand_where_they_should_and_hold_what_falls_on_them():
    spec, centers = empty_arena(), {"left": (0.0, 0.5, 0.7), "right": (0.1, -0.5, 0.9)}
    add_tables(spec, TableConfig(size=(0.6, 0.4, 0.04)), centers)
    for name, (x, y, z) in centers.items():
        box("on_" + name, (0.02, 0.02, 0.02)).add_to(spec)
        spec.body("on_" + name).pos = (x + 0.28, y, z + 0.025)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 100)
    for name, (_, _, z) in centers.items():
        assert data.body("on_" + name).xpos[2] == pytest.approx(z + 0.02, abs=1e-3)
    with pytest.raises(ValidationError, match="no room for legs"):
        add_tables(empty_arena(), TableConfig(), {"low": (0.0, 0.0, 0.05)})


def test_only_what_collides_bounds_a_body():
    model = compile_scene(scene(load_robot("Panda")))
    collides = (model.geom_contype | model.geom_conaffinity) > 0
    assert not model.geom_rbound[~collides].any()
    sized = collides & (model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE)
    assert model.geom_rbound[sized].all()
