import mujoco
import numpy as np
import pytest

from wbc_suite.errors import ConfigError, DescriptionError, UnknownNameError
from wbc_suite.scene import empty_arena, objects
from wbc_suite.scene.objects import MjcfObject, ObjectState, Part, SceneObject

STANDING = [
    objects.box("t", (0.02, 0.03, 0.04)),
    objects.cylinder("t", 0.03, 0.05),
    objects.can("t"),
    objects.milk("t"),
    objects.bread("t"),
    objects.cereal("t"),
    objects.bottle("t"),
    objects.pot("t"),
    objects.open_bin("t", (0.3, 0.2, 0.1)),
    objects.lid("t", (0.3, 0.2, 0.01)),
    objects.hollow_cylinder("t", 0.03, 0.04, 0.05),
    objects.plate_with_hole("t"),
    objects.square_nut("t"),
    objects.round_nut("t"),
    objects.wrench("t"),
    objects.stand("t"),
]
LABELS = [thing.parts[0].kind + str(k) for k, thing in enumerate(STANDING)]


def simulate(thing, *, seconds=0.5, quat=(1.0, 0.0, 0.0, 0.0)):
    spec = empty_arena()
    thing.add_to(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    state = ObjectState(model, data, thing.name)
    state.move((0.0, 0.0, state.extent(quat).bottom), quat)
    start = data.qpos.copy()
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, data)
    return model, data, start


@pytest.mark.parametrize("thing", STANDING, ids=LABELS)
def test_things_stay_as_they_are_put(thing):
    _, data, start = simulate(thing)
    np.testing.assert_allclose(data.qpos, start, atol=1e-3)
    assert np.abs(data.qvel).max() < 0.01
    assert not any(w.number for w in data.warning)


def test_a_mass_is_what_was_asked_for():
    thing = objects.hammer("t", mass=0.25)
    model, _, _ = simulate(thing, seconds=0.0)
    assert model.body("t").mass[0] == pytest.approx(0.25)


def test_drawn_parts_weigh_and_touch_nothing():
    model, _, _ = simulate(objects.can("t"), seconds=0.0)
    solid = [
        i
        for i in range(model.ngeom)
        if model.geom_contype[i] and model.geom(i).name != "floor"
    ]
    assert [model.geom(i).name for i in solid] == ["t_0"]
    volume = np.pi * 0.026**2 * 0.085
    inertia = 0.05 * (3 * 0.026**2 + 0.085**2) / 12
    assert model.geom_type[solid[0]] == mujoco.mjtGeom.mjGEOM_CYLINDER
    assert volume == pytest.approx(1.8e-4, rel=0.01)
    np.testing.assert_allclose(model.body("t").inertia.max(), inertia, rtol=1e-9)


def test_materials_are_shared():
    spec = empty_arena()
    for name in "ab":
        objects.box(name, (0.02, 0.02, 0.02)).add_to(spec)
    names = [m.name for m in spec.materials]
    assert names.count("object_wood") == 1


@pytest.mark.parametrize("size", [(0.1,), (0.1, 0.1, -0.1), (0.1, np.nan, 0.1)])
def test_bad_sizes_are_refused(size):
    with pytest.raises(ConfigError, match="3 positive sizes"):
        Part(kind="box", size=size)


def test_unknown_materials_are_refused():
    with pytest.raises(UnknownNameError, match="Did you mean 'metal'"):
        Part(kind="ball", size=(0.1,), material="metall")


