"""The plain way: everything through ``numba.njit`` and ``numba.extending``, without numba's private parts.

The lane loops are compiled as ordinary Python, with the same fused multiply-adds as in ``lowering``; these, selections
and the views of a double's bits are intrinsics.
"""

import ast
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar, cast

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from sprag_study.engine.compile.fused import fused
from sprag_study.engine.compile.places import use_cache
from sprag_study.engine.compile.ways import GROUP

P = ParamSpec("P")
R = TypeVar("R")


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile ``function`` on first call and keep the machine code in numba's on-disk cache; strict arithmetic."""
    use_cache()
    return cast(Callable[P, R], numba.njit(cache=True, error_model="numpy")(function))


#: Functions called by compiled code need no special treatment here.
part = inlined = compiled


@numba.njit
def _same(value: Any) -> Any:
    return value


#: ``unmanaged(array)`` is the array.
unmanaged = cast(Callable[[Any], Any], _same)


@intrinsic
def _select(typing_context: Any, condition: Any, yes: Any, no: Any) -> Any:  # noqa: ARG001
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:  # noqa: ARG001
        return builder.select(*arguments)

    return types.float64(types.boolean, types.float64, types.float64), generate


@intrinsic
def _fma(typing_context: Any, a: Any, b: Any, c: Any) -> Any:  # noqa: ARG001
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:  # noqa: ARG001
        return builder.fma(*arguments)

    return types.float64(types.float64, types.float64, types.float64), generate


@intrinsic
def _bits_of(typing_context: Any, number: Any) -> Any:  # noqa: ARG001
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:  # noqa: ARG001
        return builder.sitofp(builder.bitcast(arguments[0], ir.IntType(64)), ir.DoubleType())

    return types.float64(types.float64), generate


@intrinsic
def _of_bits(typing_context: Any, number: Any) -> Any:  # noqa: ARG001
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:  # noqa: ARG001
        return builder.bitcast(builder.fptosi(arguments[0], ir.IntType(64)), ir.DoubleType())

    return types.float64(types.float64), generate


class _Straight(ast.NodeTransformer):
    """Writes loops over the groups that the call asks for, and selections without branches."""

    def visit_For(self, node: ast.For) -> ast.AST:
        self.generic_visit(node)
        node.iter = ast.parse(f"range(groups*{GROUP})", mode="eval").body
        return node

    def visit_IfExp(self, node: ast.IfExp) -> ast.AST:
        self.generic_visit(node)
        return ast.Call(ast.Name("select", ast.Load()), [node.test, node.body, node.orelse], [])

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.AST:
        self.generic_visit(node)
        assert isinstance(node.op, ast.Or)
        return ast.BinOp(node.values[0], ast.BitOr(), node.values[1])


def lane_loops(text: str, first: str, second: str) -> Callable[[Any, float, float, int], None]:
    """A function ``(W, a, b, groups)`` for compiled code, as that of ``lowering``."""
    loops = _Straight().visit(fused(text))
    function = ast.parse(f"def run(workspace, {first}, {second}, groups):\n    W = workspace.ravel()")
    assert isinstance(function.body[0], ast.FunctionDef)
    function.body[0].body += loops.body
    names = {"select": _select, "bits_of": _bits_of, "of_bits": _of_bits, "fma": _fma}
    exec(compile(ast.fix_missing_locations(function), "<lane loops>", "exec"), names)  # noqa: S102
    return cast(Callable[[Any, float, float, int], None], numba.njit(error_model="numpy")(names["run"]))


def lane_mask(sign: str, row: int, lanes: int) -> Callable[[Any], int]:
    """A function ``(W)`` for compiled code that finds lanes, as that of ``lowering``."""
    names: dict[str, Any] = {}
    text = f"""
def find(workspace):
    W = workspace.ravel()
    mask = 0
    for lane in range({lanes}):
        value = W[{row * lanes} + lane]
        if value {sign} 0.0 or value != value:
            mask |= 1 << lane
    return mask
"""
    exec(text, names)  # noqa: S102
    return cast(Callable[[Any], int], numba.njit(names["find"]))


@numba.njit
def _lowest(mask: int) -> int:
    lane = 0
    while (mask >> lane) & 1 == 0:
        lane += 1
    return lane


#: ``lowest(mask)`` is the first lane of a mask that is not 0, for compiled code.
lowest = cast(Callable[[int], int], _lowest)


def constant_record(record: np.void) -> Callable[[Any], Any]:  # noqa: ARG001
    """A function for compiled code that gives a record: here the one that it gets, which is equal."""
    return cast(Callable[[Any], Any], _same)


def constant_shape(*shape: int) -> Callable[[Any], Any]:  # noqa: ARG001
    """A function for compiled code that gives an array: here as it is."""
    return cast(Callable[[Any], Any], _same)
