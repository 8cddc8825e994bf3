"""Tracking in operational space: steps, a circle, an unknown payload.

Each robot stands at `ready`; its right hand follows OSC_POSE with absolute goals in
world axes at 20 Hz, with its default stiffness, critically damped.

- step: 5 cm and 20 degrees at once, six directions, 2 s each, no interpolation; time
  until both errors stay within 2 %, overshoot, errors at the end, the worst of each;
  "haste" is how much of its top speed the most hurried joint reached, per direction;
  "soonest" is when joints at their top speeds could be there by any way, whatever
  law drives them: the largest of all directions in the table, each in the JSON file.
- circle: 20 cm across, upright, once in 4 s, goals interpolated over the whole action
  period; distance from the moving point after the first second.
- payload: the weight of 1 kg hung on the grip point without telling the controller; how
  far it sags in 2 s, beside what the stated stiffness predicts,
  `J M^-1 J^T F / kp`, and with the disturbance observer.

robosuite's OSC_POSE follows the same goals in its Lift scene, with its defaults
("robosuite") and with position and orientation coupled, as ours are ("coupled").

Usage: python benchmarks/tracking.py [--quick] [--json FILE] [--plot FILE]
"""

import sys
from pathlib import Path
from typing import Any

from harness.motion import (
    DIRECTIONS,
    RATE,
    circle,
    circle_motion,
    hold_motion,
    judge_circle,
    judge_step,
    step_motion,
)
from harness.report import Report, options
from harness.robosuite import Robosuite
from harness.soonest import soonest
from harness.stand import Stand, arms_config

import mujoco  # isort: skip  (after harness: it sets the number of threads)
import numpy as np
import pinocchio as pin

ROBOTS = ("Panda", "Sawyer", "UR5e", "Baxter", "Tiago")
ABSOLUTE = {"input_type": "absolute", "input_ref_frame": "world"}
OBSERVER = {"disturbance_observer": 20.0}  # 1/s
SMOOTH = {"interpolation": "linear", "ramp_ratio": 1.0}
DT = 2e-3  # s, of the physics
WEIGHT = 9.81  # N
SIDES = {"robosuite": {}, "robosuite, coupled": {"uncouple_pos_ori": False}}
COLOURS = {
    "ours": "C0",
    "ours, observer": "C2",
    "robosuite": "C1",
    "robosuite, coupled": "C3",
}
COLUMNS = {
    "Step of 5 cm and 20 degrees": (
        "settling_s",
        "soonest_s",
        "overshoot",
        "error_mm",
        "error_deg",
    ),
    "Circle of 20 cm in 4 s": ("worst_mm", "median_mm"),
    "Payload of 1 kg": ("sag_mm", "predicted_mm", "observed_mm"),
}


