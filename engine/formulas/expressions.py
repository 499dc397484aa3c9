"""Formulas of the shaft's angle, or of parameters, read by a parser of our own, never by Python's.

Grammar, loosest first (``^`` and ``**`` are the same and bind to the right)::

    comparison := sum [("<" | "<=" | ">" | ">=") sum]
    sum        := product {("+" | "-") product}
    product    := sign {("*" | "/") sign}
    sign       := {"+" | "-"} power
    power      := atom ["^" sign]
    atom       := number | name | name "(" comparison {"," comparison} ")" | "(" comparison ")"

A name is an identifier, or several with points between them such as ``pendulums.0.mass``.

A formula is evaluated together with its derivative with respect to its first variable.
"""

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine import elementary
from sprag_study.engine.problems import MachineError
from sprag_study.sentences import Sentence

Floats = NDArray[np.float64]
Value = Floats | float
#: Value and derivative; a derivative that is the float 0.0 vanishes identically.
Dual = tuple[Value, Value]

MAX_LENGTH = 2_000
MAX_NODES = 500
MAX_DEPTH = 40

CONSTANTS: Mapping[str, float] = {"pi": float(np.pi), "deg": float(np.pi) / 180.0}


class ExpressionError(MachineError):
    """A formula cannot be read, or its value is not a number.

    Attributes
    ----------
    position : int or None
        Position in the text, from 0; None where there is no single position.
    part : str
        "mechanism", "drive", "operation", or of one of several parts "parts.0.mechanism" and so on; "" where only
        the text was checked.
    """

    def __init__(self, message: Sentence, position: int | None, part: str = "") -> None:
        self._unplaced = message
        super().__init__(message if position is None else self.at(position))
        self.position, self.part = position, part

    def at(self, position: int) -> Sentence:
        """What is wrong, with a position in the text."""
        return Sentence("{what} (at character {character})", what=self._unplaced, character=str(position + 1))


_TOO_DEEP = Sentence("the formula is nested more than {most} deep", most=MAX_DEPTH)


def _operand_expected(token: str) -> Sentence:
    return Sentence("a number, a name or a bracket expected, {token} found", token=token)


_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<name>[A-Za-z_][A-Za-z_0-9]*(?:\.[A-Za-z_0-9]+)*)"
    r"|(?P<sign>\*\*|<=|>=|[-+*/^(),<>]))"
)


@dataclass(frozen=True, slots=True)
class Node:
    """One operation of a formula: its kind, its operands, and its position in the text."""

    kind: str
    position: int
    parts: tuple["Node", ...] = ()
    number: float = 0.0


def _known_zero(derivative: Value) -> bool:
    return isinstance(derivative, float) and derivative == 0.0


def _chain(outer: Callable[[], Value], inner: Value) -> Value:
    return 0.0 if _known_zero(inner) else outer() * inner


def _power(u: Dual, v: Dual) -> Dual:
    base, exponent = np.asarray(u[0], dtype=np.float64), v[0]
    value = elementary.power(base, exponent)
    slope = _chain(lambda: exponent * elementary.power(base, np.asarray(exponent) - 1.0), u[1])
    return value, slope + _chain(lambda: value * elementary.log(base), v[1])


def _pick(condition: Value | NDArray[np.bool_], u: Dual, v: Dual) -> Dual:
    chosen = np.asarray(condition) != 0.0
    flat = _known_zero(u[1]) and _known_zero(v[1])
    return np.where(chosen, u[0], v[0]), 0.0 if flat else np.where(chosen, u[1], v[1])


def _atan2(y: Dual, x: Dual) -> Dual:
    size = np.square(x[0]) + np.square(y[0])
    return elementary.arctan2(y[0], x[0]), _chain(lambda: x[0] / size, y[1]) + _chain(lambda: -y[0] / size, x[1])


def _mod(u: Dual, v: Dual) -> Dual:
    quotient = np.floor(u[0] / np.asarray(v[0]))
    return u[0] - v[0] * quotient, u[1] - _chain(lambda: quotient, v[1])


def _extreme(parts: list[Dual], larger: bool) -> Dual:
    best = parts[0]
    for other in parts[1:]:
        better = np.asarray(best[0]) >= other[0] if larger else np.asarray(best[0]) <= other[0]
        best = _pick(better, best, other)
    return best


