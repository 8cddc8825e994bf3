"""Part controllers of users, registered like the built-in ones."""

from typing import Literal, get_args

import numpy as np
import pytest
from pydantic import PositiveFloat

import wbc_suite
from wbc_suite.compiling import compiled
from wbc_suite.config_files import FrozenModel
from wbc_suite.control import (
    ActionPart,
    PartController,
    PartSettings,
    SliceKind,
    Unit,
    load_composite_controller_config,
    load_part_controller_config,
    register_part_controller,
)
from wbc_suite.control.law.joint_laws import JointLaw
from wbc_suite.control.law.law import LAWS, Law, register_law
from wbc_suite.control.part.registry import PART_CONTROLLERS, PartControllerName
from wbc_suite.errors import ConfigError, UnknownNameError


class SwingConfig(PartSettings):
    """One value swings all joints about the posture at reset."""

    type: Literal["ROCKING"] = "ROCKING"
    kp: PositiveFloat = 400.0
    angle: PositiveFloat = 0.1


class SwingController(PartController[JointLaw]):
    """Sets one offset from the posture at reset for all joints."""

    def __init__(self, part, config, state):
        self.config = config
        self.law = JointLaw(state, part.joints, kp=config.kp, kd=2.0 * config.kp**0.5)
        self.slices = (
            ActionPart(
                name=part.name,
                kind=SliceKind.POSTURE,
                labels=("swing",),
                units=(Unit("rad", config.angle),),
                low=(-1.0,),
                high=(1.0,),
            ),
        )

    def reset(self, state):
        self.home = state.data.qpos[self.law.drives["qpos"]]
        self.value = 0.0
        self.law.aim(self.home)

    def set_goal(self, values, period):
        self.value = float(values[0])
        self.law.move(self.home + self.config.angle * self.value, 0.0)

    @property
    def hold_action(self):
        return np.array([self.value])


@pytest.fixture
def swing(forget):
    forget(PART_CONTROLLERS, "ROCKING")
    register_part_controller("ROCKING", SwingController, SwingConfig)


def test_a_registered_controller_runs_by_name_in_make(swing):
    env = wbc_suite.make("Lift", robots="Panda", controller_configs="ROCKING").unwrapped
    env.reset(seed=0)
    part = env.action_layout["right"]
    assert (part.labels, str(part.units[0])) == (("swing",), "0.1 rad")
    joints = env.controllers[0].parts["right"].law.drives["qpos"]
    before = env.simulation.data.qpos[joints].copy()
    for _ in range(20):
        env.step(env.action_layout.pack({"right": [0.5]}, base=env.hold_action))
    moved = env.simulation.data.qpos[joints] - before
    np.testing.assert_allclose(moved, 0.05, atol=1e-3)
    env.close()


def test_a_registered_controller_takes_its_own_settings(swing):
    part = {"type": "ROCKING", "angle": 0.2, "gripper": None}
    config = {"format": 1, "type": "BASIC", "body_parts": {"right": part}}
    env = wbc_suite.make("Lift", robots="Panda", controller_configs=config).unwrapped
    assert [s.name for s in env.action_layout.slices] == ["right"]
    assert str(env.action_layout["right"].units[0]) == "0.2 rad"
    env.close()


@pytest.mark.parametrize(
    ("part", "message"),
    [
        (
            {"type": "ROCKING", "angel": 1},
            r"key 'body_parts\.right\.angel'.*'angle'",
        ),
        ({"type": "ROCKING", "angle": -1}, r"key 'body_parts\.right\.angle' = -1"),
        ({"type": "ROCKIN"}, r"key 'body_parts\.right\.type'.*Did you mean 'ROCKING'"),
        ({"type": 3}, r"key 'body_parts\.right\.type'"),
        ({"angle": 1.0}, r"missing key 'body_parts\.right\.type'"),
        ("ROCKING", r"key 'body_parts\.right' = 'ROCKING': not a table"),
    ],
)
def test_mistakes_in_the_config_of_a_part_are_named(swing, part, message):
    config = {"format": 1, "type": "BASIC", "body_parts": {"right": part}}
    with pytest.raises(ConfigError, match=message):
        load_composite_controller_config(config, "Panda")


def test_a_registered_controller_checks_its_part(swing, monkeypatch):
    config = {"format": 1, "type": "BASIC", "body_parts": {"head": {"type": "ROCKING"}}}
    load_composite_controller_config(config, "GR1")
    monkeypatch.setattr(SwingController, "needs_hand", True)
    with pytest.raises(ConfigError, match=r"ROCKING needs a hand.*right, left"):
        load_composite_controller_config(config, "GR1")


def test_a_base_is_for_controllers_that_drive_one(swing, monkeypatch):
    config = {"format": 1, "type": "BASIC", "body_parts": {"base": {"type": "ROCKING"}}}
    with pytest.raises(ConfigError, match="driven by BASE_VELOCITY, not by ROCKING"):
        load_composite_controller_config(config, "PandaOmron")
    monkeypatch.setattr(SwingController, "drives_base", True)
    load_composite_controller_config(config, "PandaOmron")
    config["body_parts"] = {"right": {"type": "ROCKING"}}
    with pytest.raises(ConfigError, match="ROCKING drives the part 'base'"):
        load_composite_controller_config(config, "PandaOmron")


