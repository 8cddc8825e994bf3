"""URDF files read into descriptions, against Pinocchio's own reader and ours back."""

import itertools
import logging
import re
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest
import trimesh

import wbc_suite
from wbc_suite.catalogue import Catalogue
from wbc_suite.errors import ConfigError, DescriptionError
from wbc_suite.robot.mesh_files import write_stl
from wbc_suite.robot.shape_geometry import support_points
from wbc_suite.robot.shapes import Box, Cylinder, Hull
from wbc_suite.robot.urdf_import import read_urdf

ROBOTS = Catalogue().names("robots")
CASES = [(name, None) for name in ROBOTS] + [
    ("spot", root) for root in ("fixed", "planar", "free")
]
TOLERANCE = 1e-9

FEATURES = """<?xml version="1.0"?>
<robot name="all features" xmlns:x="urn:x">
  <material name="light blue"><color rgba="0.2 0.4 1 1"/></material>
  <link name="world"/>
  <joint name="to_world" type="fixed">
    <parent link="world"/><child link="pelvis"/><origin xyz="0 0 1" rpy="0 0 0.5"/>
  </joint>
  <link name="pelvis">
    <inertial><origin xyz="0.01 0 0" rpy="0.3 0.2 0.1"/><mass value="7"/>
      <inertia ixx="0.05" ixy="0.001" ixz="0.002" iyy="0.06" iyz="0.003" izz="0.07"/>
    </inertial>
    <visual><geometry><box size="0.3 0.2 0.4"/></geometry>
      <material name="light blue"/></visual>
    <collision><origin xyz="0 0 0.1" rpy="1.57 0 0"/>
      <geometry><cylinder radius="0.1" length="0.3"/></geometry></collision>
  </link>
  <joint name="left.shoulder-1" type="revolute">
    <origin xyz="0.1 0.2 0.3" rpy="0.1 1.5707963267948966 -0.4"/>
    <parent link="pelvis"/><child link="left.upper arm"/>
    <axis xyz="0 0.6 0.8"/>
    <limit lower="-1" upper="2" effort="40" velocity="3"/>
    <dynamics damping="0.7" friction="0.2"/>
    <mimic joint="left_elbow" multiplier="-1.5" offset="0.25"/>
  </joint>
  <link name="left.upper arm">
    <inertial><origin xyz="0 0 0.1" rpy="1 0.5 -0.7"/><mass value="2"/>
      <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.012" iyz="0" izz="0.005"/></inertial>
    <visual><geometry><sphere radius="0.15"/></geometry>
      <material name="inline"><color rgba="1 0 0 0.5"/></material></visual>
  </link>
  <joint name="left_elbow" type="continuous">
    <origin xyz="0 0 0.3"/><parent link="left.upper arm"/><child link="left_elbow"/>
  </joint>
  <link name="left_elbow">
    <inertial><mass value="1"/>
      <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>
  </link>
  <joint name="left_wrist_slide" type="prismatic">
    <origin xyz="0 0 0.1"/><parent link="left_elbow"/><child link="left_hand"/>
    <axis xyz="0 0 2"/><limit lower="0.1" upper="0.3" effort="0" velocity="1e7"/>
  </joint>
  <link name="left_hand">
    <inertial><mass value="0.5"/>
      <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/></inertial>
  </link>
  <joint name="sensor_fixed" type="fixed">
    <origin xyz="0.02 0 0" rpy="0 0 1"/><parent link="left_hand"/><child link="ft"/>
  </joint>
  <link name="ft"><inertial><mass value="0.1"/>
    <inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial></link>
  <joint name="tool_mount" type="fixed">
    <origin xyz="0 0 0.05"/><parent link="ft"/><child link="tool0"/></joint>
  <link name="tool0"/>
  <joint name="optical_joint" type="fixed">
    <origin rpy="0.3 0 0"/><parent link="tool0"/><child link="optical"/></joint>
  <link name="optical"/>
  <x:gazebo reference="ft"/>
</robot>
"""


def write(folder: Path, text: str, name: str = "robot.urdf") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def one_arm(links: str, joints: str = "") -> str:
    return f'<robot name="r"><link name="base"/>{links}{joints}</robot>'


BODY = (
    '<inertial><mass value="1"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0"'
    ' izz="0.1"/></inertial>'
)


def joint(name: str, parent: str, child: str, *, kind="continuous", inner="") -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/>'
        f'<child link="{child}"/>{inner}</joint>'
    )


@pytest.fixture
def features(tmp_path):
    return write(tmp_path, FEATURES)


def positions(model, values):
    q = pin.neutral(model)
    for name, value in values.items():
        entry = model.joints[model.getJointId(name)]
        if entry.nq == 2:
            q[entry.idx_q : entry.idx_q + 2] = np.cos(value), np.sin(value)
        else:
            q[entry.idx_q] = value
    return q


OURS = {  # what is called otherwise here, because names are unique and plain
    "left.shoulder-1": "left_shoulder_1",
    "left_elbow": "left_elbow_joint",
    "left_wrist_slide": "left_wrist_slide",
}


def test_every_feature_agrees_with_pinocchios_reader(features):
    robot = wbc_suite.load_robot(features)
    ours, theirs = robot.to_pinocchio(), pin.buildModelFromUrdf(str(features))
    data, other = ours.createData(), theirs.createData()
    rng = np.random.default_rng(1)
    for _ in range(20):
        values = {name: rng.uniform(-3, 3) for name in OURS}
        q = positions(ours, {OURS[n]: v for n, v in values.items()})
        p = positions(theirs, values)
        pin.framesForwardKinematics(ours, data, q)
        pin.framesForwardKinematics(theirs, other, p)
        for mine, its in (
            (ours.getFrameId("left_upper_arm"), "left.upper arm"),
            (ours.getFrameId("ft"), "ft"),
            (ours.getFrameId("tool0"), "tool0"),
            (ours.getFrameId("optical"), "optical"),
        ):
            frame = theirs.getFrameId(its, pin.FrameType.BODY)
            np.testing.assert_allclose(
                data.oMf[mine].homogeneous, other.oMf[frame].homogeneous, atol=1e-12
            )
        rows = [theirs.joints[theirs.getJointId(n)].idx_v for n in OURS]
        M = pin.crba(theirs, other, p)
        M = (np.triu(M) + np.triu(M, 1).T)[np.ix_(rows, rows)]
        N = pin.crba(ours, data, q) - np.diag(ours.armature)  # estimated
        np.testing.assert_allclose(np.triu(N) + np.triu(N, 1).T, M, atol=1e-12)
        np.testing.assert_allclose(
            pin.computeGeneralizedGravity(ours, data, q),
            pin.computeGeneralizedGravity(theirs, other, p)[rows],
            atol=1e-12,
        )


