"""Adversarial targets: do robots keep joint limits and stay out of obstacles?

Each robot stands in Lift under its whole-body controller. For 60 s its hands, torso,
head and base are sent, 20 times a second, to where they must not go: they jump, go
through the table and the floor, behind the robot and metres away, press, shake, turn
over, and swing joints from stop to stop; grippers open and close. Each motion lasts 0.5
to 3 s. After every physics step the positions of the simulated joints are compared with
their ranges, and contacts of the robot with the scene are read; those with the cube,
which is free to move, are listed separately.

Usage: python benchmarks/adversarial_targets.py [--quick] [--json FILE] [--seeds N]
           [--seconds S] [--robots NAME ...] [--controller NAME]
"""

import time
from dataclasses import dataclass, field

from harness.report import Report, options

import mujoco  # isort: skip  (after harness: it sets the number of threads)
import numpy as np
import pinocchio as pin

import wbc_suite
from wbc_suite.control.action import ActionSlice, SliceKind
from wbc_suite.envs.env import RobotEnv
from wbc_suite.kinematics import Configuration

ROBOTS = {
    "Panda": "WHOLE_BODY_IK",
    "GR1": "WHOLE_BODY_IK",
    "Tiago": "WHOLE_BODY_IK",
    "SpotWithArm": "WHOLE_BODY_ID",
}
"""Controllers of robots."""
MOTIONS = (
    *("jump", "table", "floor", "behind", "far", "press", "shake", "turn", "joints"),
    *("joints", "table"),
)
PERIOD = 0.05  # s, of an action
LIMIT_MRAD, LIMIT_MM = 2.0, 3.0


