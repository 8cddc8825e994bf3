"""Gaits of users, registered like the built-in ones."""

from typing import Literal

import pytest
from pydantic import PositiveFloat

import wbc_suite
from wbc_suite.compiling import compiled
from wbc_suite.errors import ConfigError
from wbc_suite.locomotion import (
    GAITS,
    GaitConfig,
    TrotConfig,
    WalkConfig,
    make_gait,
    plan_trot,
    register_gait,
)


class ShowConfig(TrotConfig):
    """A trot that leaves a mark in `gait.state.progress`, which a trot does not use."""

    type: Literal["show"] = "show"  # pyright: ignore - as the guide says


@compiled
def plan_show(gait, measured, command, dt, plan):
    """Trot, and leave a mark."""
    plan_trot(gait, measured, command, dt, plan)
    gait.state[0].progress = gait.settings[0].apex


@pytest.fixture
def show(forget):
    forget(GAITS, "show")
    register_gait("show", plan_show, ShowConfig)


def config_of(robot, **changes):
    config = wbc_suite.load_composite_controller_config("WHOLE_BODY_ID", robot)
    return config | {"gait": config["gait"] | changes}


@pytest.mark.slow
@pytest.mark.parametrize("is_compiled", [True, False])
def test_a_registered_gait_plans_in_the_loop(show, is_compiled):
    config = config_of("Spot", type="Show", apex=0.06)
    env = wbc_suite.make(
        "Stand", robots="Spot", controller_configs=config, compiled=is_compiled
    )
    env.reset(seed=0)
    env.step(env.hold_action)
    gait = env.controllers[0].dynamics.gait
    assert gait.state["progress"][0] == gait.settings["apex"][0] == 0.06
    env.close()


def test_a_gait_is_checked_at_registration_and_where_it_is_named(show):
    with pytest.raises(ConfigError, match="gait named 'show' exists already"):
        register_gait("SHOW", plan_show, ShowConfig)
    with pytest.raises(ConfigError, match=r"needs the field type: Literal\['other'\]"):
        register_gait("other", plan_show, ShowConfig)
    load = wbc_suite.load_composite_controller_config
    with pytest.raises(ConfigError, match=r"'gait\.type'.*Did you mean 'show'"):
        load(config_of("Spot", type="shew"), "Spot")
    with pytest.raises(ConfigError, match=r"unknown key 'gait.apexx'.* mean 'apex'"):
        load(config_of("Spot", apexx=0.1), "Spot")
    with pytest.raises(ConfigError, match="a gait of type 'show' needs four feet"):
        load(config_of("GR1FreeBody") | {"gait": {"type": "show"}}, "GR1FreeBody")


class AmbleConfig(GaitConfig):
    """Has a number that no other gait has."""

    type: Literal["amble"] = "amble"  # pyright: ignore - as the guide says
    stride: PositiveFloat = 0.3


def test_numbers_of_a_config_are_read_by_name():
    gait = make_gait(AmbleConfig(stride=0.2), [[0.0] * 4] * 4)
    assert gait.settings["stride"][0] == 0.2
    assert gait.settings["apex"][0] == 0.0
    plain = make_gait(WalkConfig(), [[0.0] * 4] * 2)
    assert plain.settings.dtype == make_gait(TrotConfig(), []).settings.dtype
