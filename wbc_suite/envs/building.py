"""Put an environment together: robots, scene, simulation, observations."""

from typing import Any

import mujoco

from wbc_suite.benchmark import Benchmark, ObjectBenchmark
from wbc_suite.control import (
    RobotState,
    build_composite_controller,
    load_composite_controller_config,
)
from wbc_suite.envs.config import EnvConfig
from wbc_suite.envs.posture import StartPosture
from wbc_suite.envs.simulation import Simulation
from wbc_suite.errors import ConfigError
from wbc_suite.robot import RobotDescription, load_robot
from wbc_suite.scene import attach_robot, compile_scene, empty_arena, robot_prefix
from wbc_suite.sensing.observables import Observables
from wbc_suite.sensing.proprioception import proprioception
from wbc_suite.sensing.robot_sensors import add_contact_sensors, sensors_of
from wbc_suite.sensing.robot_view import add_robot_view, aim_robot_view

__all__ = ["compose", "make_observables", "place_robots", "simulate", "take_sampler"]


def take_sampler(benchmark: Benchmark, config: EnvConfig) -> None:
    """Let the user's own sampler, if there is one, place a benchmark's things."""
    if config.placement_initializer is None:
        return
    if not isinstance(benchmark, ObjectBenchmark):
        raise ConfigError(
            f"placement_initializer: {benchmark.name} places things by itself."
        )
    benchmark.sampler = config.placement_initializer


def place_robots(
    benchmark: Benchmark, config: EnvConfig
) -> tuple[RobotDescription, ...]:
    """Load the robots, and stand them where the benchmark wants them."""
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
            gripper = None  # Spot without an arm has no place for a pad
    return load_robot(robot, gripper=gripper, base=base, skin=config.skin)


def compose(
    benchmark: Benchmark, robots: tuple[RobotDescription, ...], config: EnvConfig
) -> mujoco.MjSpec:
    """Return the scene: the benchmark's room with the robots in it."""
    spec = empty_arena()
    benchmark.build(spec)
    for i, robot in enumerate(robots):
        attach_robot(spec, robot, robot_prefix(i))
        add_robot_view(spec, robot, robot_prefix(i))
        if config.use_sensor_obs:
            add_contact_sensors(spec, robot, robot_prefix(i))
    benchmark.equip(spec, robots)
    return spec


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
    for state in states:
        aim_robot_view(state)
    pairs = [
        (
            state,
            build_composite_controller(
                load_composite_controller_config(given, state.robot), state
            ),
        )
        for state, given in zip(states, config.controller_list, strict=True)
    ]
    simulation = Simulation(
        model, data, pairs, compiled=config.compiled, lite=config.lite_physics
    )
    return simulation, postures


def make_observables(
    benchmark: Benchmark, simulation: Simulation, config: EnvConfig
) -> Observables:
    """Return what is seen of robots, sensors and things, with the user's changes."""
    groups = {
        f"{state.prefix}proprio-state": proprioception(state)
        for state in simulation.robots
    }
    for prefix, felt in benchmark.felt().items():
        groups[f"{prefix}proprio-state"] |= felt
    if config.use_sensor_obs:
        for state in simulation.robots:
            groups[f"{state.prefix}sensor-state"] = sensors_of(state)
    if config.use_object_obs:
        groups["object-state"] = benchmark.observables()
    observables = Observables(simulation.model, simulation.data, groups)
    for key, changes in (config.observables or {}).items():
        observables.modify(key, **changes)
    return observables
