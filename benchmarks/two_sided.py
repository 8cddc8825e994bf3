"""Search for false verdicts from both sides, with four kinds of robots.

Each try puts the things of a benchmark somewhere: at their goals, tipped, leaned,
stacked, beside another, or between fingers that close; hands are somewhere near.
Physics goes on for up to 0.4 s, around robots that do not move. Then the benchmark's
verdict is compared with a judge that knows vertices, distances, and what happens next;
see `harness/geometric_judges.py`. States in which things overlap by more than 1 mm are
drawn anew; those that are too near to a bound are undecided.

Usage: python benchmarks/two_sided.py [BENCHMARK ...] [--robots R[,R] ...]
    [--tries 10000] [--seed 0] [--quick] [--json FILE]
"""

import math
import time
from collections import Counter
from typing import Any

import mujoco
import numpy as np
from harness.geometric_judges import JUDGES, World, judged
from harness.report import Report, options

import wbc_suite
from wbc_suite.cli.options import progress
from wbc_suite.typing import Vector

ONE = ("Panda", "PandaDexRH", "Baxter", "GR1")
TWO = ("Panda,Panda", "UR5e,Kinova3", "Baxter", "GR1")
"""One arm with a jaw, with fingers; two arms; a humanoid."""
ALL = (
    *("Lift", "Stack", "Door", "ToolHang"),
    *("NutAssembly", "NutAssemblySingle", "NutAssemblySquare", "NutAssemblyRound"),
    *("PickPlace", "PickPlaceSingle", "PickPlaceMilk", "PickPlaceBread"),
    *("PickPlaceCereal", "PickPlaceCan"),
    *("TwoArmLift", "TwoArmPegInHole", "TwoArmHandover", "TwoArmTransport"),
)
STEPS, SHARES = (2, 20, 60, 200), (0.3, 0.3, 0.3, 0.1)
POSES = 6  # of hands, for each scene
SCENES = 50  # tries in each scene
DEEP = 1e-3  # m, overlap from which a state does not count
SQUEEZE = 0.03  # of the way of fingers, beyond the first touch of two of them
QUARTER = math.sqrt(0.5)
TURNS = [(1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0)]
TURNS += [(QUARTER, s * QUARTER, 0.0, 0.0) for s in (1, -1)]
TURNS += [(QUARTER, 0.0, s * QUARTER, 0.0) for s in (1, -1)]


