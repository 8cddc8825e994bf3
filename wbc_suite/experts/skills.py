"""Skills of one arm: move, grasp, carry, release."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
import pinocchio as pin

from wbc_suite import logs
from wbc_suite.experts.arm import SPEED, TURN, Arm
from wbc_suite.experts.grasp_choice import Approach, Choice, choose_grasp
from wbc_suite.experts.scene import ExpertScene, Steps, wait_until
from wbc_suite.typing import Vector

log = logs.logger(__name__)

UP = np.array([0.0, 0.0, 1.0])
STALLED = 8  # control periods without progress end a motion
PUSHED = 0.01  # m, by which the error rises while a hand is pushed off its way
PUSHES = 4  # such rises after which a motion starts anew; none for coupled arms
STOPPED = 2e-4  # rad or m per control period, of fingers
OPENING = 8  # control periods until a gripper is open
OUT_OF_REACH = 0.008  # m, error of predictions; from the start more may be in reach
TOLD_ERROR = 0.05  # m, error that is told
PASSING = 0.03  # m, tolerance of poses on the way
BESIDE, STAYS_BACK = 0.002, 8.0  # m; distance kept for each m beside the way
ALIGNED = 0.002, 0.02  # m and rad, over an object that may barely fit between fingers


def shifted(pose: pin.SE3, offset: Iterable[float]) -> pin.SE3:
    """Return a pose moved by an offset in the world, m."""
    return pin.SE3(pose.rotation, pose.translation + np.asarray([*offset]))


def move(
    arm: Arm,
    target: pin.SE3 | Callable[[], pin.SE3],
    *,
    speed: float = SPEED,
    turn: float = TURN,
    tolerance: float = 0.004,
    turn_tolerance: float = 0.04,
    most: int = 120,
) -> Steps[bool]:
    """Move a hand to a pose; return whether it got within the tolerances, m and rad.

    A target that is a function is followed. It ends without success when the hand makes
    no more progress; one that was pushed off its way starts anew.
    """
    best, waited, pushes = np.inf, 0, 0 if arm.coupled else PUSHES
    for _ in range(most):
        arm.aim(target() if callable(target) else target, speed=speed, turn=turn)
        distance, angle = arm.error()
        if distance < tolerance and angle < turn_tolerance:
            return True
        left = distance + 0.1 * angle
        pushed = left > best + PUSHED and pushes > 0
        pushes -= pushed
        waited = 0 if pushed or left < best - 2e-4 else waited + 1
        best = left if pushed else min(best, left)
        if waited > STALLED:
            return False
        yield
    return False


def move_in_joints(
    scene: ExpertScene, arm: Arm, q: Vector, **options: Any
) -> Steps[bool]:
    """Move a hand as its joints move on a straight line to q, as a prediction has them.

    On a straight line in space an arm may end in other joints than the look-ahead, and
    meet their limits. `options` are those of `move`, for the end.
    """
    for pose in (poses := arm.sweep(q, scene.period)):
        arm.aim(pose, speed=2 * SPEED, turn=2 * TURN)
        yield
    return (yield from move(arm, poses[-1], **options))


def travel(arm: Arm, target: pin.SE3, *, height: float, **options: Any) -> Steps[bool]:
    """Move over what is below a height in the world, m, then down to a pose.

    `options` are those of `move`, for the last part.
    """
    pose = arm.pose
    if pose.translation[2] < height - PASSING:
        yield from move(arm, at_height(pose, height), tolerance=PASSING, most=40)
    if target.translation[2] < height - PASSING:
        over = at_height(target, height)
        yield from move(arm, over, tolerance=PASSING, turn_tolerance=0.3, most=60)
    return (yield from move(arm, target, **options))


def go_home(arm: Arm) -> Steps[bool]:
    """Return to where the hand was at the start, first without turning.

    Where a joint is in the way, the hand is turned about its approach by quarters.
    """
    height = max(arm.pose.translation[2], arm.home.translation[2])
    inward = pin.SE3(arm.pose.rotation, at_height(arm.home, height).translation)
    quarters = [pin.SE3(pin.exp3(k * np.pi / 2 * UP), np.zeros(3)) for k in range(4)]
    homes = [arm.home * quarter for quarter in quarters]
    costs = [
        arm.look_ahead([inward, home]).cost + (k > 0) for k, home in enumerate(homes)
    ]
    home = homes[int(np.argmin(costs))]
    yield from move(arm, inward, tolerance=PASSING, most=40)
    return (yield from move(arm, home, tolerance=0.02, turn_tolerance=0.2, most=40))


def at_height(pose: pin.SE3, height: float) -> pin.SE3:
    """Return a pose at another height in the world, m."""
    x, y, _ = pose.translation
    return pin.SE3(pose.rotation, np.array([x, y, height]))


def settle(scene: ExpertScene, name: str, *, most: int = 20) -> Steps[bool]:
    """Wait until an object lies still."""
    yield
    return (yield from wait_until(lambda: scene.speed(name) < 0.02, most=most))


def grip(scene: ExpertScene, arm: Arm, name: str, *, most: int = 60) -> Steps[bool]:
    """Close the gripper until it holds an object; return whether it does.

    It ends without success when the fingers have stopped.
    """
    arm.close()
    held = still = 0
    fingers = arm.fingers
    for _ in range(most):
        yield
        held = held + 1 if scene.holds(arm, name) else 0
        moved = float(np.abs(arm.fingers - fingers).max(initial=0.0))
        still, fingers = still + 1 if moved < STOPPED else 0, arm.fingers
        if held >= 2 or still >= STALLED:
            break
    return scene.holds(arm, name)


def release(arm: Arm, *, back: float = 0.08, steps: int = 5) -> Steps[None]:
    """Open the gripper, and withdraw along the approach."""
    arm.open()
    for _ in range(steps):
        yield
    away = arm.pose
    out = pin.SE3(away.rotation, away.translation - back * away.rotation[:, 2])
    yield from move(arm, out, tolerance=0.02, turn_tolerance=0.3, most=30)


def pick(
    scene: ExpertScene,
    name: str,
    *,
    arms: Sequence[Arm] | None = None,
    then: Sequence[Sequence[pin.SE3]] = ((),),
    costs: Sequence[float] | None = None,
    over: float | None = None,
    tries: int = 3,
    **approach: Any,
) -> Steps[Choice | None]:
    """Grasp an object and raise it; return how, or None if all tries fail.

    Args:
        scene: The scene.
        name: The object.
        arms: The arms that may do it; all by default.
        then: Where it will be carried, see `choose_grasp`.
        costs: See `choose_grasp`.
        over: Height in the world at which to come, m; on a straight line if None.
        tries: How often.
        approach: Fields of `Approach`.
    """
    way, candidates = Approach(**approach), arms or scene.arms

    def choose() -> Choice | None:
        return choose_grasp(
            scene, name, arms=candidates, approach=way, then=then, costs=costs
        )

    for _ in range(tries):
        choice = choose()
        if choice is not None and choice.prediction.error > OUT_OF_REACH:
            yield from go_home(choice.arm)
            choice = choose()
        if choice is None:
            return None
        if choice.prediction.error > TOLD_ERROR:
            short = 1e3 * choice.prediction.error
            log.warning("No hand can reach '%s': it stops %.0f mm short.", name, short)
        if (yield from take(scene, name, choice, raised=way.raised, over=over)):
            return choice
        choice.arm.open()
        for _ in range(OPENING):
            yield
        up = shifted(choice.arm.pose, max(way.raised, 0.05) * UP)
        yield from move(choice.arm, up, most=20)
        yield from settle(scene, name)
    return None


def take(
    scene: ExpertScene,
    name: str,
    choice: Choice,
    *,
    raised: float = 0.0,
    over: float | None = None,
) -> Steps[bool]:
    """Grasp an object as chosen, and raise it; return whether it came along.

    See `pick` for `raised` and `over`.
    """
    arm = choice.arm
    if not (yield from come_before(scene, choice, over=over)):
        return False
    yield from close_in(scene, name, choice)
    if not (yield from grip(scene, arm, name)):
        return False
    if raised > 0.0:
        yield from move(arm, shifted(arm.pose, raised * UP), tolerance=0.02)
    return scene.holds(arm, name)


def close_in(
    scene: ExpertScene, name: str, choice: Choice, *, speed: float = SPEED
) -> Steps[bool]:
    """Bring the open hand to a grasp of an object that may move, at a speed in m/s.

    It stays back while it is beside its way, so that no finger comes down on an object
    that barely fits between them.
    """
    arm = choice.arm

    def goal() -> pin.SE3:
        return choice.hand_at(scene.pose(name))

    def behind() -> pin.SE3:
        beside = np.linalg.norm(goal().actInv(arm.pose).translation[:2])
        back = min(STAYS_BACK * max(0.0, float(beside) - BESIDE), choice.away)
        return goal() * pin.SE3(np.eye(3), -back * UP)

    yield from move(arm, behind, speed=speed)
    return (yield from move(arm, goal, speed=speed))


def come_before(
    scene: ExpertScene, choice: Choice, *, over: float | None = None
) -> Steps[bool]:
    """Bring the open hand before a grasp; return whether it got near.

    See `pick` for `over`.
    """
    arm = choice.arm
    arm.open(choice.site.grasp)
    near: dict[str, Any] = {"tolerance": 0.02, "turn_tolerance": 0.15}
    if over is None:
        arrived = yield from move(arm, choice.before, **near)
    else:
        arrived = yield from travel(arm, choice.before, height=over, **near)
    if not arrived:
        arrived = yield from move_in_joints(scene, arm, choice.prediction.q[0], **near)
    if not arrived and arm.error()[0] > 2 * PASSING:
        return False
    if over is not None:
        close, even = ALIGNED
        yield from move(arm, choice.before, tolerance=close, turn_tolerance=even)
    return True


def put_down(
    scene: ExpertScene, arm: Arm, name: str, at: Vector, *, over: float
) -> Steps[None]:
    """Let go of a held object at a point, the hand pointing down.

    Args:
        scene: The scene.
        arm: The arm.
        name: The object.
        at: Where its origin is when it is let go, m.
        over: Height above that at which it is brought there, m.
    """
    held = scene.pose(name).actInv(arm.pose)
    down = np.diag([1.0, -1.0, -1.0])
    best, cost = [], np.inf
    for k in range(8):
        R = pin.exp3(k * np.pi / 4 * UP) @ down @ held.rotation.T
        poses = [pin.SE3(R, at + height * UP) for height in (over, 0.0)]
        found = arm.look_ahead([pose * held for pose in poses]).cost
        if found < cost:
            best, cost = poses, found
    above, low = best
    yield from carry(scene, arm, name, above, tolerance=0.02, turn_tolerance=0.1)
    yield from carry(scene, arm, name, low, tolerance=0.01, turn_tolerance=0.1)
    yield from release(arm, back=over)


def follow_arc(
    scene: ExpertScene, arm: Arm, joint: str, angle: float, *, speed: float
) -> Steps[bool]:
    """Turn a hinge to an angle with the hand that holds what it carries.

    The hand moves about the hinge's present axis ahead of its angle, by 0.25 rad at
    most. Returns whether the hinge got there, to 0.02 rad.

    Args:
        scene: The scene.
        arm: The arm.
        joint: The hinge.
        angle: The angle, rad.
        speed: Of the hand's goal, rad/s.
    """
    hinge, index = scene.data.joint(joint), scene.model.joint(joint).id
    start, grip = hinge.qpos.item(), arm.pose
    axis, anchor = scene.data.xaxis[index].copy(), scene.data.xanchor[index].copy()
    wanted = start
    for _ in range(round(abs(angle - start) / (speed * scene.period)) + 30):
        present = hinge.qpos.item()
        if abs(angle - present) < 0.02:
            return True
        step = np.clip(angle - wanted, -speed * scene.period, speed * scene.period)
        if abs(wanted + step - present) < 0.25:
            wanted += step
        R = pin.exp3((wanted - start) * axis)
        at = anchor + R @ (grip.translation - anchor)
        arm.aim(pin.SE3(R @ grip.rotation, at))
        yield
    return False


def turned_about(
    scene: ExpertScene, pose: pin.SE3, joint: str, angle: float
) -> pin.SE3:
    """Return a pose turned about a hinge's present axis by an angle, rad."""
    index = scene.model.joint(joint).id
    R = pin.exp3(angle * scene.data.xaxis[index])
    anchor = scene.data.xanchor[index]
    return pin.SE3(R @ pose.rotation, anchor + R @ (pose.translation - anchor))


def carry(
    scene: ExpertScene,
    arm: Arm,
    name: str,
    goal: pin.SE3,
    **options: Any,
) -> Steps[bool]:
    """Bring a held object to a pose; its place in the hand is measured in each step."""

    def target() -> pin.SE3:
        return goal * scene.pose(name).actInv(arm.pose)

    return (yield from move(arm, target, **options))
