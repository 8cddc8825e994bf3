"""Files for single readers: in Pinocchio and MuJoCo, and by the readers' own rules."""

import re
from itertools import combinations
from xml.etree import ElementTree

import mujoco
import numpy as np
import pinocchio as pin
import pytest
import trimesh

import wbc_suite
from wbc_suite.robot.collision_capsules import collision_pairs
from wbc_suite.robot.readers.export import EXPORTS, export_for
from wbc_suite.robot.readers.files import STIFFNESS, file_stem, joint_gains
from wbc_suite.robot.readers.ros2 import yaml_text

ROBOTS = ("panda", "pr2", "spot_with_arm", "iiwa")  # fixed, planar, free, closed loops
ROOTS = {"planar": pin.JointModelPlanar, "free": pin.JointModelFreeFlyer}
TOLERANCE = 1e-9


@pytest.fixture(scope="module", params=ROBOTS)
def robot(request):
    return wbc_suite.load_robot(request.param)


@pytest.fixture(scope="module")
def exported(robot, tmp_path_factory):
    """Folders by reader; all are written once."""
    folder = tmp_path_factory.mktemp(robot.name)
    hints = {r: export_for(robot, r, folder / r) for r in EXPORTS}
    assert all(hints.values())
    return {reader: folder / reader for reader in EXPORTS}


def only(folder, pattern):
    (found,) = folder.rglob(pattern)
    return found


def xml(folder, pattern="*.urdf"):
    return ElementTree.parse(only(folder, pattern)).getroot()


def place(model, values):
    """Return q; continuous joints of Pinocchio's reader have cosine and sine."""
    q = pin.neutral(model)
    for name, value in values.items():
        if model.existJointName(name):
            joint = model.joints[model.getJointId(name)]
            turned = joint.nq == 2
            own = (np.cos(value), np.sin(value)) if turned else value
            q[joint.idx_q : joint.idx_q + joint.nq] = own
    return q


def random_values(robot, rng):
    given = {j.name: rng.uniform(*(j.range or (-3.0, 3.0))) for j in robot.joints}
    return robot.posture(given)


def total_mass(tree):
    return sum(float(mass.get("value")) for mass in tree.iter("mass"))


def test_a_reader_adds_its_own_root_to_a_urdf_without_one(robot):
    """A floating root in the file would be counted twice: 25 and 6 velocities."""
    root = ROOTS.get(robot.root.kind)
    text = robot.to_urdf(root="none")
    assert 'link="world"' not in text
    assert '"root"' not in text
    model = pin.buildModelFromXML(text, root()) if root else pin.buildModelFromXML(text)
    assert model.nv == robot.to_pinocchio().nv


@pytest.mark.parametrize("kind", ["fixed", "planar", "floating"])
def test_the_root_of_a_urdf_is_chosen(kind):
    robot = wbc_suite.load_robot("panda")
    *_, joint = ElementTree.fromstring(robot.to_urdf(root=kind)).iter("joint")
    assert (joint.get("name"), joint.get("type")) == ("root", kind)
    ours = robot.with_root({"floating": "free"}.get(kind, kind))
    assert ours.to_urdf() == robot.to_urdf(root=kind)


def test_the_root_is_the_last_joint(robot):
    """Readers find leaders by the index of a joint among those before, as yourdfpy."""
    names = [joint.get("name") for joint in ElementTree.fromstring(robot.to_urdf())]
    joints = [name for name in names if name == "root" or name in robot.joint_names]
    assert joints[-1] == "root"
    assert joints[:-1] == list(robot.joint_names)


@pytest.mark.parametrize(("reader", "lightest"), [("pybullet", 0.0), ("isaac", 1e-6)])
def test_readers_that_assume_masses_find_all_of_them(exported, robot, reader, lightest):
    tree = xml(exported[reader])
    for link in tree.iter("link"):
        if link.get("name") is not None:
            assert float(link.find("inertial/mass").get("value")) >= lightest
    assert abs(total_mass(tree) - robot.mass) < 1e-3  # kg
    below = {joint.find("child").get("link") for joint in tree.findall("joint")}
    (first,) = (x for x in tree.findall("link") if x.get("name") not in below)
    static = float(first.find("inertial/mass").get("value")) < 1e-3
    assert static == (robot.root.kind != "free")  # PyBullet fixes a massless root


@pytest.mark.parametrize("reader", EXPORTS)
def test_no_reader_meets_joints_that_it_cannot_drive(exported, reader):
    types = {joint.get("type") for joint in xml(exported[reader]).findall("joint")}
    assert types <= {"fixed", "revolute", "continuous", "prismatic"}