def test_a_bolt_keeps_the_door_shut_until_the_lever_is_turned():
    opened = {}
    angles = np.radians([0.0, 67.0, 77.0, 90.0])
    for latch, angle in [*((True, angle) for angle in angles), (False, 0.0)]:
        spec = empty_arena()
        objects.door("door", latch=latch).fixed((0.0, 0.0, 0.2)).add_to(spec)
        model = spec.compile()
        data = mujoco.MjData(model)
        lever, panel = data.joint("door_handle_joint"), data.joint("door_panel_joint")
        for _ in range(1000):
            lever.qpos[0] = angle
            lever.qvel[0] = 0.0
            panel.qfrc_applied[0] = 0.5
            mujoco.mj_step(model, data)
        opened[latch, angle] = panel.qpos[0]
    assert abs(opened[True, 0.0]) < 0.05
    assert abs(opened[True, angles[1]]) < 0.1
    assert all(opened[True, angle] > 0.6 for angle in angles[2:])
    assert opened[False, 0.0] > 0.6


def test_the_lever_stays_level():
    spec = empty_arena()
    objects.door("door").fixed((0.0, 0.0, 0.2)).add_to(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    for _ in range(1000):
        mujoco.mj_step(model, data)
    assert abs(data.joint("door_handle_joint").qpos[0]) < 0.02


MUG = """<mujoco><asset><material name="red" rgba="1 0 0 1"/></asset><worldbody>
<body name="mug" pos="1 2 3"><freejoint/><geom name="wall" type="cylinder"
size=".03 .04" material="red"/><site name="rim" pos="0 0 .04"/></body>
</worldbody></mujoco>"""


def written(tmp_path, text):
    path = tmp_path / "mug.xml"
    path.write_text(text)
    return path


def test_a_users_mjcf_becomes_a_thing(tmp_path):
    mug = MjcfObject(name="cup", path=written(tmp_path, MUG))
    model, data, start = simulate(mug)
    np.testing.assert_allclose(data.qpos, start, atol=1e-3)
    assert model.joint("cup_joint").type[0] == mujoco.mjtJoint.mjJNT_FREE
    assert model.njnt == 1
    assert model.site("cup_rim").id >= 0
    assert model.geom("cup_wall").bodyid[0] == model.body("cup").id


def test_the_step_and_gravity_of_a_users_mjcf_do_not_count(tmp_path):
    other = "<mujoco><option timestep='1' gravity='0 0 5'/>"
    path = written(tmp_path, MUG.replace("<mujoco>", other, 1))
    model, *_ = simulate(MjcfObject(name="cup", path=path))
    assert model.opt.timestep == empty_arena().option.timestep
    assert model.opt.gravity.tolist() == [0.0, 0.0, -9.81]


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("<asset>", '<asset><mesh file="/etc/passwd"/>', "outside the folder"),
        ("<asset>", '<asset><mesh file="../x.stl"/>', "outside the folder"),
        ("<mujoco>", '<!DOCTYPE a [<!ENTITY b "c">]><mujoco>', "DOCTYPE"),
        ("<asset>", "<extension><plugin/></extension><asset>", "plugins"),
        ("</worldbody>", "<body/></worldbody>", "not 2"),
        ("<geom", "<replicate count='1000000000'/><geom", "replicate"),
    ],
)
def test_dangerous_or_unclear_files_are_refused(tmp_path, old, new, told):
    (tmp_path.parent / "x.stl").touch()
    path = written(tmp_path, MUG.replace(old, new, 1))
    with pytest.raises((ConfigError, DescriptionError), match=told):
        MjcfObject(name="cup", path=path).add_to(empty_arena())


def test_a_hinge_hangs_one_thing_on_another():
    arm = SceneObject(
        name="arm",
        parts=(Part(kind="box", size=(0.1, 0.01, 0.01), pos=(0.1, 0.0, 0.0)),),
        motion=objects.Hinge(axis=(0.0, 1.0, 0.0), range=(-1.0, 1.0)),
    )
    spec = empty_arena()
    SceneObject(name="post", parts=(), motion="fixed", children=(arm,)).fixed(
        (0.0, 0.0, 1.0)
    ).add_to(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    for _ in range(1000):
        mujoco.mj_step(model, data)
    assert data.joint("arm_joint").qpos[0] == pytest.approx(1.0, abs=0.01)
