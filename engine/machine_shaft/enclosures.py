"""Enclosures of formulas over intervals of the angle: how well polynomials approximate a formula there.

Samples cannot exclude features between them; interval arithmetic can (R. E. Moore, Interval Analysis, 1966).
"""

from collections.abc import Sequence

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from sprag_study.engine.compile.jit import compiled, part
from sprag_study.engine.formulas.expressions import Expression, Node
from sprag_study.engine.machine_shaft import intervals as iv
from sprag_study.engine.machine_shaft.intervals import ORDERS
from sprag_study.engine.machine_shaft.panels import POSITIONS, WEIGHTS, apply

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_KINDS = (
    "number", "angle", "way", "constant", "+", "-", "*", "/", "whole", "^", "negative", "sin", "cos", "tan", "asin",
    "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "abs", "sign", "floor", "step", "atan2", "mod", "min",
    "max", "if", "<", "<=", ">", ">=",
)  # fmt: skip
(
    _NUMBER, _PHI, _X, _CONSTANT, _PLUS, _MINUS, _TIMES, _OVER, _WHOLE, _POWER, _NEGATIVE, _SIN, _COS, _TAN, _ASIN,
    _ACOS, _ATAN, _SINH, _COSH, _TANH, _EXP, _LOG, _SQRT, _ABS, _SIGN, _FLOOR, _STEP, _ATAN2, _MOD, _MIN,
    _MAX, _IF, _LESS, _LESS_EQUAL, _MORE, _MORE_EQUAL,
) = range(len(_KINDS))  # fmt: skip
_CODES = {kind: code for code, kind in enumerate(_KINDS)}
#: Largest integer exponent that is evaluated by multiplication.
_MOST_WHOLE = 64
#: Rows of the stack that operations use besides their operands.
_SPARE = 4

_LEGENDRE = (2 * np.arange(ORDERS)[:, None] + 1) / 2.0 * legendre.legvander(POSITIONS, ORDERS - 1).T * WEIGHTS
_POWERS = np.array([np.pad(legendre.leg2poly(row), (0, ORDERS))[:ORDERS] for row in np.eye(ORDERS)]).T.copy()


def _series(values: Floats) -> Floats:
    """Coefficients of the polynomials through values (n, ORDERS) at the Gauss nodes of -1 .. 1, rounding left out."""
    coefficients = apply(_LEGENDRE, values)
    noise = 8.0 * np.finfo(float).eps * np.abs(values).max(axis=1, keepdims=True)
    return apply(_POWERS, np.where(np.abs(coefficients) > noise, coefficients, 0.0))


