"""Objects, arenas and formulas that scripts take from robosuite's modules."""

import importlib

import mujoco
import numpy as np
import pytest

from wbc_suite.compat.robosuite.models.objects import (
    BallObject,
    BoxObject,
    CompositeBodyObject,
    CompositeObject,
    CylinderObject,
    ObjectGroup,
)
from wbc_suite.compat.robosuite.models.objects.ready_made import READY_MADE
from wbc_suite.compat.robosuite.models.tasks import MujocoWorldBase
from wbc_suite.compat.robosuite.utils import control_utils, mjcf_utils
from wbc_suite.compat.robosuite.utils import transform_utils as T
from wbc_suite.errors import ConfigError, UnknownNameError


def compiled(item):
    """Return the model of an object alone."""
    world = MujocoWorldBase()
    world.merge_assets(item)
    world.worldbody.append(item.get_obj())
    return world.get_model()


@pytest.mark.parametrize("name", READY_MADE)
def test_an_object_of_robosuites_class_extends_as_it_says(suite, name):
    item = getattr(importlib.import_module("robosuite.models.objects"), name)("thing")
    model = compiled(item)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    assert model.body(item.root_body).id == 1
    names = [model.geom(k).name for k in range(model.ngeom)]
    assert names == [f"thing_g{k}" for k in range(model.ngeom)]
    assert set(item.contact_geoms) <= set(names)
    assert bool(item.contact_geoms) != ("Visual" in name)
    assert all(model.site(site).id >= 0 for site in item.important_sites.values())
    free = mujoco.mjtJoint.mjJNT_FREE
    assert (free in model.jnt_type) == (item.joints == ["thing_joint0"])
    for geom in item.contact_geoms:
        k = model.geom(geom).id
        middle = data.geom_xpos[k, 2]
        assert item.bottom_offset[2] - 1e-3 <= middle <= item.top_offset[2] + 1e-3
        assert np.hypot(*data.geom_xpos[k, :2]) <= item.horizontal_radius + 1e-3


def test_arguments_of_objects_count_and_unknown_ones_are_errors():
    pot = READY_MADE["PotWithHandlesObject"]("pot", body_half_size=(0.06, 0.06, 0.05))
    assert pot.top_offset[2] == pytest.approx(0.05)
    heavy, light = (compiled(READY_MADE["Bin"]("b", density=d)) for d in (800.0, 400.0))
    assert heavy.body_mass[1] == pytest.approx(2.0 * light.body_mass[1])
    rng = np.random.default_rng(3)
    hammers = [READY_MADE["HammerObject"]("h", rng=rng) for _ in range(2)]
    assert hammers[0].top_offset[2] != hammers[1].top_offset[2]
    with pytest.raises(ConfigError, match="unsupported arguments among ngeoms2"):
        READY_MADE["HollowCylinderObject"]("tube", ngeoms2=3)


def test_geoms_are_placed_in_a_box_from_its_corner_or_its_middle():
    common = {"total_size": (0.1, 0.1, 0.05), "geom_types": ["box", "cylinder"]}
    common |= {
        "geom_sizes": [(0.02, 0.03, 0.01), (0.01, 0.04)],
        "density": [100, 200.0],
    }
    places = [(0.0, 0.0, 0.0), (0.05, 0.0, 0.01)]
    cornered = compiled(CompositeObject("a", geom_locations=places, **common))
    middle = CompositeObject(
        "b",
        geom_locations=places,
        locations_relative_to_center=True,
        geom_names=["plate", None],
        sites=[{"name": "hole", "pos": "0 0 0.02"}],
        **common,
    )
    centred = compiled(middle)
    expected = [[-0.08, -0.07, -0.04], [-0.04, -0.09, 0.0]]
    np.testing.assert_allclose(cornered.geom_pos, expected, atol=1e-12)
    np.testing.assert_allclose(centred.geom_pos, places, atol=1e-12)
    assert centred.geom("b_plate").id == 0
    np.testing.assert_allclose(centred.site("b_hole").pos, [0, 0, 0.02])
    mass = 100.0 * 8 * 0.02 * 0.03 * 0.01 + 200.0 * np.pi * 0.01**2 * 0.08
    assert centred.body_mass[1] == pytest.approx(mass)
    assert middle.in_box([1, 1, 1], [1.05, 0.95, 0.945])
    assert not middle.in_box([1, 1, 1], [1.05, 0.95, 0.935])
    with pytest.raises(ConfigError, match="'mesh' is none of"):
        CompositeObject("c", (1, 1, 1), ["mesh"], [(1, 1, 1)], [(0, 0, 0)])


