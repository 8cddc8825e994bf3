"""The environment: robots, controllers, a benchmark and physics behind Gymnasium."""

import copy
import os
import zlib
from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Unpack

import gymnasium
import mujoco
import numpy as np
from numpy.typing import ArrayLike

from wbc_suite.benchmark import Benchmark, ObjectBenchmark, load_benchmark
from wbc_suite.benchmark.base import ResumableBenchmark
from wbc_suite.envs.building import (
    action_space,
    compose,
    joint_layout,
    make_cameras,
    make_observables,
    place_robots,
    simulate,
    use_sampler,
)
from wbc_suite.envs.config import RATE, EnvArguments, checked_seed, parse_env_config
from wbc_suite.envs.physics_states import PhysicsStates
from wbc_suite.envs.states import EnvState, write_physics, write_scene
from wbc_suite.envs.thread_lock import one_thread_at_a_time, thread_lock
from wbc_suite.errors import ConfigError, PhysicsError
from wbc_suite.scene import Push
from wbc_suite.scene.pushes import PushSchedule
from wbc_suite.sensing.observation_buffer import ObservationBuffer
from wbc_suite.typing import Vector

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
        robots: Descriptions of the robots at their places.
        controllers: One composite controller per robot.
        lock: Held by the thread that uses the environment; others wait.
        action_layout: Slices of the action.
        simulation: Model, data and `tick`.
        observables: Observations but pictures; changes, adds and removes them, and
            changes pictures.
        cameras: Pictures of the scene, and projections of points into them.
        beginning: State of the random generator, and physics state if the episode began
            with `reset_to`; with the actions they determine the episode.
        latency: Physics steps between a step's begin and its action taking effect; may
            exceed a control period.
        pushes: Forces on bodies in this episode, besides those of the benchmark.
        paraphrased: Whether `instruction` has a wording that recordings never use.
    """

    metadata = {"render_modes": ["human", "rgb_array", "depth_array"], "render_fps": 20}

    def __init__(
        self,
        benchmark: str | Path | Callable[[], Benchmark] = "Lift",
        **arguments: Unpack[EnvArguments],
    ) -> None:
        self._given, self.lock = (benchmark, dict(arguments)), thread_lock()
        self.benchmark = load_benchmark(benchmark, arena=arguments.get("arena"))
        robots = list(self.benchmark.robots)
        self.config = parse_env_config({"robots": robots, **arguments})
        use_sampler(self.benchmark, self.config)
        self.render_mode = self.config.render_mode
        self.robots = place_robots(self.benchmark, self.config)
        made = simulate(self.benchmark, self.robots, self.config)
        self.simulation, self._postures = made
        self.controllers = self.simulation.controllers
        self.action_layout = joint_layout(self.controllers)
        self.action_space = action_space(self.action_layout)
        self.cameras, self._display = make_cameras(self.simulation, self.config)
        self.observables = make_observables(
            self.benchmark, self.simulation, self.config, self.cameras
        )
        self._spaces: tuple[Any, Any, gymnasium.spaces.Dict] | None = None
        self._substeps = self.config.substeps
        rate = self.config.control_freq
        fps = int(rate) if rate.is_integer() else rate
        self.metadata = {**self.metadata, "render_fps": fps}
        self.horizon = self.config.horizon or self._own_horizon()
        self._steps, self._broken, self.latency = 0, "", 0
        self.pushes: tuple[Push, ...] = ()
        self._begun, self._process = False, os.getpid()
        self.paraphrased = False
        given = self.config.randomisation
        self._randomiser = None if given is None else given.bind(self)
        self._states = PhysicsStates(self.simulation, given, self.action_layout.size)
        self._start(np.random.default_rng(0))
        self._begun = False

    def _own_horizon(self) -> int:
        """Return the benchmark's horizon, which takes as long at any rate."""
        return max(1, round(self.benchmark.horizon * self.config.control_freq / RATE))

    @one_thread_at_a_time
    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode; the same seed gives the same episode.

        Raises:
            ConfigError: If the seed is no whole number >= 0, or there are options; then
                nothing has changed.
        """
        if options:
            raise ConfigError(f"reset takes no options, but got {options!r:.60}.")
        info = self.begin(seed)
        if self.render_mode == "human":
            self.render()
        return self.observation(), info

    @one_thread_at_a_time
    def step(
        self, action: Any
    ) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Advance one control period.

        Raises:
            ActionError: If the action has a wrong shape or type, or is not finite; then
                nothing has changed.
            PhysicsError: If `reset` was never called, or not after such an error.

        Where the benchmark says that it has failed, such as by a fall, the episode is
        terminated, and `info["failure"]` says why.
        """
        reward, terminated, truncated, info = self.advance(action)
        if self.render_mode == "human":
            self.render()
        return self.observation(), reward, terminated, truncated, info

    @one_thread_at_a_time
    def begin(self, seed: int | None = None) -> dict[str, Any]:
        """Do what `reset` does, but leave the observation in its buffer."""
        if seed is None and self._process != os.getpid():  # copies draw their own
            self._np_random, self._process = None, os.getpid()
        super().reset(seed=checked_seed(seed))
        self._start(self.np_random)
        return self._info(0, self.benchmark.success())

    @one_thread_at_a_time
    def advance(self, action: Any) -> tuple[float, bool, bool, dict[str, Any]]:
        """Do what `step` does, but leave the observation in its buffer."""
        vector, clipped = self.action_layout.take(action)
        if self._broken:
            raise PhysicsError(f"Call reset() first: {self._broken}")
        if not self._begun:
            raise PhysicsError("Call reset() first: no episode has begun.")
        self._taken.append(vector)
        self._steps += 1
        try:
            self._drive(vector)
        except PhysicsError as error:
            self._broken = str(error)
            info = {"physics_error": str(error), "clipped": clipped}
            info |= {"success": False, "is_success": False}
            return 0.0, True, False, info
        self.benchmark.after_step()
        self.observables.update()
        success = self.benchmark.success()
        reward = self.benchmark.reward(
            shaped=self.config.reward_shaping, success=success
        )
        info = self._info(clipped, success)
        terminated = self.config.terminate_on_success and success
        if terminated and self.config.reward_shaping:  # else hovering would pay more
            reward *= 1 + max(self.horizon - self._steps, 0)
        failure = self.benchmark.failure()
        if failure is not None:
            info["failure"], terminated = failure, True
        truncated = self._steps >= self.horizon
        return reward * self.config.reward_scale, terminated, truncated, info

    @one_thread_at_a_time
    def observation(self) -> Observation:
        """Return the present observation; after a physics error pictures are black."""
        pictures = self.cameras.black() if self._broken else self.cameras.observation()
        return {**self.observation_buffer.observation(), **pictures}

    @property
    def observation_buffer(self) -> ObservationBuffer:
        """The last observation but pictures, and the place of each key in it."""
        return self.observables.buffer

    @property
    def observation_space(self) -> gymnasium.spaces.Dict:  # pyright: ignore[reportIncompatibleVariableOverride] - it changes with what is observed
        """Space of the observations, by key."""
        now = self.observation_buffer, self.cameras.space
        if self._spaces is None or any(
            a is not b for a, b in zip(self._spaces, now, strict=False)
        ):
            spaces = {**now[0].space.spaces, **now[1]}
            self._spaces = *now, gymnasium.spaces.Dict(spaces)
        return self._spaces[2]

    @property
    def hold_action(self) -> Vector:
        """The action that keeps all present goals."""
        return np.concatenate([c.hold_action for c in self.controllers])

    @one_thread_at_a_time
    def render(self) -> Any:
        """Return a picture in the form of `render_mode`; see `Display.render`.

        In mode `human` each step is shown on a page whose address is logged.
        """
        return self._display.render()

    def close(self) -> None:
        """Free renderers and page; they are made again when needed."""
        self.cameras.close()
        self._display.close()

    def get_state(self) -> EnvState:
        """Return the episode up to now, to be continued with `set_state`."""
        return EnvState(
            began_with=self.beginning[0],
            placed=self.beginning[1],
            taken=tuple(self._taken),
            observables=copy.deepcopy(self.observables.state()),
            rng=copy.deepcopy(self._np_random),
            seed=self._np_random_seed,
        )

    def set_state(self, state: EnvState) -> Observation:
        """Repeat the steps of an episode, bit for bit, to continue it.

        The environment must be made with the same arguments. Values written directly
        into the simulation are not part of the state.
        """
        self.begin_at(state.began_with, state.placed)
        for action in state.taken:
            self.advance(action)
        self.observables.restore(copy.deepcopy(state.observables))
        self._np_random, self._np_random_seed = copy.deepcopy(state.rng), state.seed
        return self.observation()

    def reset_to(self, physics: ArrayLike) -> Observation:
        """Start an episode in a saved world, in the midst of its episode too.

        `physics` is a `physics_state` of this environment or of another one of the same
        description. Objects and randomisation are as they were drawn there, and the
        references of controllers as they were set: the recorded actions go on as they
        did. With another controller references start from the state; another
        randomisation is drawn anew. The horizon counts from here, and delayed
        observations begin with the present values.

        Time, qpos and qvel alone are taken too, as in robosuite's datasets; all else
        is then drawn as at a reset.

        Raises:
            ConfigError: If the state is of another scene, or has numbers that cannot
                be; see `write_physics`.
        """
        self.restore(physics)
        return self.observation()

    def restore(self, physics: ArrayLike) -> None:
        """Do what `reset_to` does, but leave the observation in its buffer."""
        self._start(self.np_random, physics)

    def check_state(self, physics: ArrayLike) -> None:
        """Raise ConfigError if a physics state is of another scene, or none at all."""
        self._states.read(physics)

    @one_thread_at_a_time
    def show_state(self, physics: ArrayLike) -> None:
        """Write a physics state for observations, reward and pictures, without a step.

        The benchmark sees it as the state after the one before. What the scene drew
        stays, and no episode begins. For errors see `reset_to`.
        """
        saved, simulation = self._states.read(physics), self.simulation
        user = simulation.data.userdata
        before = user.copy()
        write_physics(simulation.model, simulation.data, saved.values)
        after, user[:] = user.copy(), before
        simulation.forward()
        self.benchmark.after_step()
        if saved.origin is not None:
            user[:] = after
            self._states.resume(saved)
            if isinstance(self.benchmark, ResumableBenchmark):
                self.benchmark.resume()
        self.observables.update()

    def begin_at(
        self, began_with: Mapping[str, Any], placed: ArrayLike | None = None
    ) -> None:
        """Start an episode like another one; see `beginning`."""
        rng = np.random.default_rng(0)
        rng.bit_generator.state = dict(began_with)
        self._start(rng, placed)

    @property
    def made_of(self) -> tuple[Any, dict[str, Any]]:
        """The benchmark and the arguments of this environment (a copy)."""
        return self._given[0], dict(self._given[1])

    @property
    def instruction(self) -> str:
        """What to do in this episode, a sentence; its wording follows from the seed."""
        number = zlib.crc32(repr(self.beginning[0]).encode())
        if isinstance(self.benchmark, ObjectBenchmark):
            return self.benchmark.instruction(number, paraphrased=self.paraphrased)
        return self.benchmark.title

    @property
    def physics_state(self) -> Vector:
        """The present world in one vector, as `reset_to` takes it, a copy.

        It begins with time, qpos and qvel; for the rest see `physics_states`. Values
        written directly into the model are not part of it.
        """
        now = self._first + self._steps * self._substeps
        waiting = ((due - now, action) for due, action in self._waiting)
        return self._states.write(waiting, self.latency // self._substeps)

    @property
    def scene_xml(self) -> str:
        """The scene as MJCF text, with plain colours in place of computed textures."""
        benchmark = load_benchmark(self._given[0], arena=self.config.arena)
        return write_scene(compose(benchmark, self.robots, self.config))

    def __repr__(self) -> str:
        """Return benchmark, robots, controllers and rate of actions."""
        robots = zip(self.robots, self.controllers, strict=True)
        driven = [f"{robot.name} by {_name_of(c)}" for robot, c in robots]
        values, rate = self.action_layout.size, self.config.control_freq
        return (
            f"<{type(self).__name__} {self.benchmark.name}: {', '.join(driven)}; "
            f"{values} values of an action, {rate:g} Hz>"
        )

    __str__ = __repr__

    def __getstate__(self) -> dict[str, Any]:
        """Return the arguments and the episode up to now."""
        return {"made_of": self._given, "state": self.get_state()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Make the environment and repeat its steps."""
        benchmark, arguments = state["made_of"]
        RobotEnv.__init__(self, benchmark, **arguments)
        self.observables.prepare(state["state"].observables)
        self.set_state(state["state"])

    @one_thread_at_a_time
    def _start(self, rng: np.random.Generator, given: ArrayLike | None = None) -> None:
        """Bring robots, objects and controllers to the start of an episode."""
        saved = None if given is None else self._states.read(given)
        self._begun = False  # until all of this has succeeded
        placed = None if saved is None else saved.values
        self.beginning: tuple[Mapping[str, Any], Vector | None]
        self.beginning = rng.bit_generator.state, placed
        self._taken: list[Vector] = []
        self._waiting: deque[tuple[int, Vector]] = deque()
        simulation = self.simulation
        if self._randomiser is not None:
            self._randomiser.restore()
        mujoco.mj_resetData(simulation.model, simulation.data)
        draw = self._states.scene_generator(saved, rng)
        for posture in self._postures:
            posture.write(draw)
        self.benchmark.reset(draw)
        self._states.compare_draws(saved)
        if self._randomiser is not None:
            self._randomiser.apply(self._states.randomisation_generator(saved, rng))
        if saved is not None:
            write_physics(simulation.model, simulation.data, saved.values)
            if isinstance(self.benchmark, ResumableBenchmark):
                self.benchmark.resume()
        simulation.start()
        if saved is not None:
            self._states.resume(saved)
        self._steps, self._first, self._broken = 0, self._step_number(), ""
        if saved is not None and saved.waiting is not None:
            for left, *action in saved.waiting:
                self._waiting.append((self._first + int(left), np.array(action)))
        pushes = *self.benchmark.pushes, *self.pushes
        self._schedule = PushSchedule(pushes, simulation.data, simulation.timestep)
        self.observables.start(rng)
        self._begun = True

    def _step_number(self) -> int:
        """Return how many physics steps the episode of the present state has taken."""
        return max(0, round(self.simulation.data.time / self.simulation.timestep))

    def _drive(self, action: Vector) -> None:
        """Advance physics by one step; actions take effect after their latency."""
        now = self._first + (self._steps - 1) * self._substeps
        end = now + self._substeps
        self._waiting.append((now + self.latency, action))
        while self._waiting and self._waiting[0][0] < end:
            due, action = self._waiting.popleft()
            if due > now:
                self._step_physics(now, due)
                now = due
            self._set_goals(action)
        self._step_physics(now, end)

    def _step_physics(self, first: int, last: int) -> None:
        """Advance physics steps; changed observations are sampled after each."""
        for n in self._schedule.spans(first, last):
            if not self.observables.follows_physics:
                self.simulation.tick(n)
                continue
            for _ in range(n):
                self.simulation.tick(1)
                self.observables.sample()

    def _set_goals(self, action: Vector) -> None:
        start, period = 0, 1.0 / self.config.control_freq
        for controller in self.controllers:
            stop = start + controller.layout.size
            controller.set_goal(action[start:stop], period)
            start = stop

    def _info(self, clipped: int, success: bool) -> dict[str, Any]:
        info = {"success": success, "is_success": success, "clipped": clipped}
        info["control_freq"] = self.config.control_freq
        distances = self.simulation.data.contact.dist
        info["penetration"] = max(0.0, -float(distances.min(initial=0.0)))
        for state, controller in self.simulation.pairs:
            before = state.prefix if len(self.controllers) > 1 else ""
            info |= {before + k: v for k, v in controller.info(state).items()}
        return info


def _name_of(controller: Any) -> str:
    """Return the registered name of a composite controller, or its class's."""
    config = getattr(controller, "config", None)
    return str(getattr(config, "type", type(controller).__name__))
