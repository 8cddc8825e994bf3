"""A robot is drawn with the meshes of a file with other names, frames and zeros."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.errors import ConfigError
from wbc_suite.robot import load_robot
from wbc_suite.robot.mesh_files import write_stl
from wbc_suite.robot.poses import joint_motion

Z, Y, X = np.eye(3)[[2, 1, 0]]
AXES = {"a": Z, "b": Y, "c": Y, "d": X, "left": Y, "right": Y}
PLACES = {
    "a": ("base", (0.0, 0.0, 0.1)),
    "b": ("a", (0.05, 0.0, 0.2)),
    "c": ("b", (0.3, 0.0, 0.0)),
    "d": ("c", (0.2, 0.0, 0.03)),
    "left": ("d", (0.1, 0.04, 0.0)),
    "right": ("d", (0.1, -0.04, 0.0)),
}
SLIDES = ("left", "right")


@pytest.fixture(autouse=True)
def _own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def urdf(origins, axes, visual, names=lambda name: name):
    """Return an arm with two fingers as URDF, given the poses of its joints."""

    def pose(T):
        xyz, rpy = T.translation, pin.rpy.matrixToRpy(T.rotation)
        return f'xyz="{numbers(xyz)}" rpy="{numbers(rpy)}"'

    def link(name):
        inertia = '<inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/>'
        return (
            f'<link name="{names(name)}"><inertial><mass value="0.5"/>{inertia}'
            f"</inertial><visual><geometry>{visual(name)}</geometry></visual></link>"
        )

    text = link("base")
    for name, T in origins.items():
        kind = "prismatic" if name in SLIDES else "revolute"
        text += (
            f'{link(name)}<joint name="{names(name)}_joint" type="{kind}">'
            f'<parent link="{names(PLACES[name][0])}"/><child link="{names(name)}"/>'
            f'<origin {pose(T)}/><axis xyz="{numbers(axes[name])}"/>'
            '<limit lower="-3" upper="3" effort="9" velocity="3"/></joint>'
        )
    return f'<robot name="arm">{text}</robot>'


def numbers(values):
    return " ".join(f"{v:.15g}" for v in values)


def two_files(folder, rng, zeros):
    """Write an arm of boxes, and the same of meshes in other frames; return both."""
    mesh = rng.uniform(0.01, 0.04, (4, 3))
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    other = {"base": pin.SE3(pin.exp3(rng.normal(size=3)), rng.normal(size=3))}
    ours, theirs, axes = {}, {}, {}
    write_stl(folder / "base.stl", mesh, faces)
    for name, (above, place) in PLACES.items():
        shift = rng.uniform(-0.05, 0.05) * AXES[name]  # along the axis
        other[name] = pin.SE3(pin.exp3(rng.normal(size=3)), shift)
        ours[name] = pin.SE3(np.eye(3), np.array(place))
        turn = joint_motion(AXES[name], zeros.get(name, 0.0), slide=name in SLIDES)
        theirs[name] = other[above].inverse() * ours[name] * turn * other[name]
        axes[name] = other[name].rotation.T @ AXES[name]
        write_stl(folder / f"{name}.stl", mesh + rng.uniform(0, 0.02, 3), faces)
    one, two = folder / "boxes.urdf", folder / "meshes.urdf"
    one.write_text(urdf(ours, AXES, lambda _: '<box size="0.04 0.04 0.04"/>'))
    drawn = '<mesh filename="{}.stl"/>'.format
    two.write_text(urdf(theirs, axes, drawn, lambda name: f"{name[:1]}{len(name)}x"))
    return one, two, other["base"]


def drawn_points(robot, values):
    """Return the vertices of visual meshes in the world, shape (n, 3), in any order."""
    model = robot.to_mjspec().compile()
    data = mujoco.MjData(model)
    data.qpos[:] = values
    mujoco.mj_forward(model, data)
    found = []
    for g in np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_MESH):
        mesh = model.geom_dataid[g]
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        points = model.mesh_vert[first : first + count]
        found.append(data.geom_xpos[g] + points @ data.geom_xmat[g].reshape(3, 3).T)
    return np.concatenate(found)


@pytest.mark.parametrize("zeros", [{}, {"b": 0.7}, {"b": -0.4, "c": 1.1}])
def test_meshes_move_with_our_joints_as_with_their_own(tmp_path, zeros):
    rng = np.random.default_rng(len(zeros))
    one, two, T = two_files(tmp_path, rng, zeros)
    robot, other = load_robot(one, skin=two), load_robot(two)
    assert set(robot.skins) == {link.name for link in robot.links}
    for _ in range(3):
        q = dict(zip(AXES, rng.uniform(-1.0, 1.0, len(AXES)), strict=True))
        q |= {name: 0.02 * q[name] for name in SLIDES}
        own = [q[joint.name.removesuffix("_joint")] for joint in robot.joints]
        moved = [q[name] - zeros.get(name, 0.0) for name in AXES]
        ours, theirs = drawn_points(robot, own), drawn_points(other, moved)
        theirs = theirs @ T.rotation.T + T.translation
        assert len(ours) == len(theirs) == 4 * len(robot.links)
        gaps = np.linalg.norm(ours[:, None] - theirs[None], axis=-1)
        assert gaps.min(axis=0).max() < 1e-5
        assert gaps.min(axis=1).max() < 1e-5


def test_a_part_of_a_robot_is_dressed_alone(tmp_path):
    one, two, _ = two_files(tmp_path, np.random.default_rng(5), {})
    text = one.read_text().replace('axis xyz="1 0 0"', 'axis xyz="0 0 1"')
    one.write_text(text)  # joint d differs, and with it what it carries
    robot = load_robot(one, skin=two)
    assert set(robot.skins) == {"base", "a", "b", "c"}


def test_a_file_without_meshes_is_no_skin(tmp_path):
    one, _, _ = two_files(tmp_path, np.random.default_rng(6), {})
    with pytest.raises(ConfigError, match=r"boxes.urdf has no meshes for 'arm'"):
        load_robot(one, skin=one)
