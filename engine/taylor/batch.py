"""Roots and peaks of many polynomials: the simple shapes of ``roots`` without branches, one polynomial per lane.

Polynomials are stored in blocks of ``SLOTS``; row k of a block holds the coefficients of x^k. Shapes that the moduli
cannot determine and iterations that do not converge are marked ``HARD`` and left to the functions of ``roots``, which
find every root.
"""

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.compile.jit import inlined
from sprag_study.engine.taylor.straight import LaneCode, larger, smaller

#: Polynomials in a block.
SLOTS = 8
_LINE = 8  # doubles of a cache line
#: Status of a slot after its loop.
NONE, FOUND, HARD = 0.0, 1.0, 2.0
#: Rows behind the highest coefficient's: what is known (peaks), the result, the status; and their number and one.
KNOWN, RESULT, STATUS, ROWS = 1, 2, 3, 4
_ROOT_ITERATIONS = 5
_PEAK_ITERATIONS = 4


@inlined
def slot_start(order: int, slot: int) -> int:
    """Place of a slot's first coefficient in the flat array of all blocks; the next row is ``SLOTS`` further."""
    return (slot // SLOTS) * (order + ROWS) * SLOTS + slot % SLOTS


@inlined
def put(blocks: NDArray[np.float64], order: int, slot: int, g: NDArray[np.float64]) -> None:
    """Write the coefficients ``g`` of one polynomial into a slot."""
    start = slot_start(order, slot)
    for k in range(order + 1):
        blocks[start + k * SLOTS] = g[k]


@inlined
def take(blocks: NDArray[np.float64], order: int, slot: int, g: NDArray[np.float64]) -> None:
    """Read the coefficients of a slot back into ``g``."""
    start = slot_start(order, slot)
    for k in range(order + 1):
        g[k] = blocks[start + k * SLOTS]


def aligned_zeros(size: int) -> NDArray[np.float64]:
    """A flat array that begins with a cache line, so that no vector of lanes lies across two."""
    spare = np.zeros(size + _LINE)
    skipped = -(spare.ctypes.data // spare.itemsize) % _LINE
    return spare[skipped : skipped + size]


def blocks_for(polynomials: int, order: int) -> NDArray[np.float64]:
    """The flat array of as many blocks as that many polynomials need."""
    return aligned_zeros(-(-polynomials // SLOTS) * (order + ROWS) * SLOTS)


class _Shape:
    """Code that determines the shape of a polynomial on [0, 1] from its coefficients (as ``roots._shape``)."""

    def __init__(self, order: int) -> None:
        self.code = code = LaneCode(SLOTS)
        self.order = order
        self.g = g = code.series("g", 0, order + 1)
        sizes = [code.let(f"size{k}", f"abs({name})") for k, name in enumerate(g)]
        self.end = code.let("end", " + ".join(g))
        self.moduli = code.let("moduli", " + ".join(sizes[1:]))
        self.end_slope = code.let("end_slope", " + ".join(f"{float(k)!r}*{g[k]}" for k in range(1, order + 1)))
        slopes = code.let("slopes", " + ".join(f"{float(k)!r}*{sizes[k]}" for k in range(2, order + 1)))
        bends = code.let("bends", " + ".join(f"{float(k * (k - 1))!r}*{sizes[k]}" for k in range(3, order + 1)))
        self.monotone = self.flag("monotone", f"{sizes[1]} > {slopes}")
        self.bowl = self.flag("bowl", f"2.0*{g[2]} > {bends}")
        self.arch = self.flag("arch", f"-2.0*{g[2]} > {bends}")

    def flag(self, name: str, condition: str) -> str:
        """A condition as 0 or 1."""
        return self.code.let(name, f"1.0 if {condition} else 0.0")

    def inside(self, x: str) -> str:
        """``x`` kept in [0, 1]."""
        low = self.code.let("kept", larger(x, "0.0"))
        return self.code.let("kept", smaller(low, "1.0"))

    def derivative(self, times: int, x: str) -> str:
        """Value of the polynomial's derivative."""
        names = []
        for k in range(times, self.order + 1):
            factor = 1.0
            for j in range(times):
                factor *= k - j
            names.append(self.g[k] if factor == 1.0 else f"{factor!r}*{self.g[k]}")
        return self.code.let(f"d{times}", self._even_odd(names, x))

    def _even_odd(self, names: list[str], x: str) -> str:
        """Value of a series by its even and odd part: half as long a chain as Horner's scheme."""
        square = self.code.let("square", f"{x}*{x}")
        parts = []
        for part in (names[0::2], names[1::2]):
            text = part[-1]
            for name in reversed(part[:-1]):
                text = f"{name} + {square}*({text})"
            parts.append(text)
        return f"({parts[0]}) + {x}*({parts[1]})"


def peaks_loop(order: int) -> str:
    """Source of the loop that finds, for every slot, the larger of what is known and the largest value on [0, 1]."""
    shape = _Shape(order)
    code, g = shape.code, shape.g
    best = code.load("known", order + KNOWN)
    for name in (g[0], shape.end):
        best = code.let("best", larger(name, best))
    rises = shape.flag("rises", f"{g[1]} > 0.0")
    falls = shape.flag("falls", f"{shape.end_slope} < 0.0")
    x = shape.inside(code.let("guess", f"-0.5*{g[1]}/{g[2]}"))
    moved = "1.0"
    for _ in range(_PEAK_ITERATIONS):
        new = shape.inside(code.let("new", f"{x} - {shape.derivative(1, x)}/{shape.derivative(2, x)}"))
        moved = code.let("moved", f"abs({new} - {x})")
        x = new
    # Where the curve is an arch that rises at first and falls at last, its peak is inside.
    peak = code.let("peak", f"{shape.arch}*{rises}*{falls}*(1.0 - {shape.monotone})")
    top = shape.derivative(0, x)
    higher = code.let("higher", larger(top, best))
    code.store(order + RESULT, f"{higher} if {peak} > 0.5 else {best}")
    settled = shape.flag("settled", f"{moved} <= 1e-6")
    plain = code.let("plain", f"{shape.monotone} + {shape.bowl} + {shape.arch}*(1.0 - {peak} + {peak}*{settled})")
    below = shape.flag("below", f"{g[0]} + {shape.moduli} <= {best}")
    code.store(order + STATUS, f"{FOUND} if {plain} + {below} > 0.5 else {HARD}")
    return code.loop()


def roots_loop(order: int) -> str:
    """Source of the loop that finds, for every slot, where a polynomial that starts positive first stops being so."""
    shape = _Shape(order)
    code, g = shape.code, shape.g
    ends_below = shape.flag("ends_below", f"{shape.end} <= 0.0")
    above = shape.flag("above", f"{shape.moduli} < {g[0]}")
    level = shape.flag("level", f"{g[1]} >= 0.0")
    still_falling = shape.flag("still_falling", f"{shape.end_slope} <= 0.0")
    # No crossing: far above; a slope or an arch that ends above; a bowl that ends above without a bottom inside.
    flat = code.let("flat", f"{shape.monotone} + {shape.arch} + {shape.bowl}*({level} + {still_falling})")
    none = code.let("none", f"{above} + (1.0 - {ends_below})*{flat}")
    # One crossing: a slope, an arch or a bowl that ends below.
    one = code.let("one", f"{ends_below}*({shape.monotone} + {shape.arch} + {shape.bowl})")
    # Newton's method comes down to the root from one side if it starts where the curve falls: at the chord's zero or,
    # where that is before an arch's peak or behind a bowl's bottom, at the end beyond.
    guess = code.let("guess", f"{g[0]}/({g[0]} - {shape.end})")
    low = code.let("kept", larger(guess, "0.05"))
    chord = code.let("kept", smaller(low, "0.95"))
    x: str = code.let("start", f"{chord} if {shape.derivative(1, chord)} < 0.0 else {shape.arch}")
    moved = "1.0"
    for _ in range(_ROOT_ITERATIONS):
        new = shape.inside(code.let("new", f"{x} - {shape.derivative(0, x)}/{shape.derivative(1, x)}"))
        moved = code.let("moved", f"abs({new} - {x}) - 1e-9*{x}")
        x = new
    settled = shape.flag("settled", f"{moved} <= 0.0")
    interior = shape.flag("interior", f"{x}*(1.0 - {x}) > 0.0")
    found = code.let("found", f"{one}*{settled}*{interior}")
    code.store(order + RESULT, x)
    code.store(order + STATUS, f"{NONE} if {none} > 0.5 else ({FOUND} if {found} > 0.5 else {HARD})")
    return code.loop()