class Search:
    """Tries to find false verdicts of one benchmark with some robots."""

    def __init__(self, name: str, robots: str, seed: int) -> None:
        each = robots.split(",")
        self.env = wbc_suite.make(name, robots=each if len(each) > 1 else robots)
        self.task: Any = self.env.benchmark
        self.world, self.rng = World(self.env), np.random.default_rng(seed)
        self.model, self.data = self.world.model, self.world.data
        kinds = [kind.__name__ for kind in type(self.task).__mro__]
        self.judge = next(JUDGES[kind] for kind in kinds if kind in JUDGES)
        self.counts: Counter[str] = Counter()
        self.done = self.overlaps = 0
        self.found: list[dict[str, Any]] = []
        self._poses: list[Vector] = []
        self._fingers = [
            _fingers(state, side)
            for state in self.task._robots
            for side in state.robot.hands
        ]
        names = [s for s, state in self.task.states.items() if state.is_free]
        self.free = list(getattr(getattr(self.task, "sorting", None), "active", names))

    def attempt(self) -> None:
        """Make one try, and note what came of it."""
        number = self.counts.total()
        if number % SCENES == 0:
            self.env.begin(int(self.rng.integers(1_000_000)))
            self._reach_around()
        while not self.draw():
            self.overlaps += 1
        verdict = self.task.success()
        truth, margins = judged(self.judge(self.world))
        kind = {None: "undecided", verdict: "right"}.get(truth, "false")
        self.counts[kind] += 1
        self.done += bool(truth and verdict)
        if kind == "false":
            side = "success" if verdict else "failure"
            one = {"try": number, "side": side, "margins": margins}
            self.found.append(one | {"qpos": self.data.qpos.tolist()})

    def draw(self) -> bool:
        """Draw a state; return whether nothing overlaps in it."""
        rng, data, task = self.rng, self.data, self.task
        data.qpos[self.world.at] = self._poses[int(rng.integers(len(self._poses)))]
        data.qvel[:] = 0.0
        match type(task).__name__:
            case "Door":
                data.joint("door_panel_joint").qpos[0] = rng.uniform(-0.05, 0.6)
                data.joint("door_handle_joint").qpos[0] = rng.uniform(0.0, 1.5)
            case "TwoArmPegInHole":
                self._put_peg()
            case _:
                self._put_things()
        if data.userdata.size:
            data.userdata[0] = rng.random() < 0.8
        mujoco.mj_forward(self.model, data)
        if type(task).__name__ not in ("Door", "TwoArmPegInHole"):
            if self.world.deepest() > 3 * DEEP:
                return False
            self.world.run(int(rng.choice(STEPS, p=SHARES)))
        return self.world.deepest() < DEEP

    def _put_peg(self) -> None:
        """Put the peg near the hole, in the axes of the plate, whatever carries it."""
        rng, data = self.rng, self.data
        mujoco.mj_kinematics(self.model, data)
        plate = data.body("plate")
        tilt = rng.normal(0.0, rng.choice([0.05, 0.4, 2.0]), 3)
        R = plate.xmat.reshape(3, 3) @ _rotation(tilt)
        aside = np.array([0.0, 0.0, rng.uniform(-0.2, 0.2)])
        aside[:2] = rng.normal(0.0, rng.choice([0.01, 0.05]), 2)
        at = plate.xpos + plate.xmat.reshape(3, 3) @ aside
        body = self.model.body("peg").id
        parent = data.body(int(self.model.body_parentid[body]))
        P = parent.xmat.reshape(3, 3)
        quat = np.empty(4)
        mujoco.mju_mat2Quat(quat, (P.T @ R).ravel())
        self.task.states["peg"].move(P.T @ (at - parent.xpos), quat)

    def _put_things(self) -> None:
        """Put each thing somewhere, and close hands on those that are in them."""
        rng = self.rng
        for name in self.free:  # away
            self.task.states[name].move((0.0, 0.0, 30.0 + len(name)))
        held, kinds = False, rng.permutation(self.free).tolist()
        for name in kinds:
            for _ in range(8):
                mujoco.mj_kinematics(self.model, self.data)
                if self.task.hands and rng.random() < self._share():
                    held = True
                    self._put_in(
                        name, self.task.hands[int(rng.integers(len(self.task.hands)))]
                    )
                else:
                    self._put_on(name)
                mujoco.mj_fwdPosition(self.model, self.data)
                if self.world.deepest() < 3 * DEEP:
                    break
        for hand, joints in zip(self.task.hands, self._fingers, strict=True):
            if rng.random() < (0.8 if held else 0.2):
                self._close(hand, joints)

    def _share(self) -> float:
        kinds = ("Lift", "TwoArmLift", "TwoArmHandover")
        return 0.8 if type(self.task).__name__ in kinds else 0.1

    def _put_in(self, name: str, hand: Any) -> None:
        """Put a thing between fingers, at one of its grasps."""
        rng, state = self.rng, self.task.states[name]
        R = self.data.site_xmat[hand.site].reshape(3, 3)
        R = R @ _rotation(rng.normal(0.0, rng.choice([0.03, 0.3]), 3))
        R = R @ _matrix(TURNS[int(rng.integers(len(TURNS)))])
        sites, at = self.task.grasps.get(name, ()), np.zeros(3)
        if sites and rng.random() < 0.8:
            site = sites[int(rng.integers(len(sites)))].pose
            base = self.data.site_xmat[hand.site].reshape(3, 3)
            R = base @ _rotation(rng.normal(0.0, 0.05, 3)) @ site.rotation.T
            at = site.translation
        quat = np.empty(4)
        mujoco.mju_mat2Quat(quat, np.ascontiguousarray(R).ravel())
        state.move(hand.position - R @ at + rng.normal(0.0, 0.004, 3), quat)

    def _close(self, hand: Any, joints: list[tuple[str, float, float]]) -> None:
        """Close fingers until two of them touch a thing, or all the way."""

        def grasps(share: float) -> bool:
            for joint, start, end in joints:
                self.data.joint(joint).qpos[0] = start + share * (end - start)
            mujoco.mj_fwdPosition(self.model, self.data)
            return any(hand.grasps(self.task.states[n].geoms) for n in self.free)

        first = next(filter(grasps, np.linspace(0.0, 1.0, 11)), None)
        if first:
            touch = next(filter(grasps, np.linspace(first - 0.1, first, 16)))
            grasps(touch + self.rng.uniform(0.0, SQUEEZE))

    def _put_on(self, name: str) -> None:
        """Put a thing on a goal, the table or another thing, and tip it perhaps."""
        rng, state = self.rng, self.task.states[name]
        goals, rest = self._goals(name)
        x, y, z = goals[int(rng.integers(len(goals)))]
        right = rng.random() < 0.5  # as it should be
        turn = 1.0 if right else rng.random()
        quat = np.array(rest, dtype=float)
        if turn < 0.3:
            quat = np.array(TURNS[int(rng.integers(len(TURNS)))])
        elif turn < 0.5:
            quat = rng.normal(size=4)
        R = _matrix(quat / np.linalg.norm(quat))
        if rng.random() < 0.7:
            R = _rotation(np.array([0.0, 0.0, rng.uniform(-3.1, 3.1)])) @ R
        if not right:
            R = _rotation(rng.normal(0.0, rng.choice([0.0, 0.0, 0.02, 0.3]), 3)) @ R
        quat = np.empty(4)
        mujoco.mju_mat2Quat(quat, np.ascontiguousarray(R).ravel())
        state.move((0.0, 0.0, 50.0), quat)
        mujoco.mj_kinematics(self.model, self.data)
        points = self.world.points(self.world.geoms(name)) - state.position
        if not right and rng.random() < 0.3:  # beside, its side next to the goal
            way = rng.uniform(-3.1, 3.1)
            far = points[:, :2] @ [math.cos(way), math.sin(way)]
            x, y = x + far.max() * math.cos(way), y + far.max() * math.sin(way)
        spread = 0.002 if right else rng.choice([0.0, 0.002, 0.01, 0.03])
        at = np.array([x, y, z]) + rng.normal(0.0, spread, 3) * [1.0, 1.0, 0.0]
        over = rng.choice([-1e-4, -1e-4, 5e-4, 0.01])
        state.move((at[0], at[1], at[2] - points[:, 2].min() + over), quat)

    def _goals(self, name: str) -> tuple[list[Vector], Any]:
        """Return points to put a thing on, and how it lies there."""
        task, data, rest = self.task, self.data, (1.0, 0.0, 0.0, 0.0)
        goals: list[Any] = []
        config = task.config
        ground = getattr(config, "target", None) or config.table
        height = ground.center[2]
        if hasattr(task, "sorting"):
            goals = 4 * [(*task.goal(name), height)]
            goals += [(*task.goal(n), height) for n in task.sorting.active]
        kind = type(task).__name__
        if kind == "TwoArmTransport":
            goals = [
                np.add(data.body(b).xpos, (0.0, 0.0, config.bin.wall))
                for b in ("target_bin", "trash_bin")
            ]
            goals = 4 * [goals[name == "trash"]] + goals
            rest = (0.5, 0.5, 0.5, 0.5) if name == "payload" else rest
        if kind == "ToolHang":
            if name == "frame":
                tip = data.site("base_floor").xpos
                goals = 6 * [tip]
            else:
                goals = 4 * [data.site("frame_hook").xpos, data.site("frame_bend").xpos]
        others = [n for n in task.states if n != name]
        for other in others:
            points = self.world.points(self.world.geoms(other))
            if points[:, 2].max() > height - 0.1:
                top = np.array([*data.body(other).xpos[:2], points[:, 2].max()])
                goals += 3 * [top]
                goals.append(np.array([*data.body(other).xpos[:2], height]))
        where = np.array([*ground.center[:2], height])
        goals.append(where + self.rng.uniform(-0.15, 0.15, 3) * [1.0, 1.0, 0.0])
        return goals, rest

    def _reach_around(self) -> None:
        """Bring the hands near to goals; keep where the joints are then."""
        data, rng, task = self.data, self.rng, self.task
        home = data.qpos[self.world.at].copy()
        self._poses = [home]
        if type(task).__name__ in ("Door", "TwoArmPegInHole"):
            return
        goals = [g for n in self.free for g in self._goals(n)[0]]
        for _ in range(POSES):
            data.qpos[self.world.at] = home
            for hand in task.hands:
                goal = goals[int(rng.integers(len(goals)))]
                up = [0.0, 0.0, rng.choice([0.02, 0.05, 0.1, 0.2])]
                if self._share() > 0.5:
                    up[2] = rng.uniform(0.06, 0.3)
                self._bring(hand, goal + rng.normal(0.0, 0.02, 3) + up)
            self._poses.append(data.qpos[self.world.at].copy())
        data.qpos[self.world.at] = home

    def _bring(self, hand: Any, point: Vector) -> None:
        """Bring a hand, fingers down, near to a point by damped least squares."""
        model, data = self.model, self.data
        root = model.body_rootid[model.site_bodyid[hand.site]]
        mine = (model.body_rootid[model.dof_bodyid] == root) & np.isin(
            model.jnt_type[model.dof_jntid], (2, 3)
        )
        dofs = np.flatnonzero(mine)
        address = model.jnt_qposadr[model.dof_jntid[dofs]]
        low, high = model.jnt_range[model.dof_jntid[dofs]].T
        free = ~model.jnt_limited[model.dof_jntid[dofs]].astype(bool)
        low, high = np.where(free, -np.inf, low), np.where(free, np.inf, high)
        J, down = np.zeros((6, model.nv)), np.diag([1.0, -1.0, -1.0])
        turn = _rotation(np.array([0.0, 0.0, self.rng.uniform(-1.5, 1.5)])) @ down
        quat, error = np.empty(4), np.empty(6)
        for _ in range(25):
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            mujoco.mj_jacSite(model, data, J[:3], J[3:], hand.site)
            R = turn @ data.site_xmat[hand.site].reshape(3, 3).T
            mujoco.mju_mat2Quat(quat, np.ascontiguousarray(R).ravel())
            mujoco.mju_quat2Vel(error[3:], quat, 1.0)
            error[:3] = point - data.site_xpos[hand.site]
            own = J[:, dofs]
            step = own.T @ np.linalg.solve(own @ own.T + 3e-3 * np.eye(6), error)
            data.qpos[address] = np.clip(data.qpos[address] + step, low, high)