class Ours:
    """One robot whose right hand follows motions."""

    def __init__(self, robot: str, **more: Any) -> None:
        self.stand = Stand(robot, arms_config(robot, "OSC_POSE", **ABSOLUTE, **more))
        self.frame = self.stand.robot.hands["right"]
        self.site = self.stand.state.prefix + self.frame
        self.haste = 0.0

    def follow(self, goals: np.ndarray, force: float = 0.0) -> np.ndarray:
        """Return where the hand was after each physics step; see `harness.motion`."""
        stand = self.stand
        stand.reset()
        start, hold = stand.pose(self.frame), stand.controller.hold_action
        drives = stand.controller.parts["right"].law.drives
        found, self.haste = [], 0.0
        for goal in goals:
            turn = pin.log3(pin.exp3(goal[3:]) @ start.rotation)
            pose = np.concatenate([start.translation + goal[:3], turn])
            action = stand.controller.layout.pack({"right": pose}, base=hold)
            stand.controller.set_goal(action, 1.0 / RATE)
            for _ in range(round(1.0 / (RATE * DT))):
                self.hang(force)
                stand.simulation.tick(1)
                found.append(offset(start, stand.pose(self.frame)))
                speeds = abs(stand.data.qvel[drives["dof"]]) / drives["velocity_max"]
                self.haste = max(self.haste, float(speeds.max()))
        self.hang(0.0)
        return np.array(found)

    def hang(self, force: float) -> None:
        """Pull the grip point down."""
        data, site = self.stand.data, self.stand.model.site(self.site)
        body, pull = site.bodyid[0], np.array([0.0, 0.0, -force])
        lever = data.site_xpos[site.id] - data.xipos[body]
        data.xfrc_applied[body] = [*pull, *np.cross(lever, pull)]

    def soonest(self, goal: np.ndarray) -> float:
        """Return the least time in which joints can bring the hand to a goal, s."""
        self.stand.reset()
        drives = self.stand.controller.parts["right"].law.drives
        return soonest(self.stand, goal, site=self.site, drives=drives)

    def predicted_sag(self) -> float:
        """Return `J M^-1 J^T F / kp` where the hand is now, m."""
        model, data, state = self.stand.model, self.stand.data, self.stand.state
        mujoco.mj_forward(model, data)
        J = np.zeros((6, model.nv))
        mujoco.mj_jacSite(model, data, J[:3], J[3:], model.site(self.site).id)
        robot = state.robot
        fingers = {j for name in robot.synergies for j in robot.groups.get(name, ())}
        _, dofs = state.joint_addresses(
            tuple(j for j in robot.joint_names if j not in fingers)
        )
        M, J = state.mass_matrix()[np.ix_(dofs, dofs)], J[:, dofs]
        lift = J @ np.linalg.solve(M, J.T @ [0.0, 0.0, WEIGHT, 0.0, 0.0, 0.0])
        kp = self.stand.controller.parts["right"].law.record["kp"][0]
        return float(np.linalg.norm(lift[:3] / kp[:3]))


class Theirs:
    """robosuite's hand, asked for the same."""

    def __init__(self, robot: str, peer: Robosuite, **more: Any) -> None:
        self.peer = peer
        peer.ask(
            "make",
            robot=robot,
            controller="OSC_POSE",
            rate=round(1.0 / DT),
            options=ABSOLUTE | more,
            initialization_noise=None,
        )

    def follow(self, goals: np.ndarray, force: float = 0.0) -> np.ndarray:
        return np.array(self.peer.ask("follow", goals=goals.tolist(), force=force))


def offset(start: pin.SE3, now: pin.SE3) -> np.ndarray:
    """Return position and rotation vector relative to the start, world axes."""
    turn = pin.log3(now.rotation @ start.rotation.T)
    return np.concatenate([now.translation - start.translation, turn])


class Study:
    """All motions of one robot; keeps what is to be drawn."""

    def __init__(self, robot: str, report: Report, *, quick: bool) -> None:
        self.robot, self.report = robot, report
        self.directions = range(2 if quick else len(DIRECTIONS))
        self.sides = list(SIDES.items())[: 1 if quick else None]
        self.drawn: dict[str, dict[str, np.ndarray]] = {}

    def add(self, motion: str, side: str, found: dict[str, Any]) -> None:
        case = f"{self.robot}/{motion}"
        self.report.rows.append({"case": case, "side": side, **found})

    def run_ours(self) -> None:
        self.steps("ours", Ours(self.robot))
        self.circle("ours", Ours(self.robot, **SMOOTH))
        plain, watched = Ours(self.robot), Ours(self.robot, **OBSERVER)
        found = self.sag("ours", plain)
        found["predicted_mm"] = 1e3 * plain.predicted_sag()
        found["observed_mm"] = self.sag("ours, observer", watched)["sag_mm"]
        self.add("payload", "ours", found)
        ratio = found["sag_mm"] / found["predicted_mm"]
        self.report.ratios[f"{self.robot}/payload/predicted"] = ratio

    def run_theirs(self, peer: Robosuite) -> None:
        for name, more in self.sides:
            side = Theirs(self.robot, peer, **more)
            self.steps(name, side)
            self.circle(name, side)
            self.add("payload", name, self.sag(name, side))

    def steps(self, name: str, side: Ours | Theirs) -> None:
        """Step in several directions; report the worst of each figure."""
        judged, hastes, soon = [], [], []
        for direction in self.directions:
            goals = step_motion(direction)
            found = side.follow(goals)
            judged.append(judge_step(goals, found, DT))
            hastes.append(getattr(side, "haste", None))
            if isinstance(side, Ours):
                soon.append(side.soonest(goals[0]))
            if direction == 0:
                along = found[:, :3] @ DIRECTIONS[0] / np.linalg.norm(goals[0, :3])
                self.drawn.setdefault("step", {})[name] = along
        worst = {
            key: None if None in values else max(values)
            for key in judged[0]
            for values in [[one[key] for one in judged]]
        }
        each = {"settled_s": [one["settling_s"] for one in judged], "haste": hastes}
        if soon:
            each |= {"soonest_s": max(soon), "possible_s": soon}
        self.add("step", name, worst | each)

    def circle(self, name: str, side: Ours | Theirs) -> None:
        found = side.follow(circle_motion())
        moving = circle(DT * np.arange(1, len(found) + 1))
        away = np.linalg.norm(found[:, :3] - moving[:, :3], axis=1)
        self.drawn.setdefault("circle", {})[name] = 1e3 * away
        self.add("circle", name, judge_circle(found, DT))

    def sag(self, name: str, side: Ours | Theirs) -> dict[str, float]:
        found = side.follow(hold_motion(2.0), WEIGHT)
        self.drawn.setdefault("payload", {})[name] = found[:, 2]
        return {"sag_mm": 1e3 * float(np.linalg.norm(found[-1, :3]))}