#: Functions of one variable: value and derivative.
_SMOOTH: Mapping[str, tuple[Callable[[Value], Value], Callable[[Value], Value]]] = {
    "sin": (elementary.sin, elementary.cos),
    "cos": (elementary.cos, lambda u: -elementary.sin(u)),
    "tan": (elementary.tan, lambda u: 1.0 / np.square(elementary.cos(u))),
    "asin": (elementary.arcsin, lambda u: 1.0 / np.sqrt(1.0 - u * u)),
    "acos": (elementary.arccos, lambda u: -1.0 / np.sqrt(1.0 - u * u)),
    "atan": (elementary.arctan, lambda u: 1.0 / (1.0 + u * u)),
    "sinh": (elementary.sinh, elementary.cosh),
    "cosh": (elementary.cosh, elementary.sinh),
    "tanh": (elementary.tanh, lambda u: 1.0 / np.square(elementary.cosh(u))),
    "exp": (elementary.exp, elementary.exp),
    "log": (elementary.log, lambda u: 1.0 / u),
    "sqrt": (np.sqrt, lambda u: 0.5 / np.sqrt(u)),
    "abs": (np.abs, np.sign),
    "sign": (np.sign, lambda u: 0.0 * u),
    "floor": (np.floor, lambda u: 0.0 * u),
    "step": (lambda u: np.where(np.asarray(u) >= 0.0, 1.0, 0.0), lambda u: 0.0 * u),
}
#: Functions of several variables: fewest and most arguments.
_ARITY: Mapping[str, tuple[int, int]] = {
    **dict.fromkeys(_SMOOTH, (1, 1)),
    "atan2": (2, 2),
    "mod": (2, 2),
    "min": (2, 16),
    "max": (2, 16),
    "if": (3, 3),
}
#: A variable that no formula can name: where it is given, ``t`` is ``phi`` over it.
MEAN_SPEED = "mean speed"
TIME = "t"
#: Names that a constant or variable may not have.
RESERVED = frozenset(_ARITY) | frozenset(CONSTANTS)
_COMPARE: Mapping[str, Callable[[Value, Value], NDArray[np.bool_]]] = {
    "<": np.less,
    "<=": np.less_equal,
    ">": np.greater,
    ">=": np.greater_equal,
}


