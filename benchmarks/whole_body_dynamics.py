"""Robustness of whole-body inverse dynamics: standing, pushes, walking, hands.

Each trial is a simulation of one robot on a floor under WHOLE_BODY_ID. A robot has
fallen when its trunk is tilted over 53 degrees or 25 cm lower. A push is a force on the
trunk for 0.1 s. Trials of a case differ by their seed: the phase of the push, and small
changes of the posture at the start.

Usage:
    python benchmarks/whole_body_dynamics.py --quick
    python benchmarks/whole_body_dynamics.py --only GR1FreeBody/push --trials 20
    python benchmarks/whole_body_dynamics.py --only hand/far --trials 200
"""

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from harness.report import Report, options
from harness.stand import Stand

import wbc_suite
from wbc_suite.control import load_composite_controller_config
from wbc_suite.robot import load_robot

GR1, SPOT, ARM = "GR1FreeBody", "Spot", "SpotWithArm"
TILTED, DROPPED = 0.6, 0.25  # cosine; m
PUSH = 0.1  # s
ACTION = 0.02  # s between two actions
SETTLED = 1.0  # s after which errors count
LIMIT_TICKS = 100_000
OVER_CUBE = 0.08  # m
COLUMNS = ("trials", "survived", "travelled_m", "drift_m", "turned_deg", "slip_mm")
COLUMNS += ("hand_median_mm", "hand_worst_mm", "torque_change_nm", "unsolved_per_s")
COLUMNS += ("false_alarms", "late_alarms", "unnamed")


@dataclass(frozen=True, kw_only=True)
class Case:
    """What a robot does, and what happens to it."""

    robot: str
    name: str
    seconds: float = 8.0
    walk: tuple[float, float, float] = (0.0, 0.0, 0.0)
    height: float = 0.0
    start: float = 0.5  # s; when it begins to walk
    stop: float = np.inf  # trials spread it over a second
    push: tuple[float, float, float] | None = None  # N
    at: float = 3.0  # s; trials spread it over a second
    pushes: tuple[float, float] | None = None  # N; every 3 s, from any side
    random_commands: bool = False
    lissajous: float = 0.0  # m
    load: float = 0.0  # kg in each hand
    far_goals: bool = False
    tied: bool = False  # the feet, to each other
    effort: float = 1.0  # part of the motors' torques that there is
    table: bool = False  # in the way
    in_world: bool = False
    recover: bool = True
    friction: float | None = None
    slope: float = 0.0  # degrees
    boxes: float = 0.0  # m
    mass: float = 1.0
    damping: float = 0.0  # N m s
    jitter: float = 0.01  # rad; of the posture at the start
    period: float = ACTION  # s between two actions
    timestep: float = 0.002  # s
    delay: int = 0  # actions; from the command to its effect
    sensors: dict[str, Any] = field(default_factory=dict)  # of the controller
    smooth: bool = False  # whether changes of torques are noted
    cutoff: float | None = None  # Hz; of the filter of velocities
    most: dict[str, float] = field(default_factory=dict)  # what is asked for

    @property
    def case(self) -> str:
        """Its name as a path."""
        return f"{self.robot}/{self.name}"


