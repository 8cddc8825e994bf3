"""Tasks, limits and equalities written outside the package: as fast, as explained."""

import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.errors import ConfigError
from wbc_suite.qp import (
    AccelerationLimit,
    ComTask,
    DampingTask,
    Equality,
    FloorLimit,
    FrameEquality,
    FrameTask,
    JointTask,
    LimitKind,
    LinearEquality,
    ObstacleLimit,
    PositionLimit,
    PostureTask,
    RowLimit,
    RowTask,
    SelfCollisionLimit,
    TaskStack,
    VelocityLimit,
    record_type,
)
from wbc_suite.qp.part import kernel_of

DT = 5e-3


class HeightTask(RowTask):
    """Brings a frame to a height, m."""

    def __init__(self, frame, height, **options):
        super().__init__(f"height of {frame}", dim=1, **options)
        self.frame, self.height = frame, height

    def evaluate(self, configuration, error, jacobian):
        error[0] = self.height - configuration.frame_pose(self.frame).translation[2]
        jacobian[0] = configuration.frame_jacobian(self.frame, "aligned")[2]


class CeilingLimit(RowLimit):
    """Keeps a frame below a height."""

    dim = 1

    def __init__(self, frame, height):
        self.frame, self.height = frame, height

    def rows(self, configuration, dt, G, h):
        G[0] = configuration.frame_jacobian(self.frame, "aligned")[2]
        h[0] = self.height - configuration.frame_pose(self.frame).translation[2]

    def subject(self, row):
        return f"{self.frame} below {self.height:g} m"


class FixedJoint(Equality):
    """Lets a joint stand still."""

    dim = 1

    def __init__(self, index):
        self.name, self.index = f"joint {index} stands", index

    def rows(self, configuration, dt, A, b):
        A[0], b[0] = np.eye(configuration.nv)[self.index], 0.0


class Comfort(JointTask):
    """Pulls all joints to the middle of their ranges."""

    def evaluate(self, configuration, error):
        model = configuration.model
        middle = 0.5 * (model.lowerPositionLimit + model.upperPositionLimit)
        error[:] = middle - configuration.q


class OwnFrameTask(FrameTask):
    """The frame task, computed once more with Pinocchio."""

    def evaluate(self, configuration, error, jacobian):
        pose = configuration.frame_pose(self.frame)
        error[:3] = self.target.translation - pose.translation
        error[3:] = pin.log3(pose.rotation.T @ self.target.rotation)
        J = configuration.frame_jacobian(self.frame, "aligned")
        jacobian[:3] = J[:3]
        jacobian[3:] = pin.Jlog3(pin.exp3(-error[3:])) @ pose.rotation.T @ J[3:]


def run(stack, seconds):
    solution = None
    for _ in range(round(seconds / DT)):
        solution = stack.solve(DT)
        stack.configuration.update(stack.configuration.integrate(solution.dq))
    return solution


def test_a_users_task_is_met_and_reported(arm):
    height = arm.frame_pose("hand").translation[2] + 0.1
    task = HeightTask("hand", height, cost=5.0, max_speed=0.5)
    stack = TaskStack(arm, [task, PostureTask(1e-2)])
    assert not stack.is_compiled
    stack.solve(DT)
    assert stack.levels[0].qp.e[0] == pytest.approx(5.0 * 0.5 * DT)  # saturated
    report = stack.explain()["height of hand"]
    assert not report.reached
    assert report.position_error == pytest.approx(0.1)
    run(stack, 3.0)
    assert arm.frame_pose("hand").translation[2] == pytest.approx(height, abs=1e-3)
    assert stack.explain()["height of hand"].reached


def test_a_users_limit_holds_a_task_and_is_named_by_its_own_words(arm):
    height = arm.frame_pose("hand").translation[2] + 0.1
    ceiling = CeilingLimit("hand", height - 0.05)
    task = HeightTask("hand", height)
    stack = TaskStack(arm, [task, PostureTask(1e-3)], limits=[ceiling])
    solution = run(stack, 3.0)
    at = arm.frame_pose("hand").translation[2]
    assert at == pytest.approx(height - 0.05, abs=1e-6)
    (limit,) = [x for x in solution.active if not x.is_joint]
    assert limit.kind is LimitKind.OTHER
    assert str(limit) == f"limit: {ceiling.subject(0)}"
    assert "self-collision" not in str(limit)
    assert limit in solution.explain()["height of hand"].reasons


