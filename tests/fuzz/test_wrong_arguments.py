"""Wrong arguments of constructors and look-ups: one error of ours, never NumPy's."""

import pickle

import numpy as np
import pytest

import wbc_suite
from wbc_suite.errors import ConfigError, UnknownNameError, WbcError
from wbc_suite.kinematics import Configuration
from wbc_suite.qp import (
    AccelerationLimit,
    ComTask,
    DampingTask,
    FloorLimit,
    FrameEquality,
    FrameTask,
    JointCouplingTask,
    LinearEquality,
    LookAtTask,
    PositionLimit,
    PostureTask,
    RelativeFrameTask,
    SelfCollisionLimit,
    TaskStack,
    VelocityLimit,
)

ROBOT = wbc_suite.load_robot("Panda")
MODEL = ROBOT.to_pinocchio()
HAND, WRIST = "right_tcp", "right_eef"
JOINTS = "panda_joint1", "panda_joint2"


def stack(*tasks, **options):
    return TaskStack(Configuration(MODEL), tasks, **options)


POSITIVE = {
    "frame gain": lambda x: FrameTask(HAND, gain=x),
    "frame linear speed": lambda x: FrameTask(HAND, max_linear_speed=x),
    "frame angular speed": lambda x: FrameTask(HAND, max_angular_speed=x),
    "relative speed": lambda x: RelativeFrameTask(HAND, WRIST, max_linear_speed=x),
    "com speed": lambda x: ComTask(max_speed=x),
    "posture speed": lambda x: PostureTask(max_speed=x),
    "coupling speed": lambda x: JointCouplingTask(*JOINTS, max_speed=x),
    "look speed": lambda x: LookAtTask(HAND, max_angular_speed=x),
    "velocity limit": lambda x: VelocityLimit({JOINTS[0]: x}),
    "velocity scale": lambda x: VelocityLimit(scale=x),
    "acceleration limit": AccelerationLimit,
    "position gain": lambda x: PositionLimit(gain=x),
    "equality gain": lambda x: FrameEquality(HAND, gain=x),
    "damping": lambda x: stack(damping=x),
    "dt": lambda x: stack().solve(x),
    "nearest": lambda x: SelfCollisionLimit((), (), nearest=x),
    "rate": lambda x: SelfCollisionLimit((), (), rate=x),
    "floor rows": lambda x: FloorLimit({}, nearest=x),
    "floor rate": lambda x: FloorLimit({}, rate=x),
    "floor braking": lambda x: FloorLimit({}, braking=x),
}
NOT_NEGATIVE = {
    "level": lambda x: FrameTask(HAND, level=x),
    "position cost": lambda x: FrameTask(HAND, position_cost=x),
    "orientation cost": lambda x: FrameTask(HAND, orientation_cost=x),
    "com cost": ComTask,
    "posture cost": PostureTask,
    "joint cost": lambda x: PostureTask(costs={JOINTS[0]: x}),
    "damping cost": DampingTask,
    "coupling cost": lambda x: JointCouplingTask(*JOINTS, cost=x),
    "look cost": lambda x: LookAtTask(HAND, cost=x),
    "margin": lambda x: PositionLimit(margin=x),
    "curvature": lambda x: stack(curvature_damping=x),
}
NO_NUMBER = [-1, np.nan, -np.inf, "a", "1", None, [1, 2], {}, 1j, object()]


@pytest.mark.parametrize("name", [*POSITIVE, *NOT_NEGATIVE])
def test_no_number_passes_for_one(name):
    for bad in NO_NUMBER:
        with pytest.raises(ConfigError) as caught:
            (POSITIVE | NOT_NEGATIVE)[name](bad)
        assert len(str(caught.value)) < 200


@pytest.mark.parametrize("name", POSITIVE)
def test_zero_is_not_positive(name):
    with pytest.raises(ConfigError, match=r"greater than 0|at least 1"):
        POSITIVE[name](0)


TARGETS = {
    "frame": lambda x: FrameTask(HAND).set_target(x),
    "relative": lambda x: RelativeFrameTask(HAND, WRIST).set_target(x),
    "equality": lambda x: FrameEquality(HAND).set_target(x),
    "com": lambda x: ComTask().set_target(x),
    "look": lambda x: LookAtTask(HAND).set_target(x),
    "axis": lambda x: LookAtTask(HAND, axis=x),
    "posture": lambda x: stack(PostureTask(target=x)),
    "rows": lambda x: stack(equalities=[LinearEquality(x)]),
    "update": lambda x: Configuration(MODEL).update(x),
    "integrate": lambda x: Configuration(MODEL).integrate(x),
    "difference": lambda x: Configuration(MODEL).difference(x),
    "reset": lambda x: stack().reset(x),
}
NO_ARRAY = ["abc", [["a"] * 4] * 4, [[1, 2], [3]], {}, np.zeros((2, 2, 2)), [None], 3]


