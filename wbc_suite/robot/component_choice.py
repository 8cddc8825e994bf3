"""Replace components of an assembly by the caller's grippers and base.

A gripper may fit one hand only (`side` in its header). A base defines its own `[root]`.
A base without a body is only a root and fits every robot.
"""

from collections.abc import Callable, Iterator, Mapping

from wbc_suite.catalogue import Catalogue
from wbc_suite.errors import ConfigError, DescriptionError, UnknownNameError
from wbc_suite.robot.robot_file import Assembly, Component, Part, is_path

Choice = str | Mapping[str, str] | None
"""A component for every side, or one per side; None keeps those of the assembly."""

Reader = Callable[[Part], Component]


def choose(
    assembly: Assembly,
    *,
    gripper: Choice,
    base: Choice,
    read: Reader,
    catalogue: Catalogue,
) -> Assembly:
    """Return the assembly with the caller's components in place of its own."""
    for kind, choice in (("gripper", gripper), ("base", base)):
        _check(assembly, kind, choice)
    parts = tuple(_replaced(assembly.parts, {"gripper": gripper, "base": base}))
    chosen = assembly.model_copy(update={"parts": parts})
    for part in parts:
        _check_side(chosen, part, read=read, catalogue=catalogue)
    if base is None:
        return chosen
    if any(part.choice == "base" for part in assembly.parts):
        return chosen.model_copy(update={"root": None})  # the root of the base
    return _on_bare_root(chosen, str(base), read=read, catalogue=catalogue)


def is_bare(component: Component) -> bool:
    """Whether a component has no body: no mass, shape or joint."""
    return not any(
        link.mass or link.joint or link.visual or link.collision
        for link in component.links
    )


def _check(assembly: Assembly, kind: str, choice: Choice) -> None:
    names = choice.values() if isinstance(choice, Mapping) else (choice,)
    for name in names:
        # Checked at run time for callers without a type checker.
        if not isinstance(name, str | None):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise ConfigError(
                f"{kind}: give a name, a file, or a name for each side, not {name!r}."
            )
    sides = {p.side or p.name for p in assembly.parts if p.choice == kind}
    if isinstance(choice, Mapping):
        for side in choice:
            if side not in sides:
                raise UnknownNameError(f"side with a {kind}", side, sides)
    elif kind == "gripper" and not sides and not _is_none(choice):
        raise DescriptionError(f"{assembly.assembly.name} has no place for a gripper.")


def _is_none(choice: Choice) -> bool:
    """Whether a choice leaves a component out; `NullMount` and the like are names."""
    return choice is None or (isinstance(choice, str) and choice.casefold() == "none")


def _replaced(parts: tuple[Part, ...], choices: dict[str, Choice]) -> Iterator[Part]:
    for part in parts:
        choice = choices.get(part.choice or "")
        if isinstance(choice, Mapping):
            choice = choice.get(part.side or part.name)
        if choice is None:
            yield part
        elif not _is_none(choice):
            yield _with_component(part, str(part.choice), choice)


def _with_component(part: Part, kind: str, name: str) -> Part:
    component = name if is_path(name) else f"{kind}/{name}"
    return part.model_copy(update={"component": component})


def _check_side(
    assembly: Assembly, part: Part, *, read: Reader, catalogue: Catalogue
) -> None:
    """Refuse a gripper of the other side, and list grippers that fit."""
    side = read(part).component.side
    if side in (None, part.side) or part.side not in ("right", "left"):
        return
    hand, robot = part.component.rpartition("/")[2], assembly.assembly.name
    fault = f"{robot}: '{hand}' is a {side} hand and does not fit the {part.side} arm"
    if side in [p.side for p in assembly.parts if p.choice == "gripper"]:
        raise DescriptionError(
            f"{fault}; give one for each side, such as gripper = "
            f'{{"{side}": "{hand}", "{part.side}": "..."}}.'
        )
    fitting = [
        name
        for name in catalogue.called("robots/gripper")
        if read(_with_component(part, "gripper", name)).component.side
        in (None, part.side)
    ]
    raise DescriptionError(f"{fault}. These fit: {', '.join(fitting)}.")


def _on_bare_root(
    assembly: Assembly, base: str, *, read: Reader, catalogue: Catalogue
) -> Assembly:
    """Put a robot with its own legs or wheels on the root of a base without body.

    The robot keeps its own root pose.
    """
    if _is_none(base):
        return assembly
    part = _with_component(Part(name="base", component="base"), "base", base)
    component = read(part)
    own = assembly.root or read(assembly.parts[0]).root
    if not is_bare(component):
        roots = [
            name
            for name in catalogue.called("robots/base")
            if is_bare(read(_with_component(part, "base", name)))
        ]
        raise DescriptionError(
            f"{assembly.assembly.name} has its own lower body, and '{base}' is a body "
            f"for arms; only bases without a body fit: {', '.join(roots)}."
        )
    root = component.root.model_copy(update={"pos": own.pos, "quat": own.quat})
    return assembly.model_copy(update={"root": root})
