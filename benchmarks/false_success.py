"""Search for false successes: episodes that succeed although the task is not done.

Each try is a short episode of random moves: of a thing (thrown at a goal, brought near
it by a force that holds it and lets go, pushed) and of the robots (still, struck at
things, at random, or as their expert moves up to some step). Forces move things, so
physics holds. Half of the tries vary one that came close, as measured by the shaped
reward of its episode. At a success a check looks whether the task was done, see
`harness/task_checks.py`.

Usage: python benchmarks/false_success.py [BENCHMARK ...] [--tries 10000] [--seed 0]
    [--quick] [--json FILE]
"""

import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
import pinocchio as pin
from harness.report import Report, options
from harness.task_checks import CHECKS, Check

import wbc_suite
from wbc_suite.benchmark import Door, TwoArmPegInHole, Wipe
from wbc_suite.cli.options import progress
from wbc_suite.envs import RobotEnv
from wbc_suite.errors import PhysicsError
from wbc_suite.evaluation import make_policy
from wbc_suite.experts import ExpertScene
from wbc_suite.typing import Vector

ALL = (
    *("Lift", "Stack", "Door", "Wipe", "ToolHang"),
    *("NutAssembly", "NutAssemblySingle", "NutAssemblySquare", "NutAssemblyRound"),
    *("PickPlace", "PickPlaceSingle", "PickPlaceMilk", "PickPlaceBread"),
    *("PickPlaceCereal", "PickPlaceCan"),
    *("TwoArmLift", "TwoArmPegInHole", "TwoArmHandover", "TwoArmTransport"),
)
MOVES = ("throw", "throw", "carry", "carry", "push", "none")
ROBOTS = ("hold", "strike", "strike", "random", "expert", "expert")
STEPS = 30  # actions after the expert's
ALONE = 5  # actions without a force of the search, which may hold what cannot stay
SCENES = 5  # seeds whose experts are recorded
ELITE, MUTATED, SPREAD = 30, 0.5, 0.12
GRAVITY = np.array([0.0, 0.0, -9.81])


@dataclass(frozen=True, kw_only=True)
class Attack:
    """One try; `numbers` in [0, 1] say what its moves do."""

    scene: int
    move: str
    robot: str
    numbers: Vector


class Draw:
    """Hands out the numbers of an attack, in order, in ranges."""

    def __init__(self, numbers: Vector) -> None:
        self._left = iter(numbers.tolist())

    def real(self, low: float, high: float) -> float:
        """Return a number between two."""
        return low + (high - low) * next(self._left)

    def vector(self, most: float) -> Vector:
        """Return three numbers up to a size."""
        return np.array([self.real(-most, most) for _ in range(3)])

    def whole(self, count: int) -> int:
        """Return a whole number below a count."""
        return min(int(self.real(0, count)), count - 1)


