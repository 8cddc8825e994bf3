"""The environment: robots, controllers, a benchmark and physics behind Gymnasium."""

import copy
from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import gymnasium
import mujoco
import numpy as np
from numpy.typing import ArrayLike

from wbc_suite.benchmark import Benchmark, load_benchmark
from wbc_suite.control import ActionLayout, CompositeController
from wbc_suite.envs.building import (
    compose,
    make_observables,
    place_robots,
    simulate,
    take_sampler,
)
from wbc_suite.envs.config import EnvConfig, parse_env_config
from wbc_suite.envs.display import Display
from wbc_suite.envs.states import EnvState, write_physics, write_scene
from wbc_suite.errors import ConfigError, PhysicsError
from wbc_suite.scene import robot_prefix
from wbc_suite.sensing.cameras import Cameras
from wbc_suite.sensing.observer import Observer
from wbc_suite.sensing.projection import camera_id
from wbc_suite.typing import Vector

__all__ = ["RobotEnv", "checked_seed"]

Observation = dict[str, Any]


class RobotEnv(gymnasium.Env[Observation, Any]):
    """One benchmark with its robots.

    Args:
        benchmark: Name of the benchmark, such as `Lift`; or see `load_benchmark`.
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
        observables: What is seen but pictures; changes, adds and leaves out.
        cameras: Pictures of the scene, and where points are in them.
        latency: Physics steps from a step's beginning until its action counts; may be
            several control periods.
    """

    metadata = {
        "render_modes": ["human", "rgb_array", "depth_array"],
        "render_fps": 20,
    }

    def __init__(
        self,
        benchmark: str | Path | Callable[[], Benchmark] = "Lift",
        **arguments: Any,
    ) -> None:
        self._given = benchmark, dict(arguments)
        self.benchmark = load_benchmark(benchmark)
        robots = list(self.benchmark.robots)
        self.config: EnvConfig = parse_env_config({"robots": robots, **arguments})
        take_sampler(self.benchmark, self.config)
        self.render_mode = self.config.render_mode
        self.robots = place_robots(self.benchmark, self.config)
        self.simulation, self._postures = simulate(
            self.benchmark, self.robots, self.config
        )
        self.controllers = self.simulation.controllers
        self._driven = [
            (state.prefix if len(self.controllers) > 1 else "", controller, state)
            for controller, state in zip(
                self.controllers, self.simulation.robots, strict=True
            )
        ]
        self.action_layout = _joint_layout(self.controllers)
        self.action_space = _action_space(self.action_layout)
        self._period = 1.0 / self.config.control_freq
        self.observables = make_observables(
            self.benchmark, self.simulation, self.config
        )
        self.cameras, self._display = self._make_cameras()
        self._spaces: tuple[Observer, gymnasium.spaces.Dict] | None = None
        self._substeps = self._count_substeps()
        self.metadata = {**self.metadata, "render_fps": round(self.config.control_freq)}
        self.horizon = self.config.horizon or self.benchmark.horizon
        self._steps, self._broken, self.latency = 0, "", 0
        given = self.config.randomisation
        self._randomiser = None if given is None else given.bind(self)
        self._start(np.random.default_rng(0))

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
        info = self.begin(seed)
        if self.render_mode == "human":
            self.render()
        return self.observation(), info

    def step(
        self, action: Any
    ) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Advance one control period.

        Raises:
            ActionError: If the action has a wrong shape or type, or is not finite; then
                nothing has changed.
            PhysicsError: If the last step ended in one and `reset` was not called.
        """
        reward, terminated, truncated, info = self.advance(action)
        if self.render_mode == "human":
            self.render()
        return self.observation(), reward, terminated, truncated, info

    def begin(self, seed: int | None = None) -> dict[str, Any]:
        """Do what `reset` does, but leave what is seen in `observer`."""
        super().reset(seed=checked_seed(seed))
        self._start(self.np_random)
        return self._info(0, self.benchmark.success())

    def advance(self, action: Any) -> tuple[float, bool, bool, dict[str, Any]]:
        """Do what `step` does, but leave what is seen in `observer`."""
        vector, clipped = self.action_layout.take(action)
        if self._broken:
            raise PhysicsError(f"Call reset() first: {self._broken}")
        self._taken.append(vector)
        self._steps += 1
        try:
            self._drive(vector)
        except PhysicsError as error:
            self._broken = str(error)
            info = {"physics_error": str(error), "clipped": clipped}
            info |= {"success": False, "is_success": False}
            return 0.0, True, False, info
        self.benchmark.watch()
        self.observables.look()
        success = self.benchmark.success()
        shaped = self.config.reward_shaping
        reward = self.benchmark.reward(shaped=shaped, success=success)
        info = self._info(clipped, success)
        terminated = self.config.terminate_on_success and success
        truncated = self._steps >= self.horizon
        return reward * self.config.reward_scale, terminated, truncated, info

    def observation(self) -> Observation:
        """Return what is seen now; after a physics error pictures are black."""
        seen: Observation = self.observer.observation()
        pictures = self.cameras
        seen |= pictures.black() if self._broken else pictures.observation()
        return seen

    @property
    def observer(self) -> Observer:
        """What was seen last, and its places in one vector."""
        return self.observables.observer

    @property
    def observation_space(self) -> gymnasium.spaces.Dict:  # pyright: ignore[reportIncompatibleVariableOverride] - it changes with what is observed
        """What can be seen, by key."""
        if self._spaces is None or self._spaces[0] is not self.observer:
            spaces = {**self.observer.space.spaces, **self.cameras.space}
            self._spaces = self.observer, gymnasium.spaces.Dict(spaces)
        return self._spaces[1]

    @property
    def hold_action(self) -> Vector:
        """The action that keeps all present goals."""
        return np.concatenate([c.hold_action for c in self.controllers])

    def render(self) -> Any:
        """Return a picture, as `render_mode` says; see `Display.render`.

        Mode `human` shows every step by itself, on a page whose address is logged.
        """
        return self._display.render()

    def close(self) -> None:
        """Free what draws; a next picture makes it anew."""
        self.cameras.close()
        self._display.close()

    def get_state(self) -> EnvState:
        """Return the episode up to now, to go on from with `set_state`."""
        return EnvState(
            began_with=self._began_with,
            placed=self._placed,
            taken=tuple(self._taken),
            observables=copy.deepcopy(self.observables.state()),
            rng=copy.deepcopy(self._np_random),
            seed=self._np_random_seed,
        )

    def set_state(self, state: EnvState) -> Observation:
        """Take the steps of an episode again, and go on from there, bit by bit.

        The environment must be made as the one that the state is from. What was written
        into its simulation by hand is not in the state.
        """
        self.begin_at(state.began_with, state.placed)
        for action in state.taken:
            self.advance(action)
        self.observables.restore(copy.deepcopy(state.observables))
        self._np_random, self._np_random_seed = copy.deepcopy(state.rng), state.seed
        return self.observation()

    def reset_to(self, physics: ArrayLike) -> Observation:
        """Start an episode at a physics state: time, qpos, qvel in one vector.

        All else is drawn as at a reset: sizes of objects are not those of the episode
        that the state is from, unless the random generator is.

        Raises:
            ConfigError: If its size is wrong, or a value is not finite.
        """
        self._start(self.np_random, np.array(physics, dtype=np.float64))
        return self.observation()

    def begin_at(
        self, began_with: Mapping[str, Any], placed: ArrayLike | None = None
    ) -> None:
        """Start an episode as another one started; see `beginning`."""
        rng = np.random.default_rng(0)
        rng.bit_generator.state = dict(began_with)
        self._start(rng, None if placed is None else np.array(placed, dtype=np.float64))

    @property
    def beginning(self) -> tuple[Mapping[str, Any], Vector | None]:
        """What the episode began with: the random generator's state, a physics state.

        With the actions since, it determines the episode; the second is None unless
        the episode began by `reset_to`.
        """
        return self._began_with, self._placed

    @property
    def made_of(self) -> tuple[Any, dict[str, Any]]:
        """The benchmark and the arguments, as they were given (a copy)."""
        return self._given[0], dict(self._given[1])

    @property
    def physics_state(self) -> Vector:
        """Time, qpos and qvel in one vector, as `reset_to` takes it."""
        data = self.simulation.data
        return np.concatenate([[data.time], data.qpos, data.qvel])

    @property
    def scene_xml(self) -> str:
        """The scene as MJCF text, with plain colours for computed textures."""
        benchmark = load_benchmark(self._given[0])
        return write_scene(compose(benchmark, self.robots, self.config))

    def __getstate__(self) -> dict[str, Any]:
        """Return how to make this environment again, and what happened in it."""
        return {"made_of": self._given, "state": self.get_state()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Make the environment and take its steps again."""
        benchmark, arguments = state["made_of"]
        RobotEnv.__init__(self, benchmark, **arguments)
        self.observables.prepare(state["state"].observables)
        self.set_state(state["state"])

    def _make_cameras(self) -> tuple[Cameras, Display]:
        config, simulation = self.config, self.simulation
        cameras = Cameras(
            simulation.model,
            simulation.data,
            simulation.robots,
            config.cameras,
            preset=config.render_preset,
        )
        if config.render_mode:
            camera_id(simulation.model, config.render_camera)
        display = Display(
            config.render_mode,
            simulation,
            cameras,
            camera=config.render_camera,
            size=config.render_size,
            period=self._period,
        )
        return cameras, display

    def _count_substeps(self) -> int:
        period = 1.0 / (self.config.control_freq * self.simulation.timestep)
        count = round(period)
        if count < 1 or abs(period - count) > 1e-6:
            raise ConfigError(
                f"control_freq {self.config.control_freq:g} must divide "
                f"{1.0 / self.simulation.timestep:g}, the physics steps per second."
            )
        return count

    def _start(self, rng: np.random.Generator, placed: Vector | None = None) -> None:
        """Put robots, objects and controllers at the start of an episode."""
        self._began_with, self._placed = rng.bit_generator.state, placed
        self._taken: list[Vector] = []
        self._waiting: deque[tuple[int, Vector]] = deque()
        simulation = self.simulation
        if self._randomiser is not None:
            self._randomiser.restore()
        mujoco.mj_resetData(simulation.model, simulation.data)
        for posture in self._postures:
            posture.write(rng)
        self.benchmark.reset(rng)
        if self._randomiser is not None:
            self._randomiser.apply(rng)
        if placed is not None:
            write_physics(simulation.model, simulation.data, placed)
        simulation.start()
        self._steps, self._broken = 0, ""
        self.observables.start(rng)

    def _drive(self, action: Vector) -> None:
        """Do the physics of one step; each action counts when its latency is over."""
        now = (self._steps - 1) * self._substeps
        end = now + self._substeps
        self._waiting.append((now + self.latency, action))
        while self._waiting and self._waiting[0][0] < end:
            due, action = self._waiting.popleft()
            if due > now:
                self.observables.tick(self.simulation.tick, due - now)
                now = due
            self._set_goals(action)
        self.observables.tick(self.simulation.tick, end - now)

    def _set_goals(self, action: Vector) -> None:
        start = 0
        for controller in self.controllers:
            stop = start + controller.layout.size
            controller.set_goal(action[start:stop], self._period)
            start = stop

    def _info(self, clipped: int, success: bool) -> dict[str, Any]:
        info = {"success": success, "is_success": success, "clipped": clipped}
        for before, controller, state in self._driven:
            for key, value in controller.info(state).items():
                info[before + key] = value
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


def _action_space(layout: ActionLayout) -> gymnasium.spaces.Box:
    """Return the space of actions: float32 inside of the layout's bounds."""
    low, high = (bound.astype(np.float32) for bound in (layout.low, layout.high))
    low = np.where(low < layout.low, np.nextafter(low, np.float32(np.inf)), low)
    high = np.where(high > layout.high, np.nextafter(high, np.float32(-np.inf)), high)
    return gymnasium.spaces.Box(low, high, dtype=np.float32)


def checked_seed(seed: object) -> int | None:
    """Return a seed, or None.

    Raises:
        ConfigError: If it is no whole number from 0 on.
    """
    if seed is None:
        return None
    if not isinstance(seed, int | np.integer) or isinstance(seed, bool) or seed < 0:
        raise ConfigError(f"reset: a seed is a whole number from 0 on, not {seed!r}.")
    return int(seed)
