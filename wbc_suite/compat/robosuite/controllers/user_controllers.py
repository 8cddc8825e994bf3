"""Composite controllers: robosuite's view of ours, and base of users' classes."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from wbc_suite.compat.robosuite.controllers.part_view import (
    PartController,
    part_controller,
)
from wbc_suite.compat.robosuite.forwarding import does_nothing, forwarded
from wbc_suite.control import RobotState
from wbc_suite.control.composite.basic import BasicController, default_basic_config
from wbc_suite.control.composite.registry import register_composite
from wbc_suite.typing import Vector

REGISTERED_COMPOSITE_CONTROLLERS_DICT: dict[str, type["CompositeController"]] = {}
"""Classes of users by name, and ours."""

SPECIFIC = "composite_controller_specific_configs"


class CompositeController:
    """A composite controller; parts of the robot are driven by ours.

    A subclass with a `name`, registered by `register_composite_controller`, is made for
    configs of that `type`. It may override `set_goal`, which takes a whole action, and
    `run_controller`, which returns the commands of each enabled part at every physics
    step: torques of joints, and setpoints of grippers.
    """

    name = "BASIC"
    period = 0.05
    """Time between two actions, s."""

    def __init__(self, sim: Any, robot_model: Any, grippers: Any) -> None:
        self.sim, self.robot_model, self.grippers = sim, robot_model, grippers
        self.lite_physics = True
        self.arms = tuple(grippers)
        self.part_controllers: dict[str, PartController] = {}
        self.part_controller_config: dict[str, Any] = {}
        self.composite_controller_specific_config: dict[str, Any] = {}

    def load_controller_config(
        self,
        part_controller_config: Any,
        composite_controller_specific_config: Any = None,
    ) -> None:
        """Store the configs and make the parts' controllers."""
        self.part_controller_config = dict(part_controller_config)
        self.composite_controller_specific_config = dict(
            composite_controller_specific_config or {}
        )
        self._validate_composite_controller_specific_config()
        self._init_controllers()
        self.setup_action_split_idx()

    def bind(self, inner: Any, state: RobotState) -> None:
        """Drive the parts of one of our controllers."""
        self._inner, self._state = inner, state
        self.layout = inner.layout
        parts = getattr(inner, "parts", {})
        self.part_controllers = {
            n: part_controller(n, p, state) for n, p in parts.items()
        }

    _validate_composite_controller_specific_config = does_nothing("anything is right")
    _init_controllers = does_nothing("there are the controllers of the parts")
    setup_action_split_idx = does_nothing("the parts give `_action_split_indexes`")
    update_state = does_nothing("states are read when they are asked for")

    def set_period(self, period: float) -> None:
        """Set the time between two actions, s."""
        self.period = period
        for part in self.part_controllers.values():
            part.period = period

    @property
    def _action_split_indexes(self) -> dict[str, tuple[int, int]]:
        """Begin and end of each part of the action."""
        return {part.name: (part.start, part.stop) for part in self.layout.slices}

    def set_goal(self, all_action: Any) -> None:
        """Take an action."""
        self._inner.set_goal(np.asarray(all_action, np.float64), self.period)

    def reset(self) -> None:
        """Hold all parts where they are."""
        self._inner.reset(self._state)

    def run_controller(self, enabled_parts: Any = None) -> dict[str, Vector]:
        """Return the present commands of each part, by name."""
        found: dict[str, Vector] = {}
        state = self._state
        places = dict(zip(state.actuators, state.actuator_ids, strict=True))
        for name, part in self.part_controllers.items():
            own = [places[j] for j in part._part.law.joints if j in places]
            found[name] = self._state.data.ctrl[own].copy()
        return found

    def get_control_dim(self, part_name: str) -> int:
        """Return the number of action values of a part."""
        return self.part_controllers[part_name].control_dim

    def get_controller(self, part_name: str) -> PartController:
        """Return the controller of a part."""
        return self.part_controllers[part_name]

    def get_controller_base_pose(self, controller_name: str) -> tuple[Vector, Any]:
        """Return position and orientation matrix of the robot's base in the world."""
        pose = self._state.root_pose
        return np.array(pose.translation), np.array(pose.rotation)

    @property
    def action_limits(self) -> tuple[Vector, Vector]:
        """Least and greatest actions."""
        return self.layout.low.copy(), self.layout.high.copy()

    def create_action_vector(self, action_dict: Mapping[str, ArrayLike]) -> Vector:
        """Return an action from values of parts, and zeros for the others.

        Keys that are no parts, such as those of devices, are left out.
        """
        own = {k: v for k, v in action_dict.items() if k in self._action_split_indexes}
        return self.layout.pack(own, base=np.zeros(self.layout.size))

    def create_action_dict_from_action_vector(self, action_vector: Any) -> Any:
        """Return the values of each part."""
        split = self._action_split_indexes
        return {name: np.asarray(action_vector)[a:b] for name, (a, b) in split.items()}

    def get_action_info(self) -> Any:
        """Return the splits of the action by part."""
        return self._action_split_indexes

    def get_action_info_dict(self) -> dict[str, Any]:
        """Return dimension and indices by part."""
        split = self._action_split_indexes
        found: dict[str, Any] = {"Action Dimension": (self.layout.size,)}
        return found | {name: list(range(a, b)) for name, (a, b) in split.items()}


