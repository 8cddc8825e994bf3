"""Accuracy of whole-body IK in simulation.

Each robot stands alone on a floor, its own collisions on. Two experiments:

- reachable: from `ready`, targets for all hands at once are sent in one step and held
  for 2 s. They are the poses of a random configuration, free of collision (5 mm between
  links) and within joint limits, each joint no farther than its limits of speed and
  acceleration let it go in 0.6 s (so that 1 s can suffice). Reported: error at 2 s, and
  how many are within 1 mm and 0.2 degree from 1 s.
- ball: targets anywhere in a ball of 5 m for 1 s, then the hands' first poses for 2 s.
  Reported: how far joints left their limits, looked at after each physics step, whether
  the controller said so when it did not arrive, and the error after the return.

Each trial has a seed of its own, so a bad one can be run alone, and `--keep` lets a
long run be stopped and taken up again.

Usage:
    python benchmarks/simulation_accuracy.py --quick
    python benchmarks/simulation_accuracy.py --robots GR1 --keep gr1.jsonl
    python benchmarks/simulation_accuracy.py --robots GR1 --first 379 --trials 1
"""

import json
import time
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
from harness.report import Report, options
from harness.stand import Stand

from wbc_suite.control.ik.qp_of_config import distance_limits, joint_accelerations
from wbc_suite.control.ik.whole_body_ik import WholeBodyIK
from wbc_suite.kinematics import Configuration
from wbc_suite.planning import LimitChecker

ROBOTS = ("Panda", "GR1", "Tiago", "SpotWithArm")
REACH_TIME = 0.6  # s
ROOT_STEP = np.array([0.2, 0.2, 0.3])  # m, m, rad: of a planar root
TITLES = {
    "reachable": "Reachable poses, all hands at once, 2 s after one step",
    "ball": "Targets anywhere in a ball of 5 m, then back",
}
COLUMNS = {
    "reachable": ("trials", "median_mm", "worst_mm", "worst_deg", "settled"),
    "ball": (
        "trials",
        "worst_limit_overshoot_rad",
        "missed_in_silence",
        "back_median_mm",
        "back_worst_mm",
    ),
}
TOLERANCE = (1e-3, np.deg2rad(0.2))
KEYS = ("case", "side", "experiment", "seed", "trial")


class Bench(Stand):
    """A robot under a whole-body controller, sent to random poses."""

    def __init__(self, name, controller):
        super().__init__(name, controller)
        assert isinstance(self.controller, WholeBodyIK)
        frames = self.controller.config.frames
        self.hands = [frame for frame in frames if frame.name.endswith("hand")]
        self.body = Configuration(self.controller.robot.to_pinocchio())
        self.links = LimitChecker(
            self.controller.robot.to_pinocchio(),
            distance_limits(self.controller.robot, self.controller.config),
        )
        self.accelerations = joint_accelerations(
            self.controller.robot, self.controller.config
        )
        self.free = mujoco.MjData(self.model)
        self._limited = np.flatnonzero(self.model.jnt_limited)
        self._limited_q = self.model.jnt_qposadr[self._limited]
        self._low, self._high = self.model.jnt_range[self._limited].T

    def random_poses(self, rng):
        """Return poses of all hands at a random configuration free of collision."""
        model = self.body.model
        q0 = self.controller._conversion.q_to_pinocchio(self.data.qpos)
        resting = self._touching(self.data.qpos)
        for _ in range(1000):
            q = self._random_configuration(model, q0, rng)
            self.free.qpos[:] = self.data.qpos
            self.controller._conversion.q_to_mujoco(q, self.free.qpos)
            apart = self.links.clearance(q) > 0.0
            if apart and self._touching(self.free.qpos) <= resting:
                self.body.update(q)
                return [self.body.frame_pose(hand.frame) for hand in self.hands]
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
            hand.name: np.concatenate([pose.translation, pin.log3(pose.rotation)])
            for hand, pose in zip(self.hands, poses, strict=True)
        }
        action = layout.pack(values, base=self.controller.hold_action)
        self.controller.set_goal(layout.clip(action)[0])

    def errors(self, poses):
        """Return the worst hand's errors in the simulation, m and rad."""
        q = self.controller._conversion.q_to_pinocchio(self.data.qpos)
        self.body.update(q)
        worst = np.zeros(2)
        for hand, goal in zip(self.hands, poses, strict=True):
            pose = self.body.frame_pose(hand.frame)
            error = (
                np.linalg.norm(goal.translation - pose.translation),
                np.linalg.norm(pin.log3(pose.rotation.T @ goal.rotation)),
            )
            worst = np.maximum(worst, error)
        return worst

    def run(self, seconds, watch=None, period=0.02):
        """Advance; call `watch` every `period` seconds, at each physics step if 0."""
        steps = max(round(period / self.model.opt.timestep), 1)
        for _ in range(round(seconds / (steps * self.model.opt.timestep))):
            self.simulation.tick(steps)
            if watch is not None:
                watch()

    def overshoot(self):
        """Return how far the worst joint is outside its range, rad or m, and which."""
        q = self.data.qpos[self._limited_q]
        outside = np.maximum(self._low - q, q - self._high)
        worst = int(outside.argmax())
        return max(float(outside[worst]), 0.0), worst

    def joint_name(self, worst):
        """Return the name of the joint that `overshoot` numbered."""
        name = self.model.joint(self._limited[worst]).name
        return name.removeprefix("robot0_")