def cases() -> list[Case]:
    """Return all cases."""
    found: list[Case] = []

    def add(robot: str, name: str, **more: Any) -> None:
        found.append(Case(robot=robot, name=name, **more))

    directions = {"front": (1, 0), "back": (-1, 0), "left": (0, 1), "right": (0, -1)}
    fixed = {GR1: (250, 150, 250, 300), SPOT: (500, 300, 200, 200)}
    fixed[ARM] = fixed[SPOT]
    stepping = {GR1: (500, 500, 300, 300), SPOT: (500,) * 4, ARM: (500,) * 4}
    walking = {GR1: (500, 500, 200, 200), SPOT: (500,) * 4, ARM: (500,) * 4}
    for robot in (GR1, SPOT, ARM):
        hands = robot != SPOT
        add(
            robot, "stand", seconds=60.0, lissajous=0.1 if hands else 0.0, in_world=True
        )
        for kind, forces in (("fixed", fixed), ("step", stepping), ("walk", walking)):
            for (side, (x, y)), force in zip(
                directions.items(), forces[robot], strict=True
            ):
                add(
                    robot,
                    f"push/{kind}/{side}/{force}",
                    push=(x * force, y * force, 0.0),
                    recover=kind != "fixed",
                    walk=(0.2, 0.0, 0.0) if kind == "walk" else (0.0, 0.0, 0.0),
                )
        fast = robot != GR1
        v = 1.0 if fast else 0.5
        go = {"walk": (v, 0.0, 0.0), "seconds": (20.0 if fast else 10.0) / v + 4.0}
        add(robot, "walk/forward", **go)
        add(robot, "walk/back", walk=(-v if fast else -0.2, 0.0, 0.0), seconds=10.0)
        side = 0.4 if fast else 0.2
        add(robot, "walk/sideways", walk=(0.0, side, 0.0), seconds=10.0)
        add(robot, "walk/turn", walk=(0.0, 0.0, 1.0 if fast else 0.4), seconds=10.0)
        add(robot, "walk/stop", walk=(v, 0.0, 0.0), stop=5.0, seconds=9.0)
        add(robot, "walk/crouch", walk=(0.2, 0.0, 0.0), height=-0.15, start=3.0)
        add(robot, "walk/friction", walk=(0.5 * v, 0.0, 0.0), friction=0.3)
        slope = 10.0 if fast else 5.0
        add(robot, "walk/slope", walk=(0.5 * v, 0.0, 0.0), slope=slope, seconds=10.0)
        boxes = 0.06 if fast else 0.04
        add(robot, "walk/boxes", walk=(0.5 * v, 0.0, 0.0), boxes=boxes, seconds=14.0)
        add(robot, "walk/light", walk=(0.5 * v, 0.0, 0.0), mass=0.9)
        add(robot, "walk/heavy", walk=(0.5 * v, 0.0, 0.0), mass=1.1)
        add(robot, "walk/damped", walk=(0.5 * v, 0.0, 0.0), damping=1.0)
        add(robot, "commands", seconds=60.0, random_commands=True)
        pushes = (200.0, 400.0) if fast else (100.0, 200.0)
        add(robot, "commands/pushed", seconds=60.0, random_commands=True, pushes=pushes)
        if hands:
            add(robot, "hand/load", load=2.0, in_world=True)
            add(robot, "hand/march", walk=(0.0, 0.0, 0.0011), in_world=True)
            add(robot, "hand/far", far_goals=True, seconds=5.0)
        go = {"walk": (0.5 * v, 0.0, 0.0)}
        for side, (x, y) in directions.items():
            push = (1000.0 * x, 1000.0 * y, 0.0)
            add(robot, f"hostile/push/{side}/1000", push=push, seconds=5.0)
        walk = {"walk": (0.5 * v, 0.0, 0.0), "seconds": 6.0}
        add(robot, "hostile/feet_tied", tied=True, **walk)
        add(robot, "hostile/effort_0.15", effort=0.15, **walk)
        add(robot, "hostile/table", table=True, **walk)
        add(robot, "rate/action_1khz", period=0.001, timestep=0.001, **go)
        add(robot, "rate/step_1ms", timestep=0.001, **go)
        add(robot, "rate/step_4ms", timestep=0.004, **go)
        add(robot, "rate/delay_20ms", delay=1, **go)
        add(robot, "sensors/delay_20ms", sensors={"delay": 0.02}, **go)
        add(robot, "sensors/noise/0.05", sensors={"velocity_noise": 0.05}, **go)
        for cutoff in (1e6, 25.0):
            name = "sensors/noise/0.02" + ("/filtered" if cutoff < 1e6 else "")
            noise = {"velocity_noise": 0.02}
            add(robot, name, sensors=noise, cutoff=cutoff, smooth=True, **go)
        noise = {"gyro_noise": 0.005, "acceleration_noise": 0.05}
        noise |= {"velocity_noise": 0.02, "source": "estimator"}
        long = {"walk": (0.8 * v, 0.0, 0.0), "seconds": 14.0 if fast else 15.0}
        add(robot, "sensors/estimator", sensors=noise, cutoff=25.0, **long)
    add(GR1, "hand/walk_loaded", walk=(0.3, 0.0, 0.0), load=5.0, seconds=10.0)
    return found


