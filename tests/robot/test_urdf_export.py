"""Our URDF text, loaded by Pinocchio and by MuJoCo, against our own exports."""

from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

import wbc_suite
from wbc_suite.catalogue import Catalogue
from wbc_suite.robot.mesh_files import read_points
from wbc_suite.robot.shape_geometry import shape_bounds, support_points
from wbc_suite.robot.urdf_export import write_urdf

ROBOTS = Catalogue().names("robots")
CASES = [(name, None) for name in ROBOTS] + [
    ("spot", root) for root in ("fixed", "planar", "free")
]
TOLERANCE = 1e-9


@pytest.fixture(scope="module", params=CASES, ids=str)
def robot(request):
    """Without visuals: their meshes cost time and prove nothing here."""
    name, root = request.param
    robot = wbc_suite.load_robot(name, root=root)
    links = [link.model_copy(update={"visual": ()}) for link in robot.links]
    return robot.model_copy(update={"links": tuple(links)})


def random_values(robot, rng):
    return {j.name: rng.uniform(*(j.range or (-np.pi, np.pi))) for j in robot.joints}


def configuration(model, values):
    """q of a Pinocchio model whose continuous joints may be (cos, sin)."""
    q = pin.neutral(model)
    for joint, value in values.items():
        entry = model.joints[model.getJointId(joint)]
        if entry.nq == 2:
            q[entry.idx_q : entry.idx_q + 2] = np.cos(value), np.sin(value)
        else:
            q[entry.idx_q] = value
    return q


def inertia_by_name(model, data, q, names):
    """M and gravity torques of the named joints, without armature."""
    rows = [model.joints[model.getJointId(n)].idx_v for n in names]
    M = pin.crba(model, data, q)
    M = np.triu(M) + np.triu(M, 1).T - np.diag(model.armature)
    g = pin.computeGeneralizedGravity(model, data, q)
    return M[np.ix_(rows, rows)], g[rows]


def test_pinocchio_reads_the_robot_that_we_export(robot):
    ours, theirs = robot.to_pinocchio(), pin.buildModelFromXML(robot.to_urdf())
    data, other = ours.createData(), theirs.createData()
    rng = np.random.default_rng(3)
    for _ in range(5):
        values = random_values(robot, rng)
        q, p = configuration(ours, values), configuration(theirs, values)
        if robot.root.kind == "free":
            q[:7] = p[:7] = pin.SE3ToXYZQUAT(pin.SE3.Random())
        pin.framesForwardKinematics(ours, data, q)
        pin.framesForwardKinematics(theirs, other, p)
        for frame in (*robot.links, *robot.frames):
            mine = [i for i, f in enumerate(ours.frames) if f.name == frame.name][-1]
            its = theirs.getFrameId(frame.name, pin.FrameType.BODY)
            np.testing.assert_allclose(
                other.oMf[its].homogeneous, data.oMf[mine].homogeneous, atol=TOLERANCE
            )
        expected = inertia_by_name(ours, data, q, robot.joint_names)
        found = inertia_by_name(theirs, other, p, robot.joint_names)
        for a, b in zip(found, expected, strict=True):
            np.testing.assert_allclose(a, b, atol=TOLERANCE)


def test_mujoco_reads_the_robot_that_we_export(robot):
    ours = robot.to_mjspec().compile()
    theirs = mujoco.MjSpec.from_string(robot.to_urdf()).compile()
    assert (theirs.nq, theirs.nv) == (ours.nq, ours.nv)
    assert theirs.body_mass.sum() == pytest.approx(robot.mass)  # a fixed base's, too
    d, e = mujoco.MjData(ours), mujoco.MjData(theirs)
    rng = np.random.default_rng(4)
    dense = np.zeros((2, ours.nv, ours.nv))
    for _ in range(5):
        d.qpos[:] = e.qpos[:] = rng.normal(size=ours.nq)
        d.qvel[:] = e.qvel[:] = rng.normal(size=ours.nv)
        mujoco.mj_forward(ours, d)
        mujoco.mj_forward(theirs, e)
        for item in (*robot.links, *robot.frames):
            place = (d.site if item in robot.frames else d.body)(item.name)
            body = e.body(item.name)
            np.testing.assert_allclose(body.xpos, place.xpos, atol=TOLERANCE)
            np.testing.assert_allclose(body.xmat, place.xmat, atol=TOLERANCE)
        mujoco.mj_fullM(ours, d, dense[0])
        mujoco.mj_fullM(theirs, e, dense[1])
        dense[0] -= np.diag(ours.dof_armature)
        np.testing.assert_allclose(dense[1], dense[0], atol=TOLERANCE)
        scale = max(1.0, float(np.abs(d.qfrc_bias).max()))
        np.testing.assert_allclose(e.qfrc_bias, d.qfrc_bias, atol=TOLERANCE * scale)


