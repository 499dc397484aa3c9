"""Building blocks of generated straight-line code: one lane's arithmetic, unrolled over the orders of the series.

LLVM turns a loop over lanes into SIMD code when its body is straight-line arithmetic on one flat array with literal
rows; loops over orders, calls or a second array prevent it (docs/adr/0002). So the recurrences are written once in
Python, here and in the model's ``equations``, and unrolled into the source text of a kernel.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

Names = Sequence[str]


class Term(str):
    """The text of an operand; arithmetic with it gives the text of the result.

    So a formula that is written as an ordinary function of numbers also writes generated code.
    """

    __slots__ = ()

    def __add__(self, other: object) -> "Term":
        return Term(f"({self} + {other})")

    def __sub__(self, other: object) -> "Term":
        return Term(f"({self} - {other})")

    def __mul__(self, other: object) -> "Term":
        return Term(f"({self}*{other})")

    def __neg__(self) -> "Term":
        return Term(f"(-{self})")


class LaneCode:
    """Source lines of the body of ``for lane in range(lanes)`` over the flat workspace ``W``.

    Every local variable is assigned once: numba's analysis takes time in proportion to the number of reassigned
    variables times the length of the function. ``tag`` keeps the names of several loops in one function apart.
    """

    def __init__(self, lanes: int, tag: str = "") -> None:
        self.lanes = lanes
        self.tag = tag
        self.lines: list[str] = []
        self._uses: dict[str, int] = {}

    def row(self, row: int) -> str:
        """The element of workspace row ``row`` that belongs to this lane."""
        return f"W[{row * self.lanes} + lane]"

    def let(self, name: str, expression: str) -> Term:
        """Define a local variable; returns its actual name, which is unique."""
        use = self._uses[name] = self._uses.get(name, 0) + 1
        unique = name + self.tag if use == 1 else f"{name}{self.tag}_again{use}"
        self.lines.append(f"{unique} = {expression}")
        return Term(unique)

    def load(self, name: str, row: int) -> Term:
        """Define a local variable from a workspace row."""
        return self.let(name, self.row(row))

    def store(self, row: int, expression: str) -> None:
        """Write an expression into a workspace row."""
        self.lines.append(f"{self.row(row)} = {expression}")

    def series(self, name: str, row: int, count: int) -> list[Term]:
        """Load ``count`` consecutive rows as the coefficients of a series."""
        return [self.load(f"{name}{k}", row + k) for k in range(count)]

    def loop(self) -> str:
        """The finished loop over the lanes around the lines."""
        return f"for lane in range({self.lanes}):\n" + "\n".join(f"    {line}" for line in self.lines)


def product(a: Names, b: Names, k: int) -> str:
    """Coefficient k of the product of two series (Cauchy).

    The newest coefficients come last: all that is before them can be added up while they are still being computed.
    """
    return " + ".join(f"{a[j]}*{b[k - j]}" for j in [*range(1, k), 0, k][: k + 1])


def square(a: Names, k: int) -> str:
    """Coefficient k of the square of a series: the products that occur twice are formed once."""
    terms = [f"{a[j]}*{a[k - j]}" for j in reversed(range((k + 1) // 2))]
    twice = f"2.0*({' + '.join(terms)})" if terms else ""
    middle = f"{a[k // 2]}*{a[k // 2]}" if k % 2 == 0 else ""
    return " + ".join(part for part in (middle, twice) if part)


def horner(coefficients: Any, x: Any) -> Any:
    """Value of a series at ``x``; of terms, or of numbers in Python and in compiled code, where ``x`` may be an array.

    ``coefficients`` is a sequence of at least one, that of ``x^0`` first.
    """
    value = coefficients[len(coefficients) - 1]
    for k in range(len(coefficients) - 2, -1, -1):
        value = coefficients[k] + x * value
    return value


def slope(coefficients: Any, x: Any) -> Any:
    """Derivative of the series at ``x``; arguments as of ``horner``, numbers only."""
    value = 0.0 * x
    for k in range(len(coefficients) - 1, 0, -1):
        value = coefficients[k] * float(k) + x * value
    return value


def integral(coefficients: Any, x: Any) -> Any:
    """Integral of the series from 0 to ``x``, in the unit of ``x``; arguments as of ``horner``."""
    count = len(coefficients)
    value = coefficients[count - 1] * (1.0 / count)
    for k in range(count - 2, -1, -1):
        value = coefficients[k] * (1.0 / (k + 1)) + x * value
    return x * value


def same_everywhere(value: float) -> float:
    """A number from a function of the C library, which on another processor may differ in the last bit, without it."""
    return float(f"{value:.14g}")


def chord_constant(k: int) -> float:
    """Largest distance of ``x^k`` from its chord ``x`` on [0, 1]."""
    return same_everywhere(k ** (-1.0 / (k - 1)) - k ** (-k / (k - 1)))


class Span(NamedTuple):
    """Names of the bounds of a polynomial on [0, 1]: its values at 0 and 1, its slope at 0, and its bulge.

    ``sum c_k x^k`` differs from the chord between its end values by at most the bulge, ``sum |c_k| max(x - x^k)`` over
    k >= 2. For the short steps of a high order this is nearly sharp, and it needs no branches.
    """

    start: Term
    end: Term
    slope: Term
    bulge: Term
    order: int

    @property
    def low(self) -> str:
        """Lower bound."""
        return f"({smaller(self.start, self.end)}) - {self.bulge}"

    @property
    def high(self) -> str:
        """Upper bound."""
        return f"({larger(self.start, self.end)}) + {self.bulge}"

    @property
    def least_slope(self) -> str:
        """A slope at 0 larger than this, whatever its sign, is kept by the chord from 0 to every other point.

        Those chords' slopes differ from it by ``sum |c_k|`` over k >= 2 at most.
        """
        return f"{max(1.0 / chord_constant(k) for k in range(2, self.order + 1))!r}*{self.bulge}"

    @property
    def monotone(self) -> str:
        """Condition under which the polynomial certainly has no extremum inside: its slope differs from that at 0 by
        ``sum k |c_k|`` over k >= 2 at most.
        """
        return f"abs({self.slope}) > {max(k / chord_constant(k) for k in range(2, self.order + 1))!r}*{self.bulge}"


def span(code: LaneCode, tag: str, coefficients: Sequence[Term]) -> Span:
    """The span of a polynomial."""
    end = code.let(f"end_{tag}", " + ".join(coefficients))
    bulge = _bulge(coefficients[2:], lambda _: 1.0)
    return Span(coefficients[0], end, coefficients[1], code.let(f"bulge_{tag}", bulge), len(coefficients) - 1)


def rate_span(code: LaneCode, tag: str, coefficients: Names, inverse_h: str) -> Span:
    """The span of the time derivative of a polynomial in fractions of a step whose inverse is ``inverse_h``."""
    start = code.let(f"start_{tag}", f"{inverse_h}*{coefficients[1]}")
    slope = code.let(f"slope_{tag}", f"{inverse_h}*2.0*{coefficients[2]}")
    terms = [name if k == 1 else f"{float(k)!r}*{name}" for k, name in enumerate(coefficients) if k >= 1]
    end = code.let(f"end_{tag}", f"{inverse_h}*({' + '.join(terms)})")
    bulge = code.let(f"bulge_{tag}", f"{inverse_h}*({_bulge(coefficients[3:], lambda k: k + 1.0)})")
    return Span(start, end, slope, bulge, len(coefficients) - 2)


def primitive_span(code: LaneCode, tag: str, start: Term, coefficients: Names, h: str) -> Span:
    """The span of the time integral, from the value ``start``, of a polynomial in fractions of the step ``h``."""
    terms = [name if k == 0 else f"{1.0 / (k + 1)!r}*{name}" for k, name in enumerate(coefficients)]
    end = code.let(f"end_{tag}", f"{start} + {h}*({' + '.join(terms)})")
    slope = code.let(f"slope_{tag}", f"{h}*{coefficients[0]}")
    bulge = code.let(f"bulge_{tag}", f"{h}*({_bulge(coefficients[1:], lambda k: 1.0 / k)})")
    return Span(start, end, slope, bulge, len(coefficients))


def _bulge(coefficients: Names, factor: Callable[[int], float]) -> str:
    """``coefficients`` begin with that of x^2."""
    terms = enumerate(coefficients, 2)
    return " + ".join(f"{factor(k) * chord_constant(k)!r}*abs({name})" for k, name in terms)


def smaller(a: str, b: str) -> str:
    """Selection that vectorises; a NaN in ``a`` gives ``b``."""
    return f"{a} if {a} < {b} else {b}"


def larger(a: str, b: str) -> str:
    """Selection that vectorises; a NaN in ``a`` gives ``b``."""
    return f"{a} if {a} > {b} else {b}"


# Cody-Waite splitting of pi/2: the first two parts have 33 bits, so that a multiple below 2^20 of them is exact.
HALF_PI = ("1.57079632673412561417e+00", "6.07710050630396597660e-11", "2.02226624879595063154e-21")
#: Largest angle in rad, in modulus, that is reduced without losing digits.
LARGEST_ANGLE = 1e6
ROUND = "6755399441055744.0"  # 1.5 * 2^52: adding and subtracting it rounds to the nearest integer
# Minimax coefficients of sin and cos on [-pi/4, pi/4] (the classic ones of fdlibm's kernels, error below 2^-58).
SINE = (
    Term("-1.66666666666666324348e-01"),
    Term("8.33333333332248946124e-03"),
    Term("-1.98412698298579493134e-04"),
    Term("2.75573137070700676789e-06"),
    Term("-2.50507602534068634195e-08"),
    Term("1.58969099521155010221e-10"),
)
COSINE = (
    Term("4.16666666666666019037e-02"),
    Term("-1.38888888888741095749e-03"),
    Term("2.48015872894767294178e-05"),
    Term("-2.75573143513906633035e-07"),
    Term("2.08757232129817482790e-09"),
    Term("-1.13596475577881948265e-11"),
)


def sincos(code: LaneCode, x: str, tag: str) -> tuple[Term, Term]:
    """Sine and cosine of ``|x|`` up to `LARGEST_ANGLE` within an ulp or so, without calls or branches."""
    q = code.let(f"q_{tag}", f"({x}*0.6366197723675814 + {ROUND}) - {ROUND}")
    r = code.let(f"r_{tag}", f"(({x} - {q}*{HALF_PI[0]}) - {q}*{HALF_PI[1]}) - {q}*{HALF_PI[2]}")
    z = code.let(f"z_{tag}", f"{r}*{r}")
    s = code.let(f"sk_{tag}", f"{r} + {r}*({z}*({horner(SINE, z)}))")
    c = code.let(f"ck_{tag}", f"1.0 - (0.5*{z} - {z}*{z}*({horner(COSINE, z)}))")
    # The quadrant, -2..2.
    j = code.let(f"j_{tag}", f"{q} - 4.0*(({q}*0.25 + {ROUND}) - {ROUND})")
    a = code.let(f"ja_{tag}", f"abs({j})")
    sine = code.let(f"sv_{tag}", f"{c} if {a} == 1.0 else {s}")
    cosine = code.let(f"cv_{tag}", f"{s} if {a} == 1.0 else {c}")
    sine = code.let(f"s_{tag}", f"-{sine} if ({a} == 2.0 or {j} == -1.0) else {sine}")
    cosine = code.let(f"c_{tag}", f"-{cosine} if ({a} == 2.0 or {j} == 1.0) else {cosine}")
    return sine, cosine


#: Splitting of ln 2: multiples of the first part by 11 bits are exact.
LN2 = ("6.93147180369123816490e-01", "1.90821492927058770002e-10")
# Coefficients of the exponential of fdlibm on [-ln 2/2, ln 2/2].
EXPONENTIAL = (
    Term("1.66666666666666019037e-01"),
    Term("-2.77777777770155933842e-03"),
    Term("6.61375632143793436117e-05"),
    Term("-1.65339022054652515390e-06"),
    Term("4.13813679705723846039e-08"),
)
#: Exponents beyond which their exponential is that of the bound: the power of two must be a normal number.
LARGEST_EXPONENT = 700.0


def exponential(code: LaneCode, x: str, tag: str) -> Term:
    """e to the power of ``x``, from -`LARGEST_EXPONENT` to it, within an ulp or so, without calls or branches."""
    given = code.let(f"given_{tag}", x)
    least = code.let(f"least_{tag}", larger(given, repr(-LARGEST_EXPONENT)))
    inside = code.let(f"inside_{tag}", smaller(least, repr(LARGEST_EXPONENT)))
    n = code.let(f"n_{tag}", f"({inside}*1.4426950408889634 + {ROUND}) - {ROUND}")
    high = code.let(f"eh_{tag}", f"{inside} - {n}*{LN2[0]}")
    low = code.let(f"el_{tag}", f"{n}*{LN2[1]}")
    r = code.let(f"er_{tag}", f"{high} - {low}")
    t = code.let(f"et_{tag}", f"{r}*{r}")
    c = code.let(f"ec_{tag}", f"{r} - {t}*({horner(EXPONENTIAL, t)})")
    value = code.let(f"ev_{tag}", f"1.0 - (({low} - ({r}*{c})/(2.0 - {c})) - {high})")
    return code.let(f"exp_{tag}", f"{value}*of_bits(({n} + 1023.0)*4503599627370496.0)")


def log2(x: str) -> str:
    """Base-2 logarithm of a positive double within 0.09, from its bits read as an integer."""
    return f"(bits_of({x})*2.220446049250313e-16 - 1023.0)"


def exp2(x: str) -> str:
    """Power of two within 6 %, inverse of ``log2``: only for choosing a step size."""
    return f"of_bits(({x} + 1023.0)*4503599627370496.0)"