class Program:
    """A formula as a list of operations on a stack.

    Parameters
    ----------
    expression : Expression
    constants : sequence of str
        Names of its variables beside ``phi`` and ``x``, in the order of their columns.
    """

    def __init__(self, expression: Expression, constants: Sequence[str]) -> None:
        self._constants = list(constants)
        self._code: list[tuple[int, int, float]] = []
        self._depth = self._most = 0
        self._emit(expression.root)
        codes, arguments, numbers = zip(*self._code, strict=True)
        self.codes, self.arguments = np.array(codes, dtype=np.int64), np.array(arguments, dtype=np.int64)
        self.numbers = np.array(numbers, dtype=np.float64)

    def _emit(self, node: Node) -> None:
        kind, parts = node.kind, node.parts
        if not parts:
            name = kind.removeprefix("name ")
            code = _NUMBER if kind == "number" else {"phi": _PHI, "x": _X}.get(name, _CONSTANT)
            self._add(code, self._constants.index(name) if code == _CONSTANT else 0, node.number, 1)
            return
        self._emit(parts[0])
        exponent = _whole(parts[1]) if kind == "^" else None
        if exponent is not None:
            self._add(_WHOLE, exponent, 0.0, 0)
            return
        for other in parts[1:]:
            self._emit(other)
            if kind in {"min", "max"}:
                self._add(_CODES[kind], 0, 0.0, -1)
        if kind not in {"min", "max"}:
            self._add(_CODES[kind], 0, 0.0, 1 - len(parts))

    def _add(self, code: int, argument: int, number: float, grows: int) -> None:
        self._code.append((code, argument, number))
        self._depth += grows
        self._most = max(self._most, self._depth)

    def over(self, low: Floats, high: Floats, constants: Floats, ways: Floats | None) -> tuple[Floats, Floats]:
        """How well polynomials approximate the formula on intervals.

        Parameters
        ----------
        low, high : arrays, shape (n,)
            Ends of the intervals in rad.
        constants : array, shape (n, names)
        ways : array, shape (n, ORDERS), or None
            ``x`` at the Gauss nodes of each interval, if the formula has it.

        Returns
        -------
        errors : array, shape (n,)
            Bound of the error of the best polynomial of degree below ORDERS on each interval; infinite where unknown.
        least : array, shape (n,)
            Lower bound of the formula's modulus on the interval.
        """
        errors, least = np.empty(len(low)), np.empty(len(low))
        series = np.zeros((1, ORDERS)) if ways is None else _series(ways)
        stack = np.empty((2, self._most + _SPARE, ORDERS))
        _enclose(
            self.codes, self.arguments, self.numbers, low, high, np.ascontiguousarray(constants),
            np.ascontiguousarray(series), stack, errors, least,
        )  # fmt: skip
        return errors, least

    def entries(self, low: float, high: float) -> tuple[Floats, Floats]:
        """Lower and upper ends, each of shape (ORDERS,), of a formula's enclosures on one interval (``intervals``).

        The formula has no variable beside ``phi``.
        """
        stack = np.empty((2, self._most + _SPARE, ORDERS))
        _enclose(
            self.codes, self.arguments, self.numbers, np.array([low]), np.array([high]), np.empty((1, 0)),
            np.zeros((1, ORDERS)), stack, np.empty(1), np.empty(1),
        )  # fmt: skip
        return stack[0, 0], stack[1, 0]


def _whole(node: Node) -> int | None:
    """The exponent as an integer, if it is one."""
    if node.kind == "negative":
        inner = _whole(node.parts[0])
        return None if inner is None else -inner
    small = node.kind == "number" and node.number == int(node.number) and node.number <= _MOST_WHOLE
    return int(node.number) if small else None


@part
def _way(low: Floats, high: Floats, row: int, series: Floats) -> None:
    """The fraction of the stroke from its polynomial, whose last entries bound the truncation error."""
    tail = abs(series[ORDERS - 1]) + abs(series[ORDERS - 2])
    for j in range(ORDERS):
        spread, binomial = 2.0**-10 * tail, 1.0
        for i in range(j + 1, ORDERS):
            binomial = binomial * i / (i - j)
            spread += binomial * abs(series[i])
        # A few dozen operations, each accurate to one unit in the last place.
        spread = iv.up(spread, 64.0)
        low[row, j], high[row, j] = iv.down(series[j] - spread, 1.0), iv.up(series[j] + spread, 1.0)
    low[row, 0], high[row, 0] = max(low[row, 0], 0.0), min(high[row, 0], 1.0)


@part
def _compare(low: Floats, high: Floats, u: int, v: int, code: int) -> None:
    a, b, c, d = low[u, 0], high[u, 0], low[v, 0], high[v, 0]
    if code in (_MORE, _MORE_EQUAL):
        a, b, c, d = c, d, a, b
    strict = code in (_LESS, _MORE)
    if b < c or (not strict and b <= c):
        iv.constant(low, high, u, 1.0, 1.0)
    elif a > d or (strict and a >= d):
        iv.constant(low, high, u, 0.0, 0.0)
    else:
        iv.rough(low, high, u, 0.0, 1.0)


@part
def _larger(low: Floats, high: Floats, u: int, v: int, larger: bool) -> None:
    a, b, c, d = low[u, 0], high[u, 0], low[v, 0], high[v, 0]
    if (b <= c and larger) or (a >= d and not larger):
        iv.copy(low, high, v, u)
    elif not ((a >= d and larger) or (b <= c and not larger)):
        if larger:
            iv.rough(low, high, u, max(a, c), max(b, d))
        else:
            iv.rough(low, high, u, min(a, c), min(b, d))


