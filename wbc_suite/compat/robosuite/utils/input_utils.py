"""Choices that demos ask on the terminal."""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

import wbc_suite.compat.robosuite as suite
import wbc_suite.compat.robosuite.utils.transform_utils as T
from wbc_suite.compat.robosuite.robots import (
    ROBOT_CLASS_MAPPING,
    FixedBaseRobot,
    LeggedRobot,
    MobileRobot,
    WheeledRobot,
)

__all__ = [  # scripts import all of it
    "ROBOT_CLASS_MAPPING",
    "FixedBaseRobot",
    "LeggedRobot",
    "MobileRobot",
    "T",
    "WheeledRobot",
    "choose_controller",
    "choose_environment",
    "choose_multi_arm_config",
    "choose_robots",
    "np",
    "suite",
]


SINGLE = (
    *("Sawyer", "Panda", "Jaco", "Kinova3", "IIWA", "UR5e", "XArm7"),
    "SpotWithArmFloating",
)
"""Robots with one arm that scripts offer."""


def _choose(kind: str, options: Iterable[Any], ask: Callable[[str], str]) -> Any:
    """Return the chosen option: a number or a name; the first for anything else."""
    known = list(options)
    listing = "\n".join(f"[{k}] {option}" for k, option in enumerate(known))
    answer = ask(f"{kind}:\n{listing}\nChoose (0 to {len(known) - 1}): ").strip()
    if answer in known:
        return answer
    return (
        known[int(answer)]
        if answer.isdigit() and int(answer) < len(known)
        else known[0]
    )


def choose_environment() -> str:
    """Return the name of an environment."""
    from wbc_suite.compat.robosuite.environments import ALL_ENVIRONMENTS

    return _choose("Environment", sorted(ALL_ENVIRONMENTS), input)


def choose_controller(part_controllers: bool = False) -> str:
    """Return the name of a composite controller, or of a part's."""
    from wbc_suite.compat.robosuite import controllers

    if part_controllers:
        return _choose("Controller", controllers.ALL_PART_CONTROLLERS, input)
    return _choose("Controller", controllers.ALL_COMPOSITE_CONTROLLERS, input)


def choose_multi_arm_config() -> str:
    """Return an arrangement of two arms."""
    known = ("opposed", "parallel", "single-robot")
    return _choose("Configuration", known, input)


def choose_robots(
    exclude_bimanual: bool = False,
    use_humanoids: bool = False,
    exclude_single_arm: bool = False,
) -> str:
    """Return the name of a robot."""
    names = set() if exclude_single_arm else {*SINGLE}
    if not exclude_bimanual:
        names |= {"Baxter", "GR1ArmsOnly", "Tiago"}
    if use_humanoids:
        names.add("GR1ArmsOnly")
    return _choose("Robot", sorted(names), input)
