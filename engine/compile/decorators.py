"""The decorators of the way ``programs``; they preserve signatures for the type checker."""

from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar, cast

import numba
from numba.core import cgutils
from numba.core.compiler import CompilerBase
from numba.core.types import unliteral
from numba.extending import intrinsic

from sprag_study.engine.compile.places import use_cache
from sprag_study.engine.compile.program import PartCompiler, ProgramCompiler

P = ParamSpec("P")
R = TypeVar("R")


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile ``function`` on first call and keep the machine code in numba's on-disk cache.

    Strict arithmetic: division by zero gives infinities as in numpy, and nothing is contracted or reordered. So all
    inlined copies of a function return the same bits.
    """
    return _compiled(function, ProgramCompiler)


def part(function: Callable[P, R]) -> Callable[P, R]:
    """The same for a function that only compiled code calls: it is compiled as part of its caller (``program``)."""
    return cast(Callable[P, R], _without_entry(_compiled(function, PartCompiler)))


def inlined(function: Callable[P, R]) -> Callable[P, R]:
    """A short part that is inlined, so that its callers need not pass their many arrays."""
    return cast(Callable[P, R], _without_entry(_compiled(function, PartCompiler, forceinline=True)))


def _compiled(
    function: Callable[P, R], pipeline_class: type[CompilerBase], forceinline: bool = False
) -> Callable[P, R]:
    use_cache()
    decorate = numba.njit(cache=True, error_model="numpy", pipeline_class=pipeline_class, forceinline=forceinline)
    return cast(Callable[P, R], _for_any_number(decorate(function)))


def _for_any_number(dispatcher: Any) -> Any:
    """Make compiled callers that pass a constant use the code for any number of its type.

    Otherwise numba compiles another copy of the function, and of everything that it calls with the constant, for every
    constant, which took half of the time of the first start.
    """
    find = dispatcher.get_call_template

    def without_constants(args: Any, kws: Any) -> Any:
        types = [unliteral(arg) for arg in args]  # type: ignore[no-untyped-call]
        named = {name: unliteral(arg) for name, arg in kws.items()}  # type: ignore[no-untyped-call]
        return find(types, named)

    dispatcher.get_call_template = without_constants
    return dispatcher


def _without_entry(dispatcher: Any) -> Any:
    """Make calls from Python raise TypeError: no code for them is compiled or loaded from the cache."""

    def refuse(*_arguments: Any, **_named: Any) -> None:
        raise TypeError(f"{dispatcher.py_func.__name__} is for compiled callers only")

    def add_overload(result: Any) -> None:
        dispatcher.overloads[tuple(result.signature.args)] = result

    dispatcher._compile_for_args = refuse
    dispatcher.add_overload = add_overload
    return dispatcher


@intrinsic
def _unmanaged(typing_context: Any, array: Any) -> Any:  # noqa: ARG001
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        make = context.make_array(signature.args[0])
        given, bare = make(context, builder, arguments[0]), make(context, builder)
        for field in ("data", "shape", "strides", "itemsize", "nitems"):
            setattr(bare, field, getattr(given, field))
        for field in ("meminfo", "parent"):
            setattr(bare, field, cgutils.get_null_value(getattr(given, field).type))  # type: ignore[no-untyped-call]
        return bare._getvalue()

    return array(array), generate


#: ``unmanaged(array)`` is the same array without its reference count, for compiled code whose caller keeps it alive.
#: numba counts references at many calls, atomically; without that the workload of one pendulum
#: (`benchmarks/workloads.py`) went from 3850 to 5000 cases a second.
unmanaged = cast(Callable[[Any], Any], _unmanaged)