def reachable(bench, trial, seed):
    """Send the hands to where some configuration has them; return a row."""
    rng = np.random.default_rng((seed, trial))
    bench.reset()
    poses = bench.random_poses(rng)
    bench.send(poses)
    bench.run(1.0)
    history = [bench.errors(poses)]
    bench.run(1.0, lambda: history.append(bench.errors(poses)))
    info = bench.controller.info(bench.state)["ik"]["frames"]
    frames = [info[hand.name] for hand in bench.hands]
    return {
        "mm": 1e3 * float(history[-1][0]),
        "deg": float(np.rad2deg(history[-1][1])),
        "settled": bool((np.array(history) <= TOLERANCE).all()),
        "reasons": [str(reason) for frame in frames for reason in frame["reasons"]],
    }


def ball(bench, trial, seed):
    """Send the hands somewhere in the ball, then home; return a row."""
    rng = np.random.default_rng((seed, 1, trial))
    bench.reset()
    goals = bench.controller.goals_in_world
    home = [goals[hand.name].copy() for hand in bench.hands]
    poses = []
    for _ in bench.hands:
        direction = rng.normal(size=3)
        direction *= 5.0 * rng.uniform() ** (1 / 3) / np.linalg.norm(direction)
        turn = pin.Quaternion(rng.normal(size=4)).normalized()
        poses.append(pin.SE3(turn.matrix(), direction))
    outside = [(0.0, 0)]
    bench.send(poses)
    bench.run(1.0, lambda: outside.append(bench.overshoot()), period=0.0)
    missed = bench.errors(poses)[0] > 2e-3
    reached = bench.controller.info(bench.state)["ik"]["reached"]
    bench.send(home)
    bench.run(2.0, lambda: outside.append(bench.overshoot()), period=0.0)
    most, joint = max(outside)
    return {
        "back_mm": 1e3 * float(bench.errors(home)[0]),
        "limit_overshoot_rad": most,
        "limit_joint": bench.joint_name(joint),
        "silent": bool(missed and reached),
    }


def is_bad(row):
    """Tell whether a trial is to be looked at."""
    if "mm" in row:
        return row["mm"] > 2.0
    return row["back_mm"] > 1.0 or row["limit_overshoot_rad"] > 1e-3 or row["silent"]


