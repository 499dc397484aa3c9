"""Compiler from the text of lane loops directly to LLVM, for the arithmetic that ``straight`` writes.

The loops consist of thousands of assignments. numba's type inference alone would take longer for them than everything
else together, although all values are doubles. Here each statement is translated to LLVM instructions inside the numba
function that calls the loops (measured in benchmarks/start.py; docs/adr/0002).

The language is a subset of Python: ``for lane in range(N)``, of which each call runs the requested number of groups,
around assignments to names and to ``W[k + lane]``; ``+ - * /``, comparisons, ``or``, ``a if c else b``, ``abs``, and
the two views of a double's bits of ``straight.log2`` and ``exp2``. Nothing is contracted or reordered; ``fused``
decides which products are fused with sums.
"""

import ast
import math
from collections.abc import Callable
from functools import cache, partial
from typing import Any, cast

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

from sprag_study.engine.compile.fused import fused
from sprag_study.engine.compile.ways import GROUP

_DOUBLE = ir.DoubleType()
_INT = ir.IntType(64)
#: Bytes: the largest vector, a cache line.
_STACK_ALIGNMENT = 64
_ARITHMETIC = {ast.Add: "fadd", ast.Sub: "fsub", ast.Mult: "fmul", ast.Div: "fdiv"}
_COMPARISONS = {ast.Lt: "<", ast.Gt: ">", ast.LtE: "<=", ast.GtE: ">=", ast.Eq: "=="}


class _Lane:
    """Lowers the statements of one loop body; ``names`` maps local names to LLVM values."""

    def __init__(self, builder: Any, workspace: Any, lane: Any, names: dict[str, Any]) -> None:
        self.builder, self.workspace, self.lane, self.names = builder, workspace, lane, names

    def statement(self, node: ast.stmt) -> None:
        assert isinstance(node, ast.Assign)
        target, value = node.targets[0], self.value(node.value)
        if isinstance(target, ast.Name):
            self.names[target.id] = value
        else:
            self.builder.store(value, self.element(target))

    def element(self, node: ast.expr) -> Any:
        """Address of ``W[k + lane]``."""
        assert isinstance(node, ast.Subscript)
        assert isinstance(node.slice, ast.BinOp)
        assert isinstance(node.slice.left, ast.Constant)
        index = self.builder.add(_INT(node.slice.left.value), self.lane, flags=("nsw", "nuw"))
        return self.builder.gep(self.workspace, [index], inbounds=True)

    def value(self, node: ast.expr) -> Any:
        lower = {
            ast.Constant: self._constant,
            ast.Name: self._name,
            ast.Subscript: self._subscript,
            ast.BinOp: self._bin_op,
            ast.UnaryOp: self._unary_op,
            ast.Compare: self._compare,
            ast.BoolOp: self._bool_op,
            ast.IfExp: self._if_exp,
            ast.Call: self._call,
        }[type(node)]
        return lower(node)  # type: ignore[operator]

    def _constant(self, node: ast.Constant) -> Any:
        assert isinstance(node.value, (int, float))
        return _DOUBLE(float(node.value))

    def _name(self, node: ast.Name) -> Any:
        return self.names[node.id]

    def _subscript(self, node: ast.Subscript) -> Any:
        return self.builder.load(self.element(node))

    def _bin_op(self, node: ast.BinOp) -> Any:
        operation = getattr(self.builder, _ARITHMETIC[type(node.op)])
        return operation(self.value(node.left), self.value(node.right))

    def _unary_op(self, node: ast.UnaryOp) -> Any:
        assert isinstance(node.op, ast.USub)
        return self.builder.fneg(self.value(node.operand))

    def _compare(self, node: ast.Compare) -> Any:
        sign = _COMPARISONS[type(node.ops[0])]
        return self.builder.fcmp_ordered(sign, self.value(node.left), self.value(node.comparators[0]))

    def _bool_op(self, node: ast.BoolOp) -> Any:
        assert isinstance(node.op, ast.Or)
        return self.builder.or_(self.value(node.values[0]), self.value(node.values[1]))

    def _if_exp(self, node: ast.IfExp) -> Any:
        return self.builder.select(self.value(node.test), self.value(node.body), self.value(node.orelse))

    def _call(self, node: ast.Call) -> Any:
        assert isinstance(node.func, ast.Name)
        argument, *more = (self.value(given) for given in node.args)
        if node.func.id == "fma":
            return self.builder.fma(argument, *more)
        if node.func.id == "abs":
            return self.builder.call(self.builder.module.declare_intrinsic("llvm.fabs", [_DOUBLE]), [argument])
        if node.func.id == "bits_of":
            return self.builder.sitofp(self.builder.bitcast(argument, _INT), _DOUBLE)
        assert node.func.id == "of_bits"
        return self.builder.bitcast(self.builder.fptosi(argument, _INT), _DOUBLE)


