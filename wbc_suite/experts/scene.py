"""What an expert sees and moves: arms, objects, and the action of both."""

import itertools
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from types import MappingProxyType
from typing import Any, Generic, TypeAlias, TypeVar

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.benchmark import ObjectBenchmark
from wbc_suite.control import RobotState
from wbc_suite.control.composite import WholeBodyID
from wbc_suite.devices.action_ports import LimbKind, LimbPort, limb_ports
from wbc_suite.envs import RobotEnv
from wbc_suite.errors import ConfigError
from wbc_suite.experts.arm import Arm
from wbc_suite.experts.mobile_base import MobileBase, mobile_base
from wbc_suite.experts.walker import Walker, walker_of
from wbc_suite.scene.objects import ObjectState
from wbc_suite.scene.objects.grasp_site import GraspSite
from wbc_suite.sensing.hands import Hand, pairs_in_contact
from wbc_suite.typing import Vector

NONE: Mapping[str, float] = MappingProxyType({})
T = TypeVar("T")
B = TypeVar("B", bound=ObjectBenchmark)
Steps: TypeAlias = Generator[None, None, T]
"""A skill: it yields once in each control period, and returns what came of it."""


class ExpertScene(Generic[B]):
    """The arms and objects of an environment that was reset.

    Attributes:
        benchmark: The environment's benchmark.
        arms: One for each hand of the benchmark that the action moves.
        walker: What walks a robot on its feet; None for other robots.
        rng: Generator of the episode.

    Raises:
        ConfigError: If the action has neither the pose of a hand nor a walk.
    """

    def __init__(self, env: RobotEnv, benchmark: B, rng: np.random.Generator) -> None:
        self._env, self.benchmark, self.rng = env, benchmark, rng
        self.model, self.data = env.simulation.model, env.simulation.data
        self._copy = mujoco.MjData(self.model)
        free = [g for s in benchmark.states.values() if s.is_free for g in s.geoms]
        self._is_thing = np.zeros(self.model.ngeom, dtype=bool)
        self._is_thing[free] = True
        self._objects = dict(benchmark.states)
        self.period = 1.0 / env.config.control_freq
        ports = [*limb_ports(env).values()]
        self.arms = tuple(self._arms([p for p in ports if p.kind is LimbKind.POSE]))
        self._bases = {
            prefix: mobile_base(env, state, self._between_hands(state))
            for prefix, state in {a.state.prefix: a.state for a in self.arms}.items()
        }
        self.walker: Walker | None = walker_of(
            env, getattr(benchmark, "standing", None)
        )
        if not self.arms and self.walker is None:
            names = ", ".join(s.name for s in env.action_layout.slices)
            raise ConfigError(
                f"An expert needs a controller of hand poses, such as OSC_POSE; this "
                f"action has {names}."
            )

    def action(self) -> Vector:
        """Return the action of the next control period."""
        action = self._env.hold_action
        for arm in self.arms:
            arm.write(action, self.period)
        for base in filter(None, (self.walker, *self._bases.values())):
            base.write(action)
        return action

    def base(self, state: RobotState) -> MobileBase | None:
        """Return the base of a robot, if it drives in any direction."""
        return self._bases[state.prefix]

    def object(self, name: str) -> ObjectState:
        """Return the state of an object, or of a body attached to one."""
        if name not in self._objects:
            self._objects[name] = ObjectState(self.model, self.data, name)
        return self._objects[name]

    def pose(self, name: str) -> pin.SE3:
        """Return the pose T_wo of an object."""
        state = self.object(name)
        return pin.SE3(state.rotation.copy(), state.position.copy())

    def point(self, site: str) -> Vector:
        """Return the position of a site in the world, m."""
        return self.data.site_xpos[self.model.site(site).id].copy()

    def speed(self, name: str) -> float:
        """Return the speed of an object, m/s, with 0.05 m/s for each rad/s."""
        v = np.zeros(6)
        mujoco.mj_objectVelocity(
            self.model,
            self.data,
            mujoco.mjtObj.mjOBJ_BODY,
            self.object(name).body,
            v,
            0,
        )
        return float(np.linalg.norm(v[3:]) + 0.05 * np.linalg.norm(v[:3]))

    def grasps(self, name: str) -> Sequence[GraspSite]:
        """Return where and how hands can hold an object."""
        return self.benchmark.grasps[name]

    def bottom(self, name: str) -> float:
        """Return the height of the lowest point of an object, m."""
        state = self.object(name)
        geoms = [g for g in state.geoms if self.model.geom_bodyid[g] == state.body]
        rows = self.data.geom_xmat[geoms].reshape(-1, 3, 3)[:, 2]
        middle = self.data.geom_xpos[geoms, 2]
        middle = middle + np.sum(rows * self.model.geom_aabb[geoms, :3], axis=1)
        half = np.sum(np.abs(rows) * self.model.geom_aabb[geoms, 3:], axis=1)
        return float((middle - half).min(initial=np.inf))

    def holds(self, arm: Arm, name: str) -> bool:
        """Whether the fingers of an arm touch an object from two sides."""
        return arm.hand.grasps(self.object(name).geoms)

    def touching(self, name: str, other: str) -> bool:
        """Whether two objects touch."""
        return self.benchmark.scene.touching(name, other)

    def overlap(
        self,
        arm: Arm,
        q: Vector,
        *,
        but: str,
        fingers: Mapping[str, float] = NONE,
        along: Vector | None = None,
        beside: float = 0.0,
    ) -> float:
        """Return how deep a robot at a configuration is in anything but an object, m.

        Contacts that there are already do not count.

        Args:
            arm: An arm of the robot.
            q: The configuration.
            but: The object.
            fingers: Joints of the gripper that are elsewhere than now.
            along: Unit vector in the world, if only depth along it counts.
            beside: By how much the robot may miss its way, m: things that can move
                count as if they were larger by it.
        """
        data, state = self._copy, arm.state
        data.qpos[:] = self.data.qpos
        state.conversion.q_to_mujoco(q, data.qpos)
        for joint, value in fingers.items():
            data.joint(state.prefix + joint).qpos = value
        mujoco.mj_kinematics(self.model, data)
        with contacts_within(self.model, beside) if beside else nullcontext():
            mujoco.mj_collision(self.model, data)
        present = {(a, b) for a, b in pairs_in_contact(self.data)}
        moves = self._is_thing[data.contact.geom].any(axis=1)
        depths = beside * moves - data.contact.dist
        if along is not None:
            depths = depths * np.abs(data.contact.frame[:, :3] @ along)
        object_geoms, deepest = self.object(but).geoms, 0.0
        for (a, b), depth in zip(pairs_in_contact(data), depths.tolist(), strict=True):
            own = self._is_of(state, a) == self._is_of(state, b)
            if not own and (a, b) not in present and not {a, b} & {*object_geoms}:
                deepest = max(deepest, depth)
        return deepest

    def _is_of(self, state: RobotState, geom: int) -> bool:
        body = self.model.geom_bodyid[geom]
        return self.model.body(body).name.startswith(state.prefix)

    def _between_hands(self, state: RobotState) -> Vector:
        """Return the middle of a robot's hands at the start, in the world, m."""
        own = [arm.home.translation for arm in self.arms if arm.state is state]
        return np.mean(own, axis=0)

    def _arms(self, ports: Sequence[LimbPort]) -> list[Arm]:
        hands = iter(self.benchmark.hands)
        arms = []
        for state, controller in self._env.simulation.pairs:
            for _ in state.robot.hands:
                hand = next(hands)
                port = next((p for p in ports if self._carries(p, hand)), None)
                if port is None:
                    continue
                arms.append(
                    Arm(
                        port,
                        hand,
                        state,
                        layout=self._env.action_layout,
                        several=len(self._env.robots) > 1,
                        joints=_joints(state, controller, hand),
                    )
                )
        for arm, other in itertools.permutations(arms, 2):
            arm.coupled |= arm.shares_joints(other)
        return arms

    def _carries(self, port: LimbPort, hand: Hand) -> bool:
        """Whether the frame of a port is rigidly fixed to a hand."""
        weld = self.model.body_weldid
        body = self.model.site_bodyid[hand.site]
        return port.body >= 0 and weld[port.body] == weld[body]