def compare(robot: str, report: Report) -> None:
    """Book ours over robosuite's."""
    rows = {(row["case"], row["side"]): row for row in report.rows}
    for motion, key in (("step", "settling_s"), ("circle", "worst_mm")):
        ours = rows[f"{robot}/{motion}", "ours"][key]
        theirs = rows.get((f"{robot}/{motion}", "robosuite"), {}).get(key)
        if ours is not None and theirs is not None:
            report.ratios[f"{robot}/{motion}/robosuite"] = ours / theirs


def draw(study: Study, path: Path) -> None:
    """Draw one robot's motions."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    figure, (left, middle, right) = pyplot.subplots(1, 3, figsize=(12, 3.6))
    for name, along in study.drawn["step"].items():
        left.plot(
            DT * np.arange(1, len(along) + 1),
            100 * along,
            color=COLOURS[name],
            label=name,
        )
    left.axhspan(98, 102, color="0.85", zorder=0)
    left.set(title="Step of 5 cm and 20 degrees", xlabel="s", ylabel="%", xlim=(0, 1.5))
    for name, away in study.drawn["circle"].items():
        middle.plot(
            DT * np.arange(1, len(away) + 1), away, color=COLOURS[name], label=name
        )
    middle.set(title="Circle of 20 cm in 4 s: distance", xlabel="s", ylabel="mm")
    middle.set_ylim(bottom=0)
    for name, height in study.drawn["payload"].items():
        right.plot(
            DT * np.arange(1, len(height) + 1),
            1e3 * height,
            color=COLOURS[name],
            label=name,
        )
    right.set(title="1 kg hung on the hand", xlabel="s", ylabel="mm")
    for axes in (left, middle, right):
        axes.legend(fontsize=7)
        axes.grid(alpha=0.3)
    figure.suptitle(f"{study.robot}, OSC_POSE")
    figure.tight_layout()
    figure.savefig(path, dpi=80)


def main() -> None:
    parser = options(__doc__, "two directions; robosuite, uncoupled, beside Panda only")
    parser.add_argument("--robots", nargs="+", default=list(ROBOTS))
    parser.add_argument("--plot", type=Path, help="draw the first robot's motions here")
    arguments = parser.parse_args()
    report, peer = Report(), Robosuite.find()
    if peer is None:
        print("robosuite is left out: make bench-peers", file=sys.stderr)
    else:
        report.versions |= peer.versions
    for k, robot in enumerate(arguments.robots):
        study = Study(robot, report, quick=arguments.quick)
        study.run_ours()
        if peer is not None and (k == 0 or not arguments.quick):
            study.run_theirs(peer)
        compare(robot, report)
        if k == 0 and arguments.plot:
            draw(study, arguments.plot)
    if peer is not None:
        peer.close()
    for title, columns in COLUMNS.items():
        report.show(title, ("case", "side", *columns))
    report.show_ratios()
    report.write(arguments.json)


if __name__ == "__main__":
    main()
