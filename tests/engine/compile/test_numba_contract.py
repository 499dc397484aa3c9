"""What the engine uses of numba without numba's promise to keep it: each attribute by name, and why it is used.

When this fails with a new numba, docs/porting-numba.md says what to do.
"""

from __future__ import annotations

import ast
import inspect
from pathlib import Path
from typing import Any

import llvmlite.binding
import numba
import numba.core.caching
import numba.core.compiler
import numba.core.compiler_lock
import pytest
from numba.core import cgutils, types
from numba.core.registry import cpu_target

from sprag_study.engine.compile import decorators, lowering, plain, program

COMPILE = Path(program.__file__).parent


@numba.njit
def _identity(value: float) -> float:
    return value


def _objects() -> dict[str, Any]:
    """One object of each kind whose attributes are used."""
    context = cpu_target.target_context
    codegen = context.codegen()
    builder = llvmlite.ir.IRBuilder(
        llvmlite.ir.Function(
            llvmlite.ir.Module(), llvmlite.ir.FunctionType(llvmlite.ir.VoidType(), []), "empty"
        ).append_basic_block()
    )
    array = context.make_array(types.float64[::1])(context, builder)
    return {
        "library": codegen.create_library("contract"),
        "codegen": codegen,
        "module": llvmlite.binding.parse_assembly(""),
        "compiler": numba.core.compiler.Compiler,
        "flags": numba.core.compiler.Flags(),
        "dispatcher": _identity,
        "context": context,
        "array": array,
        "cgutils": cgutils,
        "types": types,
        "numba.core.compiler_lock": numba.core.compiler_lock,
        "numba.core.compiler": numba.core.compiler,
        "numba.config": numba.config,
        "locator": numba.core.caching,
        "locator class": numba.core.caching.UserProvidedCacheLocator(_identity.py_func, __file__),
    }


#: (object, attribute): why.
USED = {
    # program.py: a function's code as part of its caller
    ("library", "finalize"): "replaced: a part is linked together and not optimised",
    ("library", "_raise_if_finalized"): "called by the replaced finalize, as numba's own does",
    ("library", "_linking_libraries"): "the libraries of the functions that a part calls",
    ("library", "_reload_init"): "what must be loaded again with cached code, handed on to the caller",
    ("library", "_final_module"): "the LLVM module that parts are linked into and whose functions become internal",
    ("library", "_get_module_for_linking"): "a part's module, which its caller links in",
    ("library", "_finalize_dynamic_globals"): "called by the replaced finalize, as numba's own does",
    ("library", "_finalized"): "set by the replaced finalize, as numba's own does",
    ("library", "_ensure_finalized"): "called before a part is asked for its address, as numba's own does",
    ("library", "codegen"): "replaced: what numba tells the environment's address, for which a part has no code",
    ("codegen", "set_env"): "numba calls it on what codegen returns",
    ("library", "get_pointer_to_function"): "replaced: a part has no machine code",
    ("library", "serialize_using_object_code"): "replaced: a part is cached as bitcode",
    ("library", "serialize_using_bitcode"): "the form in which a part is cached",
    ("library", "_optimize_final_module"): "extended: parts become internal to the program before it is optimised",
    ("library", "enable_object_caching"): "the library that replaces numba's can be cached too",
    ("module", "functions"): "the functions of a program, parts included",
    ("compiler", "define_pipelines"): "extended: the place where the library and the wrappers are chosen",
    ("compiler", "_compile_core"): "extended: compiled in one piece of Python's stack and without its collector",
    ("flags", "no_cfunc_wrapper"): "no entry for C",
    ("flags", "no_cpython_wrapper"): "no entry from Python for parts",
    ("numba.core.compiler", "Compiler"): "the class of the compilers of parts and programs",
    ("numba.core.compiler", "CompilerBase"): "the type of both",
    (
        "numba.core.compiler_lock",
        "require_global_compiler_lock",
    ): "called by the replaced finalize, as numba's own does",
    # decorators.py: no copy for each constant, no entry from Python
    ("dispatcher", "get_call_template"): "replaced: compiled callers that pass a constant use the code for its type",
    ("dispatcher", "_compile_for_args"): "replaced: a part that Python calls raises TypeError",
    ("dispatcher", "add_overload"): "replaced: a part has no entry point to add",
    ("dispatcher", "overloads"): "where the replaced add_overload puts the code",
    ("types", "unliteral"): "the type of a constant without its value",
    # decorators.py and lowering.py: intrinsics
    ("context", "make_array"): "reads and writes the fields of an array",
    ("context", "get_dummy_value"): "the value of a function that returns nothing",
    ("context", "get_value_type"): "the LLVM type of a record",
    ("array", "_getvalue"): "an array made of fields",
    ("array", "data"): "a workspace's first element, and a field of an array without reference count",
    **{("array", field): "a field of an array without reference count" for field in ("shape", "strides", "itemsize")},
    **{("array", field): "a field of an array without reference count" for field in ("nitems", "meminfo", "parent")},
    ("context", "get_abi_sizeof"): "bytes of an element, for the strides of a constant shape",
    ("context", "get_data_type"): "the LLVM type of an element",
    ("cgutils", "pack_array"): "a constant shape and its strides",
    ("cgutils", "for_range"): "the loop over lanes",
    ("cgutils", "get_null_value"): "no reference count",
    ("cgutils", "global_constant"): "the layout as a constant",
    # places.py
    ("numba.config", "CACHE_DIR"): "where compiled code is kept (documented as an environment variable only)",
    ("numba.config", "CACHE_LOCATOR_CLASSES"): "which classes name the folder of a function (documented likewise)",
    ("locator", "UserProvidedCacheLocator"): "the class that names a folder in CACHE_DIR by the path of the sources",
    ("locator class", "_cache_path"): "replaced: the folder that get_cache_path gives",
    ("locator class", "ensure_cache_path"): "extended: once for all functions of a folder",
    ("locator class", "from_function"): "extended: only functions of the engine",
}


