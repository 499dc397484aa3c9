"""Curves, maps and fronts as bytes that are ready to be sent.

The service itself writes small answers; those with more than `FEW` numbers belong in a checking process, because
reading and writing them takes seconds during which nobody else would be answered.
"""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING, Any, Final

from sprag.service.jobs.reading import reading_of
from sprag.service.json_text import numbers, to_bytes
from sprag.service.results import exports
from sprag.service.results.calibration import calibration_csv, calibration_json
from sprag.service.results.curves import flag_names
from sprag.service.results.directions import in_words
from sprag.service.results.figures.calibration import calibration_figure
from sprag.service.results.figures.front import front_figure, history_figure
from sprag.service.results.figures.read import read_figure, read_map
from sprag.service.results.fronts import front_csv, front_json
from sprag.service.results.pictures import curves as pictures
from sprag.service.results.pictures.maps import draw_map as draw_map_picture
from sprag.service.results.refined import not_joined
from sprag.service.results.regimes import kind_columns
from sprag.service.results.stored_curves import drawn_curves, stored_curves, stored_map
from sprag.worker import models

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sprag.service.answers.calibration import CalibrationReport
    from sprag.service.jobs.library import Library
    from sprag.service.reading.reader import Choice
    from sprag.service.results.curves import Curve, CurveQuery, Curves, Map

#: Numbers of curves or a map that are read and written in about ten milliseconds.
FEW: Final = 20_000


def curves_of(library: Library, study_id: str, query: CurveQuery) -> Curves:
    """The curves of a study; raises as `stored_curves` does."""
    return stored_curves(library.store, study_id, query)


def curves_drawn(library: Library, study_id: str, query: CurveQuery) -> Curves:
    """The same for a picture, as of `drawn_curves`."""
    return drawn_curves(library.store, study_id, query)


def curves_json(library: Library, study_id: str, query: CurveQuery) -> bytes:
    """The curves as JSON text."""
    return to_bytes({"study": study_id, **curves_of(library, study_id, query).to_json()})


def curves_csv(library: Library, study_id: str, query: CurveQuery, choice: Choice) -> bytes:
    """Every point of every curve as one row: fixed parameters, case, x, results, regime and its order, ending.

    Of refined curves also the results that are not interpolated up to the next point, of a sweep whether the motion
    jumps between this point and the next.
    """
    curves = curves_of(library, study_id, query)
    names = kind_columns(curves.selection.regime)
    columns: dict[str, list[Any]] = {}
    for curve in curves.curves:
        points = len(curve.endings)
        kinds: Iterable[tuple[str, list[Any]]] = zip(names, (curve.regimes or [], curve.orders or []), strict=False)
        parts: dict[str, list[Any]] = {
            **{path: [value] * points for path, value in in_words({**curve.line.by, **curve.line.at}).items()},
            "case": curve.line.cases.tolist(),
            curves.selection.x: list(curve.line.x),
            **{info.name: numbers(curve.y[info.name], info.kind == "count") for info in curves.selection.results},
            **dict(kinds),
            **_jumped(curve),
            **_not_joined(curve, [info.name for info in curves.selection.results]),
            "flags": [" ".join(names) for names in flag_names(curve.flags or [""] * points)],
            "ending": curve.endings,
        }
        for name, part in parts.items():
            columns.setdefault(name, []).extend(part)
    units = {**curves.selection.units, **{info.name: info.unit for info in curves.selection.results}}
    return exports.read_table(columns, units, reading_of(library.store, study_id, choice).units)


def _jumped(curve: Curve) -> dict[str, list[Any]]:
    """A column of a sweep: 1 where the motion jumps between the point of a row and the next one."""
    if curve.jumps is None:
        return {}
    lows = {jump["low"] for jump in curve.jumps}
    return {"jump": [int(x in lows) for x in curve.line.x]}


def _not_joined(curve: Curve, names: list[str]) -> dict[str, list[Any]]:
    """A column of refined curves: the results that are not interpolated from the point of a row to the next one."""
    if curve.refined is None:
        return {}
    texts = [""] * len(curve.endings)
    for place, text in zip(curve.run().tolist(), not_joined(curve.refined, names), strict=True):
        texts[place] = text
    return {"not_joined": texts}


def curves_picture(
    library: Library, study_id: str, query: CurveQuery, choice: Choice, title: str, form: pictures.Picture
) -> bytes:
    """The curves as a picture."""
    reading = reading_of(library.store, study_id, choice)
    return pictures.draw_curves(curves_drawn(library, study_id, query), title, form, reading)


