"""Spot: the vendor's figures, standing and grasping."""

import mujoco
import numpy as np
import pytest

import wbc_suite
from wbc_suite.robot.inertia import inertia_matrix

FEET = ["front_left_foot", "front_right_foot", "rear_left_foot", "rear_right_foot"]
FOOT_RADIUS = 0.036
LEGGED = ["Spot", "SpotWithArm"]
GRAVITY = 9.81


def compiled(spec):
    model = spec.compile()
    model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    return model, mujoco.MjData(model)


def at_ready(model, data):
    mujoco.mj_resetDataKeyframe(model, data, model.key("ready").id)
    mujoco.mj_forward(model, data)


def add_floor(spec):
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0, 0, 0.1],
        friction=[1.0, 0.005, 0.0001],
    )


def test_mass_without_arm_is_the_makers():
    assert wbc_suite.load_robot("Spot").mass == pytest.approx(32.7, abs=1e-9)


def test_variants_have_the_joints_they_promise():
    figures = {
        name: (wbc_suite.load_robot(name).root.kind, wbc_suite.load_robot(name).dof)
        for name in ("Spot", "SpotWithArm", "SpotWithArmFloating")
    }
    assert figures == {
        "Spot": ("free", 12),
        "SpotWithArm": ("free", 12 + 6 + 1),
        "SpotWithArmFloating": ("planar", 6 + 1),
    }
    floating = wbc_suite.load_robot("SpotWithArmFloating")
    assert floating.mass == wbc_suite.load_robot("SpotWithArm").mass


def test_wrist_and_palm_add_up_to_the_sources_hand():
    robot = wbc_suite.load_robot("SpotWithArm")
    wrist, palm = robot.link("arm_link_wr1"), robot.link("jaw_palm")
    mass = wrist.mass + palm.mass
    com = (wrist.mass * np.array(wrist.com) + palm.mass * np.array(palm.com)) / mass
    tensor = np.zeros((3, 3))
    for link in (wrist, palm):
        r = np.array(link.com) - com
        tensor += inertia_matrix(link.inertia)
        tensor += link.mass * (r @ r * np.eye(3) - np.outer(r, r))
    # spot_description, arm_link_wr1
    assert mass == pytest.approx(0.785, abs=1e-12)
    np.testing.assert_allclose(
        com, [0.1251680255, 0.0001013743531, -0.01399798226], atol=1e-11
    )
    figures = (0.0008441038381, 0.001762323899, 0.001605608876)
    figures += (2.111337479e-05, 0.0002526799569, -5.269971159e-06)
    np.testing.assert_allclose(tensor, inertia_matrix(figures), atol=1e-12)
    model, data = compiled(robot.to_mjspec())
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(
        data.body("jaw_palm").xpos, data.body("arm_link_wr1").xpos, atol=1e-12
    )
    np.testing.assert_allclose(
        data.body("jaw_palm").xmat, data.body("arm_link_wr1").xmat, atol=1e-12
    )


@pytest.mark.parametrize("name", LEGGED)
def test_ready_stands_on_four_feet_and_touches_nothing_else(name):
    model, data = compiled(wbc_suite.load_robot(name).to_mjspec())
    at_ready(model, data)
    assert data.ncon == 0
    heights = [data.site(foot).xpos[2] for foot in FEET]
    np.testing.assert_allclose(heights, FOOT_RADIUS, atol=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("name", LEGGED)
def test_stands_for_five_seconds_under_joint_control(name):
    """Stiff joints with the weight fed forward: no slip, little sag."""
    robot = wbc_suite.load_robot(name)
    spec = robot.to_mjspec()
    add_floor(spec)
    model, data = compiled(spec)
    at_ready(model, data)
    joints = [model.joint(j) for j in robot.joint_names if j != "arm_f1x"]
    qs = [j.qposadr[0] for j in joints]
    vs = [j.dofadr[0] for j in joints]
    motors = [model.actuator(j.name).id for j in joints]
    goal = data.qpos[qs].copy()
    height = data.qpos[2]
    places = np.array([data.site(foot).xpos for foot in FEET])
    J = np.zeros((3, model.nv))
    for _ in range(round(5.0 / model.opt.timestep)):
        torque = 500 * (goal - data.qpos[qs]) - 15 * data.qvel[vs] + data.qfrc_bias[vs]
        for foot, load in zip(FEET, loads(model, data), strict=True):
            mujoco.mj_jacSite(model, data, J, None, model.site(foot).id)
            torque -= load * J[2, vs]
        data.ctrl[motors] = torque
        mujoco.mj_step(model, data)
    moved = np.array([data.site(foot).xpos for foot in FEET]) - places
    assert np.abs(moved[:, :2]).max() < 1e-3
    assert abs(height - data.qpos[2]) < 3e-3
    assert np.abs(data.qvel).max() < 1e-3
    assert np.abs(torque).max() < 45.0  # N m, the weakest leg joint's limit


def loads(model, data):
    """Vertical forces on the feet that balance the weight, shape (4,), N."""
    places = np.array([data.site(foot).xpos for foot in FEET])
    weight = model.body("body").subtreemass[0] * GRAVITY
    com = data.body("body").subtree_com
    balance = np.vstack([np.ones(4), places[:, 0], places[:, 1]])
    return np.linalg.pinv(balance) @ (weight * np.array([1.0, com[0], com[1]]))


def test_floating_base_glides_without_dragging_its_feet():
    spec = wbc_suite.load_robot("SpotWithArmFloating").to_mjspec()
    add_floor(spec)
    model, data = compiled(spec)
    model.opt.gravity[:] = 0.0  # the arm's joints are not driven here
    at_ready(model, data)
    data.ctrl[model.actuator("root_x").id] = 40.0
    for _ in range(100):
        mujoco.mj_step(model, data)
        assert data.ncon == 0
    mujoco.mj_subtreeVel(model, data)
    momentum = model.body("body").subtreemass[0] * data.body("body").subtree_linvel[0]
    assert momentum == pytest.approx(40.0 * data.time, rel=0.02)


def jaw_with_cube():
    """The jaw alone, palm forward and level, a 4 cm cube lying on its lower pad."""
    jaw = wbc_suite.load_robot("gripper/bd_gripper")
    half = np.sqrt(0.5)
    level = {"pos": (0, 0, 0.5), "quat": (half, 0, half, 0)}
    jaw = jaw.with_root("fixed", **level)
    spec = jaw.to_mjspec()
    cube = spec.worldbody.add_body(name="cube", pos=[0.14, 0, 0.4842])
    cube.add_freejoint()
    cube.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.02] * 3, mass=0.1)
    model, data = compiled(spec)
    model.opt.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    return jaw.synergies["gripper"][0], model, data