@pytest.fixture(scope="module")
def objects() -> dict[str, Any]:
    return _objects()


@pytest.mark.parametrize(("kind", "name"), sorted(USED))
def test_numba_has_what_is_used_of_it(objects: dict[str, Any], kind: str, name: str) -> None:
    assert hasattr(objects[kind], name), (
        f"numba {numba.__version__} has no {kind}.{name} any more ({USED[kind, name]}): see docs/porting-numba.md"
    )


def test_environments_are_set_through_the_codegen_of_the_library() -> None:
    """Where numba sets them otherwise, a part would keep the environments of a function that it is not."""
    import numba.core.base
    import numba.core.cpu

    calls = inspect.getsource(numba.core.cpu.CPUContext.get_executable)
    assert "library.codegen.set_env(" in calls, f"numba {numba.__version__} sets environments otherwise"


def _trees() -> list[tuple[Path, ast.Module]]:
    return [(path, ast.parse(path.read_text(encoding="utf-8"))) for path in sorted(COMPILE.glob("*.py"))]


def test_no_private_attribute_is_used_that_is_not_named_here() -> None:
    own = {
        node.name
        for _path, tree in _trees()
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef | ast.ClassDef)
    } - {name for _kind, name in USED}
    named = own | {name for _kind, name in USED}
    for path, tree in _trees():
        for node in ast.walk(tree):
            if isinstance(node, ast.Attribute) and node.attr.startswith("_") and not node.attr.startswith("__"):
                assert node.attr in named, f"{path.name}:{node.lineno} uses {node.attr}"
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("numba.core"):
                for alias in node.names:
                    assert alias.name in {"cgutils", "types", "JITCodeLibrary", *named}, f"{path.name}: {alias.name}"


@pytest.mark.parametrize(
    ("base", "classes", "added"),
    [
        ("library", (program.Part, program.Program), {"set_env"}),
        ("compiler", (program.PartCompiler, program.ProgramCompiler), {"library"}),
    ],
)
def test_every_method_that_is_replaced_is_named_here(base: str, classes: tuple[type, ...], added: set[str]) -> None:
    for kind in classes:
        for name in vars(kind):
            if not name.startswith("__") and name != "_abc_impl":
                assert name in added or (base, name) in USED, f"{kind.__name__}.{name}"


def test_the_plain_way_uses_nothing_of_numbas_inside() -> None:
    text = inspect.getsource(plain)
    assert "numba.core" not in text
    assert not [
        node.attr for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Attribute) and node.attr.startswith("_")
    ]


def test_both_ways_offer_the_same() -> None:
    for name in ("compiled", "part", "inlined", "unmanaged"):
        assert callable(getattr(decorators, name))
        assert callable(getattr(plain, name))
    for name in ("lane_loops", "lane_mask", "lowest", "constant_record", "constant_shape"):
        assert callable(getattr(lowering, name))
        assert callable(getattr(plain, name))