class Adversary:
    """Chooses actions; all follows from the seed."""

    def __init__(self, env: RobotEnv, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        state, controller = env.simulation.pairs[0]
        self.state, self.layout = state, env.action_layout
        frames = {frame.name: frame.frame for frame in controller.config.frames}
        self.frames = {x.name: frames.get(x.name) for x in self.layout.slices}
        self.model = state.robot.to_pinocchio()
        self.configuration = Configuration(self.model, state.q)
        self.home = self._poses()
        table = env.simulation.model.geom("table")
        at = env.simulation.data.geom("table").xpos
        self.table = np.add(at, [0.0, 0.0, table.size[2]])
        self.half = table.size[:2]
        self.time, self.until = 0.0, 0.0

    def _poses(self) -> dict[str, pin.SE3]:
        pose = self.configuration.frame_pose
        return {x: pose(frame) for x, frame in self.frames.items() if frame}

    def act(self) -> np.ndarray:
        """Return the next action."""
        rng = self.rng
        if self.time >= self.until:
            self.motion, self.since = str(rng.choice(MOTIONS)), self.time
            self.until = self.time + rng.uniform(0.5, 3.0)
            self.frequency = 10.0 ** rng.uniform(-0.5, 0.7)  # Hz
            self.phase = rng.uniform(0.0, 2.0 * np.pi)
            self.start = {x.name: self._goal(x) for x in self.layout.slices}
            self.grip = rng.uniform(-1.0, 1.0, self.layout.size)
            self.joints = self._joints()
        wave = np.sin(
            2 * np.pi * self.frequency * (self.time - self.since) + self.phase
        )
        self.time += PERIOD
        if self.motion == "joints":
            low, high = self.joints
            self.configuration.update(low if wave < 0.0 else high)
            poses = self._poses()
        else:
            poses = {x: self._moved(pose, wave) for x, pose in self.start.items()}
        values = {x.name: self._values(x, poses) for x in self.layout.slices}
        return np.clip(self.layout.pack(values), self.layout.low, self.layout.high)

    def _values(self, part: ActionSlice, poses: dict[str, pin.SE3]) -> np.ndarray:
        if part.kind is SliceKind.GRIPPER:
            return np.sign(self.grip[part.start : part.stop])
        if part.kind is SliceKind.VELOCITY:  # it stands: steps do not look where to
            return np.zeros(part.stop - part.start)
        if part.kind is SliceKind.POSITION:  # height
            return self.grip[part.start : part.stop]
        pose = poses[part.name]
        turn = pin.log3(pose.rotation)
        if part.kind is SliceKind.BASE:
            return np.array([*pose.translation[:2], turn[2]])
        at = {SliceKind.POSE: pose.translation, SliceKind.ORIENTATION: []}[part.kind]
        return np.array([*at, *turn])

    def _goal(self, part: ActionSlice) -> pin.SE3:
        """Return where a motion sends a frame, the middle of it if it swings."""
        rng, home = self.rng, self.home.get(part.name)
        if home is None:
            return pin.SE3.Identity()
        axis = rng.normal(size=3)
        turn = pin.exp3(rng.uniform(0.0, 3.0) * axis / np.linalg.norm(axis))
        R = turn @ home.rotation if rng.random() < 0.5 else home.rotation
        at = home.translation.copy()
        over = np.add(self.table, [*rng.uniform(-self.half, self.half), 0.0])
        match self.motion:
            case "jump":
                at += rng.uniform(-0.6, 0.6, 3)
            case "table":
                at = over - [0.0, 0.0, rng.uniform(0.0, 0.6)]
            case "press":
                at = over - [0.0, 0.0, rng.uniform(0.0, 0.05)]
            case "floor":
                at[2] = -rng.uniform(0.0, 1.0)
            case "behind":
                at -= [rng.uniform(0.5, 1.5), *rng.uniform(-0.3, 0.3, 2)]
            case "far":
                at += rng.uniform(-5.0, 5.0, 3)
        return pin.SE3(R, at)

    def _moved(self, pose: pin.SE3, wave: float) -> pin.SE3:
        """Return the goal at a phase of the swing."""
        at, R = pose.translation.copy(), pose.rotation
        if self.motion == "shake":
            at += wave * np.array([0.3, 0.3, 0.3])
        elif self.motion == "press":
            at[2] += 0.1 * wave
        elif self.motion == "turn":
            R = pin.exp3(3.0 * wave * np.array([0.6, 0.0, 0.8])) @ R
        elif self.motion == "table" and wave > 0.9:
            at[2] += 0.8
        return pin.SE3(R, at)

    def _joints(self) -> tuple[np.ndarray, np.ndarray]:
        """Return configurations with some joints at their lower and upper stops."""
        q = self.state.q
        low, high = q.copy(), q.copy()
        lower, upper = self.model.lowerPositionLimit, self.model.upperPositionLimit
        limited = np.flatnonzero((lower < upper) & (upper - lower < 10.0))
        count = self.rng.integers(1, len(limited) + 1)
        some = self.rng.permutation(limited)[:count]
        flip = self.rng.random(count) < 0.5
        low[some] = np.where(flip, upper[some], lower[some])
        high[some] = np.where(flip, lower[some], upper[some])
        return low, high


@dataclass
class Worst:
    """The worst of one kind, and where it was."""

    value: float = 0.0
    what: str = ""

    def add(self, value: float, what: str) -> None:
        if value > self.value:
            self.value, self.what = value, what


@dataclass
class Found:
    """What a robot did."""

    hinge: Worst = field(default_factory=Worst)  # rad past a range
    slide: Worst = field(default_factory=Worst)  # m past a range
    scene: Worst = field(default_factory=Worst)  # m into what is fixed
    cube: Worst = field(default_factory=Worst)  # m into what moves
    times: list[float] = field(default_factory=list)  # us of an action


class Watch:
    """Compares joints with their ranges, and reads contacts."""

    def __init__(self, env: RobotEnv, found: Found) -> None:
        self.model, self.data = env.simulation.model, env.simulation.data
        self.found, m = found, self.model
        own = [m.body(int(b)).name.startswith("robot0_") for b in m.geom_bodyid]
        self.own = np.array(own)
        self.fixed = m.body_weldid[m.geom_bodyid] == 0
        joints = [
            k
            for k in np.flatnonzero(m.jnt_limited).tolist()
            if m.joint(k).name.startswith("robot0_")
        ]
        self.joints, self.q = np.array(joints), m.jnt_qposadr[joints]
        self.low, self.high = m.jnt_range[joints].T
        self.slides = m.jnt_type[joints] == mujoco.mjtJoint.mjJNT_SLIDE

    def look(self, when: str) -> None:
        """Note what is worse than before."""
        found, q = self.found, self.data.qpos[self.q]
        over = np.maximum(self.low - q, q - self.high)
        for worst, kind in ((found.slide, self.slides), (found.hinge, ~self.slides)):
            some = np.where(kind, over, 0.0)
            k = int(np.argmax(some))
            if some[k] > worst.value:
                name = self.model.joint(int(self.joints[k])).name
                worst.add(float(some[k]), f"{name.removeprefix('robot0_')}, {when}")
        least = min(found.scene.value, found.cube.value)
        for i in np.flatnonzero(self.data.contact.dist < -least).tolist():
            contact = self.data.contact[i]
            a, b = (int(g) for g in contact.geom)
            if self.own[a] == self.own[b]:
                continue
            other = b if self.own[a] else a
            worst = found.scene if self.fixed[other] else found.cube
            worst.add(-float(contact.dist), f"{self._names(a, b)}, {when}")

    def _names(self, *geoms: int) -> str:
        m = self.model
        links = [m.body(int(m.geom_bodyid[g])).name or m.geom(g).name for g in geoms]
        return " - ".join(sorted(x.removeprefix("robot0_") for x in links))


def run(env: RobotEnv, seed: int, seconds: float, found: Found) -> None:
    """Let an adversary drive a robot."""
    env.reset(seed=seed)
    adversary, watch = Adversary(env, seed), Watch(env, found)
    simulation = env.simulation
    steps = round(PERIOD / simulation.timestep)
    for _ in range(round(seconds / PERIOD)):
        action = adversary.act()
        start = time.thread_time_ns()
        simulation.controllers[0].set_goal(action, PERIOD)
        for _ in range(steps):
            simulation.tick(1)
            watch.look(f"{adversary.motion}, seed {seed}, {adversary.time:.2f} s")
        found.times.append((time.thread_time_ns() - start) / 1e3)


def main() -> None:
    parser = options(__doc__, "one seed of 5 s")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--robots", nargs="+", default=[*ROBOTS])
    parser.add_argument("--controller", help="in place of each robot's")
    arguments = parser.parse_args()
    seeds, seconds = arguments.seeds, arguments.seconds
    if arguments.quick:
        seeds, seconds = 1, 5.0
    report = Report()
    for robot in arguments.robots:
        controller = arguments.controller or ROBOTS.get(robot, "WHOLE_BODY_IK")
        env = wbc_suite.make("Lift", robots=robot, controller_configs=controller)
        found = Found()
        for seed in range(arguments.first, arguments.first + seeds):
            run(env, seed, seconds, found)
        env.close()
        row = report.add(
            robot,
            controller,
            found.times,
            joint_mrad=1e3 * found.hinge.value,
            slide_mm=1e3 * found.slide.value,
            scene_mm=1e3 * found.scene.value,
            cube_mm=1e3 * found.cube.value,
            joint=found.hinge.what,
            slide=found.slide.what,
            pair=found.scene.what,
            cube=found.cube.what,
        )
        report.ratios[f"{robot}/joint/{LIMIT_MRAD:g}"] = row["joint_mrad"] / LIMIT_MRAD
        report.ratios[f"{robot}/scene/{LIMIT_MM:g}"] = row["scene_mm"] / LIMIT_MM
        for name in ("joint", "slide", "pair", "cube"):
            print(f"{robot}: {name}: {row[name]}", flush=True)
    columns = ("case", "side", "joint_mrad", "slide_mm", "scene_mm", "cube_mm")
    report.show("Adversarial targets", columns)
    report.show_ratios()
    report.write(arguments.json)


if __name__ == "__main__":
    main()