def test_jaw_closes_on_a_cube_and_holds_it_against_a_pull():
    synergy, model, data = jaw_with_cube()
    joint = model.joint("arm_f1x")
    data.qpos[joint.qposadr] = synergy.open["arm_f1x"]
    data.ctrl[0] = synergy.closed["arm_f1x"]
    fastest = 0.0
    for _ in range(round(0.5 / model.opt.timestep)):
        mujoco.mj_step(model, data)
        fastest = max(fastest, abs(data.joint("arm_f1x").qvel[0]))
    assert fastest < 10.0  # rad/s, the joint's limit
    held = data.joint("arm_f1x").qpos[0]
    assert -0.4 < held < -0.25  # stopped by the cube, not shut
    before = data.body("cube").xpos.copy()
    model.opt.gravity[:] = [5 * GRAVITY, 2 * GRAVITY, -GRAVITY]  # out of the jaw
    for _ in range(round(1.0 / model.opt.timestep)):
        mujoco.mj_step(model, data)
    assert np.linalg.norm(data.body("cube").xpos - before) < 3e-3


def test_jaw_opens_and_shuts_when_empty():
    synergy, model, data = jaw_with_cube()
    data.qpos[-7:-4] = [3, 3, 3]
    for goal in (synergy.closed, synergy.open):
        data.ctrl[0] = goal["arm_f1x"]
        for _ in range(round(1.0 / model.opt.timestep)):
            mujoco.mj_step(model, data)
        assert data.joint("arm_f1x").qpos[0] == pytest.approx(goal["arm_f1x"], abs=0.01)


def test_left_and_right_legs_mirror_each_other():
    robot = wbc_suite.load_robot("Spot")
    model, data = compiled(robot.to_mjspec())
    rng = np.random.default_rng(3)
    for end in ("front", "rear"):
        roll, pitch, knee = rng.uniform([-0.7, 0.0, -2.5], [0.7, 1.5, -0.5])
        for side, sign in (("left", 1.0), ("right", -1.0)):
            data.joint(f"{end}_{side}_hip_x").qpos = sign * roll
            data.joint(f"{end}_{side}_hip_y").qpos = pitch
            data.joint(f"{end}_{side}_knee").qpos = knee
        mujoco.mj_forward(model, data)
        left = data.site(f"{end}_left_foot").xpos
        right = data.site(f"{end}_right_foot").xpos
        np.testing.assert_allclose(left * [1, -1, 1], right, atol=1e-12)


@pytest.mark.slow
def test_no_pair_of_links_always_collides():
    robot = wbc_suite.load_robot("SpotWithArm")
    model, data = compiled(robot.to_mjspec())
    low, high = np.array([joint.range for joint in robot.joints]).T
    data.qpos[7:] = np.clip(0.0, low, high)
    mujoco.mj_forward(model, data)
    assert data.ncon == 0
    rng = np.random.default_rng(5)
    always = None
    for _ in range(200):
        data.qpos[7:] = rng.uniform(low, high)
        mujoco.mj_forward(model, data)
        pairs = {tuple(sorted(pair)) for pair in model.geom_bodyid[data.contact.geom]}
        always = pairs if always is None else always & pairs
    assert not always
