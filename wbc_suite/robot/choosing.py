"""Choose the components of an assembly: the caller's grippers and base.

A gripper may be made for one hand (`side` in its header), a base says how it stands
(`[root]`). A base without a body of its own is only a root, and so fits every robot.
"""

from collections.abc import Callable, Iterator, Mapping

from wbc_suite.catalogue import Catalogue
from wbc_suite.errors import ConfigError, DescriptionError, UnknownNameError
from wbc_suite.robot.component import Assembly, Component, Part

__all__ = ["Choice", "Reader", "choose", "is_bare", "is_path"]

Choice = str | Mapping[str, str] | None
"""A component for every side, or one for each side, or the assembly's own."""

Reader = Callable[[Part], Component]
"""Reads the component of a part."""

OTHER_SIDE = {"right": "left", "left": "right"}


def choose(
    assembly: Assembly,
    *,
    gripper: Choice,
    base: Choice,
    read: Reader,
    catalogue: Catalogue,
) -> Assembly:
    """Put the caller's components in the place of the assembly's own.

    Args:
        assembly: What the file says.
        gripper: A gripper for all sides, or a mapping from side to gripper.
        base: A base.
        read: Reads a part's component.
        catalogue: Where to look for what would fit.

    Raises:
        DescriptionError: If there is no place for it, or it is for the other hand.
        UnknownNameError: If no such component exists.
    """
    for kind, choice in (("gripper", gripper), ("base", base)):
        _check(assembly, kind, choice)
    parts = tuple(_replaced(assembly.parts, {"gripper": gripper, "base": base}))
    chosen = assembly.model_copy(update={"parts": parts})
    for part in parts:
        _check_hand(chosen, part, read=read, catalogue=catalogue)
    if base is None:
        return chosen
    if any(part.choice == "base" for part in assembly.parts):
        return chosen.model_copy(update={"root": None})  # the base's own
    return _on_bare_root(chosen, str(base), read=read, catalogue=catalogue)


def is_path(name: str) -> bool:
    """Whether a component is a file, not a catalogue name."""
    return name.endswith(".toml")


def is_bare(component: Component) -> bool:
    """Whether a component has no body of its own: no mass, shape or joint."""
    return not any(
        link.mass or link.joint or link.visual or link.collision
        for link in component.links
    )


def _check(assembly: Assembly, kind: str, choice: Choice) -> None:
    names = choice.values() if isinstance(choice, Mapping) else (choice,)
    for name in names:
        # Callers without a type checker are answered in words.
        if not isinstance(name, str | None):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise ConfigError(
                f"{kind}: a name, a file, or a name for each side, not {name!r}."
            )
    sides = {p.side or p.name for p in assembly.parts if p.choice == kind}
    if isinstance(choice, Mapping):
        for side in choice:
            if side not in sides:
                raise UnknownNameError(f"side with a {kind}", side, sides)
    elif kind == "gripper" and not sides and not _is_none(choice):
        raise DescriptionError(f"{assembly.assembly.name} has no place for a gripper.")


def _is_none(choice: Choice) -> bool:
    """Whether a choice leaves something out; `NullMount` and the like are names."""
    return choice is None or (isinstance(choice, str) and choice.casefold() == "none")


def _replaced(parts: tuple[Part, ...], choices: dict[str, Choice]) -> Iterator[Part]:
    for part in parts:
        choice = choices.get(part.choice or "")
        if isinstance(choice, Mapping):
            choice = choice.get(part.side or part.name)
        if choice is None:
            yield part
        elif not _is_none(choice):
            name = choice if is_path(choice) else f"{part.choice}/{choice}"
            yield part.model_copy(update={"component": name})


def _check_hand(
    assembly: Assembly, part: Part, *, read: Reader, catalogue: Catalogue
) -> None:
    """Refuse a hand on the arm of the other side, and name what fits there."""
    made_for = read(part).component.side
    if made_for is None or made_for == part.side or part.side not in OTHER_SIDE:
        return
    hand, robot = part.component.rpartition("/")[2], assembly.assembly.name
    sides = [p.side for p in assembly.parts if p.choice == "gripper"]
    fault = f"{robot}: '{hand}' is a {made_for} hand and does not fit the {part.side}"
    if made_for in sides:
        raise DescriptionError(
            f"{fault} arm; give one for each side, such as gripper = "
            f'{{"{made_for}": "{hand}", "{part.side}": "..."}}.'
        )
    names = catalogue.called("robots/gripper")
    fitting = [n for n in names if _fits(n, part, read)]
    raise DescriptionError(
        f"{fault} arm, the only one; there fit: {', '.join(fitting)}."
    )


def _fits(name: str, part: Part, read: Reader) -> bool:
    other = part.model_copy(update={"component": f"gripper/{name}"})
    return read(other).component.side in (None, part.side)


def _on_bare_root(
    assembly: Assembly, base: str, *, read: Reader, catalogue: Catalogue
) -> Assembly:
    """Put a robot with legs or wheels of its own on the root of a bare base.

    It keeps its own height.
    """
    if _is_none(base):
        return assembly
    part = Part(name="base", component=base if is_path(base) else f"base/{base}")
    component = read(part)
    own = assembly.root or read(assembly.parts[0]).root
    if not is_bare(component):
        names = catalogue.called("robots/base")
        roots = [n for n in names if is_bare(_base(n, part, read))]
        raise DescriptionError(
            f"{assembly.assembly.name} stands on its own body, and '{base}' is a body "
            f"for arms to stand on; it takes only a root: {', '.join(roots)}."
        )
    root = component.root.model_copy(update={"pos": own.pos, "quat": own.quat})
    return assembly.model_copy(update={"root": root})


def _base(name: str, part: Part, read: Reader) -> Component:
    return read(part.model_copy(update={"component": f"base/{name}"}))