class _Parser:
    def __init__(self, text: str, names: frozenset[str]) -> None:
        self.text, self.names, self.nodes, self.depth = text, names, 0, 0
        self.tokens: list[tuple[str, str, int]] = []
        position, end = 0, len(text.rstrip())
        while position < end:
            match = _TOKEN.match(text, position)
            if match is None:
                sign = repr(text[position:].lstrip()[:1])
                raise ExpressionError(Sentence("{sign} has no meaning here", sign=sign), self._bare(position))
            kind = match.lastgroup or ""
            self.tokens.append((kind, match.group(kind), match.start(kind)))
            position = match.end()
        self.index = 0

    def _bare(self, position: int) -> int:
        rest = self.text[position:]
        return position + len(rest) - len(rest.lstrip())

    def peek(self) -> str:
        return self.tokens[self.index][1] if self.index < len(self.tokens) else ""

    def position(self) -> int:
        return self.tokens[self.index][2] if self.index < len(self.tokens) else len(self.text)

    def node(self, kind: str, position: int, *parts: Node, number: float = 0.0) -> Node:
        self.nodes += 1
        if self.nodes > MAX_NODES:
            message = Sentence("the formula has more than {most} operations", most=MAX_NODES)
            raise ExpressionError(message, position)
        return Node(kind, position, parts, number)

    def expect(self, sign: str) -> None:
        if self.peek() != sign:
            token = repr(self.peek()) if self.peek() else Sentence("the end")
            message = Sentence("{sign} expected, {token} found", sign=repr(sign), token=token)
            raise ExpressionError(message, self.position())
        self.index += 1

    def comparison(self) -> Node:
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise ExpressionError(_TOO_DEEP, self.position())
        left = self.chain(("+", "-"), lambda: self.chain(("*", "/"), self.sign))
        if self.peek() in _COMPARE:
            position, kind = self.position(), self.peek()
            self.index += 1
            left = self.node(kind, position, left, self.chain(("+", "-"), lambda: self.chain(("*", "/"), self.sign)))
        self.depth -= 1
        return left

    def chain(self, signs: tuple[str, ...], part: Callable[[], Node]) -> Node:
        left = part()
        while self.peek() in signs:
            position, kind = self.position(), self.peek()
            self.index += 1
            left = self.node(kind, position, left, part())
        return left

    def sign(self) -> Node:
        negative, position = False, self.position()
        while self.peek() in {"+", "-"}:
            negative ^= self.peek() == "-"
            self.index += 1
        power = self.power()
        return self.node("negative", position, power) if negative else power

    def power(self) -> Node:
        base = self.atom()
        if self.peek() in {"^", "**"}:
            position = self.position()
            self.depth += 1
            if self.depth > MAX_DEPTH:
                raise ExpressionError(_TOO_DEEP, position)
            self.index += 1
            base = self.node("^", position, base, self.sign())
            self.depth -= 1
        return base

    def atom(self) -> Node:
        position = self.position()
        if self.index >= len(self.tokens):
            raise ExpressionError(_operand_expected(Sentence("the end")), position)
        kind, text, _ = self.tokens[self.index]
        self.index += 1
        if kind == "number":
            number = float(text)
            if not np.isfinite(number):
                raise ExpressionError(Sentence("the number {number} is too large", number=text), position)
            return self.node("number", position, number=number)
        if kind == "name":
            return self.named(text, position)
        if text == "(":
            inner = self.comparison()
            self.expect(")")
            return inner
        raise ExpressionError(_operand_expected(repr(text)), position)

    def named(self, name: str, position: int) -> Node:
        if name in _ARITY:
            self.expect("(")
            parts = [self.comparison()]
            while self.peek() == ",":
                self.index += 1
                parts.append(self.comparison())
            self.expect(")")
            fewest, most = _ARITY[name]
            if not fewest <= len(parts) <= most:
                wanted = str(fewest) if fewest == most else Sentence("{low} to {high}", low=fewest, high=most)
                message = Sentence(
                    "{name} takes {wanted} arguments, not {given}", name=name, wanted=wanted, given=len(parts)
                )
                raise ExpressionError(message, position)
            if name in {"min", "max"}:
                # Equal arguments are identical everywhere, which is neither a jump nor a kink.
                parts = list({_content(part): part for part in reversed(parts)}.values())[::-1]
                if len(parts) == 1:
                    return parts[0]
            return self.node(name, position, *parts)
        if name in CONSTANTS:
            return self.node("number", position, number=CONSTANTS[name])
        if name in self.names:
            return self.node(f"name {name}", position)
        timed = MEAN_SPEED in self.names
        if name == TIME and timed:
            parts = [self.node(f"name {own}", position) for own in ("phi", MEAN_SPEED)]
            return self.node("/", position, *parts)
        known = ", ".join(sorted((self.names | RESERVED | ({TIME} if timed else set())) - {MEAN_SPEED}))
        message = Sentence("{name} is not known; known are {known}", name=repr(name[:40]), known=known)
        raise ExpressionError(message, position)


class Expression:
    """A formula.

    Parameters
    ----------
    text : str
        See the module's grammar.
    names : iterable of str
        Variables it may use; every value is an array or a number when it is evaluated.

    Raises
    ------
    ExpressionError
        If it cannot be read, with the position.
    """

    def __init__(self, text: str, names: Iterable[str] = ("phi",)) -> None:
        if len(text) > MAX_LENGTH:
            message = Sentence("the formula is longer than {most} characters", most=str(MAX_LENGTH))
            raise ExpressionError(message, MAX_LENGTH)
        parser = _Parser(text, frozenset(names))
        self.text = text
        self.root = parser.comparison()
        if parser.index < len(parser.tokens):
            message = Sentence("{token} is not expected here", token=repr(parser.peek()))
            raise ExpressionError(message, parser.position())
        #: The variables that it uses.
        self.used = frozenset(names_of(self.root))
        self._switches: list[Callable[[Mapping[str, Dual]], Value]] = []
        self._find_switches(self.root)

    @property
    def switch_count(self) -> int:
        """Number of quantities whose change of sign is a jump or a kink of the formula."""
        return len(self._switches)

    @property
    def kinds(self) -> set[str]:
        """Operations and functions that the formula uses."""
        return _kinds(self.root)

    def evaluate(self, variables: Mapping[str, Dual]) -> Dual:
        """Value and derivative; ``variables`` gives both for every name. Not-finite values are left for the caller."""
        with np.errstate(all="ignore"):
            return _evaluate(self.root, variables)

    def __call__(self, **variables: Value) -> Floats:
        """Value of the formula, broadcast over its variables."""
        value, _ = self.evaluate({name: (given, 0.0) for name, given in variables.items()})
        shape = np.broadcast_shapes(*(np.shape(given) for given in variables.values()))
        return np.broadcast_to(np.asarray(value, dtype=np.float64), shape)

    def switch(self, index: int, variables: Mapping[str, Dual]) -> Value:
        """Number ``index`` of the quantities whose change of sign is a jump or a kink of the formula."""
        with np.errstate(all="ignore"):
            return self._switches[index](variables)

    def _find_switches(self, node: Node) -> None:
        parts = node.parts
        for part in parts:
            self._find_switches(part)
        if node.kind in {"abs", "sign", "step"}:
            self._switches.append(lambda v: _evaluate(parts[0], v)[0])
        elif node.kind in {"floor", "mod"}:
            # The sine of the scaled quotient changes sign at each integer.
            self._switches.append(lambda v: elementary.sin(np.pi * _evaluate(parts[0], v)[0] / _divisor(parts, v)))
        elif node.kind in _COMPARE:
            self._switches.append(lambda v: _evaluate(parts[0], v)[0] - _evaluate(parts[1], v)[0])
        elif node.kind in {"min", "max"}:
            # Each argument is compared with the extreme of the previous ones: any visible kink of a pair is a kink of
            # one of these, and their number grows linearly with the arguments, not quadratically.
            for count in range(1, len(parts)):
                self._switches.append(_lead(parts[:count], parts[count], larger=node.kind == "max"))
        elif node.kind == "atan2":
            self._switches.append(lambda v: _turn(_evaluate(parts[0], v)[0], _evaluate(parts[1], v)[0]))
        elif node.kind == "if" and parts[0].kind not in _COMPARE:
            self._switches.append(lambda v: np.abs(np.sign(_evaluate(parts[0], v)[0])) - 0.5)


