"""How exactly whole-body IK brings hands to targets, in simulation.

Each robot stands alone on a floor, its own collisions on. Two experiments:

reachable  From `ready`, targets for all hands at once are sent in one step and held for
           2 s. They are the poses of a random configuration, free of collision (5 mm
           between links) and within joint limits, each joint no farther than its limits
           of speed and acceleration let it go in 0.6 s (so that 1 s can suffice).
           Reported: error at 2 s, and how many are within 1 mm and 0.2 degree from 1 s.
ball       Targets anywhere in a ball of 5 m for 1 s, then the hands' first poses for
           2 s. Reported: how far joints left their limits, whether the controller said
           so when it did not arrive, and the error after the return.

    python benchmarks/simulation_accuracy.py --quick
    python benchmarks/simulation_accuracy.py --robots GR1 --trials 1000 --json out.json
"""

import argparse
import json
import time
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.control import (
    RobotState,
    build_composite_controller,
    load_composite_controller_config,
)
from wbc_suite.control.composite.clearance import Clearance
from wbc_suite.control.composite.tasks import joint_accelerations
from wbc_suite.control.composite.whole_body import WholeBodyIK
from wbc_suite.envs.simulation import Simulation
from wbc_suite.robot import load_robot
from wbc_suite.scene import attach_robot, empty_arena, robot_prefix

ROBOTS = ("Panda", "GR1", "Tiago", "SpotWithArm")
REACH_TIME = 0.6  # s
ROOT_STEP = np.array([0.2, 0.2, 0.3])  # m, m, rad: of a planar root
TOLERANCE = (1e-3, np.deg2rad(0.2))


class Bench:
    """One robot alone on a floor, under one controller."""

    def __init__(self, name, controller):
        self.robot = load_robot(name)
        spec = empty_arena()
        attach_robot(spec, self.robot, robot_prefix(0))
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.state = RobotState(
            self.model, self.data, self.robot, prefix=robot_prefix(0)
        )
        self.start()
        config = load_composite_controller_config(controller, self.robot)
        self.controller = build_composite_controller(config, self.state)
        assert isinstance(self.controller, WholeBodyIK)
        self.simulation = Simulation(
            self.model, self.data, [(self.state, self.controller)]
        )
        self.hands = [
            k
            for k, frame in enumerate(self.controller.config.frames)
            if frame.name.endswith("hand")
        ]
        self.clearance = Clearance(self.controller.robot, self.controller.config)
        self.accelerations = joint_accelerations(
            self.controller.robot, self.controller.config
        )
        self.free = mujoco.MjData(self.model)
        self.worst = (0.0, "")
        self.limited = np.flatnonzero(self.model.jnt_limited)

    def start(self):
        """Stand at `ready`."""
        mujoco.mj_resetData(self.model, self.data)
        posture = self.robot.keyframe("ready")
        q, _ = self.state.joint_addresses(tuple(posture))
        self.data.qpos[q] = list(posture.values())
        if self.robot.root.kind == "free":
            at = self.model.joint(f"{self.state.prefix}root").qposadr[0]
            self.data.qpos[at : at + 7] = (*self.robot.root.pos, *self.robot.root.quat)
        mujoco.mj_forward(self.model, self.data)

    def reset(self):
        """Stand at `ready` with goals that hold."""
        self.start()
        self.controller.reset(self.state)

    def random_poses(self, rng):
        """Return poses of all hands at a random configuration free of collision."""
        model = self.controller._configuration.model
        q0 = self.controller._conversion.q_to_pinocchio(self.data.qpos)
        resting = self._touching(self.data.qpos)
        for _ in range(1000):
            q = self._random_configuration(model, q0, rng)
            self.free.qpos[:] = self.data.qpos
            self.controller._conversion.q_to_mujoco(q, self.free.qpos)
            apart = self.clearance.is_kept(q)
            if apart and self._touching(self.free.qpos) <= resting:
                self.controller._configuration.update(q)
                return [self.controller._planner.frame_pose(k) for k in self.hands]
        raise RuntimeError("no configuration free of collision in 1000 draws")

    def _touching(self, qpos):
        self.free.qpos[:] = qpos
        mujoco.mj_fwdPosition(self.model, self.free)
        deep = self.free.contact.dist < 0.0
        return {tuple(pair) for pair in self.free.contact.geom[deep].tolist()}

    def _random_configuration(self, model, q0, rng):
        q = q0.copy()
        moved = {j for g in self.robot.groups for j in self.robot.group(g)}
        if self.robot.root.kind == "free":
            moved -= set(self.robot.groups.get("legs", ()))
        for joint in self.controller.robot.joints:
            if joint.name not in moved or joint.range is None:
                continue
            k = model.joints[model.getJointId(joint.name)].idx_q
            low, high = joint.range
            inset = 0.05 * (high - low)
            far = self._distance_in_time(joint)
            q[k] = rng.uniform(
                max(low + inset, q0[k] - far), min(high - inset, q0[k] + far)
            )
        if self.robot.root.kind == "planar":
            q[:3] = q0[:3] + rng.uniform(-1.0, 1.0, 3) * ROOT_STEP
        return q

    def _distance_in_time(self, joint):
        """Return how far a joint gets from rest to rest in REACH_TIME."""
        speed, braking = joint.velocity or np.inf, self.accelerations[joint.name]
        if speed > braking * REACH_TIME / 2.0:
            return braking * REACH_TIME**2 / 4.0
        return speed * REACH_TIME - speed**2 / braking

    def send(self, poses):
        """Set the hands' goals."""
        layout = self.controller.layout
        values = {
            layout.slices[k].name: np.concatenate(
                [pose.translation, pin.log3(pose.rotation)]
            )
            for k, pose in zip(self.hands, poses, strict=True)
        }
        action = layout.pack(values, base=self.controller.hold_action)
        self.controller.set_goal(layout.clip(action)[0])

    def errors(self, poses):
        """Return the worst hand's errors in the simulation, m and rad."""
        q = self.controller._conversion.q_to_pinocchio(self.data.qpos)
        self.controller._configuration.update(q)
        worst = np.zeros(2)
        for k, goal in zip(self.hands, poses, strict=True):
            pose = self.controller._planner.frame_pose(k)
            error = (
                np.linalg.norm(goal.translation - pose.translation),
                np.linalg.norm(pin.log3(pose.rotation.T @ goal.rotation)),
            )
            worst = np.maximum(worst, error)
        return worst

    def run(self, seconds, watch=None):
        """Advance; call `watch` every 20 ms."""
        period = round(0.02 / self.model.opt.timestep)
        for _ in range(round(seconds / 0.02)):
            self.simulation.tick(period)
            if watch is not None:
                watch()

    def overshoot(self):
        """Return how far the worst joint is outside its range, rad or m; note it."""
        q = self.data.qpos[self.model.jnt_qposadr[self.limited]]
        low, high = self.model.jnt_range[self.limited].T
        outside = np.maximum(low - q, q - high)
        worst = int(outside.argmax())
        if outside[worst] > self.worst[0]:
            name = self.model.joint(self.limited[worst]).name
            self.worst = (float(outside[worst]), name.removeprefix("robot0_"))
        return max(float(outside[worst]), 0.0)


