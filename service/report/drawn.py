"""The pictures of a document: described figures as SVG, which a page, a file and a sheet of paper share."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from sprag_study.service.figures.drawing import svg as drawing_svg
from sprag_study.service.figures.drawings import drawings
from sprag_study.service.figures.read import read_figure, read_map
from sprag_study.service.figures.svg import DOUBLE, NARROW, WIDE, as_file, svg
from sprag_study.service.figures.svg_map import map_svg
from sprag_study.service.languages import _
from sprag_study.service.reading.part_names import lower_first
from sprag_study.service.report.blocks import Block, Image, Text, said
from sprag_study.service.report.conditions import values_of
from sprag_study.service.results.curves import Map

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from sprag_study.service.figures.figure import Figure
    from sprag_study.service.report.chosen_figures import ChosenFigure
    from sprag_study.service.report.content import Report


def image(report: Report, figure: Figure, caption: str) -> Image:
    """A described figure in the reader's units, the curve that is meant in ink."""
    read = read_figure(figure, report.reading)
    if read.studies == 1:  # in the text, which has room for it on a phone too
        held = "; ".join(text for text in read.held if text not in caption)
        caption = f"{caption}. {held}" if held else caption
    chosen = "" if report.curve is None else str(report.curve)
    return image_of(
        partial(_figure, read, label=caption, chosen=chosen), WIDE if read.columns == 1 else DOUBLE, caption
    )


def image_of(draw: Callable[[int], str], width: int, caption: str, alt: str = "") -> Image:
    """What ``draw`` draws in a width (px), across a sheet and for a phone."""
    whole, narrow = (as_file(draw(each)).encode() for each in (width, NARROW))
    return Image(whole, caption, alt or caption, narrow=narrow)


def _figure(figure: Figure, width: int, *, label: str, chosen: str = "", head: Sequence[str] = ()) -> str:
    shown = replace(figure, columns=1) if width == NARROW else figure
    return svg(shown, width=width, label=label, chosen=chosen, head=head, below=True)


def _map(drawn: Map, width: int, *, label: str, contours: bool = False) -> str:
    return map_svg(drawn, contours=contours, width=width, label=label, head=drawn.held, below=True)


def drawing_images(report: Report) -> Iterator[Image]:
    """The drawings of the machine to scale, with its numbers at their places."""
    labels = {path: str(said((value,), report.reading)[0]) for path, value in values_of(report).items()}
    for drawing in drawings(report.study):
        text = _(drawing.title)
        alt = _("Drawing of the machine: {title}", title=text)
        yield Image(drawing_svg(drawing, labels, alone=True).encode(), text, alt, wide=False, look="half")


def map_images(report: Report, maps: Iterable[Map]) -> Iterator[Image]:
    """Maps in the reader's units."""
    for drawn in maps:
        read = read_map(drawn, report.reading)
        text = _("{z} over {x} and {y}", z=read.title, x=lower_first(read.names[0]), y=lower_first(read.names[1]))
        yield image_of(partial(_map, read, label=text), WIDE, text)


def chosen_image(chosen: ChosenFigure) -> Block:
    """A figure that somebody chose, with its name; or why it cannot be drawn."""
    if chosen.shown is None:
        return Text(chosen.caption, warning=True)
    text = f"{chosen.name}. {chosen.caption}"
    if isinstance(chosen.shown, Map):
        return image_of(partial(_map, chosen.shown, label=text, contours=chosen.contours), WIDE, text)
    # It is read in units of its own already.
    head = ["; ".join(chosen.shown.held)]
    return image_of(partial(_figure, chosen.shown, label=text, head=head), DOUBLE, text)