def test_limits_couplings_and_colours_are_read(features):
    robot = wbc_suite.load_robot(features)
    shoulder = robot.joint("left_shoulder_1")
    assert shoulder.range == (-1.0, 2.0)
    assert (shoulder.effort, shoulder.velocity) == (40.0, 3.0)
    assert (shoulder.damping, shoulder.frictionloss) == (0.7, 0.2)
    assert shoulder.mimic is not None
    assert shoulder.mimic.joint == "left_elbow_joint"
    assert (shoulder.mimic.ratio, shoulder.mimic.offset) == (-1.5, 0.25)
    elbow, slide = robot.joint("left_elbow_joint"), robot.joint("left_wrist_slide")
    assert elbow.range is None
    assert elbow.axis == (1.0, 0.0, 0.0)  # URDF's default
    assert slide.velocity is None
    assert slide.effort == pytest.approx(2 * 9.81 * 0.6, abs=0.01)  # twice the weight
    assert slide.axis == (0.0, 0.0, 1.0)
    assert robot.root.kind == "fixed"
    assert robot.root.pos == (0.0, 0.0, 1.0)
    box = robot.link("pelvis").visual[0]
    assert isinstance(box, Box)
    assert box.size == (0.15, 0.1, 0.2)
    assert robot.materials[str(box.color)] == (0.2, 0.4, 1.0, 1.0)
    assert robot.materials["inline"] == (1.0, 0.0, 0.0, 0.5)
    cylinder = robot.link("pelvis").collision[0]
    assert isinstance(cylinder, Cylinder)
    assert (cylinder.end, cylinder.radius) == ((0.0, 0.0, 0.15), 0.1)


def test_mujocos_reader_sees_the_same_masses_and_gravity(features):
    robot = wbc_suite.load_robot(features)
    spec = mujoco.MjSpec.from_string(robot.to_urdf())
    ours, theirs = robot.to_mjspec().compile(), spec.compile()
    d, e = mujoco.MjData(ours), mujoco.MjData(theirs)
    d.qpos[:] = e.qpos[:] = [0.3, -0.7, 0.2]
    mujoco.mj_forward(ours, d)
    mujoco.mj_forward(theirs, e)
    np.testing.assert_allclose(e.qfrc_bias, d.qfrc_bias, atol=1e-11)


def test_groups_end_effector_and_ready_are_inferred(features):
    robot = wbc_suite.load_robot(features)
    assert robot.groups == {"left_arm": ("left_elbow_joint", "left_wrist_slide")}
    eef = robot.frame("left_eef")
    tool = robot.frame("tool0")
    assert (eef.link, eef.pos, eef.role) == (tool.link, tool.pos, "eef")
    assert robot.keyframe("ready")["left_wrist_slide"] == 0.1  # zero is out of range
    assert robot.keyframe("ready")["left_shoulder_1"] == 0.25  # follows the elbow


EXAMPLE = Path(__file__).parents[2] / "examples" / "robots" / "six_axis_arm.urdf"


def test_an_only_arm_is_the_right_one_and_its_tool_is_found():
    robot = wbc_suite.load_robot(EXAMPLE)
    assert set(robot.groups) == {"right_arm", "right_gripper"}
    assert len(robot.groups["right_arm"]) == 6
    assert robot.groups["right_gripper"] == ("left_finger_joint",)
    roles = {frame.role: frame.name for frame in robot.frames}
    assert roles == {"eef": "right_eef", "tcp": "right_tcp", "other": "tcp"}
    tool, tcp = robot.frame("tcp"), robot.frame("right_tcp")
    assert (tcp.link, tcp.pos, tcp.quat) == (tool.link, tool.pos, tool.quat)


LIMBS = {
    "LHipYaw RHipYaw LShoulderPitch RShoulderPitch HeadYaw": (
        "legs left_arm right_arm head"
    ),
    "fl_haa fr_haa hl_haa hr_haa": "legs",
    "torso_lift arm_left_1 arm_right_1": "torso left_arm right_arm",
    "joint1": "right_arm",
    "arm_1 arm_2": "arm_1 arm_2",
    "front_left_wheel front_right_wheel": "base",
}


def test_templates_beside_links_stay_unread_and_are_named(tmp_path, caplog):
    text = one_arm(TWO, joint("a", "base", "l0") + joint("b", "l0", "l1"))
    path = write(tmp_path, text.replace("<link", '<xacro:property name="w"/><link', 1))
    assert read_urdf(path).joint_names == ("a", "b")
    assert "not expanded, and not read: xacro:property." in caplog.text


@pytest.mark.parametrize(("joints", "groups"), LIMBS.items())
def test_limbs_are_inferred_from_words(tmp_path, joints, groups):
    names = joints.split()
    bodies = "".join(f'<link name="b{i}">{BODY}</link>' for i in range(len(names)))
    hung = "".join(joint(name, "base", f"b{i}") for i, name in enumerate(names))
    robot = read_urdf(write(tmp_path, one_arm(bodies, hung)))
    assert set(robot.groups) == set(groups.split())


