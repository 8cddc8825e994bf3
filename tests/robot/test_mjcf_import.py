"""MJCF files read into descriptions, against MuJoCo's own model of them."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import wbc_suite
from wbc_suite.catalogue import Catalogue
from wbc_suite.errors import ConfigError, DescriptionError
from wbc_suite.robot.mesh_files import write_stl
from wbc_suite.robot.mjcf_import import read_mjcf
from wbc_suite.robot.shapes import Box, Hull

CASES = [(name, None) for name in Catalogue().names("robots")] + [
    ("spot", root) for root in ("fixed", "planar", "free")
]
TOLERANCE = 1e-9

FEATURES = """
<mujoco model="all features">
  <compiler angle="degree" autolimits="true"/>
  <option gravity="0 0 -9.81"/>
  <default>
    <joint damping="0.5" armature="0.02" frictionloss="0.1"/>
    <default class="arm"><geom rgba="1 0 0 1" group="2"/></default>
  </default>
  <asset><material name="blue" rgba="0 0 1 1"/></asset>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 0.1"/>
    <body name="pedestal" pos="0.1 0.2 0.3" euler="0 0 30">
      <inertial pos="0 0 0.1" mass="5" fullinertia="0.1 0.12 0.15 0.01 0.02 0.03"/>
      <geom type="box" size="0.1 0.1 0.2" material="blue"/>
      <body name="upper-arm" pos="0.1 0 0.4" quat="0.6 0.8 0 0" childclass="arm">
        <joint name="swing" axis="0 0.6 0.8" pos="0.05 0.02 -0.1" range="-60 90"
               ref="20"/>
        <joint name="push" type="slide" axis="1 0 0" pos="0.01 0.02 0.03"
               range="-0.1 0.3" ref="0.05"/>
        <joint name="roll" axis="1 0 0" pos="0 0 0.2"/>
        <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.05" mass="2"
              friction="0.7 0.01 0.001" condim="4"/>
        <site name="elbow" pos="0.3 0 0" euler="10 20 30"/>
        <camera name="eye" pos="0 0 0.1" fovy="60"/>
        <body name="hand" pos="0.3 0 0" euler="0 40 0">
          <joint name="grip" type="slide" axis="0 0 1" range="0 0.05"/>
          <geom type="cylinder" size="0.02 0.1" mass="0.4"/>
          <geom type="sphere" size="0.03" pos="0 0 0.1" contype="0" conaffinity="0"
                mass="0.1"/>
          <body name="tip" pos="0 0 0.1">
            <geom type="ellipsoid" size="0.02 0.03 0.04" mass="0.2" group="3"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <contact><exclude body1="pedestal" body2="hand"/></contact>
  <equality><joint joint1="grip" joint2="push" polycoef="0.01 0.1 0 0 0"/></equality>
  <actuator>
    <motor name="m1" joint="swing" gear="50" ctrlrange="-2 2"/>
    <position name="m2" joint="push" kp="300" kv="10" forcerange="-80 80"/>
    <velocity name="m3" joint="roll" kv="7" forcerange="-9 9"/>
  </actuator>
  <sensor><force site="elbow" name="push back"/></sensor>
  <keyframe><key name="home" qpos="0.3 0.1 0.2 0.011"/></keyframe>
