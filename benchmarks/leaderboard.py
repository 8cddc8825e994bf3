"""Comparison of controllers: each on every robot, with the same motions.

The right hand (or the only one) starts at `ready`, is moved by 5 cm and 20 degrees in
three directions, and round an upright circle of 20 cm in 4 s, at 20 actions per second.
Position controllers hold the orientation. Joint controllers follow the joint angles of
the same motion, found by damped least squares.

Limit violations: how far a joint passes its range at most, and the share of physics
steps in which a joint is faster than its limit. Chatter is the total variation of the
torques, in torque ranges per second and motor; energy is the integral of
|torque x speed| over the motions. The
tick is a physics step with its control law.

Usage: python benchmarks/leaderboard.py --json artifacts/benchmarks/leaderboard.json
"""

import sys
import time
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin
from harness.motion import RATE, circle_motion, judge_circle, judge_step, step_motion
from harness.report import Report, options
from harness.stand import Stand, arms_config

from wbc_suite.catalogue import Catalogue
from wbc_suite.devices.action_ports import joint_ports, limb_ports, side_of
from wbc_suite.errors import WbcError

WORLD = {"input_type": "absolute", "input_ref_frame": "world"}
PARTS: dict[str, dict[str, Any]] = {
    "OSC_POSE": WORLD,
    "OSC_POSITION": WORLD,
    "IK_POSE": WORLD,
    "JOINT_POSITION": {"input_type": "absolute"},
    "JOINT_VELOCITY": {},
}
COMPOSITES = ("HYBRID_MOBILE_BASE", "WHOLE_BODY_IK", "WHOLE_BODY_MINK_IK")
CONTROLLERS = (*PARTS, *COMPOSITES, "WHOLE_BODY_ID")
QUICK = ("Panda", "UR5e")
STEPS = 3  # directions of the step
SETTLE = 0.5  # s before a motion
COLUMNS = {
    "Steps of 5 cm and 20 degrees, the worst of three": (
        *("settling_s", "overshoot", "error_mm", "error_deg"),
    ),
    "Circle of 20 cm in 4 s": ("worst_mm", "median_mm"),
    "Cost": ("tick_us", "tick_p99_us", "past_range_mrad", "past_speed", "chatter"),
    "Energy": ("energy_J",),
}
Send = Callable[[np.ndarray, pin.SE3], np.ndarray]
"""From a goal relative to the start, and the start, to an action."""