@part
def _choose(low: Floats, high: Floats, u: int) -> None:
    """``if``: the condition at ``u``, the two values after it."""
    if low[u, 0] > 0.0 or high[u, 0] < 0.0:
        iv.copy(low, high, u + 1, u)
    elif low[u, 0] == 0.0 and high[u, 0] == 0.0:
        iv.copy(low, high, u + 2, u)
    else:
        iv.rough(low, high, u, min(low[u + 1, 0], low[u + 2, 0]), max(high[u + 1, 0], high[u + 2, 0]))


@part
def _stepped(low: Floats, high: Floats, u: int, code: int) -> None:
    """abs, sign, floor, step of ``u``."""
    a, b = low[u, 0], high[u, 0]
    if code == _ABS:
        if b <= 0.0:
            iv.negate(low, high, u)
        elif a < 0.0:
            iv.rough(low, high, u, 0.0, max(-a, b))
        return
    p, q = np.sign(a), np.sign(b)
    if code == _FLOOR:
        p, q = _floors(a, b)
    elif code == _STEP:
        p, q = 1.0 if a >= 0.0 else 0.0, 1.0 if b >= 0.0 else 0.0
    if p == q:
        iv.constant(low, high, u, p, q)
    else:
        iv.rough(low, high, u, p, q)


@part
def _floors(a: float, b: float) -> tuple[float, float]:
    """Floors of a number within a .. b, as floats.

    An interval begins or ends at a jump only up to rounding: an end that close to an integer is assigned to the side on
    which the rest of the interval lies.
    """
    margin = min(8.0 * 2.0**-52 * max(abs(a), abs(b)), 0.25 * (b - a))
    return float(np.floor(a + margin)), float(np.floor(b - margin))


@part
def _remainder(low: Floats, high: Floats, u: int, v: int, spare: int) -> None:
    iv.divide(low, high, u, v, spare)
    p, q = _floors(low[spare, 0], high[spare, 0])
    if p == q:
        iv.constant(low, high, spare, p, p)
        iv.multiply(low, high, v, spare, spare + 1)
        iv.add(low, high, u, spare + 1, -1.0)
    else:
        most = max(abs(low[v, 0]), abs(high[v, 0]))
        iv.rough(low, high, u, -most if low[v, 0] < 0.0 else 0.0, most if high[v, 0] > 0.0 else 0.0)


@part
def _angle_of(low: Floats, high: Floats, y: int, x: int, spare: int) -> None:
    """atan2 of ``y`` and ``x`` into ``y``."""
    half = 0.5 * np.pi
    if low[x, 0] > 0.0:
        iv.divide(low, high, y, x, spare)
        iv.arctangent(low, high, spare, y, spare + 1)
    elif low[y, 0] > 0.0 or high[y, 0] < 0.0:
        turn = half if low[y, 0] > 0.0 else -half
        iv.divide(low, high, x, y, spare)
        iv.arctangent(low, high, spare, y, spare + 1)
        iv.negate(low, high, y)
        iv.shift(low, high, y, 0, iv.down(turn, 1.0), iv.up(turn, 1.0))
    else:
        iv.rough(low, high, y, -iv.up(np.pi, 1.0), iv.up(np.pi, 1.0))


@part
def _raise(low: Floats, high: Floats, u: int, v: int, spare: int) -> None:
    """``u ^ v`` into ``u``."""
    fixed = low[v, 0] == high[v, 0]
    for k in range(1, ORDERS):
        fixed = fixed and low[v, k] == 0.0 and high[v, k] == 0.0
    exponent = low[v, 0]
    if fixed and exponent == np.floor(exponent) and abs(exponent) <= _MOST_WHOLE:
        iv.whole_power(low, high, u, int(exponent), spare, spare + 1)
        iv.copy(low, high, spare, u)
    elif fixed:
        iv.real_power(low, high, u, exponent, spare)
        iv.copy(low, high, spare, u)
    else:
        iv.logarithm(low, high, u, spare)
        iv.multiply(low, high, spare, v, spare + 1)
        iv.exponential(low, high, spare + 1, u)