@pytest.mark.sample(15)
@pytest.mark.parametrize(("name", "root"), CASES)
def test_exported_robots_are_read_back(name, root, tmp_path):
    robot = wbc_suite.load_robot(name, root=root)
    # Without visuals: their meshes cost time and prove nothing here.
    links = [link.model_copy(update={"visual": ()}) for link in robot.links]
    robot = robot.model_copy(update={"links": tuple(links)})
    again = wbc_suite.load_robot(write(tmp_path, robot.to_urdf()))
    assert again.root.kind == robot.root.kind
    assert again.joint_names == robot.joint_names
    assert {link.name for link in again.links} | {f.name for f in again.frames} >= {
        link.name for link in robot.links
    } | {f.name for f in robot.frames}
    for joint in robot.joints:
        back = again.joint(joint.name)
        if joint.mimic is not None:  # URDF has no loops: followers are mimic joints
            mimic = joint.mimic.model_copy(update={"closed": False})
            joint = joint.model_copy(update={"mimic": mimic})
        for key in ("range", "effort", "velocity", "damping", "mimic", "type"):
            assert getattr(back, key) == getattr(joint, key)
    first, second = robot.to_mjspec().compile(), again.to_mjspec().compile()
    d, e = mujoco.MjData(first), mujoco.MjData(second)
    rng = np.random.default_rng(2)
    for _ in range(5):
        d.qpos[:] = e.qpos[:] = rng.normal(size=first.nq)
        d.qvel[:] = e.qvel[:] = rng.normal(size=first.nv)
        mujoco.mj_forward(first, d)
        mujoco.mj_forward(second, e)
        for link in again.links:
            np.testing.assert_allclose(
                e.body(link.name).xpos, d.body(link.name).xpos, atol=TOLERANCE
            )
        for frame in robot.frames:
            np.testing.assert_allclose(
                e.site(frame.name).xmat, d.site(frame.name).xmat, atol=TOLERANCE
            )
        scale = max(1.0, float(np.abs(d.qfrc_bias).max()))
        np.testing.assert_allclose(e.qfrc_bias, d.qfrc_bias, atol=TOLERANCE * scale)


def test_an_imported_robot_takes_another_root(features):
    robot = wbc_suite.load_robot(features, root="free")
    model = robot.to_mjspec().compile()
    assert (model.nq, model.nv) == (10, 9)
    assert robot.to_pinocchio().nv == 9


def tetrahedron() -> tuple:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    return vertices, faces


def mesh_robot(filename: str, scale: str = "0.1 0.1 0.1") -> str:
    mesh = f'<geometry><mesh filename="{filename}" scale="{scale}"/></geometry>'
    return (
        f'<robot name="r"><link name="base">{BODY}<visual><origin xyz="1 0 0"/>{mesh}'
        f"</visual><collision>{mesh}</collision></link></robot>"
    )


@pytest.mark.parametrize(
    ("filename", "place"),
    [
        ("part.stl", "part.stl"),
        ("meshes/part.stl", "meshes/part.stl"),
        ("package://my_robot/meshes/part.stl", "my_robot/meshes/part.stl"),
        ("package://my_robot/meshes/part.stl", "meshes/part.stl"),
    ],
)
def test_meshes_become_hulls(tmp_path, filename, place, caplog):
    write_stl(tmp_path / place, *tetrahedron())
    robot = read_urdf(write(tmp_path, mesh_robot(filename)))
    link = robot.links[0]
    assert link.visual[0].pos == (1.0, 0.0, 0.0)
    for shape in (*link.visual, *link.collision):
        vertices = support_points(shape)
        np.testing.assert_allclose(vertices.min(0), 0.0, atol=1e-7)
        np.testing.assert_allclose(vertices.max(0), 0.1, atol=1e-7)


def test_text_stl_and_obj_are_read(tmp_path):
    vertices, faces = tetrahedron()
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join(f"vertex {x} {y} {z}\n" for x, y, z in vertices[face])
        + "endloop\nendfacet\n"
        for face in faces
    )
    (tmp_path / "a.stl").write_text(f"solid a\n{facets}endsolid a\n")
    (tmp_path / "b.obj").write_text("".join(f"v {x} {y} {z}\n" for x, y, z in vertices))
    for name in ("a.stl", "b.obj"):
        robot = read_urdf(write(tmp_path, mesh_robot(name, "1 1 1")))
        hull = robot.links[0].collision[0]
        assert isinstance(hull, Hull)
        assert sorted(s[:3] for s in hull.spheres) == sorted(map(tuple, vertices))


def test_large_meshes_keep_their_extent(tmp_path):
    rng = np.random.default_rng(0)
    points = rng.normal(size=(3000, 3))
    points *= np.array([0.5, 0.1, 0.02]) / np.linalg.norm(points, axis=1, keepdims=True)
    text = "".join(f"v {x} {y} {z}\n" for x, y, z in points)
    (tmp_path / "egg.obj").write_text(text)
    hull = read_urdf(write(tmp_path, mesh_robot("egg.obj"))).links[0].collision[0]
    assert isinstance(hull, Hull)
    vertices = support_points(hull)
    assert len(hull.spheres) <= 64
    extent = vertices.max(0) - vertices.min(0)
    np.testing.assert_allclose(extent, [0.1, 0.02, 0.004], rtol=0.02)


def test_missing_meshes_are_one_warning(tmp_path, caplog):
    text = mesh_robot("gone.stl").replace("gone.stl", "gone.dae", 1)
    with caplog.at_level(logging.WARNING):
        robot = read_urdf(write(tmp_path, text))
    assert len(caplog.records) == 1
    message = caplog.records[0].getMessage()
    assert "gone.dae, gone.stl" in message
    assert robot.links[0].visual == ()


def test_a_visual_that_cannot_be_read_is_drawn_as_it_collides(tmp_path):
    write_stl(tmp_path / "part.stl", *tetrahedron())
    text = mesh_robot("part.stl").replace("part.stl", "part.dae", 1)
    link = read_urdf(write(tmp_path, text)).links[0]
    assert link.visual[0].model_dump(exclude={"color"}) == link.collision[0].model_dump(
        exclude={"color"}
    )


@pytest.mark.parametrize("name", ["../secret.stl", "/etc/passwd", "file:///etc/hosts"])
def test_meshes_outside_the_folder_are_not_read(tmp_path, name, caplog):
    folder = tmp_path / "robot"
    folder.mkdir()
    write_stl(tmp_path / "secret.stl", *tetrahedron())
    path = write(folder, mesh_robot(name))
    assert read_urdf(path).links[0].visual == ()
    assert f"1 of 1 meshes are not in {folder}: {name}" in caplog.text


def test_a_mesh_root_allows_more_files(tmp_path):
    folder = tmp_path / "robot"
    folder.mkdir()
    write_stl(tmp_path / "secret.stl", *tetrahedron())
    path = write(folder, mesh_robot("../secret.stl"))
    robot = wbc_suite.load_robot(path, mesh_root=tmp_path)
    assert isinstance(robot.links[0].visual[0], Hull)


