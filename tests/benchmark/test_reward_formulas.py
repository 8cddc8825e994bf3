"""Shaped rewards against the formulas that they state, without a simulation."""

import math
from types import SimpleNamespace

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.benchmark import load_benchmark
from wbc_suite.benchmark.arrangement import with_default
from wbc_suite.benchmark.carry import Carry
from wbc_suite.benchmark.falls import fall_of
from wbc_suite.benchmark.object_benchmark import ObjectBenchmark
from wbc_suite.benchmark.predicates import Predicates
from wbc_suite.benchmark.reach import Reach
from wbc_suite.benchmark.standing import arrange_on_feet
from wbc_suite.benchmark.tool_hang import HOLE, ToolHang
from wbc_suite.benchmark.two_arm_lift import TwoArmLift
from wbc_suite.benchmark.wipe import Wipe
from wbc_suite.errors import ConfigError
from wbc_suite.robot import load_robot
from wbc_suite.scene.arena import bare_arena


def stub(**fields):
    return SimpleNamespace(**fields)


def near(scale, distance):
    return 1.0 - math.tanh(scale * distance)


@pytest.mark.parametrize("known", [None, True, False])
def test_a_success_that_is_known_is_not_asked_for_again(known):
    task = stub(success=lambda: True, progress=lambda: 0.25, terms=())
    reward = ObjectBenchmark.reward(task, shaped=True, success=known)
    assert reward == (0.25 if known is False else 1.0)


@pytest.mark.parametrize("distances", [[0.0], [0.1, 0.0], [0.3, 0.05]])
def test_reach_is_the_mean_over_hands(distances):
    config = load_benchmark("Reach").config
    numbers = config.reward
    expected = numbers.reach * np.mean(
        [near(numbers.reach_scale, d) for d in distances]
    )
    task = stub(config=config, distances=np.array(distances))
    assert Reach.progress(task) == pytest.approx(expected)


@pytest.mark.parametrize("level", [True, False])
@pytest.mark.parametrize("height", [0.0, 0.06, 0.5])
@pytest.mark.parametrize("held", [(False, False), (True, False), (True, True)])
def test_two_arm_lift_counts_height_hands_and_grasps(level, height, held):
    config, distances = load_benchmark("TwoArmLift").config, (0.02, 0.3)
    numbers = config.reward
    hands = [stub(grasps=lambda bars, k=k: held[k]) for k in range(2)]
    task = stub(
        config=config,
        level=level,
        height=height,
        hands=hands,
        _bars=[{1}, {2}],
        site=lambda name: name,
        hand_distance=lambda arm, place: distances[arm],
    )
    raised = min(max(height - numbers.lift_from, 0.0), numbers.lift_most)
    expected = numbers.lift_scale * raised * level + numbers.grasp * sum(held)
    expected += sum(numbers.reach * near(numbers.reach_scale, d) for d in distances)
    assert TwoArmLift.progress(task) == pytest.approx(expected / numbers.success)


@pytest.mark.parametrize("put_down", [True, False])
@pytest.mark.parametrize(("share", "carried"), [(0.0, False), (0.4, True), (1.2, True)])
def test_carry_counts_hands_the_way_and_the_place(share, carried, put_down):
    config = load_benchmark("Carry").config
    numbers = config.reward
    start, goal = np.array(config.table.center), np.array(config.other)
    at = start + share * (goal - start) + [0.0, 0.0, 0.3]  # as high as it is carried
    distances = {0: [0.1, 0.4], 1: [0.5, 0.02]}
    places = iter([0, 1, 0, 1])
    task = stub(
        config=config,
        states={"pot": stub(position=at)},
        hands=[0, 1],
        site=lambda name: name,
        hand_distance=lambda k, place: distances[k][next(places)],
        hands_at_pot=lambda: 1,
        carried=carried,
        is_put_down=lambda: put_down,
    )
    expected = numbers.reach * np.mean(
        [near(numbers.reach_scale, d) for d in (0.1, 0.02)]
    )
    expected += 0.5 * numbers.hold
    if carried:
        way = 1.0 - abs(1.0 - share)
        expected += numbers.carry * way + numbers.place * put_down
    assert Carry.progress(task) == pytest.approx(expected)