class Trial:
    """One simulation of a case."""

    def __init__(self, case: Case, seed: int) -> None:
        self.case, self.seed, self.rng = case, seed, np.random.default_rng(seed)
        config = load_composite_controller_config("WHOLE_BODY_ID", case.robot)
        config["input_ref_frame"] = "world" if case.in_world else "base"
        config["gait"] = {**config["gait"], "recover": case.recover}
        config["sensors"] = {**case.sensors, "seed": seed}
        if case.cutoff is not None:
            config["velocity_cutoff"] = case.cutoff
        self.stand = Stand(case.robot, config, self._edit)
        self._change_model()
        self.at, self.stop = case.at + seed % 8 / 8.0, case.stop + seed % 8 / 8.0
        self.stand.start()
        self._jitter()
        self.stand.simulation.start()
        self.arrays = self.stand.controller.dynamics
        self.body = int(self.arrays.state["body"][0])
        data = self.stand.data
        self.hands = data.site_xpos[self.arrays.hand].copy()
        self.first, self.feet = data.xpos[self.body].copy(), self._feet()
        self.command, self.force = np.zeros(3), np.zeros(2)
        self.goals = self.stand.controller.hold_action
        self.errors: list[float] = []
        self.changes: list[float] = []
        self.waiting = [self.goals] * case.delay
        self.yaw, self.slip = 0.0, 0.0
        self.drop, self.told, self.finite = 0.0, np.nan, True

    def _edit(self, spec: mujoco.MjSpec) -> None:
        spec.option.timestep = self.case.timestep
        if self.case.table:
            size, place = [0.3, 0.6, 0.4], [1.0, 0.0, 0.4]
            box = mujoco.mjtGeom.mjGEOM_BOX
            spec.worldbody.add_geom(type=box, size=size, pos=place)
        if self.case.tied:
            config = load_composite_controller_config("WHOLE_BODY_ID", self.case.robot)
            first, second = (f"robot0_{x['frame']}" for x in config["foot"][:2])
            weld, site = mujoco.mjtEq.mjEQ_WELD, mujoco.mjtObj.mjOBJ_SITE
            spec.add_equality(type=weld, objtype=site, name1=first, name2=second)
        if self.case.boxes:
            rng = np.random.default_rng(0)
            for x in np.arange(0.8, 16.0, 0.25):
                for y in np.arange(-1.0, 1.1, 0.25):
                    height = 0.5 * self.case.boxes * rng.uniform(0.0, 1.0)
                    spec.worldbody.add_geom(
                        type=mujoco.mjtGeom.mjGEOM_BOX,
                        size=[0.12, 0.12, max(height, 1e-3)],
                        pos=[x, y, height],
                        condim=3,
                    )

    def _change_model(self) -> None:
        model, case = self.stand.model, self.case
        if case.friction is not None:
            model.geom_friction[:, 0] = case.friction
        angle = np.deg2rad(case.slope)
        model.opt.gravity[:] = 9.81 * np.array([-np.sin(angle), 0.0, -np.cos(angle)])
        drives = self.stand.controller.laws[0].drives
        model.dof_damping[drives["dof"]] += case.damping
        for limits in ("command_min", "command_max"):
            drives[limits] *= case.effort
        self.stand.controller.dynamics.limits[3:] *= case.effort

    def _jitter(self) -> None:
        drives, data = self.stand.controller.laws[0].drives, self.stand.data
        arms = self.stand.controller.dynamics.is_arm.any(axis=0)
        noise = self.rng.normal(0.0, self.case.jitter, len(drives))
        data.qpos[drives["qpos"]] += np.where(arms, noise, 0.0)

    def _feet(self) -> np.ndarray:
        return self.stand.data.site_xpos[self.arrays.site].copy()

    def _act(self, t: float) -> None:
        case, controller = self.case, self.stand.controller
        layout, action = controller.layout, self.goals.copy()
        if case.random_commands and round(t / case.period) % 100 == 0:
            most = np.array([0.3, 0.15, 0.4] if case.robot == GR1 else [0.8, 0.3, 0.8])
            self.command = self.rng.uniform(-most, most)
        walk = layout["walk"]
        if case.start <= t < self.stop:
            command = self.command if case.random_commands else case.walk
            action[walk.start : walk.stop] = command
        action[layout["height"].start] = case.height
        for k, frame in enumerate(controller.config.frames):
            part = layout[frame.name]
            if case.lissajous:
                s = 2.0 * np.pi * 0.2 * t
                path = [np.sin(s), np.sin(2.0 * s), np.sin(3.0 * s)]
                fade = case.lissajous * min(1.0, t / 2.0)
                action[part.start : part.start + 3] += fade * np.array(path)
            elif case.far_goals and t > 1.0:
                side = np.random.default_rng([k, self.seed])
                direction = side.normal(size=3)
                action[part.start : part.start + 3] += (
                    2.0 * direction / np.linalg.norm(direction)
                )
        self.waiting.append(action)
        action = self.waiting.pop(0)
        self.action = action  # references arrive a period later: errors are of those
        controller.set_goal(layout.clip(layout.check(action))[0], case.period)

    def _advance(self, steps: int) -> None:
        """Make physics steps; note how torques change from one to the next."""
        stand = self.stand
        if not self.case.smooth:
            stand.simulation.tick(steps)
            return
        for _ in range(steps):
            before = stand.data.ctrl.copy()
            stand.simulation.tick(1)
            self.changes.append(float(np.abs(stand.data.ctrl - before).max()))

    def _disturb(self, t: float) -> None:
        case, data = self.case, self.stand.data
        data.xfrc_applied[:] = 0.0
        if case.mass != 1.0:
            weight = self.stand.model.body_mass * (case.mass - 1.0) * -9.81
            data.xfrc_applied[:, 2] += weight
        links = self.stand.model.site_bodyid[self.arrays.hand]
        for link in links:
            data.xfrc_applied[link, 2] -= 9.81 * case.load * min(1.0, t)
        if case.push is not None and self.at <= t < self.at + PUSH:
            data.xfrc_applied[self.body, :3] = case.push
        if case.pushes is not None and t > 2.0:
            if t % 3.0 < case.period:
                angle = self.rng.uniform(0.0, 2.0 * np.pi)
                self.force = self.rng.uniform(*case.pushes) * np.array(
                    [np.cos(angle), np.sin(angle)]
                )
            if t % 3.0 < PUSH:
                data.xfrc_applied[self.body, :2] = self.force

    def _observe(self, t: float) -> None:
        case, data = self.case, self.stand.data
        R = data.xmat[self.body].reshape(3, 3)
        self.finite = self.finite and bool(np.isfinite(data.ctrl).all())
        self.drop = self.first[2] + min(case.height, 0.0) - data.xpos[self.body][2]
        if np.isnan(self.told) and self.arrays.state["fell"][0] >= 0.0:
            self.told = self.drop
        yaw = np.arctan2(R[1, 0], R[0, 0])
        self.yaw += (yaw - self.yaw + np.pi) % (2.0 * np.pi) - np.pi
        if t < SETTLED or not len(self.hands):
            return
        goal = self.hands.copy()
        if case.in_world:
            for k, frame in enumerate(self.stand.controller.config.frames):
                start = self.stand.controller.layout[frame.name].start
                goal[k] = self.action[start : start + 3]
        elif case.load:
            state, com = self.arrays.gait.state[0], self.arrays.terms.com
            c, s = np.cos(state["yaw"]), np.sin(state["yaw"])
            for k in range(len(goal)):
                p = self.arrays.goal[k].reshape(3, 4)[:, 3]
                goal[k] = com + np.array([c * p[0] - s * p[1], s * p[0] + c * p[1], 0])
                goal[k, 2] = p[2] + state["ground"] + state["height"]
        else:
            return
        found = data.site_xpos[self.arrays.hand]
        self.errors.extend(np.linalg.norm(found - goal, axis=1))

    def run(self) -> dict[str, Any]:
        """Return what happened."""
        stand, case = self.stand, self.case
        steps = round(case.period / stand.model.opt.timestep)
        i, planned = 0, round(case.seconds / case.period)
        while i < planned:
            t = i * case.period
            self._act(t)
            self._disturb(t)
            self._advance(steps)
            self._observe(t)
            if case.slope == 0.0 and case.boxes == 0.0 and self.drop > DROPPED:
                break
            if stand.data.xmat[self.body][8] < TILTED:
                break
            i += 1
        return self._found(i * case.period)

    def _found(self, seconds: float) -> dict[str, Any]:
        data, case = self.stand.data, self.case
        way = data.xpos[self.body][:2] - self.first[:2]
        direction = np.array(case.walk[:2])
        length = np.linalg.norm(direction)
        unit = direction / length if length > 1e-6 else np.array([1.0, 0.0])
        along = float(way @ unit)
        across = float(np.linalg.norm(way - along * unit))
        errors = 1e3 * np.array(self.errors or [np.nan])
        slip = np.linalg.norm((self._feet() - self.feet)[:, :2], axis=1).max()
        steps = int(self.arrays.gait.state["steps"][0])
        survived = seconds >= case.seconds - 1e-9
        frames = self.stand.controller.info(self.stand.state)["ik"]["frames"]
        return {
            "survived": survived and self.finite,
            "seconds": seconds,
            "along": along,
            "across": across,
            "turned": float(np.degrees(self.yaw)),
            "slip": 1e3 * float(slip) if steps == 0 else np.nan,
            "hand": errors,
            "change": float(np.median(self.changes)) if self.changes else np.nan,
            "reported": bool(self.arrays.state["fell"][0] >= 0.0),
            "late": bool(self.drop > 0.2 and not self.told < 0.2),
            "unnamed": sum(
                not hand["reached"] and not list(hand["reasons"])
                for hand in frames.values()
            ),
            "unsolved": int(self.arrays.state["unsolved"][0]) / max(seconds, 1e-9),
        }