def test_a_link_out_of_the_folder_is_not_followed(tmp_path):
    folder = tmp_path / "robot"
    folder.mkdir()
    write_stl(tmp_path / "secret.stl", *tetrahedron())
    (folder / "part.stl").symlink_to(tmp_path / "secret.stl")
    assert read_urdf(write(folder, mesh_robot("part.stl"))).links[0].visual == ()


@pytest.mark.parametrize(
    ("file", "mesh", "reference"),
    [
        (
            "pack/urdf/a/r.urdf",
            "pack/meshes/part.stl",
            "package://pack/meshes/part.stl",
        ),
        ("pack/urdf/r.urdf", "pack/parts/part.stl", "../parts/part.stl"),
        ("pack/r.urdf", "pack/meshes/part.stl", "package://other/meshes/part.stl"),
        ("pack/x/y/r.urdf", "pack/meshes/part.stl", "../../meshes/part.stl"),
        (
            "pack/x/y/r.urdf",
            "pack/x/parts/part.stl",
            "package:///pack/x/parts/part.stl",
        ),
        ("pack/robots/r.urdf", "pack/part.stl", "model://pack/part.stl"),
        ("robots/arm/r.urdf", "robots/hand/meshes/part.stl", "../hand/meshes/part.stl"),
        ("arm/urdf/r.urdf", "arm/meshes/m1/seen/part.stl", "package://seen/part.stl"),
    ],
)
def test_meshes_are_found_in_the_package_around_the_file(
    tmp_path, file, mesh, reference
):
    write_stl(tmp_path / mesh, *tetrahedron())
    path = tmp_path / file
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(mesh_robot(reference), encoding="utf-8")
    robot = read_urdf(path, skin=True)
    assert isinstance(robot.links[0].visual[0], Hull)
    (skin,) = robot.skins[robot.links[0].name]
    assert Path(skin.file) == tmp_path / mesh


@pytest.mark.parametrize(
    ("mesh", "variable", "value"),
    [
        ("src/hand/meshes/part.stl", None, None),
        ("src/hand/visual/part.stl", None, None),
        ("elsewhere/hand/visual/part.stl", "ROS_PACKAGE_PATH", "elsewhere"),
        ("elsewhere/hand/visual/part.stl", "ROS_PACKAGE_PATH", "elsewhere/hand"),
        ("elsewhere/repo/hand/visual/part.stl", "ROS_PACKAGE_PATH", "none:elsewhere"),
        ("prefix/share/hand/visual/part.stl", "AMENT_PREFIX_PATH", "prefix"),
    ],
)
def test_meshes_of_other_packages_are_found(
    tmp_path, monkeypatch, mesh, variable, value
):
    own = tmp_path / "src" / "arm"
    write_stl(own / "meshes" / "part.stl", 2.0 * tetrahedron()[0], tetrahedron()[1])
    write_stl(tmp_path / mesh, *tetrahedron())
    if "visual" in mesh and variable is None:
        (tmp_path / "src" / "hand" / "package.xml").write_text("<package/>")
    if variable is not None:
        paths = ":".join(str(tmp_path / x) for x in value.split(":"))
        monkeypatch.setenv(variable, paths)
    (own / "urdf").mkdir()
    part = "/".join(mesh.split("/")[-2:])
    path = write(own / "urdf", mesh_robot(f"package://hand/{part}"))
    vertices = support_points(read_urdf(path).links[0].visual[0])
    np.testing.assert_allclose(vertices.max(0), 0.1, atol=1e-7)
    own_only = support_points(read_urdf(path, mesh_root=own).links[0].visual[0])
    np.testing.assert_allclose(own_only.max(0), 0.2, atol=1e-7)


@pytest.mark.parametrize("name", ["..", ".", "hand/../..", ".hand", "*"])
def test_no_name_of_a_package_leads_out_of_packages(tmp_path, monkeypatch, name):
    write_stl(tmp_path / "src" / "secret.stl", *tetrahedron())
    write_stl(tmp_path / ".hand" / "meshes" / "secret.stl", *tetrahedron())
    (tmp_path / "src" / "hand" / "meshes").mkdir(parents=True)
    (tmp_path / "src" / "hand" / "link.stl").symlink_to(tmp_path / "src/secret.stl")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))
    own = tmp_path / "src" / "arm" / "urdf"
    own.mkdir(parents=True)
    for file in ("secret.stl", "meshes/secret.stl", "link.stl"):
        path = write(own, mesh_robot(f"package://{name}/{file}"))
        assert read_urdf(path).links[0].visual == ()


def test_meshes_that_cannot_be_read_do_not_count_as_read(tmp_path, caplog):
    write_stl(tmp_path / "a.stl", *tetrahedron())
    (tmp_path / "b.ply").write_text("ply")
    text = mesh_robot("a.stl").replace("a.stl", "b.ply", 1)
    with caplog.at_level(logging.INFO):
        read_urdf(write(tmp_path, text))
    assert "1 of 2 meshes read" in caplog.text
    assert "1 of 2 meshes are not read: b.ply. Convert them to STL" in caplog.text


def test_collada_is_read_in_its_unit(tmp_path):
    mesh = trimesh.Trimesh(*tetrahedron(), process=False)
    text = trimesh.exchange.dae.export_collada(mesh).decode()
    assert "<asset>" in text
    scaled = text.replace("<asset>", '<asset><unit name="cm" meter="0.01"/>')
    scaled = re.sub(r'(meter="0.01"/>)(.*?)<unit[^>]*/>', r"\1\2", scaled, flags=re.S)
    (tmp_path / "part.dae").write_text(scaled, encoding="utf-8")
    robot = read_urdf(write(tmp_path, mesh_robot("part.dae", "1 1 1")))
    vertices = support_points(robot.links[0].visual[0])
    np.testing.assert_allclose(vertices.max(0), 0.01, atol=1e-7)


def test_of_two_meshes_with_one_name_elsewhere_none_is_taken(tmp_path, caplog):
    for folder in ("a", "b"):
        write_stl(tmp_path / "meshes" / folder / "part.stl", *tetrahedron())
    robot = read_urdf(write(tmp_path, mesh_robot("package://gone/part.stl")))
    assert robot.links[0].visual == ()
    assert "meshes are not in" in caplog.text


