"""Parts of an environment: robots, scene, simulation, observations, cameras."""

import importlib
import time
from collections.abc import Sequence
from typing import Any

import gymnasium
import mujoco
import numpy as np

from wbc_suite.benchmark import Benchmark, ObjectBenchmark
from wbc_suite.control import (
    ActionLayout,
    CompositeController,
    RobotState,
    build_composite_controller,
    load_composite_controller_config,
)
from wbc_suite.envs.config import EnvConfig, NoiseConfig
from wbc_suite.envs.simulation import Simulation
from wbc_suite.errors import ConfigError
from wbc_suite.robot import RobotDescription, load_robot
from wbc_suite.scene import (
    ArenaConfig,
    add_robot_view,
    aim_robot_view,
    attach_robot,
    compile_scene,
    empty_arena,
    robot_prefix,
)
from wbc_suite.scene.mjcf_arena import PREFIX, clear_views
from wbc_suite.scene.placement import make_sampler
from wbc_suite.sensing.cameras import Cameras
from wbc_suite.sensing.observables import Observables
from wbc_suite.sensing.projection import camera_id
from wbc_suite.sensing.proprioception import (
    add_contact_sensors,
    proprioception,
    sensors_of,
)
from wbc_suite.sensing.things import readings_of_things

DEEPEST = 1e-3  # of robots in an arena at their start, m
WATCH_PAGE = "wbc_suite.viewers.watch_page"
"""Imported when needed: `viewers` is a layer above `envs`."""


def use_sampler(benchmark: Benchmark, config: EnvConfig) -> None:
    """Replace the benchmark's sampler by that of the arguments, or of its file."""
    given = config.placement_initializer
    if given is None and isinstance(benchmark, ObjectBenchmark):
        given = benchmark.placement
    if given is None:
        return
    if not isinstance(benchmark, ObjectBenchmark):
        raise ConfigError(
            f"placement_initializer: {benchmark.name} has no sampler to replace."
        )
    benchmark.sampler = make_sampler(given)


def place_robots(
    benchmark: Benchmark, config: EnvConfig
) -> tuple[RobotDescription, ...]:
    """Return the robots at their places in the benchmark."""
    robots = [_load(robot, benchmark, config) for robot in config.robot_list]
    return benchmark.arrange(robots, config.env_configuration)


def _load(robot: Any, benchmark: Benchmark, config: EnvConfig) -> RobotDescription:
    if isinstance(robot, RobotDescription):
        return robot
    base = None if config.base_types == "default" else config.base_types
    gripper = config.gripper_types
    if gripper == "default":
        gripper = benchmark.gripper
        if gripper is not None and not load_robot(robot, base=base).hands:
            gripper = None  # such as Spot without an arm
    return load_robot(robot, gripper=gripper, base=base, skin=config.skin)


def arena_of(benchmark: Benchmark) -> ArenaConfig | None:
    """Return the scene around a benchmark; classes of users need not name one."""
    return getattr(benchmark, "arena", None)


def check_room(arena: ArenaConfig, robots: Sequence[RobotState]) -> None:
    """Check that no robot is in the arena now.

    Raises:
        ConfigError: Names what it is in.
    """
    if not robots:
        return
    m, data = robots[0].model, robots[0].data
    prefixes = tuple(robot.prefix for robot in robots)
    for pair in data.contact.geom[data.contact.dist < -DEEPEST].tolist():
        for own, other in (pair, pair[::-1]):
            body, found = m.body(m.geom_bodyid[own]).name, m.geom(other).name
            if body.startswith(prefixes) and found.startswith(PREFIX):
                raise ConfigError(
                    f"{arena.file}: at its start '{body}' is in "
                    f"'{found.removeprefix(PREFIX)}'. Give another `surface`, or `at` "
                    "and `yaw`."
                )


def compose(
    benchmark: Benchmark, robots: tuple[RobotDescription, ...], config: EnvConfig
) -> mujoco.MjSpec:
    """Return the scene: the benchmark's arena and objects, and the robots."""
    arena = arena_of(benchmark)
    spec = empty_arena() if arena is None else arena.build()
    benchmark.build(spec)
    for i, robot in enumerate(robots):
        attach_robot(spec, robot, robot_prefix(i))
        add_robot_view(spec, robot, robot_prefix(i))
        if config.use_sensor_obs:
            add_contact_sensors(spec, robot, robot_prefix(i))
    benchmark.equip(spec, robots)
    spec.option.timestep = config.timestep
    return spec


class StartPosture:
    """Writes the keyframe `ready` of one robot, with noise on the arms' joints.

    The root is where the model has it: MuJoCo's reset of the data puts it there.
    """

    def __init__(self, state: RobotState, noise: NoiseConfig | None) -> None:
        robot = state.robot
        posture = robot.keyframe("ready")
        self._qpos, self._noise = state.data.qpos, noise
        self._index, _ = state.joint_addresses(tuple(posture))
        self._values = list(posture.values())
        groups = [group for group in robot.groups if group.endswith("arm")]
        arms = [name for group in groups for name in robot.groups[group]]
        self._arms, _ = state.joint_addresses(tuple(arms))
        ranges = [robot.joint(name).range or (-np.inf, np.inf) for name in arms]
        self._low, self._high = np.array(ranges).reshape(-1, 2).T

    def write(self, rng: np.random.Generator | None = None) -> None:
        """Write the posture into the simulation; without `rng` there is no noise."""
        self._qpos[self._index] = self._values
        if self._noise is None or rng is None:
            return
        count = len(self._arms)
        gaussian = self._noise.type == "gaussian"
        draw = rng.normal(size=count) if gaussian else rng.uniform(-1.0, 1.0, count)
        moved = self._qpos[self._arms] + self._noise.magnitude * draw
        self._qpos[self._arms] = np.clip(moved, self._low, self._high)


