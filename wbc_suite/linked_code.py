"""Compiled functions that are optimised only where others call them.

Numba optimises a function, makes machine code of it, links the optimised code into
each caller, and optimises it again there: a law that a loop reaches through three
calls goes through it all four times. What only compiled functions call needs neither.
"""

from typing import Any, Literal

from numba._dynfunc import make_function
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
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


class LinkedCompiler(CompilerBase):
    """Numba's compiler of such functions."""

    def define_pipelines(self) -> list[PassManager]:
        """Return numba's own passes, with lowering into a `LinkedLibrary`."""
        manager = DefaultPassBuilder.define_nopython_pipeline(self.state)
        manager.passes = [
            (LinkedLowering if step is NativeLowering else step, text)
            for step, text in manager.passes
        ]
        manager.finalize()
        return [manager]