def test_chains_of_followers_follow_the_first(tmp_path):
    links = "".join(f'<link name="l{i}">{BODY}</link>' for i in range(3))
    joints = joint("a", "base", "l0")
    joints += joint(
        "b", "l0", "l1", inner='<mimic joint="a" multiplier="2" offset="1"/>'
    )
    joints += joint(
        "c", "l1", "l2", inner='<mimic joint="b" multiplier="3" offset="4"/>'
    )
    robot = read_urdf(write(tmp_path, one_arm(links, joints)))
    mimic = robot.joint("c").mimic
    assert mimic is not None
    assert (mimic.joint, mimic.ratio, mimic.offset) == ("a", 6.0, 7.0)


TWO = f'<link name="l0">{BODY}</link><link name="l1">{BODY}</link>'
BAD = BODY.replace('izz="0.1"', 'izz="0.3"')
FAULTS = {
    "loop": (
        one_arm(TWO, joint("a", "l0", "l1") + joint("b", "l1", "l0")),
        r"'l0' \(line 1\), 'l1' \(line 1\) form a loop",
    ),
    "missing parent": (
        one_arm(TWO, joint("a", "bse", "l0")),
        "parent link 'bse' does not exist. Did you mean 'base'",
    ),
    "two parents": (
        one_arm(TWO, joint("a", "base", "l0") + joint("b", "l1", "l0")),
        r"'l0' is the child of two joints, joint 'a' \(line 1\) and joint 'b' ",
    ),
    "two roots": (
        one_arm(TWO, joint("a", "base", "l0")),
        r"2 links have no parent: 'base' \(line 1\), 'l1'",
    ),
    "duplicated link": (one_arm(TWO + TWO), "two links are named 'l0'"),
    "duplicated joint": (
        one_arm(TWO, joint("a", "base", "l0") + joint("a", "l0", "l1")),
        "two joints are named 'a'",
    ),
    "floating in the middle": (
        one_arm(
            TWO + f'<link name="l2">{BODY}</link>',
            joint("a", "base", "l0")
            + joint("b", "l0", "l1", kind="floating")
            + joint("c", "l1", "l2"),
        ),
        r"joint 'b' \(line 1\) is floating: only the joint",
    ),
    "unknown type": (
        one_arm(
            f'<link name="l0">{BODY}</link>', joint("a", "base", "l0", kind="spherical")
        ),
        r"joint 'a' \(line 1\): unknown type 'spherical'",
    ),
    "mimic circle": (
        one_arm(
            TWO,
            joint("a", "base", "l0", inner='<mimic joint="b"/>')
            + joint("b", "l0", "l1", inner='<mimic joint="a"/>'),
        ),
        "follows itself in a loop",
    ),
    "not a number": (
        one_arm(
            f'<link name="l0">{BODY}</link>',
            joint("a", "base", "l0", inner='<origin xyz="0 nan 0"/>'),
        ),
        "joint 'a' .*: <origin xyz=\"0 nan 0\"> must be 3 finite numbers",
    ),
    "no URDF": ("<mujoco/>", "begins with <robot>, not <mujoco>.* name it .xml"),
    "xacro": (
        '<robot name="r"><xacro:include/></robot>',
        "or expand it first: xacro robot.urdf",
    ),
    "xacro's value": (
        one_arm('<xacro:property/><link name="l0"><a b="${c}"/></link>'),
        "or expand it first: xacro robot.urdf",
    ),
    "entities": (
        '<!DOCTYPE r [<!ENTITY a SYSTEM "file:///etc/passwd">]><robot>&a;</robot>',
        "document type declaration",
    ),
    "not XML": ("<robot><link></robot>", "not well-formed XML"),
    "deep": ("<robot>" + "<a>" * 500 + "</a>" * 500 + "</robot>", "deeper than 400"),
    "huge": ("<robot>" + " " * 9_000_000 + "</robot>", "has 9000015 bytes; at most"),
    "no links": ('<robot name="r"/>', "0 links"),
}


@pytest.mark.parametrize(("text", "message"), FAULTS.values(), ids=FAULTS.keys())
def test_a_faulty_file_gets_one_clear_error(tmp_path, text, message):
    path = write(tmp_path, text)
    with pytest.raises(ConfigError, match=message) as caught:
        read_urdf(path)
    assert str(caught.value).count(str(path)) == 1


POINT = (
    '<inertial><mass value="1"/>'
    '<inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial>'
)
STUCK = '<limit lower="0.5" upper="0.5" effort="5" velocity="1"/>'
REVERSED = 'lower="2" upper="-1" effort="5" velocity="1"'
MENDED = {
    "unphysical inertia": (
        one_arm(f'<link name="l0">{BAD}</link>', joint("a", "base", "l0")),
        "link 'l0': the principal moments .* violate the triangle inequality",
    ),
    "no mass": (
        one_arm('<link name="l0"/>', joint("a", "base", "l0")),
        "the links 'l0' move but have no mass",
    ),
    "point mass that turns": (
        one_arm(
            f'<link name="l0"/><link name="l1">{POINT}</link>',
            joint("a", "base", "l0") + joint("b", "l0", "l1", kind="fixed"),
        ),
        "link 'l1': it turns, and its mass has no extent",
    ),
    "empty shape": (
        one_arm(
            f'<link name="l0">{BODY}<visual><geometry><sphere radius="0"/></geometry>'
            "</visual></link>",
            joint("a", "base", "l0"),
        ),
        r"link 'l0' \(line 1\), visual: <sphere> has the radius 0",
    ),
    "inertial without a tensor": (
        one_arm(
            '<link name="l0"><inertial><mass value="1"/></inertial></link>',
            joint("a", "base", "l0"),
        ),
        r"link 'l0' .*: <inertial> (needs <mass> and|without <mass> or) <inertia>",
    ),
    "follower of nothing": (
        one_arm(
            f'<link name="l0">{BODY}</link>',
            joint("a", "base", "l0", inner='<mimic joint="b"/>'),
        ),
        r"joint 'a' \(line 1\) follows 'b', which is no moving joint",
    ),
    "reversed range": (
        one_arm(
            f'<link name="l0">{BODY}</link>',
            joint("a", "base", "l0", kind="revolute", inner=f"<limit {REVERSED}/>"),
        ),
        r"ranges .* reversed; mended: a from -1 to 2\.|range from 2.0 to -1.0 is rev",
    ),
    "range of one value": (
        one_arm(
            TWO,
            joint("a", "base", "l0", kind="revolute", inner=STUCK)
            + joint("b", "l0", "l1"),
        ),
        r"(held fixed|cannot move).*joint 'a' \(line 1\) at 0.5|"
        r"joint 'a' \(line 1\): it cannot move from 0.5 to 0.5",
    ),
}