@pytest.mark.parametrize("force", [0.0, 0.4, 20.0, 1000.0])
@pytest.mark.parametrize("collided", [True, False])
def test_wipe_counts_marks_contact_and_force(force, collided):
    config = load_benchmark("Wipe").config
    numbers, horizon = config.reward, 400
    assert 0.4 < numbers.least_force < 20.0 < numbers.most_force < 1000.0
    task = stub(
        config=config,
        force=force,
        collided=collided,
        centroid=None,
        distance=lambda place: 0.2,
        _newly_wiped=3,
        marks=np.zeros((50, 3)),
        horizon=horizon,
    )
    total = 3 * numbers.mark + numbers.reach * near(numbers.reach_scale, 0.2)
    total += numbers.contact * (force > 0.0) - numbers.collision * collided
    if force == 20.0:
        total += numbers.contact + numbers.press * force
    if force == 1000.0:
        total -= numbers.excess * force
    most = 50 * numbers.mark + horizon * (numbers.contact + numbers.complete)
    r = max(total * horizon / most, 0.0)
    assert Wipe.progress(task) == pytest.approx(r / (1.0 + r))


def test_marks_that_were_wiped_stay_wiped():
    config, wiped = load_benchmark("Wipe").config, []
    points = [np.array([0.0, 0.0]), np.array([0.02, 0.0]), np.array([0.0, 0.02])]
    marks = np.array([[0.005, 0.005, 0.0], [0.5, 0.0, 0.0], [0.3, 0.3, 0.0]])
    task = stub(
        config=config,
        marks=marks,
        wiped=np.array([False, True, False]),
        wipe=lambda now: wiped.append(list(now)),
        _contacts=lambda: ([np.array(points)], config.reward.least_force, False),
        _measures=np.zeros(9),
    )
    Wipe.after_step(task)
    assert wiped == [[True, True, False]]
    assert task._newly_wiped == 1
    task.wiped = np.array([True, True, False])
    Wipe.after_step(task)
    assert len(wiped) == 1  # nothing new
    task._contacts = lambda: (
        [np.array(points)],
        0.9 * config.reward.least_force,
        False,
    )
    task.wiped = np.array([False, True, False])
    Wipe.after_step(task)
    assert len(wiped) == 1  # too light


@pytest.mark.parametrize(
    ("hole", "passes"),
    [
        ((0.05, 0.0, 0.0), True),
        ((0.05, 0.9 * HOLE, 0.0), True),
        ((0.05, 1.1 * HOLE, 0.0), False),
        ((-0.01, 0.0, 0.0), False),
        ((0.11, 0.0, 0.0), False),
    ],
)
@pytest.mark.parametrize("shift", [(0.0, 0.0, 0.0), (0.3, -0.2, 0.8)])
def test_a_hole_of_the_wrench_is_on_the_arm_of_the_frame(hole, passes, shift):
    sites = {"frame_corner": np.zeros(3), "frame_bend": np.array([0.1, 0.0, 0.0])}
    R = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])  # hole along x
    task = stub(
        site=lambda name: sites[name] + shift, states={"tool": stub(rotation=R)}
    )
    assert ToolHang._passes(task, np.add(hole, shift)) == passes
    task.states["tool"].rotation = np.eye(3)
    assert not ToolHang._passes(task, np.add(hole, shift))  # its plane holds the arm


@pytest.mark.parametrize(
    ("clamps", "slip", "friction", "holds"),
    [
        *((True, 0.19, 1.1, True), (True, 0.21, 1.1, False)),
        *((False, 0.0, 1.1, False), (True, 0.19, 0.9, False)),
    ],
)
def test_a_held_object_moves_with_the_hand_that_bears_it(clamps, slip, friction, holds):
    task = stub(states={"cube": stub(body=4, weight=2.0)}, grip_angle=0.5)
    hand = stub(
        clamps=lambda geoms, angle: clamps,
        slip=lambda body: slip,
        friction=lambda geoms: friction,
    )
    assert Predicates.holds(task, hand, "cube", {1}) == holds


def furnished(name):
    """Return the compiled furniture of a benchmark."""
    spec = bare_arena()
    load_benchmark(name).furnish(spec)
    model = spec.compile()
    bodies = {model.body(i).name for i in range(model.nbody)}
    return model, bodies | {model.geom(i).name for i in range(model.ngeom)}


def test_pick_place_has_two_bins_and_a_ghost_of_each_object_at_its_goal():
    task = load_benchmark("PickPlace")
    model, names = furnished("PickPlace")
    assert {name for name in names if name.startswith("bin1")}
    assert {name for name in names if name.startswith("bin2")}
    for name in task.config.objects:
        body = model.body(f"{name}_goal")
        np.testing.assert_allclose(body.pos[:2], task.goal(name), atol=1e-9)
        assert body.pos[2] > task.config.target.center[2]
    length = model.stat.extent
    assert length > 0.5