def run_trial(case: Case, seed: int) -> dict[str, Any]:
    """Run one trial, in any process."""
    return Trial(case, seed).run()


def summary(case: Case, trials: list[dict[str, Any]]) -> dict[str, Any]:
    """Return a row of the table."""
    survived = [trial for trial in trials if trial["survived"]]
    hands = np.concatenate([trial["hand"] for trial in survived or trials])

    def worst(key: str) -> float | None:
        values = [abs(trial[key]) for trial in survived]
        return float(np.max(values)) if values and np.isfinite(values).all() else None

    moves = np.linalg.norm(case.walk[:2]) > 0.0 or case.push is not None
    return {
        "case": case.case,
        "side": "WHOLE_BODY_ID",
        "trials": len(trials),
        "survived": len(survived),
        "travelled_m": (
            min(trial["along"] for trial in survived) if survived and moves else None
        ),
        "drift_m": worst("across"),
        "turned_deg": worst("turned"),
        "slip_mm": worst("slip"),
        "hand_median_mm": float(np.median(hands)) if np.isfinite(hands).all() else None,
        "hand_worst_mm": float(hands.max()) if np.isfinite(hands).all() else None,
        "torque_change_nm": worst("change"),
        "false_alarms": sum(trial["reported"] for trial in survived),
        "late_alarms": sum(trial["late"] for trial in trials),
        "unnamed": sum(trial["unnamed"] for trial in trials)
        if case.far_goals
        else None,
        "unsolved_per_s": float(np.median([trial["unsolved"] for trial in trials])),
    }