class Trial:
    """One robot under one controller; measures in every physics step."""

    def __init__(self, robot: str, controller: str) -> None:
        config: Any = controller
        if controller in PARTS:
            config = arms_config(robot, controller, **PARTS[controller])
        self.stand = Stand(robot, config)
        stand = self.stand
        self.frame = next(iter(stand.robot.hands.values()))
        self.site = stand.model.site(stand.state.prefix + self.frame).id
        self.send = self._sender(controller)
        model = stand.model
        self.motors = model.actuator_forcelimited.astype(bool)
        self.full = np.ptp(model.actuator_forcerange, axis=1)
        places = [
            (
                int(model.joint(stand.state.prefix + joint.name).dofadr[0]),
                joint.velocity,
            )
            for joint in stand.robot.joints
        ]
        limited = [(dof, limit) for dof, limit in places if limit is not None]
        self.dofs = np.array([dof for dof, _ in limited], dtype=int)
        self.speeds = np.array([limit for _, limit in limited])
        self.ticks: list[float] = []
        self.past_range, self.fast, self.path = 0.0, 0, 0.0
        self.energy, self.seconds = 0.0, 0.0

    def follow(self, goals: np.ndarray) -> np.ndarray:
        """Return where the hand was after each physics step, shape (steps, 6)."""
        stand = self.stand
        stand.reset()
        self.held, self.home = stand.controller.hold_action, stand.pose(self.frame)
        for _ in range(round(SETTLE * RATE)):
            self._act(self.held)
        start = stand.pose(self.frame)
        reached = [p for goal in goals for p in self._act(self.send(goal, start))]
        return np.array([offset(start, pose) for pose in reached])

    def figures(self) -> dict[str, float]:
        """Return what was measured on the way."""
        motors = max(1, int(self.motors.sum()))
        median, tail = np.percentile(self.ticks, [50, 99])
        return {
            "tick_us": float(median),
            "tick_p99_us": float(tail),
            "past_range_mrad": 1e3 * self.past_range,
            "past_speed": self.fast / max(1, len(self.ticks)),
            "chatter": self.path / (motors * self.seconds),
            "energy_J": self.energy,
        }

    def _act(self, action: np.ndarray) -> list[pin.SE3]:
        """Take an action; return the pose of the hand after each physics step."""
        stand, dt, found = self.stand, self.stand.model.opt.timestep, list[pin.SE3]()
        stand.controller.set_goal(action, 1.0 / RATE)
        for _ in range(round(1.0 / (RATE * dt))):
            before, begun = stand.data.actuator_force.copy(), time.process_time_ns()
            stand.simulation.tick(1)
            self.ticks.append((time.process_time_ns() - begun) / 1e3)
            self._measure(before, dt)
            found.append(stand.pose(self.frame))
        return found

    def _measure(self, before: np.ndarray, dt: float) -> None:
        model, data = self.stand.model, self.stand.data
        jumps = abs(data.actuator_force - before)[self.motors]
        self.path += float((jumps / self.full[self.motors]).sum())
        self.energy += dt * float(
            abs(data.actuator_force * data.actuator_velocity).sum()
        )
        self.seconds += dt
        kinds = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)
        ranged = model.jnt_limited.astype(bool) & np.isin(model.jnt_type, kinds)
        q = data.qpos[model.jnt_qposadr[ranged]]
        low, high = model.jnt_range[ranged].T
        self.past_range = max(self.past_range, *np.maximum(low - q, q - high), 0.0)
        self.fast += bool((abs(data.qvel[self.dofs]) > self.speeds).any())

    def _sender(self, controller: str) -> Send:
        stand = self.stand
        env: Any = SimpleNamespace(
            controllers=[stand.controller],
            action_layout=stand.controller.layout,
            simulation=stand.simulation,
        )
        env.unwrapped = env
        slices = {part.name: part for part in stand.controller.layout.slices}
        if controller.startswith("JOINT"):
            return self._joint_sender(env, slices)
        side = side_of(self.frame)
        if controller in PARTS:
            at = slices.get(side) or slices["right"]
            quaternion = at.stop - at.start == 7
            return self._writer(at, self._from_base if quaternion else world_values)
        ports = [p for p in limb_ports(env).values() if p.kind in ("pose", "position")]
        mine = [p for p in ports if side in (side_of(p.name), p.name)]
        port = (mine or ports)[0]  # raises IndexError without a hand
        return self._writer(slices[port.name], port.encode)

    def _writer(self, at: Any, encode: Callable[[pin.SE3], np.ndarray]) -> Send:
        def send(goal: np.ndarray, start: pin.SE3) -> np.ndarray:
            action = self.held.copy()
            values = encode(moved(start, goal))
            action[at.start : at.stop] = values[: at.stop - at.start]
            return action

        return send

    def _from_base(self, T_world: pin.SE3) -> np.ndarray:
        """Return position and quaternion, x y z w, relative to the base of IK_POSE."""
        T_base_hand = pin.XYZQUATToSE3(self.held[:7])
        return pin.SE3ToXYZQUAT(T_base_hand * self.home.actInv(T_world))

    def _joint_sender(self, env: Any, slices: dict[str, Any]) -> Send:
        at = next(s for s in slices.values() if len(s.labels) >= 6)
        joints = [self.stand.state.prefix + name for name in at.labels]
        ports = joint_ports(env)
        scale = np.array([1.0 if u.scale is None else u.scale for u in at.units])

        def send(goal: np.ndarray, start: pin.SE3) -> np.ndarray:
            target = reached(self.stand, joints, self.site, moved(start, goal))
            action = self.held.copy()
            if at.name in ports:
                values = ports[at.name].encode(target)
            else:
                here = np.array([self.stand.data.joint(j).qpos[0] for j in joints])
                values = np.clip((target - here) * RATE / scale, at.low, at.high)
            action[at.start : at.stop] = values
            return action

        return send