def test_a_users_equality_is_kept_and_named_in_conflicts(arm):
    stack = TaskStack(
        arm, [HeightTask("hand", 2.0)], equalities=[FixedJoint(1), FixedJoint(3)]
    )
    before = arm.q.copy()
    run(stack, 0.5)
    np.testing.assert_allclose(arm.q[[1, 3]], before[[1, 3]], atol=1e-9)
    assert np.abs(arm.q - before).max() > 1e-2
    reasons = stack.explain()["height of hand"].reasons
    assert "conflict: joint 3 stands" in [str(reason) for reason in reasons]


def test_a_users_joint_task_weighs_as_the_posture_task_does(arm):
    model = arm.model
    middle = 0.5 * (model.lowerPositionLimit + model.upperPositionLimit)
    q = arm.q.copy()
    own = TaskStack(arm, [Comfort("comfort", cost=0.5, max_speed=1.0)]).solve(DT)
    arm.update(q)
    posture = PostureTask(0.5, target=middle, max_speed=1.0)
    ours = TaskStack(arm, [posture]).solve(DT)
    np.testing.assert_allclose(own.dq, ours.dq, atol=1e-12)
    assert np.abs(own.dq).max() > 1e-3


def test_a_subclass_of_a_compiled_task_is_evaluated_itself(arm):
    """Its error may be another; here it is the same, so that both must agree."""
    target = arm.frame_pose("hand") * pin.exp6(np.array([0.1, 0, 0.2, 0.3, 0, 0.1]))
    solutions = []
    for kind in (FrameTask, OwnFrameTask):
        stack = TaskStack(arm, [kind("hand", target=target), PostureTask(1e-2)])
        assert stack.is_compiled == (kind is FrameTask)
        solutions.append(stack.solve(DT).dq)
    np.testing.assert_allclose(*solutions, atol=1e-11)


def test_a_subclass_that_overrides_evaluate_may_declare_its_kernel(arm):
    class NamedFrameTask(OwnFrameTask):
        kernel = FrameTask.kernel

    assert TaskStack(arm, [NamedFrameTask("hand")]).is_compiled


class SlowFrameTask(FrameTask):
    """Sets a speed of its own; what it computes is inherited."""

    def __init__(self, frame):
        super().__init__(frame, max_linear_speed=0.1)


def derived(base):
    """Return a subclass that overrides nothing."""
    return type(f"Own{base.__name__}", (base,), {})


def test_subclasses_inherit_the_kernel(arm):
    tasks = [SlowFrameTask("hand"), derived(ComTask)(), derived(PostureTask)()]
    tasks.append(derived(DampingTask)(0.1))
    limits = [derived(FloorLimit)({})]
    limits += [derived(x)((), ()) for x in (SelfCollisionLimit, ObstacleLimit)]
    rows = derived(LinearEquality)(np.zeros((1, arm.nv)))
    held = derived(FrameEquality)("hand", directions=("yaw",))
    stack = TaskStack(arm, tasks, limits=limits, equalities=[rows, held])
    assert stack.is_compiled
    assert stack.solve(DT).ok


@pytest.mark.parametrize("base", [FrameTask, FrameEquality, FloorLimit])
def test_an_override_anywhere_below_leaves_the_kernel(base):
    method = "evaluate" if base is FrameTask else "rows"
    mixin = type("Mixin", (), {method: lambda *arguments: None})
    between = type("Between", (mixin, base), {})
    part = object.__new__(type("Below", (between,), {}))
    assert kernel_of(part) is None


def test_a_part_without_a_kernel_is_named_once(arm, caplog):
    class LoggedTask(HeightTask):
        """A class that no other test makes a stack of."""

    for _ in range(2):
        TaskStack(arm, [LoggedTask("hand", 0.3), FrameTask("hand")])
    (record,) = caplog.records
    assert "LoggedTask 'height of hand' has no compiled kernel" in record.getMessage()


