"""Figures inside pages: the same picture for wide and for narrow places, of which the style sheet shows one."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from markupsafe import Markup

from sprag_study.service.figures.svg import DOUBLE, NARROW, WIDE, svg
from sprag_study.service.figures.svg_map import map_svg
from sprag_study.service.http.prefix import here
from sprag_study.service.reading.reader import shown

if TYPE_CHECKING:
    from sprag_study.service.figures.figure import Figure
    from sprag_study.service.results.curves import Map


def cases_of(study_id: str) -> str:
    """The address of the cases of a study, which their numbers follow, as clients see it."""
    return here(f"/studies/{study_id}/cases/")


def drawn(figure: Figure, label: str = "", cases: str = "", chosen: str = "", *, broad: bool = False) -> Markup:
    """A figure, already in its reader's units and words, with the sentence below it; `svg` has the parameters.

    Figures of several columns, and ``broad`` ones, are drawn for a whole page as well.
    """
    if figure.note:
        return _note(figure.note)
    single = replace(figure, columns=1)
    sizes = [("narrow", single, NARROW), ("wide", single, WIDE)]
    if figure.columns > 1 or figure.motion or broad:
        sizes.append(("double", figure, DOUBLE))
    every = [
        _named(svg(each, width=width, label=label, cases=cases, chosen=chosen), name) for name, each, width in sizes
    ]
    return _together(every, figure.below)


def drawn_map(drawn: Map, label: str = "", cases: str = "", *, contours: bool = False) -> Markup:
    """A map, already in its reader's units and words, with the sentence below it."""
    every = [
        _named(map_svg(drawn, contours=contours, width=width, label=label, cases=cases), name)
        for name, width in (("narrow", NARROW), ("wide", WIDE))
    ]
    return _together(every, "" if drawn.refined is None else shown(drawn.refined.sentence))


def _note(text: str) -> Markup:
    return Markup('<p class="soft">{}</p>').format(text)


def _named(picture: str, name: str) -> Markup:
    # The painter has escaped every text.
    return Markup(picture.replace('class="figure"', f'class="figure {name}"', 1))  # noqa: S704


def _together(every: list[Markup], below: str) -> Markup:
    """Pictures of several widths, the widest one last, and the sentence below them."""
    kind = "drawn two" if len(every) == 3 else "drawn"
    picture = Markup('<div class="{}">{}</div>').format(kind, Markup().join(every))
    return picture + Markup('<p class="below">{}</p>').format(below) if below else picture