def _joints(state: RobotState, controller: object, hand: Hand) -> tuple[str, ...]:
    """Return the joints that a controller moves a hand by.

    What a robot on its feet keeps upright stays where the controller holds it.
    """
    parts = getattr(controller, "parts", None)
    if parts is None:
        free = state.robot.root.kind == "free"
        held = {*(state.robot.root_joint_names if free else ())}
        if isinstance(controller, WholeBodyID):
            for link in controller.config.upright:
                held.update(_joints_of(state, link.frame))
        return tuple(x for x in _joints_of(state, hand.frame) if x not in held)
    part = parts.get(hand.name) or next(iter(parts.values()))
    return part.law.joints


def _joints_of(state: RobotState, frame: str) -> list[str]:
    """Return the joints from the root to a frame."""
    model = state.robot.to_pinocchio()
    chain = model.supports[model.frames[model.getFrameId(frame)].parentJoint]
    return [model.names[joint] for joint in chain.tolist()[1:]]


@contextmanager
def contacts_within(model: mujoco.MjModel, distance: float) -> Iterator[None]:
    """Let collision detection find what is nearer than a distance, m, in the block."""
    option: Any = model.opt
    flags, margin = option.enableflags, option.o_margin
    option.enableflags = flags | mujoco.mjtEnableBit.mjENBL_OVERRIDE
    option.o_margin = distance
    try:
        yield
    finally:
        option.enableflags, option.o_margin = flags, margin


def together(*skills: Steps[T]) -> Steps[list[T]]:
    """Run skills of several arms at the same time; return their results in order."""
    results: dict[int, T] = {}
    running = dict(enumerate(skills))
    while running:
        for k, skill in list(running.items()):
            try:
                next(skill)
            except StopIteration as end:
                results[k] = end.value
                del running[k]
        if running:
            yield
    return [results[k] for k in range(len(skills))]


def wait_until(condition: Callable[[], bool], *, most: int) -> Steps[bool]:
    """Wait for a condition, for a number of control periods at most."""
    for _ in range(most):
        if condition():
            return True
        yield
    return condition()
