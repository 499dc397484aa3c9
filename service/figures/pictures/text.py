"""Texts in pictures: labels of axes, and what the font can write."""

from __future__ import annotations

import textwrap
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Final, Literal

from sprag.service.languages import decimal, gettext
from sprag.service.reading.wording import unit_text
from sprag.worker.pool.child_process import uncounted

if TYPE_CHECKING:
    from collections.abc import Callable
    from io import BytesIO

    from matplotlib.figure import Figure

    from sprag.service.figures.figure import Quantity


#: Characters by which lines of a label may differ.
_UNEVEN: Final = 3


@cache
def load_matplotlib() -> None:
    """Load the parts of matplotlib that all pictures need, once per process, so that the time counts for no picture."""
    with uncounted():
        import matplotlib.backends.backend_agg
        import matplotlib.figure
        import matplotlib.font_manager  # noqa: F401


@cache
def writer_of(kind: Literal["svg", "png", "pdf"]) -> Callable[..., None]:
    """What writes a figure as a picture of a kind: a function of the figure, a file and the metadata of the picture.

    Its part of matplotlib is loaded once per process, as above.
    """
    with uncounted():
        module = import_module(f"matplotlib.backends.backend_{'agg' if kind == 'png' else kind}")
    canvas = module.FigureCanvas

    def write(figure: Figure, file: BytesIO, metadata: dict[str, str | None]) -> None:
        getattr(canvas(figure), f"print_{kind}")(file, metadata=metadata)

    return write


def use_decimal_mark(figure: Figure) -> None:
    """Write the numbers of all axes with the decimal mark of the language."""
    if decimal(".") == ".":
        return
    from matplotlib.ticker import ScalarFormatter

    class Marked(ScalarFormatter):
        def __call__(self, x: float, pos: int | None = None) -> str:
            return decimal(str(super().__call__(x, pos)))

        def get_offset(self) -> str:
            return decimal(str(super().get_offset()))

    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            if type(axis.get_major_formatter()) is ScalarFormatter:
                axis.set_major_formatter(Marked())


def axis_label(name: str, unit: str, brackets: str = "()") -> str:
    """The label of an axis: the name, and its unit in ``brackets`` where it has one."""
    return f"{name} {brackets[:1]}{unit_text(unit)}{brackets[1:]}" if unit != "1" else name


def quantity_label(quantity: Quantity) -> str:
    """The same for a quantity; only the unit where it has no name."""
    if quantity.name:
        return axis_label(quantity.name, quantity.unit)
    return gettext("dimensionless") if quantity.unit == "1" else unit_text(quantity.unit)


def wrapped(label: str, width: int) -> str:
    """A label in as few lines of at most ``width`` characters as its words allow, of about the same length."""
    lines = textwrap.wrap(label, width, break_long_words=False)
    if len(lines) < 2:
        return label
    even = textwrap.wrap(label, -(-len(label) // len(lines)) + _UNEVEN, break_long_words=False)
    return "\n".join(even if len(even) == len(lines) else lines)


def writable(text: str, family: str | None = None) -> str:
    """``text`` with a square for every character that the font lacks; line breaks are kept."""
    load_matplotlib()
    from matplotlib.font_manager import FontProperties, findfont, get_font

    glyphs = get_font(findfont(FontProperties(family=family))).get_charmap()
    return "".join(c if c == "\n" or ord(c) in glyphs else "\N{WHITE SQUARE}" for c in text)
