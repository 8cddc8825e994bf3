"""Choices that demos ask on the terminal."""

from collections.abc import Callable, Iterable
from typing import Any


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
    known = ("single-robot", "opposed", "parallel")
    return _choose("Configuration", known, input)


def choose_robots(
    exclude_bimanual: bool = False,
    use_humanoids: bool = False,
    exclude_single_arm: bool = False,
) -> str:
    """Return the name of a robot."""
    from wbc_suite.robot import load_robot

    single = ("Panda", "Sawyer", "IIWA", "Jaco", "Kinova3", "UR5e")
    double = ("Baxter", "Tiago") + (("GR1",) if use_humanoids else ())
    names = (() if exclude_single_arm else single) + (
        () if exclude_bimanual else double
    )
    return _choose("Robot", (n for n in names if load_robot(n).hands), input)