def test_bodies_are_composed_with_joints_between_them():
    base, arm = (
        BoxObject("base", size=[0.05] * 3),
        CylinderObject("arm", size=[0.01, 0.1]),
    )
    hinge = {"type": "hinge", "axis": "0 1 0", "pos": "0 0 -0.1"}
    whole = CompositeBodyObject(
        "machine",
        [base, arm],
        object_locations=[None, (0, 0, 0.15)],
        object_quats=[None, (1, 0, 0, 0)],
        object_parents=[None, base.root_body],
        body_joints={arm.root_body: [hinge]},
    )
    model = compiled(whole)
    arm_body = model.body("machine_arm_main")
    assert model.body(arm_body.parentid[0]).name == "machine_base_main"
    assert model.nq == 7 + 1
    assert model.joint("machine_arm_main_joint0").type[0] == mujoco.mjtJoint.mjJNT_HINGE
    assert whole.top_offset[2] == pytest.approx(0.25)
    assert whole.bottom_offset[2] == pytest.approx(-0.05)
    with pytest.raises(ConfigError, match="'nowhere' is none of"):
        CompositeBodyObject("m", [base], [None], object_parents=["nowhere"])


def test_a_group_makes_its_objects_and_takes_a_simulation():
    class Pair(ObjectGroup):
        def _generate_objects(self):
            self._objects = {k: BoxObject(f"{self.name}_{k}") for k in ("a", "b")}

    pair = Pair("pair")
    pair.update_sim("sim")
    assert pair.sim == "sim"
    assert [item.name for item in pair.objects.values()] == ["pair_a", "pair_b"]


def test_arenas_of_tasks_have_bins_pegs_and_marks(suite):
    arenas = importlib.import_module("robosuite.models.arenas")
    bins = arenas.BinsArena(bin1_pos=(0.2, -0.4, 0.9))
    model = bins.get_model()
    np.testing.assert_allclose(model.body("bin1").pos[:2], [0.2, -0.4])
    assert bins.bin2_body.get("name") == "bin2"
    pegs = arenas.PegsArena(table_full_size=(0.5, 0.7, 0.05), table_offset=(0, 0, 0.9))
    model = pegs.get_model()
    np.testing.assert_allclose(model.geom("table").size, [0.25, 0.35, 0.025])
    assert pegs.peg1_body.get("name") == "square_peg"
    assert model.body("round_peg").pos[2] > 0.9
    marks = arenas.WipeArena(num_markers=12, line_width=0.05)
    assert len(marks.markers) == 12
    assert marks.get_model().geom("mark11").size[0] == pytest.approx(0.025)


def test_formulas_of_operational_space_are_those_of_the_textbook():
    rng = np.random.default_rng(0)
    J, A = rng.normal(size=(6, 7)), rng.normal(size=(7, 7))
    M = A @ A.T + np.eye(7)
    full, pos, ori, N = control_utils.opspace_matrices(M, J, J[:3], J[3:])
    np.testing.assert_allclose(
        full @ (J @ np.linalg.inv(M) @ J.T), np.eye(6), atol=1e-8
    )
    assert pos.shape == ori.shape == (3, 3)
    still = np.zeros(7)
    tau = control_utils.nullspace_torques(M, N, rng.normal(size=7), still, still)
    assert np.abs(tau).max() > 0.1
    np.testing.assert_allclose(J @ np.linalg.solve(M, tau), 0.0, atol=1e-9)
    turn = T.quat2mat(T.axisangle2quat(np.array([0.0, 0.3, 0.0])))
    error = control_utils.orientation_error(turn, np.eye(3))
    np.testing.assert_allclose(error, [0.0, np.sin(0.3), 0.0], atol=1e-12)