def reachable(bench, trials, seed, progress=print):
    """Run the first experiment."""
    rows = []
    for trial in range(trials):
        rng = np.random.default_rng((seed, trial))
        bench.reset()
        poses = bench.random_poses(rng)
        bench.send(poses)
        bench.run(1.0)
        history = [bench.errors(poses)]
        bench.run(1.0, lambda: history.append(bench.errors(poses)))  # noqa: B023
        settled = bool((np.array(history) <= TOLERANCE).all())
        info = bench.controller.info(bench.state)["ik"]["frames"]
        reasons = [
            r
            for k in bench.hands
            for r in info[bench.controller.config.frames[k].name]["reasons"]
        ]
        rows.append((*history[-1], settled, reasons))
        if history[-1][0] > 2e-3:
            error = 1e3 * history[-1][0]
            progress(f"  trial {trial}: {error:.2f} mm {reasons}", flush=True)
        elif trial % 100 == 99:
            progress(f"  {trial + 1} trials", flush=True)
    error = np.array([row[:2] for row in rows])
    return {
        "trials": trials,
        "median_mm": 1e3 * float(np.median(error[:, 0])),
        "median_deg": float(np.rad2deg(np.median(error[:, 1]))),
        "worst_mm": 1e3 * float(error[:, 0].max()),
        "worst_deg": float(np.rad2deg(error[:, 1].max())),
        "over_2mm": int((error[:, 0] > 2e-3).sum()),
        "settled": float(np.mean([row[2] for row in rows])),
    }


def ball(bench, trials, seed):
    """Run the second experiment."""
    overshoot, silent, back = [], 0, []
    for trial in range(trials):
        rng = np.random.default_rng((seed, 1, trial))
        bench.reset()
        names = [bench.controller.config.frames[k].name for k in bench.hands]
        home = [bench.controller.goals_in_world[name].copy() for name in names]
        poses = []
        for _ in bench.hands:
            direction = rng.normal(size=3)
            direction *= 5.0 * rng.uniform() ** (1 / 3) / np.linalg.norm(direction)
            turn = pin.Quaternion(rng.normal(size=4)).normalized()
            poses.append(pin.SE3(turn.matrix(), direction))
        bench.send(poses)
        worst = [0.0]
        bench.run(1.0, lambda: worst.append(bench.overshoot()))  # noqa: B023
        missed = bench.errors(poses)[0] > 2e-3
        silent += int(missed and bench.controller.info(bench.state)["ik"]["reached"])
        bench.send(home)
        bench.run(2.0, lambda: worst.append(bench.overshoot()))  # noqa: B023
        overshoot.append(max(worst))
        back.append(bench.errors(home)[0])
    return {
        "trials": trials,
        "worst_limit_overshoot_rad": max(overshoot),
        "worst_limit_joint": bench.worst[1],
        "missed_in_silence": silent,
        "back_median_mm": 1e3 * float(np.median(back)),
        "back_worst_mm": 1e3 * max(back),
        "back_over_1mm": int((np.array(back) > 1e-3).sum()),
    }


def main():
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robots", nargs="+", default=list(ROBOTS))
    parser.add_argument("--controller", default="WHOLE_BODY_IK")
    parser.add_argument("--trials", type=int, default=1000)
    parser.add_argument("--ball", type=int, help="trials in the ball; as many")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--quick", action="store_true", help="8 trials, under 50 s")
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    trials = 8 if arguments.quick else arguments.trials
    in_ball = trials // 4 if arguments.quick else arguments.ball
    in_ball = trials if in_ball is None else in_ball
    rows = []
    for name in arguments.robots:
        began = time.perf_counter()
        bench = Bench(name, arguments.controller)
        row = {"case": name, "side": arguments.controller, "n": trials}
        if trials:
            row["reachable"] = reachable(bench, trials, arguments.seed)
            print(name, json.dumps(row["reachable"], indent=1), flush=True)
        if in_ball:
            row["ball"] = ball(bench, in_ball, arguments.seed)
            print(name, json.dumps(row["ball"], indent=1), flush=True)
        row["wall_s"] = time.perf_counter() - began
        rows.append(row)
    if arguments.json:
        arguments.json.write_text(json.dumps({"rows": rows, "ratios": {}}, indent=1))


if __name__ == "__main__":
    main()
