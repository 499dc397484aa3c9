"""Whole-program compilation: functions that only compiled code calls become part of their caller.

numba makes every function a separate library: it is optimised, compiled to machine code, wrapped for calls from Python,
and linked into every caller, where all this is repeated. For the event code of a kernel, sixty functions deep, that
took most of the first start. A ``Part`` is translated to LLVM's intermediate code only. The ``Program`` that Python
calls links all its parts, makes them private and optimises once: functions with a single caller are inlined, arguments
that are equal in all calls become constants, and unused functions are not compiled.
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
    """Do deeply nested work without system calls at the chunk boundaries of Python's stack.

    Python stores its frames in chunks of 16 KB, mapped when a call needs one and unmapped when that call returns. Calls
    that repeatedly cross such a boundary took a fifth of the time of numba's nested compilations. A frame this large
    gets a chunk of 1 MB, and the calls below it fit into the rest of that.
    """
    return work()


_with_room.__code__ = _with_room.__code__.replace(co_stacksize=70_000)


class Part(JITCodeLibrary):
    """The unoptimised code of a function without an entry point for Python, and of everything that it calls."""

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
        """The hook through which numba sets the function's environment, which only entry points for Python use."""
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
        # Python's garbage collector took a tenth of the time and finds almost nothing here.
        collects = gc.isenabled()
        gc.disable()
        try:
            return _with_room(super()._compile_core)
        finally:
            if collects:
                gc.enable()