</mujoco>
"""


def write(folder: Path, text: str) -> Path:
    path = folder / "robot.xml"
    path.write_text(text)
    return path


def body(inner: str, more: str = "") -> str:
    """A fixed base with one child; its inertia comes from a sphere."""
    geom = '<geom size="0.1"/>'
    return (
        f'<mujoco><worldbody><body name="base">{geom}<body name="child">{geom}{inner}'
        f"</body></body></worldbody>{more}</mujoco>"
    )


def dense(m, d):
    full = np.zeros((m.nv, m.nv))
    mujoco.mj_fullM(m, d, full)
    return full


def assert_same_mechanics(original, ours, *, rng, bodies, sites, atol=TOLERANCE):
    d, e = mujoco.MjData(original), mujoco.MjData(ours)
    assert (ours.nq, ours.nv) == (original.nq, original.nv)
    for _ in range(10):
        d.qpos[:] = e.qpos[:] = rng.normal(size=original.nq)
        d.qvel[:] = e.qvel[:] = rng.normal(size=original.nv)
        mujoco.mj_forward(original, d)
        mujoco.mj_forward(ours, e)
        for name in bodies:
            np.testing.assert_allclose(
                e.body(name).xipos, d.body(name).xipos, atol=TOLERANCE
            )
        for name in sites:
            np.testing.assert_allclose(
                e.site(name).xpos, d.site(name).xpos, atol=TOLERANCE
            )
            np.testing.assert_allclose(
                e.site(name).xmat, d.site(name).xmat, atol=TOLERANCE
            )
        np.testing.assert_allclose(dense(ours, e), dense(original, d), atol=atol)
        scale = max(1.0, float(np.abs(d.qfrc_bias).max()))
        np.testing.assert_allclose(e.qfrc_bias, d.qfrc_bias, atol=atol * scale)
        np.testing.assert_allclose(e.qfrc_passive, d.qfrc_passive, atol=atol)


@pytest.mark.sample(15)
@pytest.mark.parametrize(("name", "root"), CASES)
def test_exported_robots_are_read_back(name, root, tmp_path):
    robot = wbc_suite.load_robot(name, root=root)
    # Without visuals: their meshes cost time and prove nothing here.
    links = [link.model_copy(update={"visual": ()}) for link in robot.links]
    robot = robot.model_copy(update={"links": tuple(links)})
    again = wbc_suite.load_robot(write(tmp_path, robot.to_mjcf()))
    assert again.root.kind == robot.root.kind
    assert again.root_joint_names + again.joint_names == (
        robot.root_joint_names + robot.joint_names
    )
    assert_same_mechanics(
        robot.to_mjspec().compile(),
        again.to_mjspec().compile(),
        rng=np.random.default_rng(5),
        bodies=[link.name for link in robot.links if link.mass > 0.0],
        sites=[frame.name for frame in robot.frames],
    )
    for joint in robot.joints:
        back = again.joint(joint.name)
        # What a loop holds in MuJoCo is a mimic in our files only.
        coupled = joint.mimic is not None and not joint.mimic.closed
        assert (back.mimic is not None) == coupled
        if joint.range is not None:
            np.testing.assert_allclose(back.range, joint.range, atol=1e-15)


@pytest.fixture
def features(tmp_path):
    return write(tmp_path, FEATURES)


def test_every_feature_moves_as_in_mujoco(features):
    original = mujoco.MjModel.from_xml_path(str(features))
    ours = read_mjcf(features).to_mjspec().compile()
    assert_same_mechanics(
        original,
        ours,
        rng=np.random.default_rng(6),
        bodies=["hand", "tip"],
        sites=["elbow"],
        atol=1e-7,  # two links of a microgram stand between the arm's three joints
    )


def test_joints_motors_and_followers_are_read(features):
    robot = read_mjcf(features)
    assert robot.name == "all_features"
    assert robot.joint_names == ("swing", "push", "roll", "grip")
    swing, push, roll = (robot.joint(n) for n in ("swing", "push", "roll"))
    np.testing.assert_allclose(swing.range, np.deg2rad([-60, 90]))
    assert roll.range is None
    assert (swing.damping, swing.armature, swing.frictionloss) == (0.5, 0.02, 0.1)
    assert (swing.effort, push.effort, roll.effort) == (100.0, 80.0, 9.0)
    kinds = {a.joint: (a.kind, a.kp, a.kd) for a in robot.actuators}
    assert kinds == {"push": ("position", 300.0, 10.0), "roll": ("velocity", 0.0, 7.0)}
    mimic = robot.joint("grip").mimic
    assert mimic is not None
    assert mimic.joint == "push"
    np.testing.assert_allclose((mimic.ratio, mimic.offset), (0.1, 0.01 - 0.1 * 0.05))
    assert robot.contacts.exclude == (("pedestal", "hand"),)
    assert robot.keyframe("ready")["swing"] == 0.3
    assert [(s.kind, s.frame) for s in robot.sensors] == [("force", "elbow")]
    assert robot.cameras[0].fovy == 60.0


def test_shapes_are_sorted_into_seen_and_touched(features):
    robot = read_mjcf(features)
    base = robot.link("pedestal")
    box = base.visual[0]
    assert isinstance(box, Box)
    assert box.size == (0.1, 0.1, 0.2)
    assert box.color == (0.0, 0.0, 1.0, 1.0)
    arm = robot.link("upper_arm")
    assert arm.collision[0].condim == 4
    np.testing.assert_allclose(arm.collision[0].friction, (0.7, 0.01, 0.001))
    assert [s.shape for s in robot.link("hand").collision] == ["cylinder"]
    assert [s.shape for s in robot.link("hand").visual] == ["cylinder", "sphere"]
    assert robot.link("tip").visual == ()  # group 3 is hidden
    assert all(link.name != "world" for link in robot.links)


def test_roots_are_recognised(tmp_path):
    free = '<mujoco><worldbody><body pos="0 0 1"><freejoint/><geom size="1"/></body>'
    robot = read_mjcf(write(tmp_path, f"{free}</worldbody></mujoco>"))
    assert (robot.root.kind, robot.root.pos) == ("free", (0.0, 0.0, 1.0))
    hinge = '<mujoco><worldbody><body name="b"><joint/><geom size="1"/></body>'
    robot = read_mjcf(write(tmp_path, f"{hinge}</worldbody></mujoco>"))
    assert robot.root.kind == "fixed"
    assert [link.name for link in robot.links] == ["base_link", "b"]
    with pytest.raises(DescriptionError, match="'base_link' moves and needs a mass"):
        robot.with_root("free")


def test_meshes_become_hulls(tmp_path):
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    write_stl(tmp_path / "parts" / "wedge.stl", vertices, faces)
    text = (
        '<mujoco><compiler meshdir="parts"/><asset><mesh file="wedge.stl"/></asset>'
        '<worldbody><body name="b" ><geom type="mesh" mesh="wedge" pos="1 0 0"/></body>'
        "</worldbody></mujoco>"
    )
    link = read_mjcf(write(tmp_path, text)).links[0]
    hull = link.collision[0]
    assert isinstance(hull, Hull)
    R = wbc_suite.robot.poses.se3_of(hull)
    points = np.array([R.act(np.array(s[:3])) for s in hull.spheres]) - [1, 0, 0]
    found = points[np.lexsort(points.round(6).T)]
    np.testing.assert_allclose(found, vertices[np.lexsort(vertices.T)], atol=1e-6)


FAULTS = {
    "nothing": ("<mujoco/>", "the model has no body"),
    "plugin": (
        '<mujoco><extension><plugin plugin="x"/></extension></mujoco>',
        "plugins run code",
    ),
    "urdf": ("<robot/>", "begins with <mujoco>, not <robot>.* name it .urdf"),
    "mujoco refuses": (body('<joint type="wheel"/>'), "MuJoCo refuses it"),
    "mesh without a file": (
        body('<joint name="j"/><geom type="mesh"/>'),
        "MuJoCo refuses it.* valid meshid",
    ),
    "no number": (body('<joint axis="0 nan 1"/>'), "has a number that is not finite"),
    "outside include": (
        '<mujoco><include file="../secret.xml"/></mujoco>',
        "lies outside the folder",
    ),
    "entities": ("<!DOCTYPE m [<!ENTITY a 'b'>]><mujoco/>", "document type"),
}


@pytest.mark.parametrize(("text", "message"), FAULTS.values(), ids=FAULTS.keys())
def test_what_does_not_fit_gets_one_clear_error(tmp_path, text, message):
    path = write(tmp_path, text)
    with pytest.raises(ConfigError, match=message) as caught:
        read_mjcf(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("value", ["inf", "-inf", "1e999", "NaN", "-nan"])
@pytest.mark.parametrize(
    "text",
    [
        '<mujoco><option gravity="0 0 {}"/><worldbody><body/></worldbody></mujoco>',
        '<mujoco><option timestep="{}"/><worldbody><body/></worldbody></mujoco>',
        '<mujoco><worldbody><body><geom size="{}"/></body></worldbody></mujoco>',
        '<mujoco><worldbody><body pos="0 {} 0"/></worldbody></mujoco>',
    ],
)
def test_numbers_are_finite(text, value, tmp_path):
    with pytest.raises(DescriptionError, match=r"\(line 1\): .* not finite"):
        read_mjcf(write(tmp_path, text.format(value)))


@pytest.mark.parametrize(
    "geom", ['size="-0.1"', 'size="0.1" mass="-1"', 'size="0.1" density="-1"']
)
def test_a_negative_mass_or_size_is_refused(geom, tmp_path):
    text = f"<mujoco><worldbody><body><geom {geom}/></body></worldbody></mujoco>"
    with pytest.raises(DescriptionError, match=r"positive|negative"):
        read_mjcf(write(tmp_path, text))


RADIAN = '<compiler angle="radian"/>'


@pytest.mark.parametrize(
    ("given", "found"),
    [
        ("-inf inf", None),
        ("-1e300 1e5", None),
        ("-1 inf", (-1.0, 1e4)),
        ("-1 2", (-1.0, 2.0)),
    ],
)
def test_an_infinite_end_of_a_range_is_none(given, found, tmp_path):
    text = body(f'<joint name="j" range="{given}"/>', RADIAN)
    assert read_mjcf(write(tmp_path, text)).joint("j").range == found


def test_a_reversed_range_is_endless_as_in_mujoco_and_told(tmp_path, caplog):
    path = write(tmp_path, body('<joint name="j" range="2 -2"/>', RADIAN))
    assert read_mjcf(path).joint("j").range is None
    assert "the reversed range from 2 to -2 of joint 'j', endless" in caplog.text
    with pytest.raises(DescriptionError, match="reversed range from 2 to -2"):
        read_mjcf(path, strict=True)


LEFT_OUT = {
    "polynomial": (
        body(
            '<joint name="a"/><joint name="b" axis="1 0 0"/>',
            '<equality><joint name="e" joint1="a" joint2="b" polycoef="0 0 1 0 0"/>'
            "</equality>",
        ),
        "equality 'e', which is not linear in another joint",
    ),
    "wrapping tendon": (
        body(
            '<joint name="a"/><site name="s"/><geom name="g" size="0.01"/>'
            '<site name="e" pos="1 0 0"/>',
            '<tendon><spatial name="t" stiffness="1"><site site="s"/><geom geom="g"/>'
            '<site site="e"/></spatial></tendon>',
        ),
        "tendon 't', which wraps or leaves the robot",
    ),
}


@pytest.mark.parametrize(("text", "message"), LEFT_OUT.values(), ids=LEFT_OUT.keys())
def test_what_is_left_out_is_named_and_refused_if_strict(
    tmp_path, text, message, caplog
):
    path = write(tmp_path, text)
    read_mjcf(path)
    assert f"left out: {message}" in caplog.text
    with pytest.raises(DescriptionError, match=message):
        read_mjcf(path, strict=True)


@pytest.mark.parametrize(
    "text",
    [
        '<mujoco><asset><mesh file="../secret.stl"/></asset></mujoco>',
        '<mujoco><compiler meshdir="FOLDER"/><asset><mesh file="secret.stl"/></asset>'
        "</mujoco>",
    ],
)
def test_files_outside_the_folder_are_read_only_when_named(tmp_path, text):
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    write_stl(tmp_path / "secret.stl", vertices, faces)
    (tmp_path / "robot").mkdir()
    path = write(tmp_path / "robot", text.replace("FOLDER", str(tmp_path)))
    with pytest.raises(ConfigError, match="lies outside the folder"):
        read_mjcf(path)
    with pytest.raises(DescriptionError, match="no body"):  # the mesh is read
        read_mjcf(path, mesh_root=tmp_path)


def test_a_collection_of_robots_is_read_across_its_folders(tmp_path):
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    write_stl(tmp_path / "descriptions" / "parts" / "a.stl", vertices, faces)
    (tmp_path / "descriptions" / "one").mkdir()
    mesh = '<asset><mesh name="a" file="../parts/a.stl"/></asset>'
    geom = '<joint name="j"/><geom type="mesh" mesh="a"/>'
    text = body(geom).replace("<worldbody>", f"{mesh}<worldbody>")
    robot = read_mjcf(write(tmp_path / "descriptions" / "one", text))
    assert robot.links[-1].visual or robot.links[-1].collision


SPRUNG = """<mujoco><compiler angle="radian"/><worldbody><body name="base">
  <geom size="0.1" mass="1"/>
  <body name="upper" pos="0 0 0.1" gravcomp="0.5"><geom size="0.1" mass="1"/>
    <joint name="a" axis="0 1 0" stiffness="3" springref="0.2" damping="1"/>
    <site name="s"/>
    <body name="lower" pos="0.3 0 0"><geom size="0.1" mass="1"/>
      <joint name="b" axis="0 1 0"/><site name="t"/>
      <body name="hand" pos="0.3 0 0"><geom type="box" size="0.1 0.05 0.02" mass="1"/>
        <joint name="c" type="ball" pos="0 0 0.05" damping="0.1" stiffness="2"/>
      </body></body></body></body></worldbody>
  <tendon>
    <fixed name="sum" stiffness="5" damping="0.3" range="-1 1" limited="true">
      <joint joint="a" coef="0.5"/><joint joint="b" coef="-1"/></fixed>
    <spatial name="string" frictionloss="0.1"><site site="s"/><site site="t"/></spatial>
  </tendon>
  <equality><tendon tendon1="sum"/><weld body1="base" body2="lower"/>
  </equality></mujoco>"""


def test_springs_tendons_and_gravity_compensation_act_as_in_the_file(tmp_path):
    path = write(tmp_path, SPRUNG)
    (tmp_path / "again.toml").write_text(read_mjcf(path).to_toml(), encoding="utf-8")
    robot = wbc_suite.load_robot(tmp_path / "again.toml")
    ours, theirs = robot.to_mjspec().compile(), mujoco.MjModel.from_xml_path(str(path))
    forces, errors = [], []
    for model in (ours, theirs):
        data = mujoco.MjData(model)
        for name, value in (("a", 0.4), ("b", -0.7)):
            data.qpos[model.joint(name).qposadr] = value
            data.qvel[model.joint(name).dofadr] = 3 * value
        mujoco.mj_forward(model, data)
        own = [model.joint(name).dofadr[0] for name in "ab"]
        range_ = model.tendon_range[0]
        forces.append([*data.qfrc_passive[own], *data.ten_length, *range_])
        errors.append(np.sort(data.efc_pos[: data.ne]))
    # The ball's dummy links of 1e-10 kg add forces of 1e-9 N m.
    np.testing.assert_allclose(forces[0], forces[1], atol=1e-8)
    # The held tendon, and the six directions of the weld.
    np.testing.assert_allclose(errors[0], errors[1], atol=1e-9)


def test_a_ball_joint_becomes_three_hinges_that_reach_its_orientations(tmp_path):
    path = write(tmp_path, SPRUNG)
    robot = read_mjcf(path)
    ours, theirs = robot.to_mjspec().compile(), mujoco.MjModel.from_xml_path(str(path))
    turn = Rotation.from_euler("XYZ", [0.4, -0.3, 0.9])
    data, other = mujoco.MjData(ours), mujoco.MjData(theirs)
    for axis, angle in zip("xyz", turn.as_euler("XYZ"), strict=True):
        data.qpos[ours.joint(f"c_{axis}").qposadr] = angle
    start = theirs.joint("c").qposadr[0]
    other.qpos[start : start + 4] = turn.as_quat(scalar_first=True)
    for m, d in ((ours, data), (theirs, other)):
        mujoco.mj_forward(m, d)
    found, wanted = data.body("hand"), other.body("hand")
    np.testing.assert_allclose(found.xmat, wanted.xmat, atol=1e-12)
    np.testing.assert_allclose(found.xipos, wanted.xipos, atol=1e-12)


def test_free_objects_of_a_scene_are_left_out(tmp_path, caplog):
    text = (
        '<mujoco><worldbody><body name="ball"><freejoint/><geom size="1"/></body>'
        '<body name="arm"><geom size="1"/><joint name="a"/></body></worldbody></mujoco>'
    )
    robot = read_mjcf(write(tmp_path, text))
    assert robot.joint_names == ("a",)
    assert "objects beside the robot are left out: ['ball']" in caplog.text


def test_a_plane_on_a_body_is_no_shape_of_the_robot(tmp_path):
    text = body('<joint name="j"/>').replace(
        "<geom", '<geom type="plane" size="1 1 1"/><geom', 1
    )
    robot = read_mjcf(write(tmp_path, text))
    shapes = [shape.shape for link in robot.links for shape in link.visual]
    assert shapes == ["sphere", "sphere"]


def test_size_hints_of_older_files_are_ignored(tmp_path):
    text = body("<joint/>").replace("<mujoco>", '<mujoco><size nstack="5000000"/>')
    assert read_mjcf(write(tmp_path, text)).dof == 1


LEGS = """<mujoco><compiler angle="radian"/><worldbody>
<body name="base" pos="0 0 1"><freejoint/>
<geom type="box" size="0.3 0.2 0.05"/>{legs}</body></worldbody>
<keyframe><key name="home" qpos="0 0 1 1 0 0 0 {angles}"/></keyframe></mujoco>"""
LEG = """<body name="{name}_thigh" pos="{x} {y} 0"><joint name="{name}_hip" axis="0 1 0"
range="-2 2"/><geom type="capsule" fromto="0 0 -0.1 0 0 -0.2" size="0.02"/>
<body name="{name}_calf" pos="0 0 -0.3"><joint name="{name}_knee" axis="0 1 0"
range="-2.5 -0.1"/><geom type="capsule" fromto="0 0 -0.1 0 0 -0.3" size="0.02"/>
<body name="{name}_foot" pos="0 0 -0.3"><geom type="sphere" size="0.02"/></body></body>
</body>"""
PLACES = {"FL": (0.3, 0.2), "FR": (0.3, -0.2), "RL": (-0.3, 0.2), "RR": (-0.3, -0.2)}


@pytest.mark.parametrize("first", [0.4, 1.2])
def test_a_home_posture_is_used_if_the_feet_are_level(tmp_path, first):
    legs = "".join(LEG.format(name=n, x=x, y=y) for n, (x, y) in PLACES.items())
    angles = f"{first} -0.8 " + "0.4 -0.8 " * 3
    path = tmp_path / "dog.xml"
    path.write_text(LEGS.format(legs=legs, angles=angles))
    ready = wbc_suite.load_robot(path).keyframe("ready")
    hips = [ready[f"{name}_hip"] for name in PLACES]
    if first == 0.4:
        assert hips == [0.4] * 4
    else:
        assert np.ptp(hips) < 1e-3
        assert 0.4 < hips[0] < 0.7  # bent by `standing_legs`


def test_a_free_robot_with_a_hand_and_no_feet_is_planar(tmp_path):
    text = """<mujoco><worldbody><body name="base" pos="0 0 0.2"><freejoint/>
    <geom type="box" size="0.2 0.2 0.1"/><body name="arm" pos="0 0 0.2">
    <joint name="shoulder" axis="0 1 0" range="-1 1"/>
    <geom type="capsule" fromto="0 0 0.1 0 0 0.5" size="0.03"/></body></body>
    </worldbody></mujoco>"""
    path = tmp_path / "cart.xml"
    path.write_text(text)
    assert wbc_suite.load_robot(path).root.kind == "planar"
    assert wbc_suite.load_robot(path, root="free").root.kind == "free"