def test_limits_add_to_those_of_joints(arm):
    """A limit of one's own left joints without any: 44 rad/s, where 2 are allowed."""
    ceiling = CeilingLimit("hand", 10.0)
    far = pin.SE3(np.eye(3), np.array([3.0, -2.0, 1.0]))
    steps = []
    for given in ([], [ceiling]):
        task = FrameTask("hand", target=far, max_linear_speed=1e3)
        steps.append(TaskStack(arm, [task], limits=given).solve(DT).dq)
    np.testing.assert_allclose(*steps, atol=1e-12)
    assert np.abs(steps[0]).max() == pytest.approx(50.0 * DT**2)  # acceleration limit


@pytest.mark.parametrize("kind", [PositionLimit, VelocityLimit, AccelerationLimit])
def test_a_joint_limit_takes_the_place_of_its_class(arm, kind):
    class Own(kind):
        """Bounds nothing."""

        def apply(self, configuration, bounds):
            pass

    def bounded(limits):
        bounds = TaskStack(arm, [], limits=limits).bounds
        ends = bounds.q_upper, bounds.v_max, bounds.a_max
        return [bool(np.isfinite(x).any()) for x in ends]

    kinds = [PositionLimit, VelocityLimit, AccelerationLimit]
    assert bounded([]) == [True, True, True]
    assert bounded([Own()]) == [x is not kind for x in kinds]


def test_without_joint_limits_a_stack_keeps_what_is_listed(arm):
    stack = TaskStack(arm, [], limits=[VelocityLimit()], joint_limits=False)
    assert np.isinf(stack.bounds.a_max).all()
    assert np.isinf(stack.bounds.q_upper).all()
    assert np.isfinite(stack.bounds.v_max).any()


def test_an_error_that_is_not_finite_holds_and_is_reported(arm):
    task = HeightTask("hand", np.nan)
    stack = TaskStack(arm, [task, PostureTask(1e-2)])
    solution = run(stack, 0.2)
    assert solution.held == ("height of hand",)
    assert not solution.ok
    np.testing.assert_allclose(solution.dq, 0.0, atol=1e-9)


def test_targets_follow_a_task_into_all_stacks_that_hold_it(arm):
    task = FrameTask("hand")
    stacks = [TaskStack(arm, [task]) for _ in range(2)]
    del stacks[0]  # its copy of the target goes with it
    far = task.target
    far.translation = far.translation + np.array([0.0, 0.1, 0.0])
    task.set_target(far)
    task.set_costs(position=3.0)
    stack = stacks[0]
    stack.solve(DT)
    assert stack.explain()["hand"].position_error == pytest.approx(0.1)
    np.testing.assert_allclose(stack.levels[0].arrays.cost[:3], 3.0)


def test_a_solution_prints_what_tasks_lack_and_what_holds_them(arm):
    height = arm.frame_pose("hand").translation[2] + 0.1
    ceiling = CeilingLimit("hand", height - 0.05)
    task = HeightTask("hand", height)
    stack = TaskStack(arm, [task, PostureTask(1e-3)], limits=[ceiling])
    text = str(run(stack, 3.0))
    assert text.startswith("Solution: solved as stated")
    assert "fastest joint: joint" in text
    assert "rad/s" in text
    line = f"height of hand: 0.05 m from its target; limit: {ceiling.subject(0)}"
    assert line in text
    assert f"active: limit: {ceiling.subject(0)}" in text


def test_a_record_explains_its_own_tick_after_the_next_ones(arm):
    task = HeightTask("hand", arm.frame_pose("hand").translation[2] + 0.1)
    stack = TaskStack(arm, [task])
    first = stack.solve(DT)
    text = str(first)
    run(stack, 1.0)
    assert str(first) == text
    assert str(stack.solution()) != text


