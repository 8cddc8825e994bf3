"""What a robot is made of stays above the floor that it stands on."""

import mujoco
import numpy as np
import pytest

from wbc_suite.kinematics import Configuration, Conversion
from wbc_suite.qp import (
    AccelerationLimit,
    FloorLimit,
    FrameEquality,
    FrameTask,
    PostureTask,
    TaskStack,
)
from wbc_suite.robot import load_robot
from wbc_suite.robot.collision_capsules import collision_spheres
from wbc_suite.scene import attach_robot, empty_arena

DT = 0.01


class Spot:
    """Spot with its arm in both engines, on a floor."""

    def __init__(self):
        self.robot = load_robot("SpotWithArm")
        spec = empty_arena()
        attach_robot(spec, self.robot, "spot_")
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        model = self.robot.to_pinocchio()
        self.configuration = Configuration(
            model, model.referenceConfigurations["ready"]
        )
        self.conversion = Conversion(self.model, model, prefix="spot_")

    def heights(self):
        """Return what MuJoCo says of each link's distance from the floor, m."""
        qpos = self.data.qpos
        self.conversion.q_to_mujoco(self.configuration.q, qpos)
        mujoco.mj_kinematics(self.model, self.data)
        found = {}
        for geom in np.flatnonzero(self.model.geom_contype).tolist():
            name = self.model.body(int(self.model.geom_bodyid[geom])).name
            if name != "world":
                link = name.removeprefix("spot_")
                found[link] = min(found.get(link, np.inf), self._height(geom))
        return found

    def _height(self, geom):
        floor = self.model.geom("floor").id
        return mujoco.mj_geomDistance(self.model, self.data, floor, geom, 9.0, None)


def rows(limit, configuration):
    G, h = np.zeros((limit.dim, configuration.nv)), np.zeros(limit.dim)
    limit.rows(configuration, DT, G, h)
    return G, h


def random_q(configuration, rng):
    model = configuration.model
    q = model.referenceConfigurations["ready"].copy()
    q[7:] = rng.uniform(model.lowerPositionLimit[7:], model.upperPositionLimit[7:])
    q[2] = rng.uniform(0.0, 1.0)
    return q


def test_heights_of_all_links_are_those_of_the_simulator(rng):
    spot = Spot()
    spheres = collision_spheres(spot.robot)
    for _ in range(5):
        spot.configuration.update(random_q(spot.configuration, rng))
        for link, height in spot.heights().items():
            limit = FloorLimit({link: spheres[link]}, influence=9.0)
            limit.bind(spot.configuration)
            rows(limit, spot.configuration)
            # Of a cylinder's rim we know 24 points.
            assert limit.distances[0] == pytest.approx(height, abs=5e-4)


def test_rows_are_the_lowest_spheres_and_the_derivative_of_their_height(rng):
    spot = Spot()
    configuration = spot.configuration
    limit = FloorLimit(collision_spheres(spot.robot), height=0.1, nearest=8)
    limit.bind(configuration)
    whole = FloorLimit(collision_spheres(spot.robot), nearest=200, influence=9.0)
    whole.bind(configuration)
    for _ in range(5):
        q = random_q(configuration, rng)
        configuration.update(q)
        G, _ = rows(limit, configuration)
        rows(whole, configuration)
        near = whole.distances[: limit.dim] - 0.1
        expected = np.where(near < limit.influence, near, np.inf)
        np.testing.assert_allclose(limit.distances, expected, atol=1e-12)
        found, before = limit.found.copy(), limit.distances.copy()
        step = 1e-7 * rng.normal(size=configuration.nv)
        configuration.update(configuration.integrate(step))
        rows(limit, configuration)
        for row in np.flatnonzero(found >= 0):
            (at,) = np.flatnonzero(limit.found == found[row])
            change = limit.distances[at] - before[row]
            assert change == pytest.approx(-G[row] @ step, abs=1e-12)


@pytest.mark.parametrize("high", [0.0, 0.1])
def test_a_hand_sent_below_the_floor_rests_above_it(high):
    spot = Spot()
    spheres = collision_spheres(spot.robot)
    arm = {link: s for link, s in spheres.items() if link.startswith(("arm", "jaw"))}
    limit = FloorLimit(arm, height=high)
    hand = FrameTask("right_tcp", orientation_cost=0.1)
    posture = PostureTask(1e-3)
    posture.set_target(spot.configuration.q)
    below = spot.configuration.frame_pose("right_tcp")
    below.translation[2] = -1.0
    hand.set_target(below)
    stack = TaskStack(
        spot.configuration,
        [hand, posture],
        limits=[limit, AccelerationLimit(12.0)],
        equalities=[FrameEquality("base")],
    )
    moves = []
    for _ in range(350):
        solution = stack.solve(DT)
        spot.configuration.update(spot.configuration.integrate(solution.dq))
        moves.append(solution.v)
    lowest = min(spot.heights()[link] for link in arm) - high
    assert lowest == pytest.approx(limit.margin, abs=1e-3)
    assert np.abs(np.diff(moves[-100:], axis=0)).max() < 0.01
    words = {str(x) for x in solution.active}
    assert words & {"floor: arm_link_fngr", "floor: jaw_palm", "floor: arm_link_wr1"}