def tick_cost(report: Report, robot: str, walk: float, seconds: float) -> None:
    """Measure a tick: the loop with the law, less the physics with its torques."""
    stand = Stand(robot, "WHOLE_BODY_ID")
    stand.reset()
    controller, layout = stand.controller, stand.controller.layout
    action = controller.hold_action
    action[layout["walk"].start] = walk
    controller.set_goal(action)
    stand.simulation.tick(500)
    ticks, steps = [], 20
    other = mujoco.MjData(stand.model)
    for _ in range(round(seconds / (steps * stand.model.opt.timestep))):
        mujoco.mj_copyData(other, stand.model, stand.data)
        first = time.thread_time_ns()
        for _ in range(steps):
            mujoco.mj_step(stand.model, other)
        second = time.thread_time_ns()
        stand.simulation.tick(steps)
        third = time.thread_time_ns()
        ticks.append((third - second - (second - first)) / steps / 1e3)
    name = "walking" if walk else "standing"
    report.add(f"{robot}/tick", name, ticks)


PEERS = {"TSID": ("tsid", "tsid_side.py"), "placo": ("placo", "placo_dynamics_side.py")}
"""Environment and script of each; see `peers/`."""


def peers_ticks(report: Report, ticks: int) -> None:
    """Measure a tick of peers that are installed: GR1 stands, its fingers fixed.

    They compute the dynamics as well, which ours takes from the physics step.
    """
    here = Path(__file__).parent
    ours = next(row for row in report.rows if row["side"] == "standing")
    with tempfile.TemporaryDirectory() as folder:
        write_job(Path(folder), ticks)
        for name, (environment, script) in PEERS.items():
            python = here.parent / f".venv-{environment}" / "bin" / "python"
            if not python.exists():
                left_out = f"{name} is left out: make .venv-{environment}/.installed"
                print(left_out, file=sys.stderr)
                continue
            side = [python, here / "peers" / script, folder]
            found = subprocess.run(side, capture_output=True, text=True, check=True)
            times = json.loads(found.stdout.splitlines()[-1])["us"]
            theirs = report.add(f"{GR1}/tick", f"standing, {name}", times)
            report.compare(f"{GR1}/tick/{environment}", ours, theirs)


