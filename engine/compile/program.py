"""Whole programs instead of many small ones: how functions that only compiled code calls become part of their caller.

numba makes every function a library of its own: optimised, turned into machine code, wrapped for calls from Python, and
then linked into every caller, where all that is done again. For the event code of a kernel, sixty functions deep, that
was most of the first start. A ``Part`` goes no further than LLVM's intermediate code. The ``Program`` that Python calls
takes all its parts in, makes them private to itself and optimises once: what is called from one place is taken in
there, what is the same at every call becomes a constant, and nothing is compiled that is not called.
"""

# mypy: allow-untyped-calls
# (numba declares none of its own)
import gc
from collections.abc import Callable
from typing import Any

from llvmlite.binding import Linkage
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_lock import require_global_compiler_lock


def _with_room(work: Callable[[], Any]) -> Any:
    """Do deeply nested work without a system call at every border of Python's stack.

    Python keeps its frames in pieces of 16 KB, mapped when a call needs one and unmapped when that call returns. Calls
    that go to and fro over such a border cost numba's nested compilations a fifth of their time. A frame this large
    gets a piece of 1 MB, and the calls below it find room in the rest of that.
    """
    return work()


_with_room.__code__ = _with_room.__code__.replace(co_stacksize=70_000)


class Part(JITCodeLibrary):
    """The code of a function without entry from Python, and of all that it calls, not yet optimised."""

    def finalize(self) -> None:
        require_global_compiler_lock()
        self._raise_if_finalized()
        for library in dict.fromkeys(self._linking_libraries):
            self._reload_init.update(library._reload_init)
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._finalize_dynamic_globals()
        self._finalized = True

    @property
    def codegen(self) -> Any:
        """What numba tells the address of the function's environment, which only entries from Python use."""
        return self

    def set_env(self, name: str, environment: Any) -> None:
        """Nothing to set."""

    def get_pointer_to_function(self, name: str) -> int:  # noqa: ARG002
        """There is no machine code."""
        self._ensure_finalized()
        return 0

    def serialize_using_object_code(self) -> Any:
        """The form numba's cache keeps: there is no object code."""
        return self.serialize_using_bitcode()


class Program(JITCodeLibrary):
    """The code of a function that Python calls, with all its parts private to it."""

    def _optimize_final_module(self) -> None:
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == Linkage.linkonce_odr:
                function.linkage = Linkage.internal
        super()._optimize_final_module()


class PartCompiler(Compiler):
    """numba's compiler, for parts."""

    library: type[JITCodeLibrary] = Part

    def define_pipelines(self) -> Any:
        state = self.state
        state.library = self.library(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        state.flags.no_cfunc_wrapper = True
        state.flags.no_cpython_wrapper = self.library is Part
        return super().define_pipelines()


class ProgramCompiler(PartCompiler):
    """numba's compiler, for programs, with all their parts."""

    library = Program

    def _compile_core(self) -> Any:
        # A tenth of the time went to Python's collector, which finds next to nothing here.
        collects = gc.isenabled()
        gc.disable()
        try:
            return _with_room(super()._compile_core)
        finally:
            if collects:
                gc.enable()