def lane_loops(text: str, first: str, second: str) -> Callable[[Any, float, float, int], None]:
    """A function ``(W, a, b, groups)`` for compiled code that runs the loops in ``text`` over the float64 workspace
    ``W``, contiguous and flat to them, for the first so many groups of `GROUP` lanes.

    ``first`` and ``second`` are the names under which the loops know the numbers a and b. The function can only be
    called from a numba function; it is compiled as part of that one.
    """
    # Whoever loads the caller's machine code from the cache needs no statements.
    statements = cache(partial(fused, text))

    @intrinsic
    def run(typing_context: Any, W: Any, a: Any, b: Any, groups: Any) -> Any:  # noqa: ARG001
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            array = context.make_array(signature.args[0])(context, builder, arguments[0])
            # Vectors without a register are spilled to the stack, which by default is aligned only for the smallest of
            # them.
            builder.function.attributes.alignstack = _STACK_ALIGNMENT
            builder.function.attributes.add("nounwind")  # llvmlite writes no alignment alone
            numbers = {first: arguments[1], second: arguments[2]}
            for loop in statements().body:
                assert isinstance(loop, ast.For)
                with (
                    cgutils.for_range(builder, arguments[3]) as group,
                    cgutils.for_range(builder, _INT(GROUP)) as member,
                ):
                    start = builder.mul(group.index, _INT(GROUP), flags=("nsw", "nuw"))
                    index = builder.add(start, member.index, flags=("nsw", "nuw"))
                    lane = _Lane(builder, array.data, index, dict(numbers))
                    for statement in loop.body:
                        lane.statement(statement)
            return context.get_dummy_value()

        return types.void(W, types.float64, types.float64, types.int64), generate

    return cast(Callable[[Any, float, float, int], None], run)


def lane_mask(sign: str, row: int, lanes: int) -> Callable[[Any], int]:
    """A function ``(W)`` for compiled code that finds the lanes whose element of a workspace row compares with 0 as
    ``sign`` says, or is not a number: bit k of the answer is lane k.
    """
    kind = ir.VectorType(_DOUBLE, lanes)

    @intrinsic
    def find(typing_context: Any, W: Any) -> Any:  # noqa: ARG001
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            array = context.make_array(signature.args[0])(context, builder, arguments[0])
            first = builder.gep(array.data, [_INT(row * lanes)], inbounds=True)
            values = builder.load(builder.bitcast(first, kind.as_pointer()), align=8)
            holds = builder.fcmp_unordered(sign, values, ir.Constant(kind, [0.0] * lanes))
            bits = builder.bitcast(holds, ir.IntType(lanes))
            return bits if lanes == _INT.width else builder.zext(bits, _INT)

        return types.int64(W), generate

    return cast(Callable[[Any], int], find)


@intrinsic
def _lowest(typing_context: Any, mask: Any) -> Any:  # noqa: ARG001
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:  # noqa: ARG001
        return builder.cttz(arguments[0], ir.IntType(1)(1))

    return types.int64(types.int64), generate


#: ``lowest(mask)`` is the first lane of a mask that is not 0, for compiled code.
lowest = cast(Callable[[int], int], _lowest)


def constant_record(record: Any) -> Callable[[Any], Any]:
    """A function for compiled code that gives, for a record of the same type, this one as a constant.

    The compiler then evaluates everything that depends only on its fields: array indices, lengths of loops.
    """
    data = bytearray(record.tobytes())

    @intrinsic
    def fixed(typing_context: Any, given: Any) -> Any:  # noqa: ARG001
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:  # noqa: ARG001
            constant = ir.ArrayType(ir.IntType(8), len(data))(data)
            pointer = cgutils.global_constant(builder, "layout", constant)  # type: ignore[no-untyped-call]
            return builder.bitcast(pointer, context.get_value_type(given))

        return given(given), generate

    return cast(Callable[[Any], Any], fixed)


def constant_shape(*shape: int) -> Callable[[Any], Any]:
    """A function for compiled code that gives a contiguous array of this shape with the shape as a constant.

    The place of an element then depends on its indices only, as in a flat array whose row length is known. The array
    must have passed ``unmanaged``. It is not checked that it has the shape.
    """

    @intrinsic
    def shaped(typing_context: Any, array: Any) -> Any:  # noqa: ARG001
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            view = context.make_array(signature.args[0])(context, builder, arguments[0])
            size = context.get_abi_sizeof(context.get_data_type(array.dtype))
            strides = [size * math.prod(shape[axis + 1 :]) for axis in range(len(shape))]
            view.shape = cgutils.pack_array(builder, [_INT(extent) for extent in shape])  # type: ignore[no-untyped-call]
            view.strides = cgutils.pack_array(builder, [_INT(stride) for stride in strides])  # type: ignore[no-untyped-call]
            return view._getvalue()

        return array(array), generate

    return cast(Callable[[Any], Any], shaped)
