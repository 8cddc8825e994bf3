"""Environments with robots, and those in which they manipulate."""

from collections import OrderedDict
from typing import Any

import numpy as np

from wbc_suite.benchmark import load_benchmark
from wbc_suite.compat.robosuite.conventions import (
    THEIRS,
    check_conventions,
    place_cameras,
    with_their_hands,
)
from wbc_suite.compat.robosuite.environments.aliases import SceneNames
from wbc_suite.compat.robosuite.environments.arguments import (
    ARGUMENTS,
    changed_task,
    controller_of,
    one_each,
    ours,
)
from wbc_suite.compat.robosuite.environments.base import REGISTERED_ENVS, MujocoEnv
from wbc_suite.compat.robosuite.environments.observations import (
    PolledObservables,
    camera_observables,
    object_observables,
    picture_keys,
    robot_observables,
)
from wbc_suite.compat.robosuite.forwarding import does_nothing
from wbc_suite.compat.robosuite.models.tasks import TaskBenchmark
from wbc_suite.compat.robosuite.robots import ROBOT_CLASS_MAPPING
from wbc_suite.compat.robosuite.utils.binding_utils import MjSim
from wbc_suite.compat.robosuite.utils.observables import Observable, sensor
from wbc_suite.compat.robosuite.utils.placement_samplers import (
    ObjectPositionSampler,
    SamplerOfTask,
)
from wbc_suite.compat.robosuite.utils.sim_utils import (
    check_contact,
    names_of,
)
from wbc_suite.envs import RobotEnv as Core
from wbc_suite.errors import UnknownNameError
from wbc_suite.typing import Vector

AIR = 1.2, 2e-5
"""Density, kg/m^3, and viscosity, Pa s, of robosuite's air. It drags links as boxes of
their inertias: a Panda's hand with 2.5 N m at 0.6 rad/s."""


