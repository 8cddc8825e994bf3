"""The inferred `ready` posture of arms, and pairs of links that never touch."""

import mujoco
import numpy as np
import pytest

from wbc_suite.robot import load_robot
from wbc_suite.robot.adopt.contact_pairs import exclude_contacts

LINK = """<link name="{name}"><inertial><origin xyz="0 0 0.15"/><mass value="1"/>
  <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>
  <collision><origin xyz="0 0 0.15"/><geometry>
  <cylinder radius="0.03" length="0.2"/></geometry></collision></link>"""
JOINT = """<joint name="{name}" type="revolute"><parent link="{parent}"/>
  <child link="{child}"/><origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>
  <limit lower="-2.5" upper="2.5" effort="90" velocity="3"/></joint>"""
AXES = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "0 0 1")


def arm(side="", y=0.0):
    """Six joints along a column that points up at zero."""
    parts, parent = [], "body"
    for k, axis in enumerate(AXES):
        child = f"{side}arm_link_{k}"
        xyz = f"0 {y} 0.2" if k == 0 else "0 0 0.3" if k in (1, 2, 3) else "0 0 0.1"
        parts += [
            LINK.format(name=child),
            JOINT.format(name=f"{side}arm_joint_{k}", parent=parent, child=child,
                         xyz=xyz, rpy="0 0 0", axis=axis),
        ]  # fmt: skip
        parent = child
    return "".join(parts)


def load(folder, *arms):
    path = folder / "robot.urdf"
    path.write_text(
        f'<robot name="r">{LINK.format(name="body")}{"".join(arms)}</robot>'
    )
    return load_robot(path)


def simulated(robot):
    m = robot.to_mjspec().compile()
    data = mujoco.MjData(m)
    mujoco.mj_resetDataKeyframe(m, data, m.key("ready").id)
    mujoco.mj_fwdPosition(m, data)
    return m, data


def test_the_hand_is_in_front_off_the_floor_and_not_singular(tmp_path):
    robot = load(tmp_path, arm())
    m, data = simulated(robot)
    site = data.site(robot.hands["right"])
    assert site.xpos[0] > 0.3
    assert site.xpos[2] > 0.1
    J = np.zeros((6, m.nv))
    mujoco.mj_jacSite(m, data, J[:3], J[3:], site.id)
    assert np.linalg.svd(J, compute_uv=False)[-1] > 0.05  # 0 with all joints at zero
    assert data.ncon == 0
    ranges = np.array([joint.range for joint in robot.joints])
    margin = np.min(np.abs(ranges.T - data.qpos))
    assert margin > 0.1


def test_two_arms_are_mirror_images(tmp_path):
    robot = load(tmp_path, arm("right_", -0.3), arm("left_", 0.3))
    _, data = simulated(robot)
    right, left = (data.site(robot.hands[side]).xpos for side in ("right", "left"))
    assert left == pytest.approx(right * (1.0, -1.0, 1.0), abs=1e-3)


def test_pairs_that_never_touch_are_excluded_and_others_are_not(tmp_path):
    robot = load(tmp_path, arm())
    excluded = {frozenset(pair) for pair in robot.contacts.exclude}
    # One elbow between them keeps these apart; the wrist can reach the column.
    assert frozenset(("arm_link_1", "arm_link_3")) in excluded
    assert frozenset(("body", "arm_link_5")) not in excluded
    rng = np.random.default_rng(7)
    spec = robot.model_copy(update={"contacts": type(robot.contacts)()}).to_mjspec()
    m, data = (whole := spec.compile()), mujoco.MjData(whole)
    for _ in range(500):
        data.qpos[:] = rng.uniform(-2.5, 2.5, m.nq)
        mujoco.mj_fwdPosition(m, data)
        for pair in m.geom_bodyid[data.contact.geom].tolist():
            assert frozenset(m.body(b).name for b in pair) not in excluded


def test_links_whose_hulls_overlap_in_many_postures_are_excluded(tmp_path, caplog):
    wide = '<cylinder radius="0.03" length="0.2"/>'
    path = tmp_path / "robot.urdf"
    links = arm().replace(wide, '<sphere radius="0.3"/>', 1)  # past the second link
    path.write_text(f'<robot name="r">{LINK.format(name="body")}{links}</robot>')
    robot = load_robot(path)
    upright = {"ready": dict.fromkeys(robot.joint_names, 0.0)}
    changes = {"contacts": type(robot.contacts)(), "keyframes": upright}
    caplog.clear()
    sampled = exclude_contacts(robot.model_copy(update=changes), path)
    assert "overlap in many random postures" in caplog.text
    assert "'arm_link_0' and 'arm_link_2'" in caplog.text
    excluded = {frozenset(pair) for pair in sampled.contacts.exclude}
    assert frozenset(("arm_link_0", "arm_link_2")) in excluded
    assert frozenset(("arm_link_0", "arm_link_5")) not in excluded  # many joints apart
