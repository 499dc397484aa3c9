"""The report as a PDF of several pages through matplotlib: text first, then a page for each picture."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final

from sprag.service.results.figures.curves import curves_figure
from sprag.service.results.pictures.curves import paint_figure, painting
from sprag.service.results.pictures.maps import paint_map
from sprag.service.results.pictures.text import load_matplotlib, writable
from sprag.service.results.report.html import input_text, number_text

if TYPE_CHECKING:
    from matplotlib.backends.backend_pdf import PdfPages
    from matplotlib.figure import Figure

    from sprag.service.results.exports.inputs import Input
    from sprag.service.results.report.content import Report

_A4: Final = (8.27, 11.69)
_LINES: Final = 66
_WIDTH: Final = 96
#: No dates, so that two reports of one study have the same bytes.
_METADATA: Final = {"CreationDate": None, "Creator": "Sprag", "Producer": "Sprag"}


def pdf_report(report: Report) -> bytes:
    """The document: the same bytes for the same study."""
    load_matplotlib()
    from matplotlib.backends.backend_pdf import PdfPages

    buffer = io.BytesIO()
    with painting(), PdfPages(buffer, metadata={**_METADATA, "Title": report.title}) as pages:
        lines = list(_lines(report))
        for start in range(0, len(lines), _LINES):
            _text_page(pages, report.title if start == 0 else "", lines[start : start + _LINES])
        for curves in report.pictures:
            figure = _figure()
            paint_figure(figure, curves_figure([("", curves)], by_unit=True), "")
            pages.savefig(figure)
        for drawn in report.maps:
            figure = _figure()
            paint_map(figure, drawn, "")
            pages.savefig(figure)
        for part in (report.drives, report.calibration):
            if part is not None and part.figure is not None:
                figure = _figure()
                paint_figure(figure, part.figure, "")
                pages.savefig(figure)
    return buffer.getvalue()


def _figure() -> Figure:
    from matplotlib.figure import Figure

    return Figure(figsize=(_A4[1], _A4[0]), layout="constrained")


def _text_page(pages: PdfPages, title: str, lines: Sequence[str]) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=_A4)
    figure.text(0.08, 0.955, writable(title), fontsize=14, va="top")
    figure.text(
        0.08, 0.925, writable("\n".join(lines), "monospace"), fontsize=8, va="top", family="monospace", linespacing=1.35
    )
    pages.savefig(figure)  # type: ignore[no-untyped-call]


def _lines(report: Report) -> Iterator[str]:
    for name, text in report.facts:
        yield from _wrapped(f"{name:20} {text}", 21)
    yield from _section("Warnings", [f"- {text}" for text in report.warnings])
    yield from _section(
        "How the cases ended", [f"{count:>10,}  {name:16} {meaning}" for name, count, meaning in report.endings]
    )
    yield from _section(
        "What varies",
        [
            f"{axis.paths} ({axis.unit}): {axis.values} values, {input_text(axis.first)} .. {input_text(axis.last)}"
            for axis in report.axes
        ],
    )
    yield from _section("Calibration", () if report.calibration is None else report.calibration.sentences)
    yield from _section("Drives", () if report.drives is None else report.drives.sentences)
    yield from _section("Run", [f"{item.path:20} {item.value}{_mark(item)}" for item in report.run])
    head = f"{'':34} {'unit':12} {'least':>12} {'mean':>12} {'largest':>12} {'cases':>9}"
    ranges = [
        f"{row.info.name:34} {row.info.unit:12} {number_text(row.least):>12} {number_text(row.mean):>12} "
        f"{number_text(row.largest):>12} {row.known:>9}"
        for row in report.ranges
    ]
    yield from _section("Ranges of the results", [head, *ranges])
    yield from _section(
        "Inputs",
        [
            f"{item.path:34} {'varies' if item.varies else input_text(item.value):>12} {item.unit:12} "
            f"{item.description}{_mark(item)}"
            for item in report.inputs
        ],
    )
    yield from _section("Machine and run as given", [f"{path:40} {text}" for path, text in report.given.items()])
    if report.note:
        yield from _section("Curves", [report.note])


def _mark(item: Input) -> str:
    """The mark of an input that the user did not give."""
    return f" ({item.origin})" if item.origin in ("default", "fitted", "derived") else ""


def _section(title: str, lines: Sequence[str]) -> Iterator[str]:
    if not lines:
        return
    yield ""
    yield title
    yield "-" * len(title)
    for line in lines:
        yield from _wrapped(line, 4)


def _wrapped(line: str, indent: int) -> list[str]:
    return textwrap.wrap(
        line, _WIDTH, subsequent_indent=" " * indent, drop_whitespace=False, replace_whitespace=False
    ) or [""]