def write_job(folder: Path, ticks: int) -> None:
    """Write the robot, and the tasks of WHOLE_BODY_ID, for a peer."""
    robot = load_robot(GR1, root="fixed")
    config = load_composite_controller_config("WHOLE_BODY_ID", GR1)
    groups = robot.groups.keys() - robot.synergies.keys()
    limbs = [robot.joint(name) for group in groups for name in robot.groups[group]]
    ready, links = robot.keyframe("ready"), []
    for link in robot.links:
        changes: dict[str, Any] = {"visual": (), "collision": ()}
        if link.joint not in limbs:
            changes["joint"] = None
        links.append(link.model_copy(update=changes))
    job = {
        "dt": 0.002,
        "ticks": ticks,
        "friction": 0.6,
        "weight": 9.81 * robot.mass,
        "feet": [{"height": 0.0} | foot for foot in config["foot"]],
        "hands": [hand["frame"] for hand in config["frame"]],
        "trunk": "torso",
        "torques": {joint.name: joint.effort for joint in limbs},
        "joints": {joint.name: ready[joint.name] for joint in limbs},
    }
    text = robot.model_copy(update={"links": tuple(links)}).to_urdf()
    (folder / "robot.urdf").write_text(text, encoding="utf-8")
    (folder / "job.json").write_text(json.dumps(job), encoding="utf-8")


def real_time_factor(report: Report, robot: str, walk: float) -> None:
    """Measure simulated time over the time of one core, in actions at 50 Hz."""
    stand = Stand(robot, "WHOLE_BODY_ID")
    stand.reset()
    controller, seconds = stand.controller, 5.0
    action = controller.hold_action
    action[controller.layout["walk"].start] = walk
    steps, begin = round(ACTION / stand.model.opt.timestep), 0
    for i in range(-100, round(seconds / ACTION)):
        if i == 0:
            begin = time.thread_time_ns()
        controller.set_goal(action, ACTION)
        stand.simulation.tick(steps)
    factor = 1e9 * seconds / (time.thread_time_ns() - begin)
    report.rows.append({"case": f"{robot}/tick", "side": "walking", "factor": factor})


def limits_kept(report: Report, robot: str, ticks: int) -> None:
    """Measure by how much limits are passed under random commands.

    Forces and torques are those that are planned and commanded; positions are those of
    the simulation; what is inside counts as zero.
    """
    stand, rng = Stand(robot, "WHOLE_BODY_ID"), np.random.default_rng(0)
    stand.reset()
    controller, own = stand.controller, stand.controller.dynamics
    drives, edges = controller.laws[0].drives, len(own.terms.B)
    low, high, _, least, most = own.limits
    worst, action = np.zeros(3), controller.hold_action
    walk, data = controller.layout["walk"], stand.data
    for tick in range(ticks):
        if tick % 1000 == 0:
            speed = np.array([0.3, 0.15, 0.4]) * rng.uniform(-1.0, 1.0, 3)
            action[walk.start : walk.stop] = speed
        if tick % 10 == 0:
            controller.set_goal(action, ACTION)
        stand.simulation.tick(1)
        q, tau = data.qpos[own.qpos], data.ctrl[drives["ctrl"]]
        beyond = (
            -own.qp.x[:edges],
            np.r_[least - tau, tau - most],
            np.r_[low - q, q - high],
        )
        worst = np.maximum(worst, [part.max() for part in beyond])
    names = ("friction_n", "torque_nm", "position_rad")
    found = dict(zip(names, worst.tolist(), strict=True))
    report.rows.append({"case": f"{robot}/limits", "ticks": ticks, **found})