def test_limits_of_one_kind_all_have_kernels_while_there_is_room(arm):
    """Of nine limits seven have a kernel; Python evaluates the others."""
    for count, compiled in ((7, True), (9, False)):
        limits = [SelfCollisionLimit((), (), nearest=1 + k) for k in range(count)]
        stack = TaskStack(arm, [FrameTask("hand")], limits=limits)
        assert stack.is_compiled == compiled
        assert stack.solve(DT).ok


HEIGHT = record_type(("joint", "i8"), ("point", "f8", (3,)), ("height", "f8"))


def height_rows(robot, own, dt, rows, values):
    """Write how far a point is below a height, and how fast it rises."""
    task = own.view(HEIGHT)[0]
    T, p, j = robot.pose[task.joint], task.point, task.joint
    x = T[9] + T[0] * p[0] + T[3] * p[1] + T[6] * p[2]
    y = T[10] + T[1] * p[0] + T[4] * p[1] + T[7] * p[2]
    values[0] = task.height - (T[11] + T[2] * p[0] + T[5] * p[1] + T[8] * p[2])
    while j > 0:
        joint = robot.joints[j]
        for col in range(joint.v_start, joint.v_start + joint.v_count):
            J = robot.jacobian[col]
            rows[0, col] = J[2] + J[3] * y - J[4] * x
        j = joint.parent


class WithKernel:
    """What a part with the kernel above has in place of a Python method."""

    kernel = height_rows

    def own(self, configuration):
        frame = configuration.model.frames[configuration.frame_id(self.frame)]
        own = np.zeros(1, HEIGHT)
        own[0] = frame.parentJoint, frame.placement.translation, self.height
        return own.view(np.float64)


class CompiledHeight(WithKernel, RowTask):
    """`HeightTask` with a kernel."""

    def __init__(self, frame, height, **options):
        super().__init__(f"height of {frame}", dim=1, **options)
        self.frame, self.height = frame, height


class CompiledCeiling(WithKernel, RowLimit):
    """`CeilingLimit` with a kernel."""

    dim = 1

    def __init__(self, frame, height):
        self.frame, self.height = frame, height

    def subject(self, row):
        return f"{self.frame} below {self.height:g} m"


class CompiledShelf(WithKernel, Equality):
    """Lets a frame stay at a height."""

    dim, name = 1, "shelf"

    def __init__(self, frame, height):
        self.frame, self.height = frame, height


class Shelf(CompiledShelf):
    """The same by its Python method."""

    def rows(self, configuration, dt, A, b):
        A[0] = configuration.frame_jacobian(self.frame, "aligned")[2]
        b[0] = self.height - configuration.frame_pose(self.frame).translation[2]


def test_parts_with_a_kernel_do_what_their_python_methods_do(arm):
    height, start = arm.frame_pose("hand").translation[2], arm.q.copy()
    found = []
    for task, ceiling, shelf in (
        (CompiledHeight, CompiledCeiling, CompiledShelf),
        (HeightTask, CeilingLimit, Shelf),
    ):
        arm.update(start)
        tasks = [task("hand", height + 0.1, cost=5.0), PostureTask(1e-2)]
        limits = [ceiling("hand", height + 0.05)]
        stack = TaskStack(arm, tasks, limits=limits, escape=False)
        assert stack.is_compiled == (task is CompiledHeight)
        solution = run(stack, 0.2)
        equalities = [shelf("hand", height)]
        held = run(TaskStack(arm, [PostureTask(1.0)], equalities=equalities), 0.2)
        found.append((solution.dq, solution.active, held.dq, arm.q.copy()))
    for ours, theirs in zip(*found, strict=True):
        if isinstance(ours, tuple):
            assert [str(x) for x in ours] == [str(x) for x in theirs]
        else:
            np.testing.assert_allclose(ours, theirs, atol=1e-12)
    assert any("below" in str(x) for x in found[0][1])


def test_a_part_without_kernel_and_method_says_so(arm):
    class Nothing(RowTask):
        """Computes nothing."""

    with pytest.raises(ConfigError, match="Nothing has no kernel"):
        TaskStack(arm, [Nothing("nothing", dim=1)]).solve(DT)