def _content(node: Node) -> tuple[object, ...]:
    """The content of a node, independent of its position in the text."""
    return (node.kind, node.number, *map(_content, node.parts))


def names_of(node: Node) -> set[str]:
    """Names of variables and constants under a node."""
    own = {node.kind[5:]} if node.kind.startswith("name ") else set()
    return own.union(*(names_of(part) for part in node.parts))


def _kinds(node: Node) -> set[str]:
    return {node.kind}.union(*(_kinds(part) for part in node.parts))


def _divisor(parts: tuple[Node, ...], variables: Mapping[str, Dual]) -> Value:
    return np.asarray(_evaluate(parts[1], variables)[0]) if len(parts) > 1 else 1.0


def _turn(y: Value, x: Value) -> Value:
    return np.where(np.asarray(x) < 0.0, y, 1.0)


def _lead(before: tuple[Node, ...], part: Node, *, larger: bool) -> Callable[[Mapping[str, Dual]], Value]:
    """By how much the extreme of ``before`` exceeds ``part``."""
    return lambda v: _extreme([_evaluate(node, v) for node in before], larger)[0] - _evaluate(part, v)[0]


def _evaluate(node: Node, variables: Mapping[str, Dual]) -> Dual:
    kind = node.kind
    if kind == "number":
        return node.number, 0.0
    if kind.startswith("name "):
        return variables[kind[5:]]
    parts = [_evaluate(part, variables) for part in node.parts]
    u = parts[0]
    if kind in _SMOOTH:
        value, slope = _SMOOTH[kind]
        return value(u[0]), _chain(lambda: slope(u[0]), u[1])
    if kind == "negative":
        return -u[0], 0.0 if _known_zero(u[1]) else -u[1]
    if kind in {"min", "max"}:
        return _extreme(parts, kind == "max")
    if kind == "if":
        return _pick(u[0], parts[1], parts[2])
    v = parts[1]
    if kind in _COMPARE:
        return np.where(_COMPARE[kind](u[0], v[0]), 1.0, 0.0), 0.0
    return _arithmetic(kind, u, v)


def _arithmetic(kind: str, u: Dual, v: Dual) -> Dual:
    if kind == "+":
        return u[0] + v[0], u[1] + v[1]
    if kind == "-":
        return u[0] - v[0], u[1] - v[1]
    if kind == "*":
        return u[0] * v[0], _chain(lambda: v[0], u[1]) + _chain(lambda: u[0], v[1])
    if kind == "/":
        quotient = u[0] / np.asarray(v[0], dtype=np.float64)
        return quotient, _chain(lambda: 1.0 / np.asarray(v[0]), u[1]) - _chain(lambda: quotient / v[0], v[1])
    if kind == "^":
        return _power(u, v)
    return _atan2(u, v) if kind == "atan2" else _mod(u, v)
