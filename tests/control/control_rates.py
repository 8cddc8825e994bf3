"""Reaching goals at several rates of actions; prints a table when run as a script.

Each case drives a robot alone on the floor towards a goal for a fixed time, with a
policy that follows what it sees, and returns the remaining errors, m and rad.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from wbc_suite.envs import RobotEnv
from wbc_suite.envs.hold_check import alone
from wbc_suite.robot import load_robot

RATES = (5, 10, 15, 20, 25, 30, 50, 60, 100, 250)  # Hz
ABSOLUTE = {"input_type": "absolute"}
OFFSET, TURN = np.array([0.05, 0.10, -0.08]), np.array([0.1, -0.2, 0.3])  # m, rad
STEP = 0.15  # rad; of joints
NEAR = 5e-3, 1e-2  # m and rad


def parts(**configs):
    return {"type": "BASIC", "format": 1, "body_parts": configs}


def part_of(env: RobotEnv, name: str = "right"):
    return env.controllers[0].parts[name]


def run(
    env: RobotEnv,
    seconds: float,
    policy: Callable[[], dict],
    errors: Callable[[], tuple[float, float]] = lambda: (0.0, 0.0),
) -> tuple[float, float, float]:
    """Take actions for a time; a policy returns values by slice, others are held.

    Returns the errors at the end, and the time after which they were below `NEAR`, s.
    """
    settled = 0.0
    for _ in range(round(seconds * env.config.control_freq)):
        action = env.action_layout.pack(policy(), base=env.hold_action)
        _, _, _, _, info = env.step(action)
        assert "physics_error" not in info, info
        if any(x > near for x, near in zip(errors(), NEAR, strict=True)):
            settled = float(env.simulation.data.time)
    return *errors(), settled


def hand(env: RobotEnv, frame: str | None = None) -> pin.SE3:
    """Return the pose of a frame in the world, by default of the right hand."""
    state = env.simulation.robots[0]
    site = state.data.site(state.prefix + (frame or state.robot.hands["right"]))
    return pin.SE3(site.xmat.reshape(3, 3).copy(), site.xpos.copy())


def missing(
    env: RobotEnv, goal: pin.SE3, frame: str | None = None
) -> tuple[float, float]:
    """Return how far a hand is from a goal, m and rad."""
    pose = hand(env, frame)
    turn = pin.log3(pose.rotation.T @ goal.rotation)
    distance = np.linalg.norm(pose.translation - goal.translation)
    return float(distance), float(np.linalg.norm(turn))


def moved(pose: pin.SE3) -> pin.SE3:
    return pin.SE3(pin.exp3(TURN) @ pose.rotation, pose.translation + OFFSET)


def osc(env: RobotEnv) -> tuple[float, float, float]:
    """Follow a pose by steps or by goals."""
    goal, port = moved(hand(env)), part_of(env).pose_input()
    if len(port.action.labels) == 3:
        goal.rotation = hand(env).rotation
    return run(
        env, 3.0, lambda: {"right": port.encode(goal)}, lambda: missing(env, goal)
    )


def ik_pose(env: RobotEnv) -> tuple[float, float, float]:
    """Follow a pose by positions and quaternions, or by steps of them."""
    goal, part = moved(hand(env)), part_of(env)
    base = env.simulation.robots[0].root_pose

    def policy():
        wanted, now = base.actInv(goal), base.actInv(hand(env))
        if part.config.input_type == "delta":
            turn = pin.exp3(pin.log3(wanted.rotation @ now.rotation.T))
            step = (wanted.translation - now.translation) / 0.05
            shift = pin.SE3(turn, np.clip(step, -1.0, 1.0))
            return {"right": pin.SE3ToXYZQUAT(shift)}
        return {"right": pin.SE3ToXYZQUAT(wanted)}

    return run(env, 3.0, policy, lambda: missing(env, goal))


def joints(env: RobotEnv) -> tuple[float, float, float]:
    """Follow joint positions by steps, by positions or by velocities."""
    part, data = part_of(env), env.simulation.data
    at = part.law.drives["qpos"]
    goal = data.qpos[at] + STEP * np.array([1, -1, 1, 1, -1, 1, 1.0])

    def policy():
        error = goal - data.qpos[at]
        if part.config.type == "JOINT_VELOCITY":
            return {"right": np.clip(2.0 * error / 0.5, -1.0, 1.0)}
        if part.config.input_type == "absolute":
            return {"right": goal}
        return {"right": np.clip(error / 0.05, -1.0, 1.0)}

    return run(
        env, 4.0, policy, lambda: (0.0, float(np.abs(data.qpos[at] - goal).max()))
    )


def torque(env: RobotEnv) -> tuple[float, float, float]:
    """Push a joint and brake it; the goal is where it comes at 20 Hz."""
    part, data = part_of(env), env.simulation.data
    at, values = part.law.drives["qpos"][6], np.zeros(7)
    start = float(data.qpos[at])
    for push in (0.02, -0.02, 0.0):
        values[6] = push
        run(env, 0.2, lambda: {"right": values.copy()})
    return 0.0, float(data.qpos[at]) - start, 0.0


def drive(env: RobotEnv) -> tuple[float, float, float]:
    """Drive a base to a place half a metre ahead."""
    state = env.simulation.robots[0]
    goal = state.root_pose.translation[:2] + np.array([0.5, 0.0])

    def policy():
        away = goal - state.root_pose.translation[:2]
        return {"base": np.array([*np.clip(2.0 * away, -1.0, 1.0), 0.0])}

    def errors():
        return float(np.linalg.norm(state.root_pose.translation[:2] - goal)), 0.0

    return run(env, 5.0, policy, errors)


def stance(env: RobotEnv) -> tuple[float, float, float]:
    """Stand still while the arm follows a pose."""
    state = env.simulation.robots[0]
    before = state.root_pose.translation.copy()
    linear, angular, settled = osc(env)
    sway = np.linalg.norm(state.root_pose.translation - before)
    return max(linear, float(sway) - 0.02), angular, settled


def grip(env: RobotEnv) -> tuple[float, float, float]:
    """Close a gripper at a velocity; the goal is its setpoints."""
    part, data = part_of(env, "right_gripper"), env.simulation.data
    half, at = part._open + 0.5 * part._span, part.law.drives["qpos"]

    def errors():
        return float(np.abs(data.qpos[at] - half).max()), 0.0

    return run(env, 2.0, lambda: {"right_gripper": np.array([0.0])}, errors)


def whole_body(env: RobotEnv) -> tuple[float, float, float]:
    """Reach absolute goals with all hands."""
    controller, state = env.controllers[0], env.simulation.robots[0]
    frames = [f for f in controller.config.frames if f.kind == "pose"]
    goals = {f.name: moved(hand(env, f.frame)) for f in frames}
    base = pin.SE3.Identity()
    if controller.config.input_ref_frame == "base":
        base = getattr(controller, "heading", state.root_pose)
    values = {f.name: f.behaviour.values(base.actInv(goals[f.name])) for f in frames}

    def errors():
        left = [missing(env, goals[f.name], f.frame) for f in frames]
        return max(x for x, _ in left), max(x for _, x in left)

    return run(env, 4.0, lambda: values, errors)


def walk(env: RobotEnv) -> tuple[float, float, float]:
    """Walk ahead for some seconds; the goal is the distance."""
    state = env.simulation.robots[0]
    start = state.root_pose.translation[0]
    run(env, 6.0, lambda: {"walk": np.array([0.3, 0.0, 0.0])})
    assert "failure" not in env.controllers[0].info(state)
    return float(state.root_pose.translation[0] - start), 0.0, 0.0


@dataclass(frozen=True)
class Case:
    """A robot under a controller, and what it does.

    Attributes:
        tolerance: Greatest errors, m and rad; of what has no goal, the greatest
            difference from 20 Hz.
        relative: Whether the result is compared with that of 20 Hz.
    """

    robot: str
    controller: object
    act: Callable[[RobotEnv], tuple[float, float, float]]
    tolerance: tuple[float, float] = (2e-3, 5e-3)
    relative: bool = False


CASES = {
    "OSC_POSE delta": Case("Panda", "OSC_POSE", osc),
    "OSC_POSE absolute": Case(
        "Panda", parts(right={"type": "OSC_POSE", **ABSOLUTE}), osc
    ),
    "OSC_POSE linear": Case(
        "Panda",
        parts(right={"type": "OSC_POSE", "interpolation": "linear", **ABSOLUTE}),
        osc,
    ),
    "OSC_POSITION": Case("Panda", "OSC_POSITION", osc),
    "IK_POSE delta": Case("Panda", "IK_POSE", ik_pose),
    "IK_POSE absolute": Case(
        "Panda", parts(right={"type": "IK_POSE", **ABSOLUTE}), ik_pose
    ),
    "JOINT_POSITION delta": Case("Panda", "JOINT_POSITION", joints),
    "JOINT_POSITION absolute": Case(
        "Panda", parts(right={"type": "JOINT_POSITION", **ABSOLUTE}), joints
    ),
    "JOINT_VELOCITY": Case("Panda", "JOINT_VELOCITY", joints),
    "JOINT_TORQUE": Case("Panda", "JOINT_TORQUE", torque, relative=True),
    "GRIP": Case(
        "Panda",
        parts(right={"type": "OSC_POSE", "gripper": {"type": "GRIP", "speed": 2.0}}),
        grip,
    ),
    "BASE_VELOCITY": Case("PandaOmron", "BASIC", drive, (5e-3, 5e-3)),
    "STANCE": Case("SpotWithArm", "BASIC", stance, (5e-3, 1e-2)),
    "HYBRID_MOBILE_BASE": Case("PandaOmron", "HYBRID_MOBILE_BASE", osc),
    "WHOLE_BODY_IK Panda": Case("Panda", "WHOLE_BODY_IK", whole_body),
    "WHOLE_BODY_IK GR1": Case("GR1", "WHOLE_BODY_IK", whole_body),
    "WHOLE_BODY_IK Tiago": Case("Tiago", "WHOLE_BODY_IK", whole_body),
    "WHOLE_BODY_MINK_IK Panda": Case("Panda", "WHOLE_BODY_MINK_IK", whole_body),
    "WHOLE_BODY_MINK_IK GR1": Case("GR1", "WHOLE_BODY_MINK_IK", whole_body),
    "WHOLE_BODY_ID Panda": Case("Panda", "WHOLE_BODY_ID", whole_body),
    "WHOLE_BODY_ID GR1FreeBody": Case(
        "GR1FreeBody", "WHOLE_BODY_ID", whole_body, (1e-2, 2e-2)
    ),
    "WHOLE_BODY_ID walking": Case(
        "GR1FreeBody", "WHOLE_BODY_ID", walk, (0.1, 0.0), relative=True
    ),
}


def result(case: Case, rate: float) -> tuple[float, float, float]:
    """Return the errors of a case at a rate, m and rad, and its settling time, s."""
    robot = load_robot(case.robot)
    env = alone(robot, controller_configs=case.controller, control_freq=rate)
    try:
        env.reset(seed=0)
        return case.act(env)
    finally:
        env.close()


def main() -> None:
    """Print a row for each case: mm, mrad and settling time at each rate."""
    wanted = sys.argv[1:] or CASES
    print("| case | " + " | ".join(f"{rate} Hz" for rate in RATES) + " |")
    print("|---|" + "---|" * len(RATES))
    for name in wanted:
        cells = []
        for rate in RATES:
            try:
                linear, angular, time = result(CASES[name], rate)
                cells.append(f"{1e3 * linear:.1f} / {1e3 * angular:.1f}, {time:.2f} s")
            except Exception as error:  # noqa: BLE001 - shown in the table
                cells.append(f"{type(error).__name__}: {error}"[:60])
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
