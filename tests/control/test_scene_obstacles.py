"""Robots under whole-body inverse kinematics keep out of what does not move."""

import mujoco
import numpy as np
import pytest

import wbc_suite
from wbc_suite.control.ik.scene_obstacles import (
    INFLUENCE,
    ROWS_OF_BODY,
    SceneObstacles,
)
from wbc_suite.control.reasons import ActiveLimit, LimitKind
from wbc_suite.kinematics import Configuration

DT = 0.01


class Scene:
    """A robot in Lift, with obstacles measured for a configuration of its own."""

    def __init__(self, name):
        self.env = wbc_suite.make(
            "Lift", robots=name, controller_configs="WHOLE_BODY_IK"
        )
        self.env.reset(seed=0)
        self.state, controller = self.env.simulation.pairs[0]
        self.model, self.data = self.state.model, self.state.data
        self.robot = controller.robot
        self.configuration = Configuration(self.robot.to_pinocchio())
        self.obstacles = SceneObstacles(
            self.state,
            self.robot,
            controller.config,
            self.configuration,
            np.eye(3, 4).ravel(),
        )

    def write(self, q):
        """Move the simulated robot to a configuration of the reduced one."""
        for name, joint in zip(
            self.configuration.model.names[1:],
            self.configuration.model.joints[1:],
            strict=True,
        ):
            joint_id = self.model.joint(self.state.prefix + name).id
            self.data.qpos[self.model.jnt_qposadr[joint_id]] = q[joint.idx_q]
        mujoco.mj_kinematics(self.model, self.data)
        self.configuration.update(q)

    def rows(self):
        limit = self.obstacles.limit
        G, h = np.zeros((limit.dim, self.configuration.nv)), np.zeros(limit.dim)
        limit.rows(self.configuration, DT, G, h)
        return G, h

    def truth(self):
        """Return MuJoCo's distances of the robot's moving geoms from fixed ones, m."""
        m, found = self.model, {}
        links = {
            m.body(self.state.prefix + x.name).id: x.name for x in self.robot.links
        }
        for o in np.flatnonzero(m.body_weldid[m.geom_bodyid] == 0).tolist():
            for g in np.flatnonzero(m.geom_contype).tolist():
                body = int(m.geom_bodyid[g])
                if body in links and self.moves(links[body], o):
                    other = m.body(int(m.geom_bodyid[o])).name
                    key = links[body], "floor" if other == "world" else other
                    d = mujoco.mj_geomDistance(m, self.data, o, g, 9.0, None)
                    found[key] = min(found.get(key, np.inf), d)
        return found

    def moves(self, link, geom):
        """Whether something but a gliding base moves a link nearer to a fixed geom."""
        if int(self.model.geom_bodyid[geom]) and self.model.body(
            int(self.model.geom_bodyid[geom])
        ).name.startswith(self.state.prefix):
            return False
        support = set(self.configuration.support(link).tolist())
        if self.model.geom(geom).name == "floor":
            support -= {*self.configuration.root_linear}
            support -= {*self.configuration.root_angular}
        return bool(support)

    def lowest(self):
        return min(self.truth().values())


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Panda", "Tiago"])
def test_distances_are_those_of_the_simulator(name):
    scene, rng = Scene(name), np.random.default_rng(0)
    model, limit = scene.configuration.model, scene.obstacles.limit
    low = np.maximum(model.lowerPositionLimit, -1.0)
    high = np.minimum(model.upperPositionLimit, 1.0)
    for _ in range(5):
        scene.write(rng.uniform(low, high))
        scene.obstacles.measure()
        scene.rows()
        truth = scene.truth()
        rows = np.flatnonzero(limit.planes["found"] >= 0)
        found = {}
        for row in rows.tolist():
            pair = limit.subject(row)
            key, d = (pair.first, pair.second), float(limit.planes["distance"][row])
            found[key] = min(found.get(key, np.inf), d)
        for key, d in found.items():
            assert d >= truth[key] - 1e-5
        least = min(truth.values())
        if least < INFLUENCE:
            assert min(found.values()) == pytest.approx(least, abs=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Panda", "Tiago", "GR1"])
def test_the_nearest_geoms_of_each_body_and_obstacle_have_rows(name):
    scene, rng = Scene(name), np.random.default_rng(1)
    model, arrays = scene.configuration.model, scene.obstacles._arrays
    low = np.maximum(model.lowerPositionLimit, -1.0)
    high = np.minimum(model.upperPositionLimit, 1.0)
    for _ in range(5):
        scene.write(rng.uniform(low, high))
        scene.obstacles.measure()
        listed = {int(k) for k in scene.obstacles.limit.planes["found"] if k >= 0}
        groups = {}
        for k, pair in enumerate(zip(arrays.obstacle, arrays.geom, strict=True)):
            d = mujoco.mj_geomDistance(
                scene.model, scene.data, *map(int, pair), 9, None
            )
            key = int(arrays.obstacle[k]), int(arrays.body[k])
            groups.setdefault(key, []).append((d, k))
        nearest = sorted(min(found) for found in groups.values())
        for d, k in [x for x in nearest if x[0] < 0.2][:4]:
            assert k in listed, (d, scene.obstacles.limit.pairs[k])
        for found in groups.values():
            assert len(listed & {k for _, k in found}) <= ROWS_OF_BODY


@pytest.mark.slow
def test_rows_are_the_derivative_of_the_distance():
    scene, rng = Scene("Panda"), np.random.default_rng(0)
    planes = scene.obstacles.limit.planes
    scene.write(np.array([0.0, 1.0, 0.0, -1.0, 0.0, 2.0, 0.0]))
    scene.obstacles.measure()
    G, _ = scene.rows()
    used, before = planes["found"] >= 0, planes["distance"].copy()
    step = 1e-6 * rng.normal(size=scene.configuration.nv)
    scene.configuration.update(scene.configuration.integrate(step))
    scene.rows()
    assert used.sum() > 5
    change = planes["distance"][used] - before[used]
    np.testing.assert_allclose(change, -G[used] @ step, atol=1e-10)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Panda", "GR1"])
def test_what_slides_fast_is_kept_off_by_its_speed(name):
    """Planes stand off by 20 ms of the measured speed along them beyond 0.3 m/s."""
    scene, rng = Scene(name), np.random.default_rng(0)
    model, data, limit = scene.model, scene.data, scene.obstacles.limit.planes
    pairs = scene.obstacles._arrays
    scene.write(scene.env.simulation.controllers[0].q)
    scene.obstacles.measure()
    still, found = limit["offset"].copy(), limit["found"].copy()
    data.qvel[:] = rng.normal(size=model.nv)
    mujoco.mj_forward(model, data)
    scene.obstacles.measure()
    np.testing.assert_array_equal(limit["found"], found)
    segment, J, most = np.zeros(6), np.zeros((3, model.nv)), 0.0
    for row in np.flatnonzero(found >= 0).tolist():
        obstacle, geom = int(pairs.obstacle[found[row]]), int(pairs.geom[found[row]])
        mujoco.mj_geomDistance(model, data, obstacle, geom, 9.0, segment)
        body = int(model.geom_bodyid[geom])
        mujoco.mj_jac(model, data, J, None, segment[3:], body)
        velocity, n = J @ data.qvel, limit["normal"][row]
        along = np.linalg.norm(velocity - n * (n @ velocity))
        off = 0.02 * max(along - 0.3, 0.0)
        assert limit["offset"][row] - still[row] == pytest.approx(off, abs=1e-9)
        most = max(most, off)
    assert most > 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Panda", "Tiago"])
def test_a_hand_sent_through_the_table_stays_out_and_says_so(name):
    scene = Scene(name)
    env = scene.env
    action, least = env.hold_action, np.inf
    top = scene.data.geom("table").xpos[2] + scene.model.geom("table").size[2]
    action[:2], action[2] = scene.data.geom("table").xpos[:2], top - 0.3
    for _ in range(80):
        *_, info = env.step(action)
        least = min(least, scene.lowest())
    assert least > -1e-3
    report = info["ik"]["frames"]["right_hand"]
    reasons = [x for x in report["reasons"] if isinstance(x, ActiveLimit)]
    named = [x for x in reasons if x.kind is LimitKind.OBSTACLE]
    assert any("- table" in str(x) for x in named), report
    assert report["position_error"] > 0.1