def reach_cube(report: Report, controller: str, seed: int) -> None:
    """Send the hand of SpotWithArm over the cube of Lift; measure what is missing."""
    config = load_composite_controller_config(controller, ARM)
    config["input_ref_frame"] = "world"
    env = wbc_suite.make("Lift", robots=ARM, controller_configs=config)
    env.reset(seed=seed)
    action, data = env.hold_action, env.simulation.data
    start = env.action_layout["right_hand"].start
    action[start : start + 3] = data.body("cube").xpos
    action[start + 2] += OVER_CUBE
    hand: dict[str, Any] = {}
    for _ in range(160):
        *_, info = env.step(action)
        hand = info["ik"]["frames"]["right_hand"]
    row = {"case": f"{ARM}/hand/cube", "side": controller, "seed": seed}
    error = 1e3 * hand["position_error"], hand["orientation_error"]
    report.rows.append(row | {"missing_mm": error[0], "missing_rad": error[1]})
    env.close()


def show_ticks(report: Report, quick: bool) -> None:
    """Measure what a tick costs, and what limits are passed."""
    for robot in (GR1, SPOT, ARM):
        for walk in (0.0, 0.2):
            tick_cost(report, robot, walk, 2.0)
        real_time_factor(report, robot, 0.3)
    peers_ticks(report, 200 if quick else 1500)
    report.show("A tick of the QP", ("case", "side", "median_us", "p99_us", "n"))
    report.show("Simulated time over time", ("case", "side", "factor"))
    for robot in (GR1, SPOT, ARM):
        limits_kept(report, robot, 2000 if quick else LIMIT_TICKS)
    columns = ("case", "ticks", "friction_n", "torque_nm", "position_rad")
    report.show("Greatest violation of limits", columns)


def show_reach(report: Report, trials: int) -> None:
    """Measure how near a hand comes under each whole-body controller."""
    for controller in ("WHOLE_BODY_ID", "WHOLE_BODY_IK", "WHOLE_BODY_MINK_IK"):
        for seed in range(min(trials, 3)):
            reach_cube(report, controller, seed)
    columns = ("case", "side", "seed", "missing_mm", "missing_rad")
    report.show("Hand over the cube of Lift", columns)


def main(make: Callable[[], list[Case]] = cases) -> None:
    """Run the cases, and show a table."""
    parser = options(__doc__, "1 trial of a few cases")
    parser.add_argument(
        "--only", default="", help="cases whose name contains this; also tick, cube"
    )
    parser.add_argument("--trials", type=int, default=8)
    parser.add_argument("--processes", type=int, default=2)
    arguments = parser.parse_args()
    chosen = [case for case in make() if arguments.only in case.case]
    if arguments.quick:
        few = ("push/step", "walk/forward", "hand/load")
        chosen = [case for case in chosen if any(name in case.name for name in few)]
        chosen = [replace(case, seconds=min(case.seconds, 6.0)) for case in chosen]
    trials = 1 if arguments.quick else arguments.trials
    report = Report()
    if arguments.only in ("", "tick"):
        show_ticks(report, arguments.quick)
    if arguments.only == "cube" or not (arguments.only or arguments.quick):
        show_reach(report, trials)
    with ProcessPoolExecutor(arguments.processes) as pool:
        waiting = [
            (case, [pool.submit(run_trial, case, seed) for seed in range(trials)])
            for case in chosen
        ]
        for case, futures in waiting:
            row = summary(case, [future.result() for future in futures])
            report.rows.append(row)
            print(case.case, {k: v for k, v in row.items() if k in COLUMNS}, flush=True)
    report.show("Robustness", ("case", *COLUMNS))
    report.write(arguments.json)


if __name__ == "__main__":
    main()