@pytest.mark.parametrize("reader", EXPORTS)
def test_meshes_lie_beside_the_file(exported, reader):
    file = only(exported[reader], "*.urdf")
    packages = {"ros2": file.parents[2]}
    found = set()
    for mesh in ElementTree.parse(file).getroot().iter("mesh"):
        name, local = mesh.get("filename"), file.parent
        if reader == "ros2":
            assert name.startswith("package://")
            name, local = name.removeprefix("package://"), packages["ros2"]
        assert (local / name).is_file()
        found.add((local / name).suffix)
    assert found == {".obj" if reader == "drake" else ".stl"}


def test_a_planar_root_of_three_joints_moves_as_ours(tmp_path):
    robot = wbc_suite.load_robot("pr2")
    export_for(robot, "pybullet", tmp_path)
    theirs = pin.buildModelFromUrdf(str(only(tmp_path, "*.urdf")))
    ours = robot.to_pinocchio()
    assert theirs.nv == ours.nv
    rng = np.random.default_rng(1)
    values = random_values(robot, rng) | {
        "root_x": 0.7,
        "root_y": -0.4,
        "root_yaw": 2.0,
    }
    sides = []
    for model in (ours, theirs):
        data, q = model.createData(), place(model, values)
        pin.framesForwardKinematics(model, data, q)
        M = pin.crba(model, data, q)
        M = np.triu(M) + np.triu(M, 1).T - np.diag(model.armature)
        names = [*robot.root_joint_names, *robot.joint_names]
        rows = [model.joints[model.getJointId(n)].idx_v for n in names]
        poses = [
            data.oMf[model.getFrameId(x.name, pin.BODY)].homogeneous
            for x in robot.links
        ]
        sides.append((np.array(poses), M[np.ix_(rows, rows)]))
    for mine, its in zip(*sides, strict=True):
        np.testing.assert_allclose(its, mine, atol=TOLERANCE)


def in_pinocchio(robot, folder):
    urdf, srdf = (str(only(folder, f"*.{kind}")) for kind in ("urdf", "srdf"))
    root = ROOTS.get(robot.root.kind)
    model = pin.buildModelFromUrdf(urdf, *([root()] if root else []))
    return model, urdf, srdf


def test_pinocchio_reads_postures_and_rotors(exported, robot):
    model, _, srdf = in_pinocchio(robot, exported["pinocchio"])
    pin.loadReferenceConfigurations(model, srdf, False)
    pin.loadRotorParameters(model, srdf, False)
    for joint in robot.joints:
        v = model.joints[model.getJointId(joint.name)].idx_v
        assert model.armature[v] == pytest.approx(joint.armature)
    for name in robot.keyframes:
        expected = place(model, robot.keyframe(name))
        if robot.root.kind == "free":
            w, *xyz = robot.root.quat
            expected[:7] = (*robot.root.pos, *xyz, w)
        found = model.referenceConfigurations[name]
        np.testing.assert_allclose(found, expected, atol=1e-12)


@pytest.mark.parametrize("reader", ["pinocchio", "ros2"])
def test_pairs_of_the_srdf_are_ours(exported, robot, reader):
    disabled = {
        frozenset((pair.get("link1"), pair.get("link2")))
        for pair in xml(exported[reader], "*.srdf").iter("disable_collisions")
    }
    shaped = [link.name for link in robot.links if link.collision]
    everything = set(map(frozenset, combinations(shaped, 2)))
    assert everything - disabled == collision_pairs(robot)


def test_pinocchio_keeps_our_pairs(exported, robot):
    model, urdf, srdf = in_pinocchio(robot, exported["pinocchio"])
    folders = [str(exported["pinocchio"])]
    shapes = pin.buildGeomFromUrdf(model, urdf, pin.COLLISION, package_dirs=folders)
    shapes.addAllCollisionPairs()
    pin.removeCollisionPairs(model, shapes, srdf, False)
    link = [model.frames[shape.parentFrame].name for shape in shapes.geometryObjects]
    kept = {frozenset((link[p.first], link[p.second])) for p in shapes.collisionPairs}
    assert kept == collision_pairs(robot)


