"""The Robotiq grippers: linkages that close, and what their data sheets say."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import wbc_suite

TWO_FINGERS = {
    "robotiq85_gripper": {
        "leader": "left_driver_joint",
        "pads": ("left_pad", "right_pad"),
        "mass": 0.9,
        "stroke": 0.085,
        "force": (20.0, 235.0),
    },
    "robotiq140_gripper": {
        "leader": "finger_joint",
        "pads": ("left_inner_finger_pad", "right_inner_finger_pad"),
        "mass": 1.0,
        "stroke": 0.129,  # between the pads, as in the source
        "force": (10.0, 125.0),
    },
}


@pytest.fixture(scope="module", params=TWO_FINGERS, ids=str)
def figures(request):
    return {"robot": wbc_suite.load_robot(f"gripper/{request.param}")} | TWO_FINGERS[
        request.param
    ]


def settled(robot, command, seconds=2.0):
    """Return model and data after the fingers have reached their setpoints."""
    model = robot.to_mjspec().compile()
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.opt.gravity[:] = 0.0
    data = mujoco.MjData(model)
    for joint, value in command.items():
        data.actuator(joint).ctrl = value
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, data)
    assert not data.warning.number.any()
    return model, data


def gap(data, model, pads):
    """Return the free width between the pads' faces along y, m."""
    left, right = (model.body(p).geomadr[0] for p in pads)
    ends = [data.geom_xpos[g, 1] for g in (left, right)]
    thick = [
        np.abs(data.geom_xmat[g].reshape(3, 3)[1] @ model.geom_size[g])
        for g in (left, right)
    ]
    return abs(ends[0] - ends[1]) - sum(thick)


def test_mass_is_the_data_sheets(figures):
    assert figures["robot"].mass == pytest.approx(figures["mass"], rel=0.02)


def test_a_joint_in_a_loop_gets_no_second_constraint(figures):
    robot = figures["robot"]
    model = robot.to_mjspec().compile()
    kinds = list(model.eq_type)
    assert kinds.count(mujoco.mjtEq.mjEQ_CONNECT) == 2
    plain = [j for j in robot.joints if j.mimic and not j.mimic.closed]
    assert kinds.count(mujoco.mjtEq.mjEQ_JOINT) == len(plain)
    assert robot.dof == 1


@pytest.mark.parametrize("closed", [0.0, 0.3, 0.6, 0.85])
def test_the_loops_and_the_tree_agree(figures, closed):
    """The relation that other engines get is the one that the loops enforce."""
    robot, leader = figures["robot"], figures["leader"]
    (synergy,) = robot.synergies["gripper"]
    low, high = synergy.open[leader], synergy.closed[leader]
    _, data = settled(robot, {leader: low + closed * (high - low)})
    lead = float(data.joint(leader).qpos[0])
    assert lead == pytest.approx(low + closed * (high - low), abs=2e-3)
    tree = robot.to_pinocchio()
    q = pin.neutral(tree)
    for joint in robot.joints:
        mimic = joint.mimic
        value = lead if mimic is None else mimic.ratio * lead + mimic.offset
        assert float(data.joint(joint.name).qpos[0]) == pytest.approx(value, abs=1e-3)
        q[tree.joints[tree.getJointId(joint.name)].idx_q] = value
    state = tree.createData()
    pin.framesForwardKinematics(tree, state, q)
    for pad in figures["pads"]:
        place = state.oMf[tree.getFrameId(pad)]
        np.testing.assert_allclose(data.body(pad).xpos, place.translation, atol=3e-4)


def test_fingers_open_by_the_stroke_and_meet(figures):
    robot, leader = figures["robot"], figures["leader"]
    (synergy,) = robot.synergies["gripper"]
    model, data = settled(robot, {leader: synergy.open[leader]})
    assert gap(data, model, figures["pads"]) == pytest.approx(
        figures["stroke"], rel=0.03
    )
    model, data = settled(robot, {leader: synergy.closed[leader]})
    assert gap(data, model, figures["pads"]) == pytest.approx(0.0, abs=5e-4)
    tool = data.site("tcp").xpos
    assert abs(tool[1]) < 1e-9
    assert np.abs(data.qvel).max() < 1e-3


def test_force_at_the_pads_is_within_the_data_sheet(figures):
    """By virtual work: F dw = effort dq, with the gap's width w half closed."""
    robot, leader = figures["robot"], figures["leader"]
    closed = robot.synergies["gripper"][0].closed[leader]
    tree = robot.to_pinocchio()
    state = tree.createData()

    def width(value):
        q = pin.neutral(tree)
        for joint in robot.joints:
            mimic = joint.mimic
            follows = value if mimic is None else mimic.ratio * value + mimic.offset
            q[tree.joints[tree.getJointId(joint.name)].idx_q] = follows
        pin.framesForwardKinematics(tree, state, q)
        places = [state.oMf[tree.getFrameId(p)].translation for p in figures["pads"]]
        return float(np.linalg.norm(places[0] - places[1]))

    slope = (width(closed / 2 + 1e-4) - width(closed / 2 - 1e-4)) / 2e-4
    low, high = figures["force"]
    assert low < robot.joint(leader).effort / abs(slope) < high


@pytest.fixture(scope="module")
def dexterous():
    return wbc_suite.load_robot("gripper/robotiq_three_finger_dexterous_gripper")


def test_three_fingers_weigh_what_the_data_sheet_says(dexterous):
    assert dexterous.mass == pytest.approx(2.3, rel=0.02)


def test_each_command_moves_its_own_finger(dexterous):
    leaders = {}
    for synergy in dexterous.synergies["gripper"]:
        _, data = settled(dexterous, synergy.closed)
        moved = {
            joint.name
            for joint in dexterous.joints
            if abs(float(data.joint(joint.name).qpos[0])) > 0.05
        }
        (leader,) = synergy.closed
        leaders[leader] = moved
    for leader, moved in leaders.items():
        wanted = {
            j.name
            for j in dexterous.joints
            if j.name == leader
            or (j.mimic and j.mimic.joint == leader and j.mimic.ratio)
        }
        assert moved == wanted


def test_tips_stay_upright_while_they_close(dexterous):
    """The outer link turns back by as much as the inner one turns in."""
    model, data = settled(dexterous, {})
    tips = [model.body(f"finger_{n}_link_3").id for n in ("1", "2", "middle")]
    before = data.xquat[tips].copy()
    closed = {
        j: v
        for s in dexterous.synergies["gripper"]
        for j, v in s.closed.items()
        if not j.startswith("palm")
    }
    _, data = settled(dexterous, closed | {"palm_finger_1_joint": 0.0})
    np.testing.assert_allclose(data.xquat[tips], before, atol=5e-3)
    heights = data.xpos[tips, 1]
    assert np.ptp(np.abs(heights)) < 2e-3
    assert heights[0] * heights[2] < 0


def test_the_plain_three_finger_gripper_has_one_command(dexterous):
    plain = wbc_suite.load_robot("gripper/robotiq_three_finger_gripper")
    assert [s.name for s in plain.synergies["gripper"]] == ["grasp"]
    assert plain.links == dexterous.links