class RobotEnv(MujocoEnv):
    """An environment with robots; arguments are robosuite's or ours.

    With `conventions="wbc_suite"` grip sites, fingers, cameras and `eef_quat` are ours,
    for recordings and policies of ours; by default they are robosuite's.
    """

    def __init__(
        self, robots: Any = "Panda", *, conventions: str = THEIRS, **arguments: Any
    ) -> None:
        self.as_there = check_conventions(conventions) == THEIRS
        given = [robots] if isinstance(robots, str) else list(robots)
        self.robot_names, self.num_robots = given, len(given)
        self.use_camera_obs = arguments.get("use_camera_obs", True)
        for name, default in (("use_object_obs", True), ("reward_shaping", False)):
            if not hasattr(self, name):  # classes of users set their own before
                setattr(self, name, arguments.get(name, default))
        self.env_configuration = arguments.get("env_configuration", "default")
        super().__init__(**arguments)

    def _load_model(self) -> None:
        """Make the models of the robots; they are compiled with the scene."""
        self._load_robots()

    def _load_robots(self) -> None:
        count, arguments = self.num_robots, self.arguments
        grippers = one_each(arguments.get("gripper_types", "default"), count, "gripper")
        bases = one_each(arguments.get("base_types", "default"), count, "base")
        configs = one_each(arguments.get("controller_configs"), count, "controller")
        robot_configs = arguments.get("robot_configs") or [{}] * count
        self._check_robot_configuration(self.robot_names)
        self.robots: list[Any] = []
        for k, name in enumerate(self.robot_names):
            cls = ROBOT_CLASS_MAPPING.get(name)
            if cls is None:
                raise UnknownNameError("robot", name, ROBOT_CLASS_MAPPING)
            robot = cls(
                name,
                idn=k,
                gripper_type="none" if grippers[k] is None else grippers[k],
                base_type=bases[k],
                control_freq=self.control_freq,
                **robot_configs[k],
            )
            own = robot.robot_model
            if self.as_there:
                own.description = with_their_hands(own.description)
            else:
                own.as_there = False
                own.load(
                    robot.gripper_type, None if bases[k] == "default" else bases[k]
                )
            robot.composite_controller_config = controller_of(
                configs[k], robot.robot_model.description
            )
            self.robots.append(robot)

    _check_robot_configuration = does_nothing("our benchmark checks names and number")

    def _make_core(self) -> Core:
        arguments = ours(self.arguments) | {
            "control_freq": self.control_freq,
            "horizon": None,
            "robots": [robot.robot_model.description for robot in self.robots],
            "controller_configs": [r.composite_controller_config for r in self.robots],
            "reward_scale": 1.0,
        }
        for key in ("gripper_types", "base_types"):
            arguments.pop(key, None)
        if self.benchmark is not None:
            task = changed_task(self.benchmark, arguments)
            for key in ARGUMENTS & arguments.keys():
                del arguments[key]
            return Core(task, **self._for_our_task(arguments))
        arguments.pop("reward_shaping", None)
        arguments.pop("use_object_obs", None)
        return Core(lambda: TaskBenchmark(self), **arguments)

    def _for_our_task(self, arguments: dict[str, Any]) -> dict[str, Any]:
        """Return the arguments with robots as our benchmark has them."""
        grippers = self.arguments.get("gripper_types", "default")
        if isinstance(grippers, list | tuple):
            grippers = grippers[0]
        own = load_benchmark(str(self.benchmark)).gripper
        if grippers == "default" and own is not None:  # such as a wiping tool
            for robot in self.robots:
                if robot.robot_model.description.hands:
                    robot.robot_model.load(own, None)
            models = [robot.robot_model for robot in self.robots]
            arguments["robots"] = [model.description for model in models]
        given = arguments.get("placement_initializer")
        if isinstance(given, ObjectPositionSampler):
            arguments["placement_initializer"] = SamplerOfTask(given)
        return arguments

    def _make_sim(self, core: Core) -> MjSim:
        if self.as_there:
            option = core.simulation.model.opt
            option.density, option.viscosity = AIR
        if self.as_there and self.benchmark in REGISTERED_ENVS:
            place_cameras(core.simulation.model, self.benchmark)
        sim = super()._make_sim(core)
        for robot, (state, controller) in zip(
            self.robots, core.simulation.pairs, strict=True
        ):
            robot.bind(sim, state, controller)
        names = SceneNames(core.simulation.model, self.robots)
        sim.model.understand(names.ours, names.theirs)
        for robot in self.robots:
            for model in (robot.robot_model, *robot.gripper.values()):
                model.theirs = names.theirs
        return sim

    def _setup_observables(self) -> dict[str, Observable]:
        """Return the observables of robots, of our benchmark's objects, of cameras."""
        core, rate = self.env, self.control_freq
        found: list[Observable] = []
        for robot in self.robots:
            found += robot_observables(robot, rate, as_there=self.as_there)
        if self.benchmark is not None and core.config.use_object_obs:
            for prefix, readings in core.benchmark.robot_observables().items():
                own = object_observables(readings, core.simulation.data, rate)
                for observable in own:
                    observable.modality = f"{prefix}proprio"
                found += own
            readings = core.benchmark.observables()
            found += object_observables(readings, core.simulation.data, rate)
        cameras = core.config.cameras
        for field in ("name", "height", "width", "depth"):
            setattr(self, f"camera_{field}s", [getattr(c, field) for c in cameras])
        self.num_cameras = len(cameras)
        self._picture_keys = picture_keys(cameras)
        if self._picture_keys:
            found += camera_observables(self._picture_keys, self._picture, rate)
        return OrderedDict((o.name, o) for o in found)

    def _pre_action(self, action: Any, policy_step: bool = False) -> None:
        """Let the next `sim.step` follow the controllers, in loops of one's own.

        With `policy_step` they take the action. In `step` it does nothing.
        """
        if self._stepping:
            return
        given, start = self._of_enabled_parts(action), 0
        for robot in self.robots if policy_step else ():
            stop = start + robot.action_dim
            robot.composite_controller.set_goal(given[start:stop])
            start = stop
        self.sim.next_step = lambda: self.env.simulation.tick(1)

    def _of_enabled_parts(self, action: Any) -> Any:
        """Return the action with zeros for parts that are switched off; they hold."""
        if not any(robot.disabled for robot in self.robots):
            return action
        given, start = np.array(action, np.float64), 0
        for robot in self.robots:
            for part, (first, last) in robot._action_split_indexes.items():
                if part.removesuffix("_gripper") in robot.disabled:
                    given[start + first : start + last] = 0.0
            start += robot.action_dim
        return given

    def _picture(self, key: str) -> Any:
        observables, key = self.env.observables, self._picture_keys[key]
        if isinstance(observables, PolledObservables):
            return observables.picture(key)
        return self.env.cameras.black()[key]  # while the scene is built

    def reward(self, action: Any = None) -> float:
        """Return the reward of our benchmark."""
        shaped = self.env.config.reward_shaping
        return self.env.benchmark.reward(shaped=shaped) * self.reward_scale

    def _check_success(self) -> bool:
        """Whether our benchmark is solved."""
        return bool(self.env.benchmark.success())

    @property
    def _robots_geoms(self) -> list[str]:
        return [g for robot in self.robots for g in robot.robot_model.contact_geoms]


