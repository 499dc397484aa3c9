"""A report as sections of texts, tables and pictures, which templates turn into a page or a typeset document."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import partial
from typing import TYPE_CHECKING, Final

from sprag.service.figures.curves import curves_figure
from sprag.service.figures.pictures.curves import draw_figure
from sprag.service.figures.pictures.maps import draw_map
from sprag.service.figures.pictures.sensitivity import draw_sensitivity
from sprag.service.figures.read import read_figure, read_map
from sprag.service.languages import N_, _, date_format, pgettext
from sprag.service.reading.part_names import lower_first, upper_first
from sprag.service.reading.reader import shown, term, titled
from sprag.service.reading.wording import number, unit_text
from sprag.service.report.sketch import sketches
from sprag.service.results.regimes import left_out
from sprag.service.results.shown_inputs import choice_name, in_words

if TYPE_CHECKING:
    from sprag.service.exports.inputs import Input
    from sprag.service.figures.figure import Figure
    from sprag.service.report.content import Report

_MEASURED: Final = N_("Measured points on the fitted curve, and residuals")
_ORIGINS: Final = {
    "axes": N_("varies"), "given": "", "default": N_("default"), "derived": N_("derived"),
    "fitted": N_("fitted"), "tolerance": N_("varies from drive to drive"),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Text:
    """A paragraph; a ``warning`` stands out."""

    text: str
    warning: bool = False
    kind: str = "text"


@dataclass(frozen=True, slots=True)
class Table:
    """A table: heads of its columns ("" in all for none), rows of texts, and which columns are numbers."""

    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: tuple[int, ...] = ()
    kind: str = "table"


@dataclass(frozen=True, slots=True)
class Image:
    """A picture as SVG with a caption and a description; ``wide`` takes the width of the page."""

    svg: bytes
    caption: str
    alt: str
    wide: bool = True
    kind: str = "picture"


Block = Text | Table | Image


@dataclass(frozen=True, slots=True)
class Section:
    """A heading and what stands under it."""

    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True, slots=True)
class TitleBlock:
    """What a customer's document says of itself: who made it, for which project, under which number.

    Without a ``date`` it is of today, in the language of the task; with an empty one it has none.
    """

    office: str = ""
    project: str = ""
    author: str = ""
    number: str = ""
    date: str | None = None


@dataclass(frozen=True, slots=True)
class Document:
    """A report: its title, its title block as pairs, and its sections without empty ones."""

    title: str
    particulars: tuple[tuple[str, str], ...]
    sections: tuple[Section, ...] = field(default_factory=tuple)


def today() -> str:
    """The date (UTC), as the language writes it."""
    return datetime.now(UTC).strftime(date_format())


def document_of(report: Report, block: TitleBlock) -> Document:
    """The report with its title block."""
    pairs = (
        (_("Office"), block.office),
        (_("Project"), block.project),
        (_("Author"), block.author),
        (pgettext("of a document", "Number"), block.number),
        (_("Date"), today() if block.date is None else block.date),
    )
    every: tuple[tuple[str, Callable[[Report], Iterator[Block]]], ...] = (
        ("", _warnings),
        (_("Machine"), _machine),
        (_("Answers"), _answers),
        (_("What varies"), _axes),
        (_("Figures") if report.figures else _("Maps") if report.maps else _("Curves"), _curves),
        (_("Sensitivity"), _sensitivity),
        (_("Calibration"), partial(_part, name="calibration")),
        (_("Drives"), partial(_part, name="drives")),
        (_("How the cases ended"), _endings),
        (_("Ranges of the results"), _ranges),
        (_("Inputs"), _inputs),
        (_("Machine and run as given"), _given),
        (_("Study and versions"), _facts),
        (_("Curves of further results"), _further),
    )
    sections = (Section(title, tuple(write(report))) for title, write in every)
    return Document(report.title, tuple(pair for pair in pairs if pair[1]), tuple(s for s in sections if s.blocks))


def _warnings(report: Report) -> Iterator[Block]:
    for text in report.warnings:
        yield Text(report.reading.warning(text), warning=True)


def _machine(report: Report) -> Iterator[Block]:
    for title, svg in sketches(report.study):
        text = _(title)
        yield Image(svg, text, _("Sketch of the machine: {title}", title=text), wide=False)
    if report.clutch is not None:
        yield replace(_image(report, report.clutch, _("Law of the clutch")), wide=False)


def _answers(report: Report) -> Iterator[Block]:
    rows = tuple(report.answers)
    if rows:
        yield Table(("", _("Value"), _("at"), _("Note")), rows, (1, 2))


def _axes(report: Report) -> Iterator[Block]:
    read = report.reading
    rows = tuple(
        (
            read.caption(axis.paths),
            number(axis.values),
            number(read.value(axis.least, axis.unit)),
            number(read.value(axis.largest, axis.unit)),
            unit_text(read.unit(axis.unit)),
        )
        for axis in report.axes
    )
    if rows:
        yield Table((_("Parameter"), _("Values"), _("Least"), _("Largest"), _("Unit")), rows, (1, 2, 3))


def _curves(report: Report) -> Iterator[Block]:
    if report.note:
        yield Text(report.note)
    for chosen in report.figures:
        if chosen.shown is None:
            yield Text(chosen.caption, warning=True)
        else:
            text = f"{chosen.name}. {chosen.caption}"
            yield Image(chosen.draw("svg"), text, text)
    if report.main is not None:
        yield _image(report, report.main, report.main_caption)
    for drawn in report.maps:
        read = read_map(drawn, report.reading)
        text = _("{z} over {x} and {y}", z=read.title, x=lower_first(read.names[0]), y=lower_first(read.names[1]))
        yield Image(draw_map(read, "", "svg"), text, text)


def _sensitivity(report: Report) -> Iterator[Block]:
    for item in report.effects:
        text = _("What {result} depends on", result=report.reading.within(item.info.name))
        svg = draw_sensitivity([item], "", report.reading, "svg", noted=False)
        yield Image(svg, ". ".join((text, *(upper_first(report.reading.say(note)) for note in item.notes))), text)


def _part(report: Report, *, name: str) -> Iterator[Block]:
    part = getattr(report, name)
    if part is not None:
        if part.figure is not None:
            text = _(_MEASURED) if name == "calibration" else _("Quantiles over the drives")
            yield _image(report, part.figure, text)
        for sentence in part.sentences:
            yield Text(upper_first(report.reading.say(sentence)))


def _endings(report: Report) -> Iterator[Block]:
    rows = [(shown(term(name)), number(count), meaning) for name, count, meaning in report.endings]
    if rows:
        yield Table((_("Ending"), _("Cases"), _("Meaning")), tuple(rows), (1,))
    kinds = [(titled(name), number(count), meaning) for name, count, meaning in report.kinds]
    if kinds:
        yield Table((_("Regime or flag"), _("Cases"), _("Meaning")), tuple(kinds), (1,))


def _ranges(report: Report) -> Iterator[Block]:
    read = report.reading
    rows = []
    for row in report.ranges:
        values = [number(read.value(value, row.info.unit), 6) for value in (row.least, row.mean, row.largest)]
        cases = ["" if case is None else number(case) for case in (row.least_case, row.largest_case)]
        unit = unit_text(read.unit(row.info.unit))
        rows.append((read.caption(row.info.name), unit, values[0], cases[0], values[1], values[2], cases[1],
                     number(row.known)))  # fmt: skip
    heads = (_("Result"), _("Unit"), _("Least"), _("in case"), _("Mean"), _("Largest"), _("in case"), _("Cases"))
    yield Table(heads, tuple(rows), (2, 3, 4, 5, 6, 7))
    if report.left_out:
        yield Text(f"{upper_first(shown(left_out(report.left_out)))}.")


def _inputs(report: Report) -> Iterator[Block]:
    read = report.reading
    rows = []
    for item in report.inputs:
        name = read.caption(item.path) if item.unit else choice_name(item)
        value = _value(report, item)
        origin = _(_ORIGINS.get(item.origin, item.origin))
        rows.append((name, value, unit_text(read.unit(item.unit)), origin, item.path))
    rows += [(_("Run: {name}", name=lower_first(label)), value, "", _(_ORIGINS.get(item.origin, item.origin)),
              f"run.{item.path}") for label, value, item in report.run]  # fmt: skip
    yield Table((_("Parameter"), _("Value"), _("Unit"), _("Origin"), _("Name in specs")), tuple(rows), (1,))


def _value(report: Report, item: Input) -> str:
    if item.origin == "axes":
        return _("varies")
    shown = report.reading.value(item.value if item.origin == "derived" else in_words(item), item.unit)
    return shown if isinstance(shown, str) else number(shown, 8)


def _given(report: Report) -> Iterator[Block]:
    if report.given:
        yield Table((_("Field"), _("As given")), tuple(report.given.items()))


def _further(report: Report) -> Iterator[Block]:
    for curves in report.pictures:
        names = ", ".join(report.reading.caption(info.name) for info in curves.selection.results)
        across = report.reading.caption(curves.selection.x)
        alt = _("{names} against {x}", names=names, x=lower_first(across))
        caption = _("Further results against {x}", x=lower_first(across))
        yield replace(_image(report, curves_figure([("", curves)], 2), caption), alt=alt)
    if report.pictures:
        yield Text(_("A result that has the same value everywhere on these curves is in the table of ranges only."))


def _facts(report: Report) -> Iterator[Block]:
    yield Table(("", ""), report.facts)


def _image(report: Report, figure: Figure, caption: str) -> Image:
    return Image(draw_figure(read_figure(figure, report.reading), "", "svg", paper=True), caption, caption)