def map_of(library: Library, study_id: str, query: CurveQuery) -> Map:
    """A map; raises as `stored_map` does."""
    return stored_map(library.store, study_id, query)


def map_json(library: Library, study_id: str, query: CurveQuery) -> bytes:
    """The map as JSON text."""
    return to_bytes({"study": study_id, **map_of(library, study_id, query).to_json()})


def _flags(drawn: Map) -> list[str]:
    """The flags of every point of a map, joined by commas."""
    return [""] * drawn.values.size if drawn.flags is None else list(chain.from_iterable(drawn.flags))


def map_csv(library: Library, study_id: str, query: CurveQuery, choice: Choice) -> bytes:
    """Every point of the map as one row: fixed parameters, y, x, case, result, regime and its order, flags, ending.

    The squares of a refined map are no cases: they have neither regimes nor flags.
    """
    drawn = map_of(library, study_id, query)
    across, points = len(drawn.x_values), drawn.values.size
    kinds = kind_columns(models.regime_info(models.study_results(library.store.study(study_id))))
    columns: dict[str, list[Any]] = {
        **{path: [value] * points for path, value in drawn.at.items()},
        drawn.y: [y for y in drawn.y_values for _ in range(across)],
        drawn.x: [*drawn.x_values] * len(drawn.y_values),
        **({} if drawn.refined else {"case": drawn.cases.reshape(-1).tolist()}),
        drawn.result.name: numbers(drawn.values.reshape(-1), drawn.result.kind == "count"),
        **{
            name: list(chain.from_iterable(rows))
            for name, rows in zip(kinds, (drawn.regimes, drawn.orders), strict=False)
            if rows is not None
        },
        **({} if drawn.refined else {"flags": [" ".join(names) for names in flag_names(_flags(drawn))]}),
        "ending": list(chain.from_iterable(drawn.endings)),
    }
    (x_unit, y_unit), result = drawn.units, drawn.result
    units = {**drawn.at_units, drawn.x: x_unit, drawn.y: y_unit, result.name: result.unit}
    return exports.read_table(columns, units, reading_of(library.store, study_id, choice).units)


def map_picture(
    library: Library,
    study_id: str,
    query: CurveQuery,
    choice: Choice,
    title: str,
    form: pictures.Picture,
    *,
    contours: bool = False,
) -> bytes:
    """The map as a picture: colours, or lines of equal value."""
    reading = reading_of(library.store, study_id, choice)
    return draw_map_picture(read_map(map_of(library, study_id, query), reading), title, form, contours=contours)


def calibration_as_json(library: Library, study_id: str) -> bytes:
    """The calibration as JSON text."""
    return to_bytes(calibration_report(library, study_id))


def calibration_report(library: Library, study_id: str) -> CalibrationReport:
    """The calibration as an answer whose sentences are phrases."""
    return calibration_json(study_id, library.calibrations.of(study_id))


def calibration_as_csv(library: Library, study_id: str) -> bytes:
    """The measured points beside the fit as a table."""
    return calibration_csv(library.calibrations.of(study_id))


def calibration_picture(library: Library, study_id: str, choice: Choice, title: str, form: pictures.Picture) -> bytes:
    """The measured points on the fitted curves, and the residuals, as a picture."""
    figure = calibration_figure(library.calibrations.of(study_id))
    return pictures.draw_figure(read_figure(figure, reading_of(library.store, study_id, choice)), title, form)


def front_as_json(library: Library, study_id: str, exact: bool, limit: int) -> bytes:
    """The designs as JSON text."""
    return to_bytes(front_json(study_id, library.fronts.of(study_id, exact=exact), limit))


def front_as_csv(library: Library, study_id: str, exact: bool, limit: int) -> bytes:
    """The designs as a table."""
    return front_csv(library.fronts.of(study_id, exact=exact), limit)


def front_picture(
    library: Library,
    study_id: str,
    exact: bool,
    axes: tuple[str | None, str | None],
    choice: Choice,
    title: str,
    form: pictures.Picture,
) -> bytes:
    """The designs over two quantities as a picture."""
    found = library.fronts.of(study_id, exact=exact)
    pictures.check_size("designs", len(found.numbers), pictures.MAX_PICTURE_POINTS)
    figure = read_figure(front_figure(found, *axes), reading_of(library.store, study_id, choice))
    return pictures.draw_figure(figure, title, form)


def search_picture(library: Library, study_id: str, choice: Choice, title: str, form: pictures.Picture) -> bytes:
    """How a search has come to its designs as a picture."""
    figure = history_figure(library.fronts.of(study_id, exact=False))
    return pictures.draw_figure(read_figure(figure, reading_of(library.store, study_id, choice)), title, form)