def _fingers(state: Any, side: str) -> list[tuple[str, float, float]]:
    """Return joints of a gripper, and their positions when it is open and closed."""
    ends: dict[str, Any] = {}
    for synergy in state.robot.synergies.get(f"{side}_gripper", ()):
        ends |= {j: (q, synergy.closed.get(j, q)) for j, q in synergy.open.items()}
    for joint in state.robot.joints:
        if joint.mimic is not None and joint.mimic.joint in ends:
            leader, ratio = ends[joint.mimic.joint], joint.mimic.ratio
            ends[joint.name] = tuple(ratio * q + joint.mimic.offset for q in leader)
    return [(state.prefix + joint, *pair) for joint, pair in ends.items()]


def _matrix(quat: Any) -> np.ndarray:
    R = np.empty(9)
    mujoco.mju_quat2Mat(R, np.asarray(quat, dtype=np.float64))
    return R.reshape(3, 3)


def _rotation(vector: Vector) -> np.ndarray:
    quat, angle = np.empty(4), float(np.linalg.norm(vector))
    mujoco.mju_axisAngle2Quat(quat, vector / max(angle, 1e-12), angle)
    return _matrix(quat)


def main() -> None:
    """Search in the benchmarks that the arguments name."""
    parser = options(__doc__, "60 tries of three benchmarks")
    parser.add_argument("benchmarks", nargs="*")
    parser.add_argument("--robots", nargs="+")
    parser.add_argument("--tries", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    report, tries = Report(), 60 if given.quick else given.tries
    names = given.benchmarks or (ALL[:3] if given.quick else ALL)
    for name in names:
        kinds = given.robots or (TWO if name.startswith("TwoArm") else ONE)
        for robots in kinds:
            search, begun = Search(name, robots, given.seed), time.process_time()
            with progress(f"{name} {robots}", tries // len(kinds)) as advance:
                for _ in range(tries // len(kinds)):
                    search.attempt()
                    advance(1)
            spent = time.process_time() - begun
            sides = Counter(one["side"] for one in search.found)
            row = {"case": name, "side": robots, "tries": tries // len(kinds)}
            row |= dict(search.counts) | {"done": search.done}
            row |= {f"false_{s}": sides[s] for s in ("success", "failure")}
            row |= {
                "ms": 1e3 * spent / (tries // len(kinds)),
                "found": search.found[:20],
            }
            report.rows.append(row)
            for one in search.found[:3]:
                print(name, robots, one["side"], one["margins"], flush=True)
            print({k: v for k, v in row.items() if k != "found"}, flush=True)
    columns = ("case", "side", "tries", "done", "undecided")
    report.show("False verdicts", (*columns, "false_success", "false_failure", "ms"))
    report.write(given.json)


if __name__ == "__main__":
    main()