@pytest.mark.parametrize("name", TARGETS)
def test_no_array_passes_for_a_target(name):
    for bad in NO_ARRAY:
        with pytest.raises(ConfigError):
            TARGETS[name](bad)


NAMES = {
    "frame": lambda x: stack(FrameTask(x)),
    "relative": lambda x: stack(RelativeFrameTask(HAND, x)),
    "look": lambda x: stack(LookAtTask(x)),
    "leader": lambda x: stack(JointCouplingTask(JOINTS[0], x)),
    "held": lambda x: stack(equalities=[FrameEquality(x)]),
    "solver": lambda x: stack(solver=x),
    "pose": lambda x: Configuration(MODEL).frame_pose(x),
    "axes": lambda x: Configuration(MODEL).frame_jacobian(HAND, x),
    "joint": lambda x: Configuration(MODEL).joint_id(x),
    "link of robot": ROBOT.link,
    "joint of robot": ROBOT.joint,
    "frame of robot": ROBOT.frame,
    "group": ROBOT.group,
    "keyframe": ROBOT.keyframe,
    "robot": wbc_suite.load_robot,
    "benchmark": wbc_suite.make,
}


@pytest.mark.parametrize("name", NAMES)
def test_no_name_passes_for_one(name):
    for bad in ["right_tpc", "", None, 30_000, -1, 1.5, ["right_tcp"], "x" * 3000]:
        with pytest.raises(UnknownNameError) as caught:
            NAMES[name](bad)
        assert len(str(caught.value)) < 1500


@pytest.mark.parametrize(
    "build",
    [
        lambda: TaskStack(None, []),
        lambda: TaskStack(MODEL, []),
        lambda: TaskStack(Configuration(MODEL), FrameTask(HAND)),
        lambda: stack("task"),
        lambda: stack(PositionLimit()),
        lambda: stack(limits=["limit"]),
        lambda: stack(equalities=[PositionLimit()]),
        lambda: stack(FrameTask(HAND), FrameTask(HAND)),
        lambda: Configuration(ROBOT),
        lambda: FrameEquality(HAND, directions=3),
    ],
)
def test_a_stack_takes_only_its_parts(build):
    with pytest.raises(ConfigError):
        build()


@pytest.mark.parametrize(
    "build",
    [
        lambda: wbc_suite.load_robot("Panda", root="fre"),
        lambda: wbc_suite.load_robot("Panda", gripper=3),
        lambda: wbc_suite.load_robot("Panda", gripper={"rigt": "panda_gripper"}),
        lambda: wbc_suite.load_robot("Panda", gripper={"right": None, 3: 4}),
        lambda: wbc_suite.load_robot("Panda", base=["x"]),
        lambda: wbc_suite.load_robot("Panda", base="../arm/panda"),
        lambda: wbc_suite.load_robot("../panda"),
        lambda: wbc_suite.load_robot("Panda", catalogue="x"),
        lambda: wbc_suite.Catalogue(extra="nowhere"),
        lambda: wbc_suite.Catalogue(extra=[3]),
        lambda: wbc_suite.Catalogue(root=None),
        lambda: wbc_suite.Catalogue().find("../robots", "panda", kind="robot"),
        lambda: wbc_suite.load_composite_controller_config(),
        lambda: wbc_suite.load_composite_controller_config([], 3),
        lambda: wbc_suite.load_composite_controller_config({"type": 3}, "Panda"),
        lambda: ROBOT.with_root("fixed", poss=3),
        lambda: ROBOT.with_root("fixed", pos=(np.nan, 0, 0)),
    ],
)
def test_wrong_choices_are_refused(build):
    with pytest.raises(WbcError) as caught:
        build()
    assert len(str(caught.value)) < 1000


def test_errors_pass_between_processes():
    error = UnknownNameError("robot", "pnda", ["panda", "gr1"])
    copy = pickle.loads(pickle.dumps(error))
    assert str(copy) == str(error)
    assert "Did you mean 'panda'" in str(copy)