def world_values(T: pin.SE3) -> np.ndarray:
    """Return position and rotation vector of a pose."""
    return np.concatenate([T.translation, pin.log3(T.rotation)])


def moved(start: pin.SE3, goal: np.ndarray) -> pin.SE3:
    """Return the pose of a goal relative to the start, world axes."""
    rotation = pin.exp3(goal[3:]) @ start.rotation
    return pin.SE3(rotation, start.translation + goal[:3])


def offset(start: pin.SE3, now: pin.SE3) -> np.ndarray:
    """Return position and rotation vector relative to the start, world axes."""
    turn = pin.log3(now.rotation @ start.rotation.T)
    return np.concatenate([now.translation - start.translation, turn])


def reached(stand: Stand, joints: list[str], site: int, target: pin.SE3) -> np.ndarray:
    """Return the joint angles at which a site has a pose, by damped least squares."""
    model, data = stand.model, mujoco.MjData(stand.model)
    data.qpos[:] = stand.data.qpos
    q = [int(model.joint(j).qposadr[0]) for j in joints]
    v = [int(model.joint(j).dofadr[0]) for j in joints]
    J = np.zeros((6, model.nv))
    for _ in range(30):
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_jacSite(model, data, J[:3], J[3:], site)
        turn = target.rotation @ data.site_xmat[site].reshape(3, 3).T
        error = np.concatenate(
            [target.translation - data.site_xpos[site], pin.log3(turn)]
        )
        if np.abs(error).max() < 1e-6:
            break
        A = J[:, v]
        data.qpos[q] += A.T @ np.linalg.solve(A @ A.T + 1e-6 * np.eye(6), error)
    return data.qpos[q].copy()


def measure(robot: str, controller: str) -> dict[str, Any]:
    """Return the figures of one robot under one controller."""
    trial = Trial(robot, controller)
    turns = controller != "OSC_POSITION"
    judged = []
    for direction in range(STEPS):
        goals = step_motion(direction)
        if not turns:
            goals[:, 3:] = 0.0
        judged.append(judge(goals, trial.follow(goals), trial.stand.model.opt.timestep))
    worst: dict[str, Any] = {
        key: None
        if any(one[key] is None for one in judged)
        else max(one[key] for one in judged)
        for key in judged[0]
    }
    worst |= judge_circle(trial.follow(circle_motion()), trial.stand.model.opt.timestep)
    return worst | trial.figures()


def judge(goals: np.ndarray, found: np.ndarray, dt: float) -> dict[str, Any]:
    """Judge a step; one without a turn is judged by its position."""
    if np.any(goals[:, 3:]):
        return judge_step(goals, found, dt)
    goals, found = goals.copy(), found.copy()
    goals[:, 3:], found[:, 3:] = goals[:, :3], found[:, :3]
    return judge_step(goals, found, dt) | {"error_deg": None}


def robots() -> list[str]:
    """Return all robots with a hand."""
    from wbc_suite import load_robot

    names = [path.stem for path in Catalogue().files("robots")]
    loaded = [load_robot(name) for name in names]
    return [robot.name for robot in loaded if robot.hands]


def main() -> None:
    parser = options(__doc__, "Panda and UR5e")
    parser.add_argument("--robots", nargs="+")
    parser.add_argument("--controllers", nargs="+", default=list(CONTROLLERS))
    arguments = parser.parse_args()
    chosen = arguments.robots or (QUICK if arguments.quick else robots())
    report = Report()
    for robot in chosen:
        for controller in arguments.controllers:
            row = {"case": robot, "side": controller}
            try:
                report.rows.append(row | measure(robot, controller))
            except (WbcError, IndexError, StopIteration, KeyError) as error:
                reason = str(error).partition("\n")[0][:160] or "It moves no hand."
                report.rows.append(row | {"left_out": reason})
            print(f"{robot} {controller}", file=sys.stderr, flush=True)
            report.write(arguments.json)
    for title, columns in COLUMNS.items():
        report.show(title, ("case", "side", *columns))
    report.write(arguments.json)


if __name__ == "__main__":
    main()
