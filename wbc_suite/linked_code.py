"""Compiled functions that are optimised only where others call them.

Numba optimises a function, makes machine code of it, links the optimised code into
each caller, and optimises it again there: a law that a loop reaches through three
calls goes through it all four times. What only compiled functions call needs neither.
"""

from typing import Any, Literal

from numba._dynfunc import make_function
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder, Flags
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.typed_passes import NativeLowering

__all__ = ["LinkedCompiler"]


class LinkedLibrary(JITCodeLibrary):
    """Code as it was lowered, to be linked into that of callers."""

    def finalize(self) -> None:
        """Link in what this code calls; leave all else to its callers."""
        self._raise_if_finalized()
        for library in dict.fromkeys(self._linking_libraries):
            self._reload_init.update(library._reload_init)
            shared = library._get_module_for_linking()
            self._final_module.link_in(shared, preserve=True)
        self._finalize_dynamic_globals()
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)
class LinkedLowering(NativeLowering):
    """Numba's lowering into a `LinkedLibrary`, without machine code."""

    _name = "linked_lowering"

    def run_pass(self, state: Any) -> Literal[True]:
        """Lower a function; let callers find its code by a function without any."""
        name, context = state.func_id.func_qualname, state.targetctx
        state.library = library = LinkedLibrary(context.codegen(), name)
        state.flags.no_compile = True
        super().run_pass(state)
        lowered = state["cr"]
        key = make_function(
            lowered.fndesc.lookup_module(), name, "", 0, lowered.env, (library,)
        )
        context.insert_user_function(key, lowered.fndesc, [library])
        state["cr"] = lowered._replace(cfunc=key)
        return True


class _HandedOn(Flags):
    """Options that functions hand on to numba's own which they call, once and for all.

    Numba finds its functions by these, 45,000 times for GR1, comparing each option;
    one object is equal to itself at once.
    """

    def __eq__(self, other: object) -> bool:
        return self is other

    def __hash__(self) -> int:
        return id(self)


HANDED_ON: Any = _HandedOn()
HANDED_ON.nrt, HANDED_ON.error_model = True, "numpy"


class _Own(Flags):
    """Options of one function, which are its alone.

    What it calls takes the same form whether or not the caller holds a lock, has an
    entry from Python, or is inlined.
    """

    def copy(self) -> Flags:
        """Return what numba hands on in their place."""
        return HANDED_ON


class EntryCompiler(CompilerBase):
    """Numba's compiler, of functions that call the same forms of others."""

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self.state.flags = _Own(self.state.flags)

    def define_pipelines(self) -> list[PassManager]:
        """Return numba's own passes."""
        return [DefaultPassBuilder.define_nopython_pipeline(self.state)]


class LinkedCompiler(EntryCompiler):
    """The same for functions that are linked into their callers."""

    def define_pipelines(self) -> list[PassManager]:
        """Return numba's own passes, with lowering into a `LinkedLibrary`."""
        (manager,) = super().define_pipelines()
        manager.passes = [
            (LinkedLowering if step is NativeLowering else step, text)
            for step, text in manager.passes
        ]
        manager.finalize()
        return [manager]
