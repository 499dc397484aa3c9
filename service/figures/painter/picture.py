"""What pictures have in common: texts, legends and panels from top to bottom, inside one element."""

from __future__ import annotations

import re
from html import escape
from typing import TYPE_CHECKING, Any, Final
from zlib import crc32

from sprag_study.service.figures.painter.elements import LINE, SIZE, SMALL, element, lines_of, moved, short, text_at
from sprag_study.service.reading.wording import unit_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.figures.figure import Direction, Quantity
    from sprag_study.service.figures.painter.legends import Rows
    from sprag_study.service.figures.painter.scales import Scale

#: Names of patterns, in attributes only: texts have no quotation marks.
_NAMED: Final = re.compile(r'(?<=id=")~|(?<="url\(#)~')


class Painting:
    """One picture of a width (px); ``cases`` is the address of its cases, "" where points are no links."""

    def __init__(self, width: float, cases: str) -> None:
        self._width, self._cases = width, cases
        self._parts: list[str] = []
        self._top = 4.0

    def _text(self, text: str, *, bold: bool = False) -> None:
        """A sentence over the whole width."""
        for line in lines_of(text, self._width - 4.0, bold=bold):
            self._top += LINE
            self._parts.append(text_at(line, 0.0, self._top - 4.0, font_weight=600 if bold else None))
        self._top += 3.0

    def _named_below(self, name: Sequence[str], right: float) -> None:
        """The lines of the name of an x axis below its numbers, which end at ``right``."""
        self._parts += [
            text_at(line, right, self._top + 2.0 * LINE + LINE * place, text_anchor="end", font_size=SMALL)
            for place, line in enumerate(name)
        ]

    def _rows(self, rows: Rows) -> None:
        """A legend below what there is."""
        self._parts.append(moved("".join(rows.parts), 0.0, self._top))
        self._top += rows.height + 4.0

    def _whole(self, label: str, about: str) -> str:
        """The element around all parts; names of patterns, which begin with ~, differ from those of other pictures."""
        inside = "".join(self._parts)
        if "~" in inside:
            inside = _NAMED.sub(f"p{crc32(inside.encode()):x}-", inside)
        return element(
            "svg", element("desc", escape(about)) + inside, class_="figure",
            viewBox=f"0 0 {short(self._width)} {short(self._top + 4.0)}", width=self._width, height=self._top + 4.0,
            role="group" if "<a " in inside or 'data-cases="' in inside else "img", aria_label=label,
            data_root=self._cases or None, font_size=SIZE, fill="var(--ink)",
        )  # fmt: skip


def panel_group(
    parts: Sequence[str],
    at: tuple[float, float],
    area: tuple[float, float, str],
    scales: tuple[Scale, Scale],
    quantities: tuple[Quantity, Quantity],
    log: Sequence[Direction] = (),
) -> str:
    """A panel at its place, with width, height and colour of its area, and for scripts ends and units of its axes."""
    width, height, fill = area
    ends: dict[str, Any] = {
        f"data_{name}": f"{scale.low:.10g} {scale.high:.10g} {short(scale.start)} {short(scale.end)}"
        for name, scale in zip("xy", scales, strict=True)
    }
    ground = element("rect", class_="area", width=width, height=height, fill=fill, pointer_events="all")
    units = "|".join(unit_text(quantity.unit) for quantity in quantities)
    return moved(ground + "".join(parts), *at, class_="panel", **ends, data_units=units, data_log=" ".join(log) or None)