def test_the_srdf_names_groups_grippers_and_states(exported, robot):
    tree = xml(exported["ros2"], "*.srdf")
    groups = {
        g.get("name"): [j.get("name") for j in g.iter("joint")]
        for g in tree.findall("group")
    }
    for name, joints in robot.groups.items():
        assert groups[name] == list(joints)
        state = next(
            x
            for x in tree.iter("group_state")
            if (x.get("name"), x.get("group")) == ("ready", name)
        )
        values = {j.get("name"): float(j.get("value")) for j in state}
        assert values == {j: robot.keyframe("ready")[j] for j in joints}
    links = {link.name for link in robot.links}
    for effector in tree.iter("end_effector"):
        side = effector.get("group").removesuffix("_gripper")
        assert effector.get("parent_group") == f"{side}_arm"
        assert effector.get("parent_link") in links
    assert len(list(tree.iter("end_effector"))) == len(robot.synergies)
    virtual = tree.find("virtual_joint")
    assert (virtual is None) == (robot.root.kind == "fixed")


def test_drake_gets_motors_accelerations_and_filters(exported, robot):
    tree = xml(exported["drake"])
    motors = {x.find("joint").get("name"): x for x in tree.iter("transmission")}
    base = robot.root_joint_names if robot.root.kind == "planar" else ()
    assert set(motors) == {
        *base,
        *(j.name for j in robot.joints if j.independent and j.effort),
    }
    for joint in robot.joints:
        element = next(j for j in tree.findall("joint") if j.get("name") == joint.name)
        found = element.find("limit").get("drake:acceleration") or element.find(
            "limit"
        ).get("{https://drake.mit.edu}acceleration")
        assert (found and float(found)) == joint.acceleration
    for name in set(motors) & set(robot.joint_names):
        own = motors[name].find("actuator/{https://drake.mit.edu}rotor_inertia")
        assert float(own.get("value")) == robot.joint(name).armature
    ns = "{https://drake.mit.edu}"
    ignored = {
        frozenset((group.find(f"{ns}member").get("link"), other.get("name")[6:]))
        for group in tree.iter(f"{ns}collision_filter_group")
        for other in group.iter(f"{ns}ignored_collision_filter_group")
    }
    shaped = [link.name for link in robot.links if link.collision]
    everything = set(map(frozenset, combinations(shaped, 2)))
    assert everything - ignored == collision_pairs(robot)
    assert {f.get("name") for f in tree.findall("frame")} == {
        f.name for f in robot.frames
    }


def test_isaac_gets_frames_cameras_and_a_model_with_armature(exported, robot):
    tree = xml(exported["isaac"])
    frames = {
        f.get("name"): f.find("parent").get("link") for f in tree.iter("fixed_frame")
    }
    assert frames == {frame.name: frame.link for frame in robot.frames}
    for camera in robot.cameras:
        sensor = next(s for s in tree.iter("sensor") if s.get("name") == camera.name)
        image = sensor.find("camera/image")
        focal = camera.resolution[1] / 2 / np.tan(np.radians(camera.fovy) / 2)  # pixels
        wide = np.tan(float(image.get("hfov")) / 2)
        assert wide * focal == pytest.approx(camera.resolution[0] / 2)
    ours = mujoco.MjModel.from_xml_string(robot.to_mjcf())
    theirs = mujoco.MjModel.from_xml_path(str(only(exported["isaac"], "*.xml")))
    for key in (
        "body_mass",
        "dof_armature",
        "actuator_gainprm",
        "jnt_range",
        "site_pos",
    ):
        np.testing.assert_array_equal(getattr(theirs, key), getattr(ours, key))
    size = ours.geom_rbound.max()
    np.testing.assert_allclose(theirs.geom_rbound, ours.geom_rbound, atol=1e-3 * size)