@pytest.mark.parametrize(("text", "message"), MENDED.values(), ids=MENDED.keys())
def test_faults_are_mended_with_a_warning_or_refused(tmp_path, text, message, caplog):
    path = write(tmp_path, text)
    robot = read_urdf(path)
    assert re.search(message, caplog.text)
    model = robot.to_mjspec().compile()
    assert np.isfinite(model.dof_invweight0).all()
    with pytest.raises(DescriptionError, match=message):
        read_urdf(path, strict=True)


def test_a_joint_of_one_value_is_fixed_there_with_its_followers(tmp_path):
    """Pinocchio's reader moves these joints; there they are set to their values."""
    tilt = '<origin xyz="0.1 0.2 0.3" rpy="0.4 -0.5 0.6"/><axis xyz="0.6 0 0.8"/>'
    names = ("base", "l0", "l1", "l2", "l3")
    slide = '<limit lower="-1" upper="1" effort="5" velocity="1"/>'
    inner = {
        "a": ("revolute", STUCK),
        "b": ("prismatic", slide + '<mimic joint="a" multiplier="-2" offset="0.1"/>'),
        "c": ("continuous", '<mimic joint="b"/>'),
        "d": ("continuous", ""),
    }
    ends = dict(zip(inner, itertools.pairwise(names), strict=True))
    joints = "".join(
        joint(x, *ends[x], kind=kind, inner=tilt + text)
        for x, (kind, text) in inner.items()
    )
    links = "".join(f'<link name="{name}">{BODY}</link>' for name in names[1:])
    path = write(tmp_path, one_arm(links, joints))
    robot = read_urdf(path)
    assert robot.joint_names == ("d",)
    theirs, ours = pin.buildModelFromUrdf(str(path)), robot.to_pinocchio()
    held = {"a": 0.5, "b": -0.9, "c": -0.9}
    places = []
    for model, values in ((theirs, held | {"d": 0.7}), (ours, {"d": 0.7})):
        data, q = model.createData(), positions(model, values)
        pin.framesForwardKinematics(model, data, q)
        places.append(data.oMf[model.getFrameId("l3")].homogeneous)
    np.testing.assert_allclose(places[1], places[0], atol=TOLERANCE)


def test_unphysical_inertias_are_mended(tmp_path):
    text, _ = MENDED["unphysical inertia"]
    robot = read_urdf(write(tmp_path, text))
    xx, yy, zz, *_ = robot.link("l0").inertia
    # The nearest moments without negative mass along z: 0.15 + 0.15 >= 0.3 (+ 1 mm).
    np.testing.assert_allclose([xx, yy, zz], [0.15, 0.15, 0.3], atol=3e-6)


def test_moments_that_miss_the_triangle_inequality_by_rounding_compile(tmp_path):
    plate = BODY.replace('ixx="0.1"', 'ixx="9e-6"').replace('iyy="0.1"', 'iyy="1e-6"')
    plate = plate.replace('izz="0.1"', 'izz="1.0000001e-5"')
    plate = plate.replace('ixy="0"', 'ixy="-1e-6"')
    own = joint("a", "base", "l0", kind="revolute", inner=LIMIT)
    robot = read_urdf(write(tmp_path, one_arm(f'<link name="l0">{plate}</link>', own)))
    assert robot.link("l0").inertia == (9e-6, 1e-6, 1.0000001e-5, -1e-6, 0.0, 0.0)
    moments = robot.to_mjspec().compile().body("l0").inertia
    np.testing.assert_allclose(sorted(moments), [8.77e-7, 9.123e-6, 1e-5], rtol=1e-3)


LIMIT = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'


def test_negative_effort_and_velocity_mean_none(tmp_path):
    limit = LIMIT.replace('effort="1" velocity="1"', 'effort="-1" velocity="-1"')
    links = f'<link name="l0">{BODY}</link><link name="l1">{BODY}</link>'
    first = joint("a", "base", "l0", kind="revolute", inner=limit)
    second = joint("b", "l0", "l1", kind="revolute", inner=LIMIT)
    robot = read_urdf(write(tmp_path, one_arm(links, first + second)))
    assert (robot.joint("a").effort, robot.joint("a").velocity) == (None, None)


LEGGED = {
    "a leg begins with a joint whose name says nothing": (
        ("base hr ll", "ll thigh ll_thigh", "ll_thigh kfe ll_foot"),
        ["foot"],
    ),
    "of toe and heel the toe is the foot": (
        (
            "base hip lefthip",
            "lefthip knee leftshin",
            "leftshin heel leftheelspring",
            "leftshin toe_left lefttoe",
        ),
        ["left_foot"],
    ),
    "the legs at the back are the rear ones": (
        ("base hip_bl back_left_hip", "back_left_hip toe_bl back_left_toe"),
        ["rear_left_foot"],
    ),
}


def chain(first: str, joints: str) -> list[str]:
    """Return the rows of joints one below the other; a link is named as its joint."""
    names = joints.split()
    parents = [first, *(f"{name}_link" for name in names)]
    return [f"{a} {n} {n}_link" for a, n in zip(parents, names, strict=False)]


SIX = "j1 j2 j3 j4 j5 j6"
BRANCHED = {
    "what lifts both arms": (
        [
            "base elv z",
            *("z l_shoulder l1", "z r_shoulder r1", "l1 l_b l2", "r1 r_b r2"),
            *("base pan mast", "mast tilt camera"),
        ],
        "torso left_arm right_arm head",
        "left right",
    ),
    "a side that is spelt": (
        ["base r2_left_shoulder r2_l1", "base r2_right_shoulder r2_r1"],
        "left_arm right_arm",
        "left right",
    ),
    "letters before words": (
        [
            *chain("base", "LARM_0 LARM_1"),
            *chain("base", "RARM_0 RARM_1"),
            *("LARM_1_link LARM_2 LARM_FINGER0", "LARM_1_link LARM_3 LARM_FINGER1"),
            *chain("base", "LLEG_0 LLEG_1"),
        ],
        "left_arm right_arm left_gripper legs",
        "left right",
    ),
    "long chains with sides": (
        [
            "base turn z",
            *chain("z", " ".join(f"{name}_L" for name in SIX.split())),
            *chain("z", " ".join(f"{name}_R" for name in SIX.split())),
        ],
        "torso left_arm right_arm",
        "left right",
    ),
    "a slide beside a long arm": (
        [*chain("base", SIX), "base bellows bellows_link"],
        "right_arm head",
        "right",
    ),
    "shoulders of legs": (
        [
            *chain("base", "front_left_shoulder front_left_leg"),
            *chain("base", "front_right_shoulder front_right_leg"),
        ],
        "legs",
        "",
    ),
}


