import gc
from typing import Any

import numba
import pytest
from numba.core import event

from wbc_suite.compiling import compiled, compiled_inner, inlined


@inlined
def doubled(x):
    return 2.0 * x


@compiled_inner
def squared(x):
    return doubled(x) * x / 2.0


@compiled
def risen(x):
    return squared(x) + 1.0


@compiled
def risen_twice(x):
    return risen(risen(x))


@compiled_inner
def lonely(x):
    return doubled(x)


def test_functions_are_the_same_from_python_and_from_compiled_code():
    assert risen_twice(2.0) == 26.0
    assert risen(3.0) == 10.0


def test_code_for_callers_is_no_machine_code():
    dispatcher: Any = lonely
    dispatcher.compile((numba.float64,))
    (made,) = dispatcher.overloads.values()
    name = made.fndesc.mangled_name
    assert name in [function.name for function in made.library.get_defined_functions()]
    assert not made.library.codegen._engine.is_symbol_defined(name)


@compiled_inner
def raised(x, count):
    for _ in range(count):
        x += 1.0
    return x


@compiled
def raised_twice(x):
    return raised(x, 2) + raised(x, 3)


def test_constants_share_one_form_of_a_function():
    assert raised_twice(1.0) == 7.0
    dispatcher: Any = raised
    for count in (2, 3):  # as their callers ask, which may have come from disk
        kinds = [numba.float64, numba.types.literal(count)]
        dispatcher.get_call_template(kinds, {})
    assert dispatcher.signatures == [(numba.float64, numba.int64)]


@inlined
def inlined_larger(x, y):
    return max(x, y)


@compiled_inner
def larger(x, y, z):
    return max(inlined_larger(x, y), z)


def test_functions_of_all_kinds_share_one_form_of_what_numba_brings():
    dispatcher: Any = larger
    with event.install_recorder("numba:compile") as recorder:
        dispatcher.compile(3 * (numba.float32,))  # which nothing else here is of
    functions = [made.data["dispatcher"].py_func for _, made in recorder.buffer]
    theirs = [f for f in functions if f.__module__.startswith("numba.")]
    assert len(theirs) == 2  # the start and the end of one


@compiled
def broken(x):
    return x.nothing_of_the_kind


def test_rubbish_is_collected_again_after_compiling_fails():
    assert gc.isenabled()
    with pytest.raises(numba.TypingError):
        broken(1.0)
    assert gc.isenabled()
