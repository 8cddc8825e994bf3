"""Every robot holds its ready posture, and what its capsules call free is free."""

import mujoco
import numpy as np
import pytest

from wbc_suite.catalogue import Catalogue
from wbc_suite.compiling import compiled
from wbc_suite.control import RobotState
from wbc_suite.control.ground.records import gather
from wbc_suite.control.law.joint_laws import JointLaw
from wbc_suite.control.run.data import loop_data
from wbc_suite.control.run.kernel_table import bind_kernels
from wbc_suite.control.run.motor_commands import write_commands
from wbc_suite.kinematics import Configuration
from wbc_suite.qp import SelfCollisionLimit
from wbc_suite.robot import load_robot
from wbc_suite.robot.collision_capsules import (
    _gripper_links,
    collision_pairs,
    enclosing_capsules,
)
from wbc_suite.scene import attach_robot, empty_arena

PREFIX = "robot0_"
ROBOTS = Catalogue().names("robots")
QUICK = ("panda", "gr1")
HOLD = 5.0  # s
DRIFT = 1e-3  # rad or m
SAG = 0.01  # of a servo's range: fingers hang on springs
FREE = 1000
QUICK_FREE = 100


def without_free_root(name):
    """Return a robot by name; a free root is fixed in the air."""
    robot = load_robot(name)
    return robot.with_root("fixed") if robot.root.kind == "free" else robot


@compiled
def write_once(loop, kernels):
    """Write the commands of the present state."""
    return write_commands(loop, kernels)


class Lone:
    """A robot at `ready`, without a floor.

    Gravity acts, and each joint with a torque motor is driven by the law.
    """

    def __init__(self, robot):
        self.robot = robot
        spec = empty_arena()
        spec.delete(spec.geom("floor"))
        attach_robot(spec, robot, PREFIX)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.ready = robot.keyframe("ready")
        for joint, value in self.ready.items():
            self.data.joint(PREFIX + joint).qpos = value
        mujoco.mj_forward(self.model, self.data)

    def self_contacts(self):
        """Return the pairs of links that penetrate; a gripper may touch itself."""
        model, data = self.model, self.data
        fingers = _gripper_links(self.robot)
        found = set()
        deep = data.contact.dist < 0.0
        for geoms in data.contact.geom[deep]:
            names = [model.body(model.geom_bodyid[g]).name for g in geoms]
            pair = frozenset(name.removeprefix(PREFIX) for name in names)
            hands = {fingers.get(link) for link in pair}
            if len(hands) > 1 or hands == {None}:
                found.add(pair)
        return found

    def hold(self, seconds):
        """Return the largest way of each joint from `ready` while the law holds it."""
        state = RobotState(self.model, self.data, self.robot, prefix=PREFIX)
        servos = {a.joint for a in self.robot.actuators if a.kind == "position"}
        driven = tuple(j for j in state.actuators if j not in servos)
        law = JointLaw(state, driven, kp=900.0, kd=60.0)
        law.aim(np.array([self.ready.get(joint, 0.0) for joint in driven]))
        for joint in servos:
            self.data.actuator(PREFIX + joint).ctrl = self.ready[joint]
        drift = dict.fromkeys((*driven, *sorted(servos)), 0.0)
        records = gather([(law.record, law.drives)])
        law.adopt(*records)
        data = loop_data(self.model, self.data, *records)
        loop, kernels, _owner = bind_kernels(data)
        for _ in range(round(seconds / self.model.opt.timestep)):
            mujoco.mj_step1(self.model, self.data)
            write_once(loop, kernels)
            mujoco.mj_step2(self.model, self.data)
            for joint, largest in drift.items():
                way = self.data.joint(PREFIX + joint).qpos[0] - self.ready.get(
                    joint, 0.0
                )
                drift[joint] = max(largest, abs(way))
        return {joint: way / self._unit(joint, servos) for joint, way in drift.items()}

    def _unit(self, joint, servos):
        """What drift is allowed, so that 1 is the most."""
        if joint not in servos:
            return DRIFT
        low, high = self.robot.joint(joint).range
        return SAG * (high - low)


@pytest.mark.sample(15)
@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=() if name in QUICK else pytest.mark.slow)
        for name in ROBOTS
    ],
)
def test_robot_holds_its_ready_posture_for_five_seconds(name):
    drift = Lone(without_free_root(name)).hold(HOLD)
    worst = max(drift, key=drift.__getitem__)
    assert drift[worst] < 1.0, f"{worst} drifts {drift[worst]:.2f} of what it may"


@pytest.mark.parametrize("name", ROBOTS)
def test_no_two_links_penetrate_at_ready(name):
    assert not Lone(without_free_root(name)).self_contacts()


class Sampler:
    """Random postures of a robot, as its capsules and as the simulator see them."""

    def __init__(self, name, rng):
        self.lone, self.rng = Lone(load_robot(name, root="fixed")), rng
        robot = self.lone.robot
        self.configuration = Configuration(robot.to_pinocchio())
        self.limit = SelfCollisionLimit(
            enclosing_capsules(robot), collision_pairs(robot), nearest=1, margin=0.0
        )
        self.limit.bind(self.configuration)
        self._row = np.zeros((1, self.configuration.nv)), np.zeros(1)
        model = self.configuration.model
        self._places = {
            joint: model.joints[self.configuration.joint_id(joint)].idx_q
            for joint in robot.joint_names
        }

    def draw(self):
        """Take a random posture; grippers stay as they are at `ready`."""
        robot = self.lone.robot
        values = {
            joint.name: self.rng.uniform(*(joint.range or (-np.pi, np.pi)))
            for joint in robot.joints
        }
        hands = {
            joint for gripper in robot.synergies for joint in robot.groups[gripper]
        }
        values |= {joint: self.lone.ready[joint] for joint in hands}
        for joint in robot.joints:
            if joint.mimic is not None:
                leader = values[joint.mimic.joint]
                values[joint.name] = joint.mimic.ratio * leader + joint.mimic.offset
        q = self.configuration.q.copy()
        for joint, value in values.items():
            q[self._places[joint]] = self.lone.data.joint(PREFIX + joint).qpos[0] = (
                value
            )
        self.configuration.update(q)
        mujoco.mj_fwdPosition(self.lone.model, self.lone.data)

    def distance(self):
        """Return the distance of the two nearest capsules, m."""
        self.limit.rows(self.configuration, 1.0, *self._row)
        return self.limit.distances[0]


@pytest.mark.sample(15)
@pytest.mark.parametrize(
    ("name", "count"),
    [(name, QUICK_FREE) for name in QUICK]
    + [pytest.param(name, FREE, marks=pytest.mark.slow) for name in ROBOTS],
)
def test_what_the_capsules_call_free_is_free_in_the_simulator(name, count):
    sampler = Sampler(name, np.random.default_rng(7))
    free = 0
    for _ in range(20 * count):
        sampler.draw()
        if sampler.distance() > 0.0:
            free += 1
            assert not sampler.lone.self_contacts()
        if free == count:
            return
    pytest.fail(f"capsules of {name} overlap nearly everywhere: {free} of {20 * count}")


@pytest.mark.parametrize("name", ROBOTS)
def test_capsules_are_apart_at_every_keyframe(name):
    """Else the controller would have to leave them out of its limit."""
    sampler = Sampler(name, np.random.default_rng(0))
    configuration = sampler.configuration
    for keyframe in sampler.lone.robot.keyframes:
        configuration.update(configuration.model.referenceConfigurations[keyframe])
        assert sampler.distance() > 0.0, f"{keyframe}: {sampler.limit.subject(0)}"