def test_tool_hang_has_a_table_and_a_camera_near_the_stand():
    model, _ = furnished("ToolHang")
    top = load_benchmark("ToolHang").config.table
    highest = max(
        model.geom_pos[k, 2] + model.body_pos[model.geom_bodyid[k], 2] + size[2]
        for k, size in enumerate(model.geom_size)
        if model.geom_type[k] == mujoco.mjtGeom.mjGEOM_BOX
    )
    assert highest == pytest.approx(top.center[2], abs=1e-6)
    away = model.camera("closeview").pos - top.center
    assert np.linalg.norm(away) < 0.8


def test_places_need_a_default():
    assert with_default({"default": 1, "Panda": 2}) == {"default": 1, "Panda": 2}
    with pytest.raises(ValueError, match="'default' is needed"):
        with_default({"Panda": 2})


@pytest.mark.parametrize(
    ("robot", "hands", "refused"),
    [
        ("Panda", 0, "Panda has a fixed root and 0 feet"),
        ("GR1FloatingBody", 0, "for robots on feet"),
        ("Spot", 1, r"needs 1 hand\(s\); Spot has 0"),
        ("Spot", 0, None),
        ("GR1FreeBody", 2, None),
    ],
)
def test_benchmarks_on_feet_take_robots_with_a_free_root_and_feet(
    robot, hands, refused
):
    places = {"default": (0.3, -0.1)}
    robots = [load_robot(robot)]
    if refused is None:
        (placed,) = arrange_on_feet("Test", robots, "default", places, hands=hands)
        assert tuple(placed.root.pos[:2]) == (0.3, -0.1)
        return
    with pytest.raises(ConfigError, match=refused):
        arrange_on_feet("Test", robots, "default", places, hands=hands)


PRESSING = """
<mujoco>
  <option timestep="0.002"/>
  <worldbody>
    <geom name="table" type="box" size="1 1 .1" pos="0 0 -.1"/>
    <body name="finger" pos=".1 .2 .049"><freejoint/>
      <geom name="tip" type="sphere" size=".05" mass="1"/></body>
    <body name="elbow" pos="{elbow} 0 .049"><freejoint/>
      <geom name="elbow" type="sphere" size=".05" mass="2"/></body>
    <body name="stone" pos=".5 .5 .049"><freejoint/>
      <geom name="stone" type="sphere" size=".05" mass="3"/></body>
  </worldbody>
</mujoco>
"""


@pytest.mark.parametrize("collided", [True, False])
def test_hands_press_on_the_table_and_other_parts_collide_with_it(collided):
    model = mujoco.MjModel.from_xml_string(
        PRESSING.format(elbow=0.0 if collided else 9)
    )
    data = mujoco.MjData(model)
    for _ in range(500):
        mujoco.mj_step(model, data)
    tip, elbow = (model.geom(name).id for name in ("tip", "elbow"))
    task = stub(
        model=model,
        data=data,
        hands=[stub(owns=lambda geom: geom == tip)],
        _table=model.geom("table").id,
        scene=stub(robot_geoms={tip, elbow}),
        _wrench=np.zeros(6),
    )
    (points,), force, found = Wipe._contacts(task)
    assert found == collided
    np.testing.assert_allclose(points, [[0.1, 0.2]], atol=1e-3)
    assert force == pytest.approx(9.81, rel=0.01)


@pytest.mark.parametrize(
    ("tilt", "height", "root", "fell"),
    [
        (0.99, 0.8, "free", False),
        (1.01, 0.8, "free", True),
        (-1.01, 0.8, "free", True),
        (0.0, 0.41, "free", False),
        (0.0, 0.39, "free", True),
        (1.5, 0.1, "planar", False),
    ],
)
def test_a_robot_has_fallen_when_it_tilts_by_1_rad_or_lost_half_its_height(
    tilt, height, root, fell
):
    robot = stub(name="Spot", root=stub(kind=root, pos=(0.0, 0.0, 0.8)))
    pose = pin.SE3(pin.exp3(np.array([tilt, 0.0, 0.0])), np.array([1.0, 2.0, height]))
    found = fall_of([stub(robot=robot, root_pose=pose)])
    assert (found is not None) == fell
    if found is not None:
        assert f"{math.degrees(abs(tilt)):.0f} degrees" in found
        assert f"{100 * (1 - height / 0.8):.0f} % lower" in found