def test_goals_stay_within_limits():
    limits = np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 0.5]])
    goal = control_utils.set_goal_position(np.full(3, 0.4), np.zeros(3), limits)
    np.testing.assert_allclose(goal, 0.4)
    goal = control_utils.set_goal_position(np.full(3, 0.9), np.zeros(3), limits)
    np.testing.assert_allclose(goal, [0.9, 0.9, 0.5])
    turn = control_utils.set_goal_orientation(np.array([0, 0, 0.8]), np.eye(3), limits)
    np.testing.assert_allclose(T.mat2euler(turn), [0.0, 0.0, 0.5], atol=1e-9)
    turn = control_utils.set_goal_orientation(np.array([0, 0, 0.2]), np.eye(3), limits)
    np.testing.assert_allclose(T.mat2euler(turn), [0.0, 0.0, 0.2], atol=1e-9)
    with pytest.raises(ConfigError, match=r"not \(2, 3\)"):
        control_utils.set_goal_position(np.zeros(3), np.zeros(3), limits[:, :2])


def test_controllers_of_parts_are_of_robosuites_classes(suite):
    parts = importlib.import_module("robosuite.controllers.parts.arm.osc")
    grips = importlib.import_module("robosuite.controllers.parts.gripper.simple_grip")
    env = suite.make("Lift", robots="Panda", use_camera_obs=False)
    found = env.robots[0].part_controllers
    assert isinstance(found["right"], parts.OperationalSpaceController)
    assert isinstance(found["right_gripper"], grips.SimpleGripController)
    assert suite.Stack.__name__ == "Stack"
    two_arms = importlib.import_module("robosuite.utils.robot_utils").check_bimanual
    assert [two_arms(name) for name in ("Panda", "Baxter")] == [False, True]


def test_elements_are_found_by_parts_of_their_names_and_recoloured():
    body = BoxObject("cube").get_obj()
    found = mjcf_utils.find_elements_by_substring(body, ["geom", "site"], "default")
    assert [element.get("name") for element in found] == ["cube_default_site"]
    assert mjcf_utils.find_elements_by_substring(body, "geom", "none") is None
    mjcf_utils.recolor_collision_geoms(body, (0.0, 1.0, 0.0, 1.0))
    assert body.find("geom").get("rgba").split()[1].startswith("1")


@pytest.mark.slow
def test_the_world_of_robosuites_guide_has_its_gripper_base_and_ball(suite):
    models = importlib.import_module("robosuite.models.robots")
    grippers = importlib.import_module("robosuite.models.grippers")
    bases = importlib.import_module("robosuite.models.bases")
    arenas = importlib.import_module("robosuite.models.arenas")
    world, robot = MujocoWorldBase(), models.Panda()
    assert robot.root is not None  # written before, and again after the change
    robot.add_gripper(grippers.gripper_factory("RethinkGripper"))
    robot.add_base(bases.NullMount())
    robot.set_base_xpos([0, 0, 0])
    world.merge(robot)
    arena = arenas.TableArena()
    arena.set_origin([0.8, 0, 0])
    world.merge(arena)
    ball = BallObject(name="sphere", size=[0.04], rgba=[0, 0.5, 0.5, 1]).get_obj()
    ball.set("pos", "1.0 0 1.0")
    world.worldbody.append(ball)
    model = world.get_model(mode="mujoco")
    names = [model.body(k).name for k in range(model.nbody)]
    assert any("finger" in name and "panda" not in name for name in names)
    assert not any("pedestal" in name or "panda_hand" in name for name in names)
    data = mujoco.MjData(model)
    while data.time < 1.0:
        mujoco.mj_step(model, data)
    top = model.geom("table").size[2] + data.geom("table").xpos[2]
    assert data.body("sphere_main").xpos[2] == pytest.approx(top + 0.04, abs=2e-3)
    with pytest.raises(UnknownNameError, match="third"):
        robot.add_gripper(grippers.PandaGripper(), "third")