@pytest.mark.parametrize("name", BRANCHED)
def test_limbs_are_inferred_from_the_tree(tmp_path, name):
    rows, groups, hands = BRANCHED[name]
    found = [row.split() for row in rows]
    links = "".join(f'<link name="{child}">{BODY}</link>' for *_, child in found)
    joints = "".join(joint(own, parent, child) for parent, own, child in found)
    robot = read_urdf(write(tmp_path, one_arm(links, joints)))
    assert set(robot.groups) == set(groups.split())
    assert set(robot.hands) == set(hands.split())


def test_two_arms_without_sides_have_a_gripper_and_a_hand_each(tmp_path):
    rows = [
        f"{'base' if k == 0 else f'p{n}_{k}'} j{n}_{k} p{n}_{k + 1}"
        for n in (1, 2)
        for k in range(3)
    ]
    rows += [f"p{n}_3 f{n}_{k}_finger finger{n}_{k}" for n in (1, 2) for k in (1, 2)]
    chain = [row.split() for row in rows]
    links = "".join(f'<link name="{child}">{BODY}</link>' for *_, child in chain)
    joints = "".join(joint(own, parent, child) for parent, own, child in chain)
    robot = read_urdf(write(tmp_path, one_arm(links, joints)))
    assert set(robot.groups) == {"arm_1", "arm_2", "gripper_1", "gripper_2"}
    assert set(robot.hands) == {"eef_1", "eef_2"}


@pytest.mark.parametrize("name", LEGGED)
def test_each_leg_has_one_foot(tmp_path, name):
    chain, feet = LEGGED[name]
    rows = [row.split() for row in chain]
    links = "".join(f'<link name="{child}">{BODY}</link>' for *_, child in rows)
    joints = "".join(joint(own, parent, child) for parent, own, child in rows)
    robot = read_urdf(write(tmp_path, one_arm(links, joints)))
    assert [frame.name for frame in robot.frames if frame.role == "foot"] == feet
    assert set(robot.groups) == {"legs"}


def test_massless_links_between_masses_hardly_change_the_mass_matrix(tmp_path):
    text = one_arm(
        f'<link name="l0"/><link name="l1">{BODY}</link>',
        joint("a", "base", "l0", kind="revolute", inner=LIMIT)
        + joint("b", "l0", "l1", kind="revolute", inner=LIMIT),
    )
    path = write(tmp_path, text)
    ours, theirs = read_urdf(path).to_pinocchio(), pin.buildModelFromUrdf(str(path))
    q = np.array([0.3, -0.4])
    found = pin.crba(ours, ours.createData(), q) - np.diag(ours.armature)  # estimated
    wanted = pin.crba(theirs, theirs.createData(), q)
    np.testing.assert_allclose(np.triu(found), np.triu(wanted), atol=1e-9)


def test_a_tensor_without_mass_is_kept(tmp_path):
    tensor = POINT.replace('mass value="1"', 'mass value="0"').replace(
        'ixx="0" iyy="0" izz="0"', 'ixx="0.2" iyy="0.2" izz="0.3"'
    )
    text = one_arm(
        f'<link name="l0">{BODY}</link><link name="l1">{tensor}</link>',
        joint("a", "base", "l0", kind="revolute", inner=LIMIT)
        + joint("b", "l0", "l1", kind="fixed"),
    )
    path = write(tmp_path, text)
    robot = read_urdf(path)
    theirs = pin.buildModelFromUrdf(str(path))
    wanted = pin.crba(theirs, theirs.createData(), np.zeros(1))
    ours = robot.to_pinocchio()
    wanted += np.diag(ours.armature)  # estimated
    assert pin.crba(ours, ours.createData(), np.zeros(1)) == pytest.approx(wanted)
    model = robot.to_mjspec().compile()
    assert model.dof_M0 == pytest.approx(wanted[0])
    (tmp_path / "again.urdf").write_text(robot.to_urdf(), encoding="utf-8")
    assert read_urdf(tmp_path / "again.urdf").link("l1").inertia[2] == 0.3


@pytest.mark.parametrize(
    "limit",
    ["", '<limit effort="1" velocity="1"/>', '<limit lower="1e9" upper="-1e9"/>'],
)
def test_joints_without_a_range_are_endless(tmp_path, limit, caplog):
    own = joint("a", "base", "l0", kind="revolute", inner=limit)
    path = write(tmp_path, one_arm(f'<link name="l0">{BODY}</link>', own))
    assert read_urdf(path).joint("a").range is None
    assert "no range for these joints, which are endless: a" in caplog.text


@pytest.mark.parametrize("text", ['lower="-1" upper="2"', REVERSED])
def test_a_range_is_that_of_the_file_in_either_order(text, tmp_path):
    own = joint("a", "base", "l0", kind="revolute", inner=f"<limit {text}/>")
    robot = read_urdf(write(tmp_path, one_arm(f'<link name="l0">{BODY}</link>', own)))
    assert robot.joint("a").range == (-1.0, 2.0)
    assert robot.to_mjspec().compile().jnt_range.tolist() == [[-1.0, 2.0]]


def test_a_range_that_is_not_used_and_new_names_are_warnings(tmp_path, caplog):
    own = joint("a-1", "base", "l 0", inner='<limit lower="-1" upper="2"/>')
    path = write(tmp_path, one_arm(f'<link name="l 0">{BODY}</link>', own))
    assert read_urdf(path).joint("a_1").range is None
    said = [r.getMessage() for r in caplog.records if r.levelname == "WARNING"]
    assert any(
        "not used, since" in text and "a_1 from -1 to 2" in text for text in said
    )
    assert any("link 'l 0' to 'l_0', joint 'a-1' to 'a_1'" in text for text in said)