def test_limits_and_couplings_are_carried(robot):
    theirs = mujoco.MjSpec.from_string(robot.to_urdf()).compile()
    model = pin.buildModelFromXML(robot.to_urdf())
    followers = [j for j in robot.joints if j.mimic is not None]
    assert theirs.neq == len(followers)
    for joint in robot.joints:
        if joint.range is not None:
            assert tuple(theirs.joint(joint.name).range) == joint.range
        v = model.joints[model.getJointId(joint.name)].idx_v
        assert model.upperEffortLimit[v] == (joint.effort or 0.0)
        if joint.velocity is not None:
            assert model.upperVelocityLimit[v] == joint.velocity


def test_equal_robots_give_equal_text(robot):
    assert robot.to_urdf() == robot.model_copy(deep=True).to_urdf()


SHAPES = """
format = 1
component = { name = "bag", kind = "body" }
[[link]]
name = "bag"
visual = [
  { shape = "hull", spheres = [[0, 0, 0, 0.1], [0, 0, 0.5, 0.05]] },
  { shape = "box", size = [0.1, 0.2, 0.3], radius = 0.05, pos = [1, 0, 0] },
  { shape = "cylinder", from = [0, 0, 0], to = [0.3, 0, 0], radius = 0.1, \
    radius_to = 0.05 },
  { shape = "ellipsoid", size = [0.1, 0.2, 0.3], rpy = [0.5, 0, 0] },
  { shape = "capsule", from = [0, 0, 0], to = [0, 0, 0.3], radius = 0.1 },
]
"""


@pytest.fixture
def bag(tmp_path: Path):
    (tmp_path / "bag.toml").write_text(SHAPES)
    return wbc_suite.load_robot(tmp_path / "bag.toml")


def test_shapes_that_urdf_lacks_become_meshes(bag, tmp_path: Path):
    text = write_urdf(bag, mesh_dir=tmp_path / "meshes")
    for index, shape in enumerate(bag.links[0].visual[:3]):
        file = f"meshes/bag_visual{index}.stl"
        assert f'"{file}"' in text
        vertices = support_points(shape)
        points = read_points(tmp_path / file)
        np.testing.assert_allclose(points.min(0), vertices.min(0), atol=1e-6)
        np.testing.assert_allclose(points.max(0), vertices.max(0), atol=1e-6)
    assert len(list((tmp_path / "meshes").iterdir())) == 4
    points = read_points(tmp_path / "meshes" / "bag_visual3.stl")
    np.testing.assert_allclose(points.max(0), [0.1, 0.2, 0.3], atol=2e-3)


def test_engines_read_the_meshes_of_an_exported_robot(bag, tmp_path: Path):
    solid = bag.links[0].model_copy(update={"collision": bag.links[0].visual})
    robot = bag.model_copy(update={"links": (solid,)})
    path = tmp_path / "bag.urdf"
    path.write_text(robot.to_urdf(mesh_dir=tmp_path / "meshes"), encoding="utf-8")
    model = mujoco.MjModel.from_xml_path(str(path))
    meshes = model.geom_type == mujoco.mjtGeom.mjGEOM_MESH
    assert (meshes & (model.geom_contype > 0)).sum() == 4
    assert (meshes & (model.geom_contype == 0)).sum() == 4  # visual ones are kept too
    tree = pin.buildModelFromUrdf(str(path))
    kind = pin.GeometryType.VISUAL
    shapes = pin.buildGeomFromUrdf(tree, str(path), kind, [str(tmp_path)])
    names = [g.meshPath for g in shapes.geometryObjects if g.meshPath.endswith(".stl")]
    assert len(names) == 4
    again = wbc_suite.load_robot(path)
    hull = again.links[0].visual[0]
    low, high = shape_bounds(hull)
    wanted = shape_bounds(bag.links[0].visual[0])
    np.testing.assert_allclose([low, high], wanted, atol=5e-3)


def test_shapes_that_urdf_lacks_become_bounding_boxes(bag):
    model = pin.buildModelFromXML(bag.to_urdf())
    geometry = pin.buildGeomFromUrdfString(
        model, bag.to_urdf(), pin.GeometryType.VISUAL
    )
    sizes = [2 * g.geometry.halfSide for g in geometry.geometryObjects[:4]]
    expected = [(0.2, 0.2, 0.65), (0.2, 0.4, 0.6), (0.3, 0.2, 0.2), (0.2, 0.4, 0.6)]
    np.testing.assert_allclose(sizes, expected, atol=0.01)
    names = [type(g.geometry).__name__ for g in geometry.geometryObjects[4:]]
    assert names == ["Cylinder", "Sphere", "Sphere"]  # together one capsule


angle = st.floats(-np.pi, np.pi)
steep = st.sampled_from([np.pi / 2, -np.pi / 2, np.pi / 2 - 1e-9, 1e-8 - np.pi / 2])


@given(roll=angle, pitch=st.one_of(angle, steep), yaw=angle)
def test_roll_pitch_yaw_are_exact_at_every_attitude(roll, pitch, yaw):
    rotation = pin.rpy.rpyToMatrix(roll, pitch, yaw)
    again = pin.rpy.rpyToMatrix(*pin.rpy.matrixToRpy(rotation))
    np.testing.assert_allclose(again, rotation, atol=2e-15)  # a few rounding errors