class ManipulationEnv(RobotEnv):
    """An environment in which grippers move objects."""

    def __init__(
        self, robots: Any = "Panda", env_configuration: str = "default", **kwargs: Any
    ) -> None:
        super().__init__(robots, env_configuration=env_configuration, **kwargs)

    def _check_grasp(self, gripper: Any, object_geoms: Any) -> bool:
        """Whether a gripper holds an object between two of its sides.

        `gripper` is a `GripperModel`, a dictionary of those by arm (any of them), or
        groups of names of geoms, each of which must touch.
        """
        if isinstance(gripper, dict):
            return any(self._check_grasp(g, object_geoms) for g in gripper.values())
        geoms = names_of(object_geoms)
        if hasattr(gripper, "important_geoms"):
            sides = gripper.important_geoms
            groups = [sides["left_fingerpad"], sides["right_fingerpad"]]
            if not all(check_contact(self.sim, g, geoms) for g in groups):
                groups = [sides["left_finger"], sides["right_finger"]]
        elif isinstance(gripper, str):
            groups = [gripper]
        else:
            groups = list(gripper)
        return all(check_contact(self.sim, group, geoms) for group in groups)

    def _gripper_to_target(
        self,
        gripper: Any,
        target: Any,
        target_type: str = "body",
        return_distance: bool = False,
    ) -> Any:
        """Return the offset from a gripper to a target, m, or its length.

        `target` is an element's name, or a model, whose root body counts.
        """
        if isinstance(gripper, dict):
            found = [
                self._gripper_to_target(g, target, target_type, return_distance)
                for g in gripper.values()
            ]
            return min(found, key=lambda x: float(np.linalg.norm(x)))
        name = getattr(target, "root_body", target)
        place = getattr(self.sim.data, f"get_{target_type}_xpos")(name)
        grip = self.sim.data.get_site_xpos(gripper.important_sites["grip_site"])
        difference = place - grip
        return float(np.linalg.norm(difference)) if return_distance else difference

    _visualize_gripper_to_target = does_nothing("scenes have no visual marks")

    def _get_arm_prefixes(
        self, robot: Any, include_robot_name: bool = True
    ) -> list[str]:
        """Return the begin of the keys of each arm's observations."""
        start = robot.robot_model.naming_prefix if include_robot_name else ""
        several = len(robot.arms) > 1
        return [f"{start}{arm}_" if several else start for arm in robot.arms]

    def _get_obj_eef_sensor(
        self, prefix: str, obj_key: str, fn_name: str, modality: str
    ) -> Any:
        """Return a sensor of the offset from a hand to an observed position."""

        @sensor(modality=modality)
        def observe(obs_cache: dict[str, Any]) -> Vector:
            names = f"{prefix}eef_pos", obj_key
            if any(name not in obs_cache for name in names):
                return np.zeros(3)
            return obs_cache[obj_key] - obs_cache[names[0]]

        observe.__name__ = fn_name
        return observe

    @property
    def _eef_xpos(self) -> Vector:
        robot = self.robots[0]
        return self.sim.data.site_xpos[robot.eef_site_id[robot.arms[0]]].copy()