def test_a_fault_has_the_line_of_its_element(tmp_path):
    text = one_arm(
        f'\n<link name="l0">{BODY.replace("1", "-1", 1)}</link>',
        "\n" + joint("a", "base", "l0"),
    )
    with pytest.raises(
        DescriptionError, match=r"link 'l0' \(line 2\): key 'mass' = -1"
    ):
        read_urdf(write(tmp_path, text))
    text = text.replace('"l0"/>', '"l1"/>').replace('"-1"', '"1"')
    with pytest.raises(DescriptionError, match=r"joint 'a' \(line 3\): its child link"):
        read_urdf(write(tmp_path, text))


def test_a_floating_joint_below_a_solid_link_is_the_root(tmp_path, caplog):
    text = one_arm(
        TWO,
        joint("free", "base", "l0", kind="floating") + joint("a", "l0", "l1"),
    )
    text = text.replace('<link name="base"/>', f'<link name="base">{BODY}</link>')
    robot = read_urdf(write(tmp_path, text))
    assert (robot.root.kind, robot.links[0].name) == ("free", "l0")
    assert "'base' is the world: left out" in caplog.text


def test_a_part_that_floats_beside_the_robot_is_held_fixed(tmp_path, caplog):
    parts = joint("a", "base", "l0") + joint("b", "l0", "l1", kind="floating")
    path = write(tmp_path, one_arm(TWO, parts))
    assert read_urdf(path).joint_names == ("a",)
    assert "Link 'l1' floats beside the robot: held fixed" in caplog.text
    with pytest.raises(DescriptionError, match=r"joint 'b' \(line 1\) is floating"):
        read_urdf(path, strict=True)


def test_a_free_root_without_mass_is_held_fixed(tmp_path, caplog):
    links = f'<link name="world"/><link name="trunk"/><link name="arm">{BODY}</link>'
    joints = joint("a", "world", "trunk", kind="floating") + joint("b", "trunk", "arm")
    path = write(tmp_path, f'<robot name="r">{links}{joints}</robot>')
    assert read_urdf(path).root.kind == "fixed"
    assert "its root has no mass: 'trunk' is held fixed" in caplog.text


def test_a_world_that_is_not_declared_is_the_world(tmp_path, caplog):
    text = one_arm(f'<link name="arm">{BODY}</link>', joint("a", "base", "arm"))
    text = text.replace("</robot>", joint("b", "world", "base", kind="fixed"))
    robot = wbc_suite.load_robot(write(tmp_path, text + "</robot>", "robot.URDF"))
    assert robot.root.kind == "fixed"
    assert robot.joint_names == ("a",)
    assert "it has no link 'world', which is the world" in caplog.text


def test_a_free_robot_collides_with_its_visuals_or_is_refused(tmp_path, caplog):
    ball = '<visual><geometry><sphere radius="0.1"/></geometry></visual>'
    text = f'<robot name="r"><link name="base">{BODY}{{}}</link></robot>'
    path = write(tmp_path, text.format(ball))
    robot = wbc_suite.load_robot(path, root="free")
    assert [shape.shape for shape in robot.links[0].collision] == ["sphere"]
    assert "collides with its visual shapes: 'base'" in caplog.text
    with pytest.raises(DescriptionError, match="stands on its collision shapes"):
        wbc_suite.load_robot(write(tmp_path, text.format("")), root="free")


def test_implausible_inertias_are_taken_with_a_warning(tmp_path, caplog):
    text = mesh_robot("part.stl").replace('mass value="1"', 'mass value="0.05"')
    write_stl(tmp_path / "part.stl", *tetrahedron())
    robot = read_urdf(write(tmp_path, text))
    assert set(robot.links[0].accept) == {"inertia"}
    assert caplog.text.count("radius of gyration") == 1


def test_names_are_given_once_and_the_same_each_time(tmp_path):
    bodies = f'<link name="root">{BODY}</link><link name="1 a">{BODY}</link>'
    bodies += f'<link name="1-a">{BODY}</link>'
    joints = joint("1 a", "base", "1 a") + joint("x", "1 a", "root")
    joints += joint("1_a", "root", "1-a")
    path = write(tmp_path, one_arm(bodies, joints))
    robot = read_urdf(path)
    links = [link.name for link in robot.links]
    assert links == ["base", "link_1_a", "root_link", "link_1_a_link"]
    assert robot.joint_names == ("joint_1_a", "x", "joint_1_a_joint")
    assert robot == read_urdf(path)


def test_links_that_stand_in_each_other_do_not_collide(tmp_path, caplog):
    """Spheres of 0.25 m along a chain in steps of 0.1 m: the fifth reaches the first,
    but over four joints, so that it stands there by its posture."""
    ball = f'{BODY}<collision><geometry><sphere radius="0.25"/></geometry></collision>'
    links = "".join(f'<link name="link{k}">{ball}</link>' for k in range(1, 5))
    chain = ["base", *(f"link{k}" for k in range(1, 5))]
    step = '<origin xyz="0.1 0 0"/>'
    joints = "".join(
        joint(f"joint{k}", one, other, inner=step)
        for k, (one, other) in enumerate(itertools.pairwise(chain))
    )
    text = one_arm(links, joints).replace(
        '<link name="base"/>', f'<link name="base">{ball}</link>'
    )
    robot = read_urdf(write(tmp_path, text))
    assert {frozenset(pair) for pair in robot.contacts.exclude} == {
        frozenset(pair)
        for pair in (
            ("base", "link2"),
            ("base", "link3"),
            ("link1", "link3"),
            ("link1", "link4"),
            ("link2", "link4"),
        )
    }
    assert "'base' and 'link2'" in caplog.text
    model = robot.to_mjspec().compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    touching = {frozenset(model.geom_bodyid[c].tolist()) for c in data.contact.geom}
    ends = frozenset(model.body(name).id for name in ("base", "link4"))
    assert touching == {ends}


def test_links_that_only_touch_go_on_colliding(tmp_path):
    ball = (
        f'{BODY}<collision><geometry><sphere radius="0.1002"/></geometry></collision>'
    )
    links = "".join(f'<link name="link{k}">{ball}</link>' for k in range(1, 4))
    step = '<origin xyz="0.1 0 0"/>'
    joints = "".join(
        joint(f"joint{k}", *pair, inner=step)
        for k, pair in enumerate(
            [("base", "link1"), ("link1", "link2"), ("link2", "link3")]
        )
    )
    assert not read_urdf(write(tmp_path, one_arm(links, joints))).contacts.exclude