@part
def _function(low: Floats, high: Floats, u: int, code: int, spare: int) -> None:
    """A smooth function of ``u``."""
    out = spare
    if code in (_SIN, _COS):
        iv.sine_and_cosine(low, high, u, spare, spare + 1)
        out = spare if code == _SIN else spare + 1
    elif code in (_SINH, _COSH):
        iv.hyperbolic(low, high, u, spare, spare + 1)
        out = spare if code == _SINH else spare + 1
    elif code == _TAN:
        iv.tangent(low, high, u, out, spare + 1, 1.0)
    elif code == _TANH:
        iv.tangent(low, high, u, out, spare + 1, -1.0)
    elif code == _EXP:
        iv.exponential(low, high, u, out)
    elif code == _LOG:
        iv.logarithm(low, high, u, out)
    elif code == _SQRT:
        iv.root(low, high, u, out)
    elif code == _ATAN:
        iv.arctangent(low, high, u, out, spare + 1)
    else:
        iv.arcsine(low, high, u, out, spare + 1, spare + 2)
        if code == _ACOS:
            iv.negate(low, high, out)
            iv.shift(low, high, out, 0, iv.down(0.5 * np.pi, 1.0), iv.up(0.5 * np.pi, 1.0))
    iv.copy(low, high, out, u)


@part
def _combine(low: Floats, high: Floats, u: int, code: int, spare: int) -> None:
    """An operation on ``u`` and the row after it."""
    v = u + 1
    if code == _PLUS:
        iv.add(low, high, u, v, 1.0)
    elif code == _MINUS:
        iv.add(low, high, u, v, -1.0)
    elif code == _TIMES:
        iv.multiply(low, high, u, v, spare)
        iv.copy(low, high, spare, u)
    elif code == _OVER:
        iv.divide(low, high, u, v, spare)
        iv.copy(low, high, spare, u)
    elif code == _POWER:
        _raise(low, high, u, v, spare)
    elif code == _ATAN2:
        _angle_of(low, high, u, v, spare)
    elif code == _MOD:
        _remainder(low, high, u, v, spare)
    elif code in (_MIN, _MAX):
        _larger(low, high, u, v, code == _MAX)
    else:
        _compare(low, high, u, v, code)


@compiled
def _enclose(
    codes: Integers,
    arguments: Integers,
    numbers: Floats,
    starts: Floats,
    ends: Floats,
    constants: Floats,
    ways: Floats,
    stack: Floats,
    errors: Floats,
    least: Floats,
) -> None:
    low, high = stack[0], stack[1]
    spare = len(low) - _SPARE
    for n in range(len(starts)):
        top = -1
        for step in range(len(codes)):
            code = codes[step]
            if code <= _CONSTANT:
                top += 1
                if code == _NUMBER:
                    iv.constant(low, high, top, numbers[step], numbers[step])
                elif code == _PHI:
                    iv.constant(low, high, top, starts[n], ends[n])
                    half = 0.5 * (ends[n] - starts[n])
                    low[top, 1], high[top, 1] = iv.down(half, 1.0), iv.up(half, 1.0)
                elif code == _X:
                    _way(low, high, top, ways[n])
                else:
                    iv.constant(low, high, top, constants[n, arguments[step]], constants[n, arguments[step]])
            elif code == _WHOLE:
                iv.whole_power(low, high, top, arguments[step], spare, spare + 1)
                iv.copy(low, high, spare, top)
            elif code == _NEGATIVE:
                iv.negate(low, high, top)
            elif code <= _SQRT and code >= _SIN:
                _function(low, high, top, code, spare)
            elif code in (_ABS, _SIGN, _FLOOR, _STEP):
                _stepped(low, high, top, code)
            elif code == _IF:
                top -= 2
                _choose(low, high, top)
            else:
                top -= 1
                _combine(low, high, top, code, spare)
        a, b = low[top, 0], high[top, 0]
        least[n] = max(a, -b, 0.0) if a <= b else 0.0
        errors[n] = np.inf
        for k in range(ORDERS):
            # NaN entries are ignored.
            errors[n] = min(errors[n], iv.up(np.fmin(0.5 * (high[top, k] - low[top, k]), np.inf), 1.0))
