"""Texts in pictures: labels of axes, and what the font can write."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from sprag.service.languages import decimal, gettext
from sprag.service.results.wording import unit_text
from sprag.worker.pool.child_process import uncounted

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sprag.service.results.figures.figure import Quantity


@cache
def load_matplotlib() -> None:
    """Load the parts of matplotlib that pictures need, once per process, so that the time counts for no picture."""
    with uncounted():
        import matplotlib.backends.backend_agg
        import matplotlib.backends.backend_pdf
        import matplotlib.backends.backend_svg
        import matplotlib.figure
        import matplotlib.font_manager  # noqa: F401


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


def writable(text: str, family: str | None = None) -> str:
    """``text`` with a square for every character that the font lacks; line breaks are kept."""
    load_matplotlib()
    from matplotlib.font_manager import FontProperties, findfont, get_font

    glyphs = get_font(findfont(FontProperties(family=family))).get_charmap()
    return "".join(c if c == "\n" or ord(c) in glyphs else "\N{WHITE SQUARE}" for c in text)