def reachable_summary(rows):
    """Return the figures of the first experiment."""
    mm, deg = (np.array([row[key] for row in rows]) for key in ("mm", "deg"))
    return {
        "trials": len(rows),
        "median_mm": float(np.median(mm)),
        "median_deg": float(np.median(deg)),
        "worst_mm": float(mm.max()),
        "worst_deg": float(deg.max()),
        "over_2mm": int((mm > 2.0).sum()),
        "settled": float(np.mean([row["settled"] for row in rows])),
    }


def ball_summary(rows):
    """Return the figures of the second experiment."""
    back = np.array([row["back_mm"] for row in rows])
    worst = max(rows, key=lambda row: row["limit_overshoot_rad"])
    return {
        "trials": len(rows),
        "worst_limit_overshoot_rad": worst["limit_overshoot_rad"],
        "worst_limit_joint": worst["limit_joint"],
        "missed_in_silence": sum(row["silent"] for row in rows),
        "back_median_mm": float(np.median(back)),
        "back_worst_mm": float(back.max()),
        "back_over_1mm": int((back > 1.0).sum()),
    }


EXPERIMENTS = {
    "reachable": (reachable, reachable_summary),
    "ball": (ball, ball_summary),
}


class Kept:
    """Rows of trials by case and number, in a file of JSON lines if there is one."""

    def __init__(self, path):
        self.path, self.rows = path, {}
        if path is not None and path.exists():
            for line in path.read_text("utf-8").splitlines():
                row = json.loads(line)
                self.rows[self._key(row)] = row

    def _key(self, row):
        return tuple(row[key] for key in KEYS)

    def find(self, *key):
        """Return a row that is already there, or None."""
        return self.rows.get(key)

    def add(self, row):
        """Keep a row; it is on the disk when this returns."""
        self.rows[self._key(row)] = row
        if self.path is not None:
            with self.path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")


def run_trials(bench, case, experiment, numbers, seed, kept):
    """Run the trials that are not yet kept; return the figures of all of them."""
    trial, summary = EXPERIMENTS[experiment]
    rows = []
    for k in numbers:
        key = (*case, experiment, seed, k)
        row = kept.find(*key)
        if row is None:
            row = dict(zip(KEYS, key, strict=True)) | trial(bench, k, seed)
            kept.add(row)
        if is_bad(row):
            print("  bad:", json.dumps(row), flush=True)
        elif k % 100 == 99:
            print(f"  {experiment} {k}", flush=True)
        rows.append(row)
    figures = summary(rows)
    print(case[0], experiment, json.dumps(figures, indent=1), flush=True)
    return figures


def main():
    """Run from the command line."""
    parser = options(__doc__, "8 trials")
    parser.add_argument("--robots", nargs="+", default=list(ROBOTS))
    parser.add_argument("--controller", default="WHOLE_BODY_IK")
    parser.add_argument("--trials", type=int, default=1000)
    parser.add_argument("--ball", type=int, help="trials in the ball; as many")
    parser.add_argument("--first", type=int, default=0, help="number of the first")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--keep", type=Path, help="keep trials here, and go on with those already there"
    )
    arguments = parser.parse_args()
    trials = 8 if arguments.quick else arguments.trials
    in_ball = trials // 4 if arguments.quick else arguments.ball
    in_ball = trials if in_ball is None else in_ball
    counts = {"reachable": trials, "ball": in_ball}
    report, kept = Report(), Kept(arguments.keep)
    for name in arguments.robots:
        began, case = time.process_time(), (name, arguments.controller)
        bench = Bench(*case)
        row = {"case": name, "side": arguments.controller, "n": trials}
        for experiment, count in counts.items():
            numbers = range(arguments.first, arguments.first + count)
            if numbers:
                row[experiment] = run_trials(
                    bench, case, experiment, numbers, arguments.seed, kept
                )
        row["cpu_s"] = time.process_time() - began
        report.rows.append(row)
    for name, columns in COLUMNS.items():
        report.show(TITLES[name], ("case", *(f"{name}.{key}" for key in columns)))
    report.write(arguments.json)


if __name__ == "__main__":
    main()