class Search:
    """Tries to cheat one benchmark."""

    def __init__(self, name: str, seed: int) -> None:
        self.env = wbc_suite.make(name, reward_shaping=True, horizon=100_000)
        self.benchmark: Any = self.env.benchmark
        self.data, self.model = self.env.simulation.data, self.env.simulation.model
        self._rng, self._elite = np.random.default_rng(seed), list[Any]()
        self._experts: list[list[Vector]] = []
        self.found: list[dict[str, Any]] = []
        self.tries = self.done = self._free = 0

    def recorded(self) -> list[list[Vector]]:
        """Return the actions of experts up to their success, by scene."""
        if not self._experts:
            self._experts = [_recorded(self.env, scene) for scene in range(SCENES)]
        return self._experts

    def check(self) -> Check:
        """Return a check of the present episode."""
        kinds = type(self.benchmark).__mro__
        return next(CHECKS[kind] for kind in kinds if kind in CHECKS)(self.env)

    def attempt(self) -> Attack:
        """Make one try, and keep it if it came near."""
        attack = self._draw()
        self.tries += 1
        nearest, found = 0.0, None
        with suppress(PhysicsError):  # physics that broke ends a try
            for reward, found in self.run(attack):
                nearest = max(nearest, reward * (found is None))
        if found == "":
            self.done += 1
        elif found is not None:
            self.found.append(
                asdict(attack) | {"numbers": attack.numbers.tolist(), "why": found}
            )
        self._elite.append((nearest, self.tries, attack))
        self._elite = sorted(self._elite, key=lambda one: one[:2])[-ELITE:]
        return attack

    def _draw(self) -> Attack:
        """Draw a new try, or change one of the nearest."""
        rng = self._rng
        if self._elite and rng.random() < MUTATED:
            old = self._elite[int(rng.integers(len(self._elite)))][-1]
            noise = rng.normal(0.0, SPREAD, old.numbers.size)
            noise *= rng.random(noise.size) < 0.5
            return replace(old, numbers=np.clip(old.numbers + noise, 0.0, 0.999))
        robot = str(rng.choice(ROBOTS))
        return Attack(
            scene=int(rng.integers(SCENES if robot == "expert" else 1_000_000)),
            move=str(rng.choice(MOVES)),
            robot=robot,
            numbers=rng.random(64),
        )

    def run(self, attack: Attack) -> Iterator[tuple[float, str | None]]:
        """Yield reward and verdict after each action; the latter ends a try.

        The verdict is None without a success, "" for one that is deserved, or else
        what is wrong with it.
        """
        env, draw, actions = self.env, Draw(attack.numbers), list[Vector]()
        if attack.robot == "expert":
            actions = self.recorded()[attack.scene]
            actions = actions[: draw.whole(len(actions))]
        env.begin(attack.scene)
        check, self._free = self.check(), 0
        for action in actions:
            yield self._advance(check, action)
        cell = ExpertScene(env, self.benchmark, np.random.default_rng(0))
        act = self._robot(attack.robot, draw, cell)
        move = self._move(attack.move, draw, cell)
        for k in range(STEPS):
            self.data.xfrc_applied[:] = 0.0
            move(k)
            reward, found = self._advance(check, act(k))
            yield reward, found
            if found is not None:
                return

    def _advance(self, check: Check, action: Vector) -> tuple[float, str | None]:
        reward, _, _, info = self.env.advance(action)
        if "physics_error" in info:
            raise PhysicsError(info["physics_error"])
        wrong = check.after_step()
        self._free = 0 if self.data.xfrc_applied.any() else self._free + 1
        if wrong is None and info["success"] and self._free > ALONE:
            wrong = check.fault() or ""
        return reward, wrong

    def _bodies(self) -> list[int]:
        """Return the bodies that are thrown and pushed."""
        benchmark = self.benchmark
        if isinstance(benchmark, Door):
            return [self.model.body(f"door_{part}").id for part in ("panel", "handle")]
        if isinstance(benchmark, Wipe | TwoArmPegInHole):
            hands = [hand.site for hand in benchmark.hands]
            return [int(self.model.site_bodyid[site]) for site in hands]
        names = benchmark.states
        if hasattr(benchmark, "sorting"):
            names = benchmark.sorting.active
        states = [benchmark.states[name] for name in names]
        return [state.body for state in states if state.is_free]

    def _goals(self, cell: ExpertScene[Any]) -> list[Vector]:
        """Return points to throw things at: goals, things and hands."""
        model, data = self.model, self.data
        if hasattr(self.benchmark, "sorting"):
            config = self.benchmark.config
            ground = getattr(config, "target", None) or config.table
            over = ground.center[2] + 0.03
            goals = map(self.benchmark.goal, self.benchmark.sorting.active)
            points = [np.array([*goal, over]) for goal in goals] * 3
        else:
            sites = [k for k in range(model.nsite) if "robot" not in model.site(k).name]
            points = [data.site_xpos[k].copy() for k in sites]
        points += [data.xipos[s.body].copy() for s in cell.benchmark.states.values()]
        return points + [arm.pose.translation for arm in cell.arms]

    def _move(
        self, kind: str, draw: Draw, cell: ExpertScene[Any]
    ) -> Callable[[int], None]:
        """Return what sets the forces on a body before action k."""
        bodies, goals = self._bodies(), self._goals(cell)
        body, goal = bodies[draw.whole(len(bodies))], goals[draw.whole(len(goals))]
        start, goal = draw.whole(8), goal + draw.vector(0.06)
        mass = self.model.body_subtreemass[body].item()
        X, period = self.data.ximat[body].reshape(3, 3), cell.period
        spin, time_ = draw.vector(12.0), draw.real(0.1, 0.6)
        push, twist = draw.vector(1.0), draw.vector(1.0)
        R = pin.exp3(draw.vector(3.0))
        force = self.data.xfrc_applied[body]

        def reach(v: Vector, w: Vector, most: float) -> None:
            """Give the body a velocity within one action."""
            now = self.data.cvel[body]
            speed = now[3:] + np.cross(now[:3], self.data.xipos[body] - self._com(body))
            pull = mass * ((v - speed) / period - GRAVITY)
            force[:3] = pull * min(1.0, most / max(float(np.linalg.norm(pull)), 1e-9))
            inertia = X @ np.diag(self.model.body_inertia[body]) @ X.T
            force[3:] = inertia @ (w - now[:3]) / period

        def throw(k: int) -> None:
            if k == start:
                way = goal - self.data.xipos[body]
                reach(way / time_ - 0.5 * GRAVITY * time_, spin, 1000.0 * mass)

        def carry(k: int) -> None:
            left = 12 + start - k
            if left > 0:
                turn = pin.log3(R @ self.data.xmat[body].reshape(3, 3).T)
                over = goal + max(0, left - 5) * np.array([0.0, 0.0, 0.03])
                pace = period * max(1, left - 4)
                reach((over - self.data.xipos[body]) / pace, turn / pace, 100.0 * mass)

        def shove(k: int) -> None:
            if start <= k < start + 2 + 30 * (time_ - 0.1):
                force[:3] = push * max(10.0 * mass * 9.81, 60.0 * (mass > 0.5))
                force[3:] = twist * max(0.1, 4.0 * mass)

        return {"throw": throw, "carry": carry, "push": shove}.get(kind, lambda k: None)

    def _com(self, body: int) -> Vector:
        return self.data.subtree_com[self.model.body_rootid[body]]

    def _robot(
        self, kind: str, draw: Draw, cell: ExpertScene[Any]
    ) -> Callable[[int], Vector]:
        """Return what gives action k."""
        env, arms = self.env, cell.arms
        closing = [draw.whole(2 * STEPS) for _ in arms]
        opening = [draw.whole(2 * STEPS) for _ in arms]
        bodies = self._bodies()
        aims = []
        for arm in arms:
            at = self.data.xipos[bodies[draw.whole(len(bodies))]]
            turn = pin.exp3(draw.vector(0.8)) @ arm.pose.rotation
            first = pin.SE3(turn, at + draw.vector(0.06))
            second = pin.SE3(turn, first.translation + draw.vector(0.3))
            aims.append((first, second, draw.real(0.2, 3.0), draw.whole(STEPS)))
        low, high = env.action_space.low, env.action_space.high
        scale = draw.real(0.1, 1.0)
        rng = np.random.default_rng(int(draw.real(0, 1e9)))
        noise = [rng.uniform(-scale, scale, low.size) for _ in range(1 + STEPS // 5)]

        def act(k: int) -> Vector:
            for n, arm in enumerate(arms):
                if k == closing[n]:
                    arm.close()
                elif k == opening[n]:
                    arm.open()
                if kind == "strike":
                    first, second, speed, then = aims[n]
                    arm.aim(first if k < then else second, speed=speed, turn=6.0)
            action = cell.action()
            if kind == "random":
                action = np.clip(action + noise[k // 5], low, high)
            return action

        return act


def _recorded(env: RobotEnv, seed: int) -> list[Vector]:
    """Return the actions of an expert up to its success."""
    env.begin(seed)
    policy, actions = make_policy("expert", env, seed), list[Vector]()
    for _ in range(800):
        actions.append(np.array(policy(env.observation())))
        if env.advance(actions[-1])[-1]["success"]:
            break
    return actions


def main() -> None:
    """Search in the benchmarks that the arguments name."""
    parser = options(__doc__, "40 tries of four benchmarks")
    parser.add_argument("benchmarks", nargs="*")
    parser.add_argument("--tries", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    report, tries = Report(), 40 if given.quick else given.tries
    names = given.benchmarks or (ALL[:4] if given.quick else ALL)
    with progress("Tries", tries * len(names)) as advance:
        for name in names:
            begun, search = time.monotonic(), Search(name, given.seed)
            for _ in range(tries):
                search.attempt()
                advance(1)
            row = {"case": name, "side": "", "tries": tries, "done": search.done}
            row |= {"false": len(search.found), "found": search.found[:50]}
            report.rows.append(row | {"minutes": (time.monotonic() - begun) / 60})
            reasons = {one["why"] for one in search.found}
            print(f"{name}: {len(search.found)} false of {tries}", *reasons, flush=True)
    columns = ("case", "side", "tries", "done", "false", "minutes")
    report.show("False successes", columns)
    report.write(given.json)


if __name__ == "__main__":
    main()
