"""Pictures as files: SVG, PNG and PDF of the same figures that pages have, the same bytes for the same numbers."""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING, Any, Final, cast

from sprag_study.sentences import Sentence
from sprag_study.service.faults import refused
from sprag_study.service.figures.curves import curves_figure
from sprag_study.service.figures.read import read_figure
from sprag_study.service.figures.svg import WIDE, as_file, picture_svg
from sprag_study.service.figures.svg_bars import sensitivity_svg
from sprag_study.service.figures.svg_map import picture_map
from sprag_study.service.formats import Picture
from sprag_study.worker.pool.child_process import uncounted

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.figures.figure import Figure
    from sprag_study.service.reading.reader import Reading
    from sprag_study.service.results.curves import Curves, Map
    from sprag_study.service.results.sensitivity import Sensitivity

MEDIA_TYPES: Final[dict[Picture, str]] = {"svg": "image/svg+xml", "png": "image/png", "pdf": "application/pdf"}

#: Limits of one picture; more would be unreadable.
MAX_PICTURE_CURVES: Final = 200
MAX_PICTURE_POINTS: Final = 100_000
#: Results of one picture of sensitivities.
MOST_RESULTS: Final = 8
#: Pixels of a PNG for each of its SVG.
_FINE: Final = 2
_PROLOG: Final = b'<?xml version="1.0" encoding="UTF-8"?>\n'
_SIZE: Final = re.compile(r'<svg [^>]*?viewBox="0 0 ([\d.]+) ([\d.]+)"')
_PAGE: Final = """#set page(width: {width}pt, height: {height}pt, margin: 0pt)
#image(bytes(sys.inputs.picture), format: "svg", width: 100%)
"""


def draw_curves(curves: Curves, title: str, picture: Picture, reading: Reading) -> bytes:
    """Curves as a picture: a plot for each result as on pages, two in a row; missing points are left out.

    Raises SelectionError when there are more curves or points than one picture can show.
    """
    require_drawable([curves])
    return draw_figure(read_figure(curves_figure([("", curves)], 2), reading), title, picture)


def draw_compare(drawn: Sequence[tuple[str, Curves]], reading: Reading, picture: Picture, *, apart: str = "") -> bytes:
    """Curves of several studies with their names, which are values of ``apart`` where it is given.

    A plot for each result; raises SelectionError as `draw_curves` does.
    """
    require_drawable([curves for _, curves in drawn])
    return draw_figure(read_figure(curves_figure(drawn, apart=apart), reading), "", picture)


def draw_map(drawn: Map, title: str, picture: Picture, *, contours: bool = False) -> bytes:
    """A map as a picture: colours over two axes, or lines of equal value with their numbers.

    Cases without a result are left blank. Raises SelectionError when it is too large.
    """
    check_size("points", drawn.values.size, MAX_PICTURE_POINTS)
    return picture_file(picture_map(drawn, title, contours=contours), picture)


def draw_sensitivity(
    found: Sequence[Sensitivity], title: str, reading: Reading, picture: Picture, *, noted: bool = True
) -> bytes:
    """For each result, as somebody reads it, its bars where it has some, and its lines.

    ``noted`` writes the notes of the results above them.

    Raises SelectionError when there are more than one picture can show.
    """
    check_size("results", len(found), MOST_RESULTS, "y")
    notes = dict.fromkeys(reading.say(note) for item in found for note in item.notes) if noted else ()
    head = [line for line in (title, *notes) if line]
    return picture_file(as_file(sensitivity_svg(found, reading, head=head)), picture)


def draw_figure(figure: Figure, title: str, picture: Picture, *, paper: bool = False) -> bytes:
    """Any described figure as a picture; on ``paper`` it has the width of a page, whose letters are larger then."""
    return picture_file(picture_svg(figure, title, width=WIDE if paper else None), picture)


def require_drawable(drawn: Sequence[Curves]) -> None:
    """Raise SelectionError when there are more curves or points than one picture can show."""
    lines = [curve for curves in drawn for curve in curves.curves]
    check_size("curves", len(lines), MAX_PICTURE_CURVES)
    points = sum(len(curve.endings) for curve in lines) * len(drawn[0].selection.results)
    check_size("points", points, MAX_PICTURE_POINTS)


def check_size(what: str, count: int, most: int, parameter: str = "format") -> None:
    """SelectionError when a picture would show more than ``most``."""
    if count > most:
        message = Sentence(
            "{count} {what} are too many for one picture; choose fewer, or take the numbers",
            count=str(count), what=Sentence(what),
        )  # fmt: skip
        allowed = Sentence("<= {count} {what}", count=str(most), what=Sentence(what))
        raise refused(parameter, "too-many", message, allowed=allowed)


def picture_file(svg: str, form: Picture) -> bytes:
    """A picture as a file of a form. PNG and PDF are made by Typst, with its own fonts, never those of the system."""
    if form == "svg":
        return _PROLOG + svg.encode()
    found = _SIZE.search(svg)
    assert found is not None
    page = _PAGE.format(width=found[1], height=found[2]).encode()
    further: dict[str, Any] = {"ppi": 72 * _FINE} if form == "png" else {"timestamp": 0}
    made = _compiler()(page, format=form, sys_inputs={"picture": svg}, ignore_system_fonts=True, **further)
    return cast("bytes", made)


@cache
def _compiler() -> Any:
    """Typst's compiler, loaded once per process, so that the time counts for no picture."""
    with uncounted():
        import typst

        return typst.compile