def test_a_robot_with_a_free_root_needs_a_controller_that_holds_it(swing, monkeypatch):
    config = {"format": 1, "type": "BASIC", "body_parts": {"legs": {"type": "ROCKING"}}}
    with pytest.raises(ConfigError, match="has a free root"):
        load_composite_controller_config(config, "Spot")
    monkeypatch.setattr(SwingController, "holds_root", True)
    load_composite_controller_config(config, "Spot")


class Typeless(FrozenModel):
    """A config without a type."""


@pytest.mark.parametrize(
    ("name", "config", "message"),
    [
        ("ROCKING", SwingConfig, "'ROCKING' exists already"),
        ("rocking", SwingConfig, "'ROCKING' exists already"),
        ("", SwingConfig, "'' cannot be the name of a part controller"),
        ("OTHER", SwingConfig, r"needs the field type: Literal\['OTHER'\]"),
        ("OTHER", Typeless, r"Typeless: .*needs the field type"),
    ],
)
def test_registration_is_checked(swing, name, config, message):
    with pytest.raises(ConfigError, match=message):
        register_part_controller(name, SwingController, config)
    assert "OTHER" not in PART_CONTROLLERS


def test_the_type_of_names_lists_the_built_in_controllers():
    names = get_args(PartControllerName)
    assert tuple(PART_CONTROLLERS)[: len(names)] == names  # then those of other modules


@pytest.mark.parametrize("name", get_args(PartControllerName))
def test_defaults_of_each_controller_are_a_config_of_it(name):
    config = load_part_controller_config(name)
    assert config["type"] == name
    model = PART_CONTROLLERS[name].config
    assert model.model_validate(config).model_dump()["type"] == name


def test_an_unknown_part_controller_is_refused_with_the_nearest_name():
    with pytest.raises(UnknownNameError, match="Did you mean 'OSC_POSE'"):
        load_part_controller_config("OSC_POS")


@compiled
def damper(physics, law, drives):
    """Let the joints' velocities decay at a rate, and hold no position."""
    for j in range(law.first, law.last):
        dof = drives[j].dof
        physics.acceleration[dof] = -law.parameters[0] * physics.qvel[dof]


class DamperConfig(PartSettings):
    """Joints that can be guided by hand: velocities decay."""

    type: Literal["DAMPER"] = "DAMPER"
    rate: PositiveFloat = 5.0


class DamperController(PartController[Law]):
    """Has no slice of the action; its law has a kernel of its own."""

    def __init__(self, part, config, state):
        self.slices = ()
        self.law = Law("DAMPER", state, part.joints)
        self.law.record["parameters"][0, 0] = config.rate

    def reset(self, state):
        pass

    def set_goal(self, values, period):
        pass

    @property
    def hold_action(self):
        return np.zeros(0)


@pytest.mark.slow
def test_a_controller_with_a_law_of_its_own_runs_in_the_loop(forget):
    """Inverse dynamics make a law `a = -r v` exact: velocities decay by exp(-r t)."""
    forget(PART_CONTROLLERS, "DAMPER")
    forget(LAWS, "DAMPER")
    register_law("DAMPER", damper)
    register_part_controller("DAMPER", DamperController, DamperConfig)
    part = {"type": "damper", "rate": 4.0, "gripper": None}
    config = {"format": 1, "type": "BASIC", "body_parts": {"right": part}}
    env = wbc_suite.make("Lift", robots="Panda", controller_configs=config)
    env.reset(seed=0)
    data, arm = env.simulation.data, env.controllers[0].parts["right"]
    dofs = arm.law.drives["dof"]
    data.qvel[dofs] = start = 0.2 * np.array([1, -1, 1, -1, 1, -1, 1.0])
    begin = data.time
    for _ in range(10):
        env.step(env.hold_action)
    expected = start * np.exp(-4.0 * (data.time - begin))
    np.testing.assert_allclose(data.qvel[dofs], expected, rtol=0.02, atol=1e-4)
    env.close()


class Incomplete(PartController[JointLaw]):
    """Lacks most of what it must have."""

    def reset(self, state):
        """Do nothing."""


class OtherConfig(FrozenModel):
    """A config of its own type."""

    type: Literal["OTHER"] = "OTHER"


@pytest.mark.parametrize(
    ("controller", "message"),
    [
        (Incomplete, "Incomplete: .*'OTHER' lacks hold_action, set_goal"),
        (SwingConfig, "SwingConfig: .*'OTHER' derives from PartController"),
    ],
)
def test_an_incomplete_controller_is_refused_at_registration(controller, message):
    with pytest.raises(ConfigError, match=message):
        register_part_controller("OTHER", controller, OtherConfig)
    assert "OTHER" not in PART_CONTROLLERS


def test_a_controller_without_a_law_is_named(swing, monkeypatch):
    def constructor(self, part, config, state):
        self.slices = ()

    monkeypatch.setattr(SwingController, "__init__", constructor)
    with pytest.raises(ConfigError, match="SwingController does not set law"):
        wbc_suite.make("Lift", robots="Panda", controller_configs="ROCKING")