def read_yaml(text):
    """Return the tables of a YAML of two-space indents as nested dictionaries."""
    root = {}
    above = [root]
    for line in text.splitlines():
        indent, key, value = re.fullmatch(r"( *)([\w\"]+):(.*)", line).groups()
        del above[len(indent) // 2 + 1 :]
        above[-1][key] = value.strip() or {}
        if not value:
            above.append(above[-1][key])
    return root


def test_ros2_gets_a_package_with_control(exported, robot):
    name = f"{file_stem(robot)}_description"
    package = exported["ros2"] / name
    tree = ElementTree.parse(package / "package.xml").getroot()
    assert tree.find("name").text == name
    assert re.fullmatch(r"[a-z][a-z0-9_]*", name)
    control = xml(exported["ros2"]).find("ros2_control")
    driven = {j.name for j in robot.joints if j.independent and j.effort}
    commanded = {
        joint.get("name"): joint.find("command_interface")
        for joint in control.iter("joint")
        if joint.find("state_interface") is not None
    }
    assert set(commanded) == set(robot.joint_names)
    assert {n for n, c in commanded.items() if c is not None} == driven
    moved = {t.find("joint").get("name") for t in control.iter("transmission")}
    assert moved == driven
    content = read_yaml((package / "config" / "controllers.yaml").read_text())
    handled = []
    for key in content["controller_manager"]["ros__parameters"]:
        if key in content:
            own = content[key]["ros__parameters"]
            joints = own["joints"].strip("[]").split(", ")
            interface = own["command_interfaces"].strip("[]")
            assert {commanded[j].get("name") for j in joints} == {interface}
            handled += joints
            for joint, gains in own.get("gains", {}).items():
                stated = (float(gains["p"]), float(gains["d"]))
                assert stated == pytest.approx(joint_gains(robot)[joint])
    assert sorted(handled) == sorted(driven)
    limits = read_yaml((package / "config" / "joint_limits.yaml").read_text())
    assert set(limits["joint_limits"]) == set(robot.joint_names)


def test_gains_are_stated_or_follow_from_the_inertia(robot):
    """Against the mass matrix of MuJoCo's model."""
    m = robot.to_mjspec().compile()
    d = mujoco.MjData(m)
    mujoco.mj_resetDataKeyframe(m, d, m.key("ready").id)
    mujoco.mj_forward(m, d)
    M = np.zeros((m.nv, m.nv))
    mujoco.mj_fullM(m, d, M)
    stated = {a.joint: (a.kp, a.kd) for a in robot.actuators if a.kind != "motor"}
    for name, (kp, kd) in joint_gains(robot).items():
        if name in stated:
            assert (kp, kd) == stated[name]
        else:
            inertia = M[m.joint(name).dofadr[0], m.joint(name).dofadr[0]]
            assert kp == pytest.approx(STIFFNESS * inertia)
            assert kd == pytest.approx(2 * np.sqrt(kp * inertia))  # critical damping


@pytest.mark.parametrize(
    ("name", "stem"),
    [
        ("SpotWithArm", "spot_with_arm"),
        ("UR5eDexRH", "ur5e_dex_rh"),
        ("PR2", "pr2"),
        ("2F-85", "robot_2f_85"),
    ],
)
def test_files_have_names_that_ros_takes(name, stem):
    robot = wbc_suite.load_robot("panda").model_copy(update={"name": name})
    assert file_stem(robot) == stem


def test_yaml_keeps_types():
    """YAML takes 1e-05 for a text, and `y` or `on` for booleans."""
    data = {"a": {"y": 1e-5, "b": True, "n": 3}, "names": ["on", "arm"], "c": 2.0}
    expected = 'a:\n  "y": 1.0e-05\n  b: true\n  "n": 3\nnames: ["on", arm]\nc: 2.0\n'
    assert yaml_text(data) == expected


LABELLED = """<robot name="box"><link name="base"/>
<link name="arm"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01"
ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><mesh filename="part.stl"/></geometry></visual>
<visual><geometry><mesh filename="label.stl"/></geometry></visual></link>
<joint name="turn" type="revolute"><parent link="base"/><child link="arm"/>
<limit lower="-1" upper="1" effort="5" velocity="1"/></joint></robot>"""


def test_an_imported_robot_takes_its_meshes_along(tmp_path):
    """MuJoCo refuses a URDF with a label of two triangles; others take it."""
    part = trimesh.creation.cone(radius=0.1, height=0.3)
    corners = [[0, 0, 0.2], [0.01, 0, 0.2], [0.01, 0.01, 0.2], [0, 0.01, 0.2]]
    label = trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False)
    part.export(tmp_path / "part.stl")
    label.export(tmp_path / "label.stl")
    (tmp_path / "box.urdf").write_text(LABELLED)
    robot = wbc_suite.load_robot(tmp_path / "box.urdf", skin="meshes")
    plain = tmp_path / "out" / "box.urdf"
    plain.parent.mkdir()
    plain.write_text(robot.to_urdf(mesh_dir=plain.parent / "box_meshes"))
    export_for(robot, "ros2", tmp_path / "ros2")
    counts = {}
    for file in (plain, only(tmp_path / "ros2", "*.urdf")):
        tree, folder = ElementTree.parse(file).getroot(), file.parents[2]
        names = [
            m.get("filename").removeprefix("package://") for m in tree.iter("mesh")
        ]
        counts[file.parent.name] = len(names)
        local = plain.parent if file == plain else folder
        own = trimesh.load_mesh(local / names[0])
        np.testing.assert_allclose(own.bounds, part.bounds, atol=1e-6)
    assert counts == {"out": 1, "urdf": 2}
    assert mujoco.MjModel.from_xml_path(str(plain)).nmesh == 1
