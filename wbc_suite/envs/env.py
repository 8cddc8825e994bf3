"""The environment: robots, controllers, a benchmark and physics behind Gymnasium."""

from typing import Any

import gymnasium
import mujoco
import numpy as np

from wbc_suite.benchmark import load_benchmark
from wbc_suite.control import (
    ActionLayout,
    CompositeController,
    RobotState,
    build_composite_controller,
    load_composite_controller_config,
)
from wbc_suite.envs.config import EnvConfig, NoiseConfig, parse_env_config
from wbc_suite.envs.simulation import Simulation
from wbc_suite.errors import ConfigError, PhysicsError, UnknownNameError
from wbc_suite.robot import RobotDescription, load_robot
from wbc_suite.scene import attach_robot, empty_arena, robot_prefix
from wbc_suite.sensing.proprioception import Proprioception
from wbc_suite.sensing.renderer import make_renderer
from wbc_suite.typing import Vector

__all__ = ["RobotEnv"]

Observation = dict[str, Vector]

_UNIT_KEYS = ("_quat", "_cos", "_sin")
_LARGEST = 1e4
"""Bound of positions and speeds, SI units: physics that goes beyond has diverged."""


class RobotEnv(gymnasium.Env[Observation, Vector]):
    """One benchmark with its robots.

    Args:
        benchmark: Name of the benchmark, such as `Lift`.
        arguments: See `EnvConfig`.

    Raises:
        UnknownNameError: If a benchmark, robot or controller is unknown.
        ConfigError: If an argument is wrong.

    Attributes:
        config: The arguments.
        benchmark: Scene, reward and success.
        robots: Descriptions, standing at their places.
        controllers: One composite controller per robot.
        action_layout: Slices of the action.
        simulation: Model, data and `tick`.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 20}

    def __init__(self, benchmark: str = "Lift", **arguments: Any) -> None:
        self.config: EnvConfig = parse_env_config(arguments)
        self._given = benchmark, dict(arguments)
        self.benchmark = load_benchmark(benchmark)
        self.render_mode = self.config.render_mode
        self.robots = self._place_robots()
        self.simulation = self._build()
        self.controllers = self.simulation.controllers
        self.action_layout = _joint_layout(self.controllers)
        layout = self.action_layout
        self.action_space = gymnasium.spaces.Box(
            layout.low.copy(), layout.high.copy(), dtype=np.float64
        )
        self._check_camera()
        self._senses = [Proprioception(state) for state in self.simulation.robots]
        self._substeps = self._count_substeps()
        self.metadata = {**self.metadata, "render_fps": round(self.config.control_freq)}
        self.horizon = self.config.horizon or self.benchmark.horizon
        self._renderer: mujoco.Renderer | None = None
        self._steps, self._broken = 0, ""
        self._start(np.random.default_rng(0))
        self._observation = self._observe()
        self.observation_space = self._observation_space()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode; the same seed gives the same episode.

        Raises:
            ConfigError: If the seed is no whole number from 0 on, or there are options;
                then nothing has changed.
        """
        if options:
            raise ConfigError(f"reset: there are no options, got {options!r:.60}.")
        super().reset(seed=_checked_seed(seed))
        self._start(self.np_random)
        self._observation = self._observe()
        return _copied(self._observation), self._info(0)

    def step(
        self, action: Any
    ) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Advance one control period.

        Raises:
            ActionError: If the action has a wrong shape or type, or is not finite; then
                nothing has changed.
            PhysicsError: If the last step ended in one and `reset` was not called.
        """
        vector, clipped = self.action_layout.clip(self.action_layout.check(action))
        if self._broken:
            raise PhysicsError(f"Call reset() first: {self._broken}")
        self._taken.append(vector)
        self._set_goals(vector)
        self._steps += 1
        try:
            self.simulation.tick(self._substeps)
        except PhysicsError as error:
            self._broken = str(error)
            info = {"physics_error": str(error), "clipped": clipped}
            info |= {"success": False, "is_success": False}
            return _copied(self._observation), 0.0, True, False, info
        self._observation = self._observe()
        reward = self.benchmark.reward(shaped=self.config.reward_shaping)
        info = self._info(clipped)
        terminated = self.config.terminate_on_success and info["success"]
        return (
            _copied(self._observation),
            reward * self.config.reward_scale,
            terminated,
            self._steps >= self.horizon,
            info,
        )

    @property
    def hold_action(self) -> Vector:
        """The action that keeps all present goals."""
        return np.concatenate([c.hold_action for c in self.controllers])

    def render(self) -> Any:
        """Return a picture, shape (height, width, 3), RGB."""
        if self.render_mode is None:
            raise ConfigError("render: make the environment with render_mode.")
        renderer = self._renderer
        if renderer is None:
            width, height = self.config.render_size
            renderer = make_renderer(self.simulation.model, width=width, height=height)
            self._renderer = renderer
        renderer.update_scene(self.simulation.data, camera=self.config.render_camera)
        return renderer.render()

    def close(self) -> None:
        """Free the renderer."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    def __getstate__(self) -> dict[str, Any]:
        """Return how to make this environment again, and what happened in it.

        Solvers cannot be copied, and an episode is determined by its start and its
        actions: a copy takes the same steps again, and goes on from there.
        """
        return {
            "made_of": self._given,
            "began_with": self._began_with,
            "taken": self._taken,
            "rng": self._np_random,
            "seed": self._np_random_seed,
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Make the environment and take its steps again."""
        benchmark, arguments = state["made_of"]
        RobotEnv.__init__(self, benchmark, **arguments)
        rng = np.random.default_rng(0)
        rng.bit_generator.state = state["began_with"]
        self._start(rng)
        self._observation = self._observe()
        for action in state["taken"]:
            self.step(action)
        self._np_random, self._np_random_seed = state["rng"], state["seed"]

    def _place_robots(self) -> tuple[RobotDescription, ...]:
        given = self.config.robot_list
        if not 1 <= len(given) <= self.benchmark.max_robots:
            raise ConfigError(
                f"{self.benchmark.name} has a place for {self.benchmark.max_robots} "
                f"robot(s), not {len(given)}."
            )
        robots = [self._load(robot) for robot in given]
        return tuple(self.benchmark.place(r, i) for i, r in enumerate(robots))

    def _load(self, robot: Any) -> RobotDescription:
        if isinstance(robot, RobotDescription):
            return robot
        gripper, base = self.config.gripper_types, self.config.base_types
        return load_robot(
            robot,
            gripper=None if gripper == "default" else gripper,
            base=None if base == "default" else base,
            skin=self.config.skin,
        )

    def _build(self) -> Simulation:
        spec = empty_arena()
        self.benchmark.build(spec)
        for i, robot in enumerate(self.robots):
            attach_robot(spec, robot, robot_prefix(i))
        model = spec.compile()
        data = mujoco.MjData(model)
        states = [
            RobotState(model, data, robot, prefix=robot_prefix(i))
            for i, robot in enumerate(self.robots)
        ]
        self.benchmark.bind(model, data, states)
        for state in states:
            _set_posture(state, state.robot.keyframe("ready"))
        mujoco.mj_forward(model, data)
        pairs = [
            (
                state,
                build_composite_controller(
                    load_composite_controller_config(given, state.robot), state
                ),
            )
            for state, given in zip(states, self.config.controller_list, strict=True)
        ]
        return Simulation(model, data, pairs)

    def _check_camera(self) -> None:
        model = self.simulation.model
        known = [model.camera(i).name for i in range(model.ncam)]
        if self.config.render_mode and self.config.render_camera not in known:
            raise UnknownNameError("camera", self.config.render_camera, known)

    def _count_substeps(self) -> int:
        period = 1.0 / (self.config.control_freq * self.simulation.timestep)
        count = round(period)
        if count < 1 or abs(period - count) > 1e-6:
            raise ConfigError(
                f"control_freq {self.config.control_freq:g} must divide "
                f"{1.0 / self.simulation.timestep:g}, the physics steps per second."
            )
        return count

    def _start(self, rng: np.random.Generator) -> None:
        """Put robots, objects and controllers at the start of an episode."""
        self._began_with = rng.bit_generator.state
        self._taken: list[Vector] = []
        simulation = self.simulation
        mujoco.mj_resetData(simulation.model, simulation.data)
        for state in simulation.robots:
            posture = state.robot.keyframe("ready")
            _set_posture(state, _noisy(posture, state.robot, self.config, rng))
        self.benchmark.reset(rng)
        simulation.forward()
        for state, controller in zip(
            simulation.robots, simulation.controllers, strict=True
        ):
            controller.reset(state)
        self._steps, self._broken = 0, ""

    def _set_goals(self, action: Vector) -> None:
        start = 0
        for controller in self.controllers:
            stop = start + controller.layout.size
            controller.set_goal(action[start:stop])
            start = stop

    def _observe(self) -> Observation:
        observation: Observation = {}
        for sense in self._senses:
            observation |= sense.observe()
        if self.config.use_object_obs:
            objects = self.benchmark.observe()
            observation |= objects
            observation["object-state"] = np.concatenate(list(objects.values()))
        for key, value in observation.items():
            if key.endswith(_UNIT_KEYS):  # rounding makes 1 + 2e-16 of a unit vector
                value.clip(-1.0, 1.0, out=value)
        return observation

    def _observation_space(self) -> gymnasium.Space[Any]:
        return gymnasium.spaces.Dict(
            {
                key: gymnasium.spaces.Box(-bound, bound, value.shape, np.float64)
                for key, value in self._observation.items()
                for bound in (1.0 if key.endswith(_UNIT_KEYS) else _LARGEST,)
            }
        )

    def _info(self, clipped: int) -> dict[str, Any]:
        success = self.benchmark.success()
        info: dict[str, Any] = {"success": success, "is_success": success}
        info["clipped"] = clipped
        for state, controller in zip(
            self.simulation.robots, self.controllers, strict=True
        ):
            prefix = state.prefix if len(self.controllers) > 1 else ""
            info |= {prefix + k: v for k, v in controller.info(state).items()}
        return info


def _joint_layout(controllers: tuple[CompositeController, ...]) -> ActionLayout:
    """Return one layout; with several robots names carry the robot's prefix."""
    if len(controllers) == 1:
        return controllers[0].layout
    return ActionLayout(
        part.prefixed(robot_prefix(i))
        for i, controller in enumerate(controllers)
        for part in controller.layout.slices
    )


def _set_posture(state: RobotState, posture: dict[str, float]) -> None:
    """Write joint positions, and the root's pose, into the simulation."""
    data, robot = state.data, state.robot
    q, _ = state.joint_addresses(tuple(posture))
    data.qpos[q] = list(posture.values())
    if robot.root.kind == "free":
        start = state.model.joint(state.prefix + "root").qposadr[0]
        data.qpos[start : start + 7] = (*robot.root.pos, *robot.root.quat)
    for name in robot.root_joint_names if robot.root.kind == "planar" else ():
        data.qpos[state.model.joint(state.prefix + name).qposadr[0]] = 0.0


def _noisy(
    posture: dict[str, float],
    robot: RobotDescription,
    config: EnvConfig,
    rng: np.random.Generator,
) -> dict[str, float]:
    """Return the posture with noise on the arms' joints, inside their ranges."""
    noise = config.initialization_noise
    if noise is None:
        return posture
    if noise == "default":
        noise = NoiseConfig()
    moved = dict(posture)
    for group, joints in robot.groups.items():
        if not group.endswith("arm"):
            continue
        for name in joints:
            draw = rng.normal() if noise.type == "gaussian" else rng.uniform(-1.0, 1.0)
            low, high = robot.joint(name).range or (-np.inf, np.inf)
            value = moved[name] + noise.magnitude * draw
            moved[name] = float(np.clip(value, low, high))
    return moved


def _checked_seed(seed: object) -> int | None:
    if seed is None:
        return None
    if not isinstance(seed, int | np.integer) or isinstance(seed, bool) or seed < 0:
        raise ConfigError(f"reset: a seed is a whole number from 0 on, not {seed!r}.")
    return int(seed)


def _copied(observation: Observation) -> Observation:
    return {key: value.copy() for key, value in observation.items()}