def simulate(
    benchmark: Benchmark, robots: tuple[RobotDescription, ...], config: EnvConfig
) -> tuple[Simulation, list[StartPosture]]:
    """Compile the scene, and bind benchmark and controllers to it."""
    model = compile_scene(compose(benchmark, robots, config))
    data = mujoco.MjData(model)
    states = [
        RobotState(model, data, robot, prefix=robot_prefix(i))
        for i, robot in enumerate(robots)
    ]
    benchmark.bind(model, data, states)
    postures = [StartPosture(state, config.noise) for state in states]
    for posture in postures:
        posture.write()
    mujoco.mj_forward(model, data)
    if (arena := arena_of(benchmark)) is not None:
        check_room(arena, states)
        table = getattr(getattr(benchmark, "config", None), "table", None)
        clear_views(model, data, (0.0, 0.0, 0.8) if table is None else table.center)
    for state in states:
        aim_robot_view(state)
    pairs: list[tuple[RobotState, CompositeController]] = []
    for given, state in zip(config.controller_list, states, strict=True):
        controller = load_composite_controller_config(given, state.robot)
        pairs.append((state, build_composite_controller(controller, state)))
    simulation = Simulation(
        model, data, pairs, compiled=config.compiled, lite=config.lite_physics
    )
    return simulation, postures


def make_observables(
    benchmark: Benchmark,
    simulation: Simulation,
    config: EnvConfig,
    cameras: Cameras,
) -> Observables:
    """Return the observables of robots, sensors and objects, changed as asked.

    Changes of observed pictures are made in `cameras`.
    """
    groups = {
        f"{state.prefix}proprio-state": proprioception(state)
        for state in simulation.robots
    }
    for prefix, readings in benchmark.robot_observables().items():
        groups[f"{prefix}proprio-state"] |= readings
    if config.use_sensor_obs:
        for state in simulation.robots:
            groups[f"{state.prefix}sensor-state"] = sensors_of(state)
    if config.use_object_obs:
        groups["object-state"] = benchmark.observables()
        if (arena := arena_of(benchmark)) is not None:
            groups["object-state"] |= readings_of_things(arena, simulation.model)
    observables = Observables(simulation.model, simulation.data, groups, cameras)
    for key, changes in (config.observables or {}).items():
        observables.modify(key, **changes)
    return observables


class Display:
    """Shows a simulation in one render mode.

    Mode `human` serves a page and keeps to real time, the others return arrays.
    """

    def __init__(
        self, simulation: Simulation, cameras: Cameras, config: EnvConfig
    ) -> None:
        self._simulation, self._cameras, self._config = simulation, cameras, config
        self._page: Any = None
        self._due = 0.0

    def render(self) -> Any:
        """Return a picture, or None in mode `human`.

        `rgb_array`: shape (height, width, 3), uint8. `depth_array`: shape (height,
        width), float32, m along the camera's axis.

        Raises:
            ConfigError: If there is no render mode.
        """
        mode, camera = self._config.render_mode, self._config.render_camera
        width, height = self._config.render_size
        if mode == "human":
            return self._show()
        if mode == "rgb_array":
            return self._cameras.image(camera, width=width, height=height)
        if mode == "depth_array":
            return self._cameras.depth(camera, width=width, height=height)[..., 0]
        raise ConfigError("render: make the environment with render_mode.")

    def close(self) -> None:
        """Close the page."""
        if self._page is not None:
            self._page.stop()
            self._page = None

    def _show(self) -> None:
        if self._page is None:
            self._page = importlib.import_module(WATCH_PAGE).WatchPage(
                self._simulation.model
            )
        data = self._simulation.data
        self._page.show(data.xpos, data.xquat)
        period = 1.0 / self._config.control_freq
        time.sleep(min(max(self._due - time.monotonic(), 0.0), period))
        self._due = time.monotonic() + period


def make_cameras(simulation: Simulation, config: EnvConfig) -> tuple[Cameras, Display]:
    """Return the observed cameras, and the display of `render`."""
    cameras = Cameras(
        simulation.model,
        simulation.data,
        simulation.robots,
        config.cameras,
        preset=config.render_preset,
    )
    if config.render_mode:
        camera_id(simulation.model, config.render_camera)
    return cameras, Display(simulation, cameras, config)


def joint_layout(controllers: tuple[CompositeController, ...]) -> ActionLayout:
    """Return one layout; with several robots names carry the robot's prefix."""
    if len(controllers) == 1:
        return controllers[0].layout
    return ActionLayout(
        part.prefixed(robot_prefix(i))
        for i, controller in enumerate(controllers)
        for part in controller.layout.slices
    )


def action_space(layout: ActionLayout) -> gymnasium.spaces.Box:
    """Return the space of actions: float32 inside of the layout's bounds."""
    low, high = (bound.astype(np.float32) for bound in (layout.low, layout.high))
    low = np.where(low < layout.low, np.nextafter(low, np.float32(np.inf)), low)
    high = np.where(high > layout.high, np.nextafter(high, np.float32(-np.inf)), high)
    return gymnasium.spaces.Box(low, high, dtype=np.float32)