class WholeBody(CompositeController):
    """A composite whose solver moves all joints to targets of the hands."""

    @property
    def joint_action_policy(self) -> Any:
        """The solver's settings that scripts read: `input_type`, `input_ref_frame`."""
        return self._inner.config


class WholeBodyIK(WholeBody):
    """WHOLE_BODY_IK."""


class HybridMobileBase(CompositeController):
    """HYBRID_MOBILE_BASE."""


def register_composite_controller(
    target_class: type[CompositeController],
) -> type[CompositeController]:
    """Make a class known under its `name`, also to our `make`."""
    name = target_class.name.upper()
    if name not in REGISTERED_COMPOSITE_CONTROLLERS_DICT:
        register_composite(
            name,
            lambda config, state: _Adapter(name, config, state),
            family="basic",
            default=default_basic_config,
        )
    REGISTERED_COMPOSITE_CONTROLLERS_DICT[name] = target_class
    return target_class


class _Adapter:
    """A user's composite controller in our control loop; see `SteppedController`."""

    def __init__(self, name: str, config: Mapping[str, Any], state: RobotState) -> None:
        from wbc_suite.compat.robosuite.robots import models_of

        basic = {k: v for k, v in config.items() if k in ("format", "body_parts")}
        self._inner = BasicController({"type": "BASIC", **basic}, state)
        self.layout, self.laws = self._inner.layout, self._inner.laws
        sim, robot_model, grippers = models_of(state)
        cls = REGISTERED_COMPOSITE_CONTROLLERS_DICT[name]
        self.user = cls(sim, robot_model, grippers)
        self.user.bind(self._inner, state)
        specific = config.get(SPECIFIC, {})
        self.user.load_controller_config(basic["body_parts"], specific)
        places = dict(zip(state.actuators, range(len(state.actuators)), strict=True))
        self._places = {
            part: [places[j] for j in p.law.joints if j in places]
            for part, p in self._inner.parts.items()
        }

    hold_action = forwarded("_inner", "hold_action", "The action that holds the parts.")
    info = forwarded("_inner", "info", "Entries of the environment's `info`.")
    memory = forwarded("_inner", "memory", "Arrays that outlive a tick.")
    resume = forwarded("_inner", "resume", "Goes on from values in `memory`.")
    reset = forwarded("_inner", "reset", "Starts from the robot's state.")
    prepare = forwarded("_inner", "prepare", "Updates the laws.")

    def set_goal(self, action: Vector, period: float = 0.05) -> None:
        self.user.set_period(period)
        self.user.set_goal(action)

    def compute(self, state: RobotState) -> Vector:
        """Return the user's commands; see `SteppedController`."""
        commands = state.data.ctrl[state.actuator_ids].copy()
        given = self.user.run_controller(dict.fromkeys(self._places, True))
        for part, values in given.items():
            commands[self._places[part]] = values
        return commands


def view_of(controller: Any, state: RobotState, models: Any) -> CompositeController:
    """Return robosuite's view of one of our controllers, or the user's own."""
    if isinstance(controller, _Adapter):
        return controller.user
    name = str(getattr(getattr(controller, "config", None), "type", "BASIC"))
    cls = _VIEWS.get(name, WholeBody if name.startswith("WHOLE") else None)
    view = (cls or CompositeController)(*models)
    view.bind(controller, state)
    view.name = name
    return view


_VIEWS = {"WHOLE_BODY_IK": WholeBodyIK, "HYBRID_MOBILE_BASE": HybridMobileBase}
